"""The corrected model, and what follows from it for commands and for robot files."""

from thermal_robot.correction.constant import determined, zero_offsets
from thermal_robot.correction.model import Commands, CorrectedModel
from thermal_robot.correction.mujoco_models import calibrated_mjcf, mjcf_of_urdf, with_simulator
from thermal_robot.correction.robot_files import Calibrated, calibrated, calibrated_urdf, dh_table, ur_kinematics

__all__ = [
    "Calibrated",
    "Commands",
    "CorrectedModel",
    "calibrated",
    "calibrated_mjcf",
    "calibrated_urdf",
    "determined",
    "dh_table",
    "mjcf_of_urdf",
    "ur_kinematics",
    "with_simulator",
    "zero_offsets",
]
