"""The corrected model, and what follows from it for commands and for robot files."""

from thermal_robot.correction.constant import determined, zero_offsets
from thermal_robot.correction.model import Commands, CorrectedModel
from thermal_robot.correction.mujoco_models import calibrated_mjcf, mjcf_of_urdf, with_simulator
from thermal_robot.correction.robot_files import (
    Calibrated,
    calibrated,
    calibrated_urdf,
    dh_table,
    joint_parameters,
    ur_kinematics,
)
from thermal_robot.correction.zero_files import lerobot_calibration, pal_calibration

__all__ = [
    "Calibrated",
    "Commands",
    "CorrectedModel",
    "calibrated",
    "calibrated_mjcf",
    "calibrated_urdf",
    "determined",
    "dh_table",
    "joint_parameters",
    "lerobot_calibration",
    "mjcf_of_urdf",
    "pal_calibration",
    "ur_kinematics",
    "with_simulator",
    "zero_offsets",
]
