"""Where, which and how far: the answer to a campaign."""

from thermal_robot.diagnosis.diagnose import diagnose
from thermal_robot.diagnosis.result import Diagnosis
from thermal_robot.diagnosis.values import Finding

__all__ = ["Diagnosis", "Finding", "diagnose"]
