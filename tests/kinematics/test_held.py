"""Where joints stand that are no part of a chain."""

import numpy as np
import pytest
from coupled import COUPLED, PARALLELOGRAM, joint, link, urdf

from thermal_robot.errors import RobotError
from thermal_robot.kinematics import tool_poses
from thermal_robot.kinematics.model import Mimic, followed, held_configuration, held_position, mimics
from thermal_robot.kinematics.urdf import parse_urdf
from thermal_robot.robot import load_robot


def held(text):
    model = parse_urdf(text, "a test")
    return model, held_configuration(model, followed(mimics(text), list(model.names), []))


def test_joints_stand_at_zero_or_at_the_limit_nearest_to_it(awkward_urdf):
    model, q = held(awkward_urdf)
    expected = {"lift": 0.2, "turret": 0.0, "slide": 0.0, "branch_joint": -0.3, "roll_joint": 0.0, "tip_joint": 0.0}
    for name, position in expected.items():
        assert held_position(model, q, name) == pytest.approx(position, abs=1e-15)


def test_mimicking_joints_stand_where_what_they_follow_takes_them():
    model, q = held(COUPLED)
    expected = {"early": -0.2, "stage_2": 0.02, "stage_3": 0.05 - 0.04, "half": 1.3, "rack": 0.0, "jaw": 0.7}
    for name, position in (expected | {"finger": 0.2, "thumb": -0.7, "mount": 0.0}).items():
        assert held_position(model, q, name) == pytest.approx(position, abs=1e-15)
    model, q = held(PARALLELOGRAM)
    assert held_position(model, q, "upright") == pytest.approx(0.3)


def test_a_fixed_joint_stays_and_can_be_followed():
    text = urdf(
        link("a"), link("b"), link("c"), link("d"),
        joint("f", "fixed", "a", "b", mimic='joint="k" offset="0.5"'),
        joint("j", "continuous", "b", "c", mimic='joint="f" multiplier="3" offset="0.25"'),
        joint("k", "continuous", "c", "d", "1 0 0"),
    )  # fmt: skip
    robot = load_robot(text, "d")
    assert robot.joint_names == ("k",)
    expected = [np.cos(0.25), np.sin(0.25), 0.0]
    np.testing.assert_allclose(tool_poses(robot, [1.0])[0, :3, 3], expected, atol=1e-15)


def test_what_has_no_single_position_cannot_be_followed():
    text = urdf(
        link("a"), link("b"), link("c"), joint("free", "floating", "a", "b"), joint("j", "continuous", "b", "c")
    )
    model = parse_urdf(text, "a test")
    with pytest.raises(RobotError, match="'free', which another one mimics, has no single position") as refused:
        held_configuration(model, {"j": Mimic("free")})
    assert refused.value.name == "free"


def test_a_column_that_follows_a_lift_below_the_root_frame_carries_the_arm(awkward_urdf):
    # a second stage follows the first, wherever the root frame is
    text = urdf(
        link("floor"), link("one"), link("two", 2.0), link("arm"),
        joint("first", "prismatic", "floor", "one", limits=(0.2, 1.0)),
        joint("second", "prismatic", "one", "two", limits=(0.0, 3.0), mimic='joint="first" multiplier="2"'),
        joint("turn", "continuous", "two", "arm", axis="0 1 0"),
    )  # fmt: skip
    whole = load_robot(text, "arm")
    assert whole.joint_names == ("first", "turn")
    np.testing.assert_allclose(tool_poses(whole, [0.3, 1.0])[0, :3, 3], [0.0, 0.0, 0.9], atol=1e-15)
    np.testing.assert_allclose(whole.upper, [1.0, np.inf])
    above = load_robot(text, "arm", root_frame="one")
    assert above.joint_names == ("first", "turn")
    np.testing.assert_allclose(tool_poses(above, [0.3, 1.0])[0, :3, 3], [0.0, 0.0, 0.6], atol=1e-15)
