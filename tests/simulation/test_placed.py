"""Frames of a simulation: where they truly are, and what the campaign knows of them."""

import numpy as np
import pytest

from thermal_robot import (
    CampaignError,
    simulate,
)
from thermal_robot.kinematics import exp6, quaternion_to_rotation

TARGET = (0.05, 0.03, 0.1)


def poses_of(campaign):
    pose = np.tile(np.eye(4), (campaign.samples, 1, 1))
    pose[:, :3, :3] = quaternion_to_rotation(campaign.orientation)
    pose[:, :3, 3] = campaign.position
    return pose


def test_a_base_and_a_tool_stand_before_and_behind_the_robot(arm):
    rng = np.random.default_rng(5)
    base, tool = (exp6(rng.normal(size=6)) for _ in range(2))
    found = simulate(arm, rows=10, measures="pose", base=base, tool=tool)
    np.testing.assert_allclose(poses_of(found), base @ arm.forward(found.q) @ tool, atol=1e-12)
    assert not found.base_known
    assert not found.tool_known
    np.testing.assert_array_equal(found.target, tool[:3, 3])


def test_a_point_is_known_and_turns_nothing(planar):
    found = simulate(planar, rows=10, tool=TARGET)
    there = planar.forward(found.q) @ np.array([*TARGET, 1.0])
    np.testing.assert_allclose(found.position, there[:, :3], atol=1e-12)
    assert found.tool_known


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"base": np.eye(3)}, "'base': no pose"),
        ({"base": 2.0 * np.eye(4)}, "'base': no pose"),
        ({"tool": [0.0, 1.0]}, "or three numbers"),
        ({"base": np.diag([-1.0, -1.0, 1.0, 1.0]), "base_known": True}, "its error is an effect of its own"),
        ({"tool_known": 1}, "expected true or false"),
    ],
)
def test_frames_that_are_none_are_refused(rv_m2, given, message):
    with pytest.raises(CampaignError, match=message):
        simulate(rv_m2, **given)
