"""Diagnosis of a campaign: where the gap lies, which effects cause it, how far a correction shrinks it."""

from thermal_robot.diagnosis.diagnose import diagnose
from thermal_robot.diagnosis.result import Diagnosis
from thermal_robot.diagnosis.values import Finding

__all__ = ["Diagnosis", "Finding", "diagnose"]
