"""The robot as it really is: the corrected model, and what follows from it for commands and for robot files.

Whoever asks for the model alone does not load what writes robot files.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from thermal_robot.correction.constant import determined, zero_offsets
    from thermal_robot.correction.model import Commands, CorrectedModel
    from thermal_robot.correction.mujoco_models import calibrated_mjcf, mjcf_of_urdf, with_simulator
    from thermal_robot.correction.robot_files import Calibrated, calibrated, calibrated_urdf, dh_table, ur_kinematics

_HOMES = {
    "constant": ("determined", "zero_offsets"),
    "model": ("Commands", "CorrectedModel"),
    "mujoco_models": ("calibrated_mjcf", "mjcf_of_urdf", "with_simulator"),
}

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


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    home = next((home for home, names in _HOMES.items() if name in names), "robot_files")
    return getattr(import_module(f"{__name__}.{home}"), name)
