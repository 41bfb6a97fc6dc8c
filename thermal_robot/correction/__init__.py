"""The robot as it really is: the corrected model, and what follows from it for commands and for robot files."""

from thermal_robot.correction.calibrated import Calibrated, calibrated
from thermal_robot.correction.calibrated_mjcf import calibrated_mjcf
from thermal_robot.correction.calibrated_urdf import calibrated_urdf
from thermal_robot.correction.commands import Commands
from thermal_robot.correction.determined import determined
from thermal_robot.correction.dh_table import dh_table
from thermal_robot.correction.model import CorrectedModel
from thermal_robot.correction.mujoco_models import mjcf_of_urdf
from thermal_robot.correction.simulator import with_simulator
from thermal_robot.correction.ur_kinematics import ur_kinematics
from thermal_robot.correction.zero_offsets import zero_offsets

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
