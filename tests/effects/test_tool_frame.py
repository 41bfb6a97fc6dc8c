"""A target that does not sit on the tool where the file says."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import commanded, tool_with

from thermal_robot import diagnose, simulate
from thermal_robot.effects import ToolFrame
from thermal_robot.kinematics import tool_poses
from thermal_robot.observations import observe


def test_a_declared_target_is_off_by_a_twist_in_the_tool_frame(rv_m2):
    campaign = commanded(rv_m2, base_known=True, tool_known=True, target=[0.01, 0.02, 0.1])
    axes = tool_poses(rv_m2, campaign.q)[:, :3, :3]
    nominal = tool_with(campaign, ToolFrame(), np.zeros(3))
    shift = np.array([1e-3, 2e-3, -3e-3])
    np.testing.assert_allclose(tool_with(campaign, ToolFrame(), shift) - nominal, axes @ shift, atol=1e-14)


def test_positions_show_no_turn_of_the_tool_and_poses_do(rv_m2):
    positions = commanded(rv_m2, tool_known=True)
    poses = replace(positions, position=np.zeros((10, 3)), orientation=np.tile([1.0, 0, 0, 0], (10, 1)))
    for campaign, count in ((positions, 3), (poses, 6)):
        effect = ToolFrame().variants(observe(campaign))[0]
        # what a model was fitted with it keeps, whatever it is asked to predict
        for asked in (positions, poses):
            assert len(effect.parameters(observe(asked))) == count


def test_it_is_an_error_of_the_tool_and_says_what_would_make_it_one(rv_m2):
    assert ToolFrame.frame == "tool"
    plain = commanded(rv_m2)
    assert ToolFrame().missing(observe(plain)) == ('frames.tool = "known"',)
    assert ToolFrame().missing(observe(replace(plain, tool_known=True))) == ()
    simulated = replace(plain, simulated_position=np.zeros((10, 3)))
    assert ToolFrame().missing(observe(simulated)) == ()


@pytest.mark.parametrize("measures", [{"measures": "position"}, {"measures": "pose", "noise_orientation": 5e-5}])
def test_a_turn_about_the_last_axis_alone_is_told_with_that_joints_zero(rv_m2, measures):
    off = {"joint_offset": {rv_m2.joint_names[-1]: 3e-3}}
    found = diagnose(simulate(rv_m2, off, rows=60, noise=2e-5, tool=(0.05, 0.03, 0.1), seed=1, **measures))
    pair = {"tool_frame", "joint_offset"}
    assert all({name, *found.finding(name).confounded_with} == pair for name in pair)
