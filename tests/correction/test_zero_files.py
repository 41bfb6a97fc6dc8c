"""Zeros in the files of PAL's and of LeRobot's arms: a motor that is read through them stands where it is said to."""

import json
import re

import numpy as np
import pytest
import yaml
from readers import model_of

from thermal_robot import CampaignError, load_robot
from thermal_robot.correction import lerobot_calibration, pal_calibration
from thermal_robot.correction.holding import TICK
from thermal_robot.effects import JointOffset
from thermal_robot.kinematics import exp6
from thermal_robot.observations import Frames

ASIDE = Frames(np.eye(4), exp6([0.05, 0.03, 0.1, 0.0, 0.0, 0.0]))
ZEROS = np.array([2e-3, -3e-3, 4e-3, -5e-3, 6e-3])


def arm(rv_m2, names):
    """The RV-M2 with other names of its joints, and its zeros off."""
    robot = load_robot(re.sub(r'"joint_(\d)"', rf'"{names}"', rv_m2.urdf), "tool0")
    return model_of(robot, (JointOffset(), ZEROS), frames=ASIDE, base_known=True, tool_known=True)


def test_a_transmission_with_the_offset_reads_where_the_joint_is(rv_m2):
    """Of ros2_control: joint = actuator / reduction + offset."""
    model, actuator = arm(rv_m2, r"arm_\1_joint"), np.linspace(-50.0, 60.0, 5)
    read = yaml.safe_load(pal_calibration(model))
    held = read["robot_state_publisher"]["ros__parameters"]["eye_hand_calibration"]
    offsets = np.array([held[f"arm_{k}_joint_offset"] for k in range(1, 6)])
    stands = actuator / 100.0 + ZEROS  # commanded at actuator / 100, with no offset in use
    np.testing.assert_allclose(actuator / 100.0 + offsets, stands, atol=1e-12)


def test_what_the_robots_own_file_says_stays_and_zeros_are_added(rv_m2, tmp_path):
    model, own = arm(rv_m2, r"arm_left_\1_joint"), tmp_path / "master_calibration.yaml"
    wheels = {"mobile_base_controller": {"ros__parameters": {"wheel_separation_multiplier": 1.02}}}
    before = {"calibration_offset": {"arm_left_2_joint_offset": 0.01, "head_1_joint_offset": 0.02}}
    own.write_text(yaml.safe_dump({**wheels, "robot_state_publisher": {"ros__parameters": before}}))
    read = yaml.safe_load(pal_calibration(model, own))
    held = read.pop("robot_state_publisher")["ros__parameters"]["calibration_offset"]
    assert read == wheels
    assert held["arm_left_2_joint_offset"] == pytest.approx(0.007)
    assert held["arm_left_1_joint_offset"] == pytest.approx(0.002)
    assert held["head_1_joint_offset"] == 0.02


def motors(joints, **other):
    return {j: {"id": k, "drive_mode": 0, "homing_offset": 100 * k, "range_min": 900, "range_max": 3200, **other}
            for k, j in enumerate(joints, 1)}  # fmt: skip


@pytest.mark.parametrize(("kind", "sign"), [("feetech", -1), ("dynamixel", 1)])
def test_a_motor_with_the_new_homing_offset_reports_where_the_joint_is(rv_m2, tmp_path, kind, sign):
    """LeRobot: a Feetech motor reports its position less the offset, a Dynamixel one plus it."""
    model, own = arm(rv_m2, r"joint_\1"), tmp_path / "my_arm.json"
    before = motors([*model.robot.joint_names, "gripper"])
    own.write_text(json.dumps(before))
    after = json.loads(lerobot_calibration(model, own, motors=kind))
    assert after.pop("gripper") == before.pop("gripper")
    place = 2500
    for joint, zero in zip(model.robot.joint_names, ZEROS, strict=True):
        reported = [place + sign * held[joint].pop("homing_offset") for held in (before, after)]
        assert reported[1] - reported[0] == round(zero / TICK)
        assert after[joint] == before[joint]


@pytest.mark.parametrize(
    ("spoil", "word"),
    [
        (lambda held: held.pop("joint_2"), "no motor 'joint_2'"),
        (lambda held: held["joint_2"].update(drive_mode=1), "backwards"),
        (lambda held: held["joint_2"].update(homing_offset=2047), "register"),
        (lambda held: held["joint_2"].update(homing_offset="far"), "no number"),
    ],
)
def test_a_calibration_that_cannot_take_a_zero_is_refused(rv_m2, tmp_path, spoil, word):
    model, own = arm(rv_m2, r"joint_\1"), tmp_path / "my_arm.json"
    held = motors(model.robot.joint_names)
    spoil(held)
    own.write_text(json.dumps(held))
    with pytest.raises(CampaignError, match=word):
        lerobot_calibration(model, own)


def test_arms_of_others_are_refused(rv_m2, tmp_path):
    with pytest.raises(CampaignError, match="PAL Robotics"):
        pal_calibration(arm(rv_m2, r"joint_\1"))
    with pytest.raises(CampaignError, match="no such file"):
        lerobot_calibration(arm(rv_m2, r"joint_\1"), tmp_path / "none.json")
