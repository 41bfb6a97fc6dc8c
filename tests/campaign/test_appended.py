"""Campaigns put end to end: nothing of a row is lost, and what does not fit is refused."""

from dataclasses import replace

import numpy as np
import pytest

import thermal_robot as tr
from thermal_robot.campaign.campaign import appended
from thermal_robot.errors import CampaignError


@pytest.fixture(scope="module")
def demo():
    return tr.demo_campaign()


def test_what_was_taken_apart_is_the_same_again(demo):
    again = appended([demo.take(np.arange(40)), demo.take(np.arange(40, 41)), demo.take(np.arange(41, 120))])
    assert again.to_frame().equals(demo.to_frame())
    assert again.since_turn.keys() == demo.since_turn.keys()
    assert all((again.since_turn[name] == demo.since_turn[name]).all() for name in demo.since_turn)


def test_a_column_that_not_all_have_is_left_out(demo):
    both = appended([demo, demo.drop_covariate("temperature")])
    assert "temperature" in demo.covariates
    assert "temperature" not in both.covariates
    assert both.samples == 2 * demo.samples


def test_filled_cells_stay_marked(demo):
    marked = replace(demo, missing={"temperature": np.arange(120) < 7})
    both = appended([demo, marked])
    assert both.missing["temperature"].sum() == 7
    assert not both.missing["temperature"][:120].any()


def test_positions_and_poses_do_not_go_together(demo):
    turned = np.tile([1.0, 0.0, 0.0, 0.0], (120, 1))
    with pytest.raises(CampaignError, match="differs in orientation"):
        appended([demo, replace(demo, orientation=turned)])


def test_one_campaign_is_itself(demo):
    assert appended([demo]) is demo
