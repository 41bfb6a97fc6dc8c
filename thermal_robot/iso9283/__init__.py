"""Performance criteria of ISO 9283:1998 from repeats: AP, RP, vAP, drift, AT, RT."""

from thermal_robot.iso9283.accuracy import Accuracy, accuracy
from thermal_robot.iso9283.attained import Attained
from thermal_robot.iso9283.directions import Variation, variation
from thermal_robot.iso9283.drift import Drift, drift_of
from thermal_robot.iso9283.measure import performance
from thermal_robot.iso9283.parts import PathCriteria, PoseCriteria
from thermal_robot.iso9283.path import AlongPath, along_path
from thermal_robot.iso9283.performance import Performance
from thermal_robot.iso9283.repeatability import Repeatability, repeatability

__all__ = [
    "Accuracy",
    "AlongPath",
    "Attained",
    "Drift",
    "PathCriteria",
    "Performance",
    "PoseCriteria",
    "Repeatability",
    "Variation",
    "accuracy",
    "along_path",
    "drift_of",
    "performance",
    "repeatability",
    "variation",
]
