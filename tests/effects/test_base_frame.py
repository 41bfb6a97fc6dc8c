"""A base that does not stand where the file says."""

import numpy as np
from helpers import commanded, tool_at, tool_with

from thermal_robot import diagnose, simulate
from thermal_robot.effects import BaseFrame
from thermal_robot.observations import observe


def test_a_declared_base_is_off_by_a_twist_in_the_root_frame(rv_m2):
    campaign = commanded(rv_m2, base_known=True, tool_known=True)
    nominal = tool_at(rv_m2, campaign.q)
    shift = np.array([1e-3, 2e-3, -3e-3])
    moved = tool_with(campaign, BaseFrame(), [*shift, 0, 0, 0]) - nominal
    np.testing.assert_allclose(moved, np.broadcast_to(shift, moved.shape), atol=1e-14)
    x, y, z = nominal.T
    turned = np.stack([x * np.cos(0.1) - y * np.sin(0.1), x * np.sin(0.1) + y * np.cos(0.1), z], axis=1)
    np.testing.assert_allclose(tool_with(campaign, BaseFrame(), [0, 0, 0, 0, 0, 0.1]), turned, atol=1e-14)


def test_it_is_an_error_of_the_base_and_says_what_would_make_it_one(rv_m2):
    assert BaseFrame.frame == "base"
    assert BaseFrame().missing(observe(commanded(rv_m2))) == ('frames.base = "known"',)
    assert BaseFrame().missing(observe(commanded(rv_m2, base_known=True))) == ()


def test_a_turn_about_the_first_axis_alone_is_told_with_that_joints_zero(rv_m2):
    """No measurement of the tool tells which of the two it is, whichever was at work."""
    for at_work in ({"base_frame": {"rotation z": 2e-3}}, {"joint_offset": {"joint_1": 2e-3}}):
        found = diagnose(simulate(rv_m2, at_work, rows=60, noise=2e-5, seed=1))
        pair = {"base_frame", "joint_offset"}
        assert len(found.verdict) == 1
        assert all({name, *found.finding(name).confounded_with} == pair for name in pair)
        assert min(found.finding(name).probability for name in pair) > 0.01


def test_a_base_that_is_off_in_all_components_is_told_in_all(rv_m2):
    off = {"base_frame": [1e-3, -2e-3, 1e-3, 1e-3, 2e-3, -1e-3]}
    found = diagnose(simulate(rv_m2, off, rows=60, noise=2e-5, seed=1)).finding("base_frame")
    assert found.status == "found"
    assert len(found.parameters) == 6
