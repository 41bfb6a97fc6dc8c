"""Where, which and how far: the answer to a campaign."""

from thermal_robot.diagnosis.diagnose import diagnose
from thermal_robot.diagnosis.parts import Finding
from thermal_robot.diagnosis.result import Diagnosis

__all__ = ["Diagnosis", "Finding", "diagnose"]
