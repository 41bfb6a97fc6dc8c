"""A quantity that is turned round: its columns alone, twice is not at all, and a model's file keeps it."""

import numpy as np
import pytest

from thermal_robot import demo_campaign
from thermal_robot.campaign.campaign import read_alike, turned_round
from thermal_robot.campaign.settings import Settings


@pytest.mark.parametrize("quantity", ["approach", "temperature", "torque", "gravity"])
def test_a_quantity_turned_round_twice_is_as_it_was(quantity):
    campaign = demo_campaign()
    once = turned_round(campaign, quantity)
    again = turned_round(once, quantity)
    assert again.turned == ()
    np.testing.assert_array_equal(again.robot.gravity, campaign.robot.gravity)
    assert (once.robot.gravity != campaign.robot.gravity).any() == (quantity == "gravity")
    for name, values in campaign.covariates.items():
        np.testing.assert_allclose(again.covariates[name], values, atol=1e-12)
        changed = (once.covariates[name] != values).any()
        assert changed == (name.startswith(quantity) and (values != 0.0).any())


def test_rows_are_read_as_those_of_another_campaign():
    campaign = demo_campaign()
    other = turned_round(turned_round(campaign, "approach"), "gravity")
    read = read_alike(campaign, other.robot, other.turned)
    assert (read.turned, read.robot) == (other.turned, other.robot)
    assert read_alike(read, other.robot, other.turned) is read
    for name, values in other.covariates.items():
        np.testing.assert_array_equal(read.covariates[name], values)


def test_settings_keep_it_and_old_ones_have_none():
    settings = turned_round(demo_campaign(), "approach").settings
    assert Settings.from_dict(settings.to_dict()) == settings
    plain = demo_campaign().settings
    assert "turned" not in plain.to_dict()
    assert Settings.from_dict(plain.to_dict()).turned == ()
