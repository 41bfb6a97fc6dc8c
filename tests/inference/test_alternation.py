"""Frames from nothing: each start finds what it finds alone, and the nearest of them is told."""

import numpy as np
import pytest

import thermal_robot as tr
from thermal_robot.inference.registration import alternate, starts
from thermal_robot.kinematics import exp3
from thermal_robot.observations import Frames


@pytest.fixture(scope="module")
def campaign():
    base, tool = np.eye(4), np.eye(4)
    base[:3, :3], base[:3, 3], tool[:3, 3] = exp3(np.array([0.3, -2.0, 1.0])), [2.0, -1.0, 0.5], [0.2, 0.05, -0.1]
    return tr.simulate("builtin:rv_m2", rows=40, noise=1e-4, base=base, tool=tool, tool_frame="tool0", seed=4)


def test_starts_side_by_side_find_what_each_finds_alone(campaign):
    declared = Frames.declared(campaign)
    targets = declared.tool[:3, 3] + starts(campaign)
    alone = [alternate(campaign, declared, target[None]) for target in targets]
    cost, frames = alternate(campaign, declared, targets)
    nearest = min(alone, key=lambda found: found[0])
    assert cost == nearest[0]
    np.testing.assert_array_equal(frames.base, nearest[1].base)
    np.testing.assert_array_equal(frames.tool, nearest[1].tool)
    assert len({round(each[0], 12) for each in alone}) > 1  # they do end at different places


def test_some_rows_are_a_campaign_of_these_rows(campaign):
    declared, some = Frames.declared(campaign), np.arange(3, 40, 2)
    targets = starts(campaign)
    found, part = alternate(campaign, declared, targets, some=some), alternate(campaign.take(some), declared, targets)
    assert found[0] == part[0]
    np.testing.assert_array_equal(found[1].base, part[1].base)
