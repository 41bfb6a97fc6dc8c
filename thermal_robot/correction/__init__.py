"""The robot as it really is: the corrected model, and what follows from it for commands and for robot files."""

from thermal_robot.correction.model import CorrectedModel

__all__ = ["CorrectedModel"]
