"""The pose that the controller has of the same joints: what differs is its model's, and no robot's."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import some

import thermal_robot as tr
from thermal_robot import kinematics as kin

_TWISTS = [f"{kind} {axis}" for kind in ("translation", "rotation") for axis in "xyz"]


@pytest.fixture(scope="module")
def ur5():
    return tr.load_robot("example-robot-data:ur5", "tool0")


def reported(robot, effects=None, seed=0):
    """Poses as a controller writes them: to a micrometre."""
    made = tr.simulate(robot, effects, rows=40, measures="controller", tool=(0.0, 0.0, 0.0), seed=seed)
    return replace(made, position=np.round(made.position, 6), covariates={}, derived=(), moves="unknown")


@pytest.mark.parametrize(
    ("effect", "value", "said"),
    some(
        [
            ("joint_offset", {"elbow_joint": 0.01}, "other joint zeros in the controller"),
            ("tool_frame", {"translation z": 0.12}, "tool or flange frame set in the controller"),
            ("base_frame", {"rotation z": 0.3}, "base frame set in the controller"),
        ],
        3,
    ),
)
def test_what_is_set_is_named(ur5, effect, value, said):
    found = tr.diagnose(reported(ur5, {effect: value}))
    assert found.verdict == (effect,)
    assert said in found.summary
    (cause,) = (f for f in found.effects if f.name == effect)
    ((_, told),) = value.items()
    assert max(abs(p.value) for p in cause.parameters) == pytest.approx(told, rel=1e-3)


def turned(angle, shift=(0.0, 0.0, 0.0)):
    """A frame turned about z, rad, and shifted, m."""
    return kin.homogeneous(kin.exp3([0.0, 0.0, angle]), np.array(shift))


@pytest.mark.parametrize(
    ("base", "tool", "verdict"),
    [
        (turned(0.0), turned(np.pi / 2), {"tool_frame"}),  # tool0 and the flange of a UR
        (turned(np.pi), turned(0.0), {"base_frame"}),  # its base_link and its base
        (turned(np.pi), turned(np.pi / 2, (0.05, 0.02, 0.1)), {"base_frame", "tool_frame"}),
    ],
)
def test_frames_that_are_turned_are_no_fault_of_a_joint(ur5, base, tool, verdict):
    own = reported(ur5)
    poses = base @ kin.tool_poses(ur5, own.q) @ tool
    place, turn = np.round(poses[:, :3, 3], 6), kin.rotation_to_quaternion(poses[:, :3, :3])
    found = tr.diagnose(replace(own, position=place, orientation=turn))
    assert set(found.verdict) == verdict
    if "tool_frame" in verdict:  # the place where a pendant has it, and not the twist that leads there
        told = [p.value for p in found.finding("tool_frame").parameters]
        np.testing.assert_allclose(told, [*tool[:3, 3], *kin.log3(tool[:3, :3])], atol=5e-6)


def test_a_tool_is_told_from_the_calibration_of_an_arm(ur5):
    rng = np.random.default_rng(1)
    calibrated = {f"{what} of {s.name}": 5e-4 * rng.normal() for s in ur5.segments if s.movable for what in _TWISTS}
    found = tr.diagnose(reported(ur5, {"tool_frame": {"translation z": 0.12}, "geometric": calibrated}))
    assert set(found.verdict) == {"tool_frame", "geometric"}
    assert found.finding("tool_frame").parameters[2].value == pytest.approx(0.12, abs=2e-3)


def test_the_same_model_differs_in_nothing(ur5):
    found = tr.diagnose(reported(ur5))
    assert found.verdict == ()
    assert found.gap.rms_before < 2e-6


def test_no_wear_is_looked_for(ur5):
    found = tr.diagnose(reported(ur5))
    names = {f.name for f in found.effects}
    assert {"tool_frame", "base_frame", "geometric", "joint_offset"} <= names
    assert not names & {"backlash", "joint_compliance", "drift", "transmission_error"}


@pytest.mark.slow
def test_another_robot_of_the_family_is_named(ur5):
    other = tr.load_robot("example-robot-data:ur3", "tool0")
    found = tr.diagnose(replace(reported(other), robot=ur5))
    assert not found.usable
    assert "example-robot-data:ur3 fits" in found.summary


def test_poses_of_a_controller_are_read_from_a_file(ur5, tmp_path):
    campaign = reported(ur5)
    again = tr.read_campaign(tr.write_campaign(campaign, tmp_path / "pendant"))
    assert again.kinds == ("controller",)
    assert again.base_known
    assert again.tool_known
    assert np.allclose(again.position, campaign.position, atol=1e-12)


def test_an_arm_of_one_joint_has_poses_too():
    urdf = """<robot name="arm"><link name="base"/><link name="tip"/>
    <joint name="j" type="revolute"><parent link="base"/><child link="tip"/><origin xyz="0 0 0.2"/><axis xyz="0 0 1"/>
    <limit lower="-2" upper="2" effort="1" velocity="1"/></joint></robot>"""
    found = tr.diagnose(reported(tr.load_robot(urdf, "tip"), {"tool_frame": {"translation x": 0.1}}))
    assert "tool_frame" in found.verdict
