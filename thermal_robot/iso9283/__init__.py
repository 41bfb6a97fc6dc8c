"""ISO 9283:1998 performance criteria from repeated poses: AP, RP, vAP, drift, AT, RT."""

from thermal_robot.iso9283.criteria import (
    Accuracy,
    AlongPath,
    Attained,
    Drift,
    PathCriteria,
    PoseCriteria,
    Repeatability,
    Variation,
    accuracy,
    along_path,
    drift_of,
    repeatability,
    variation,
)
from thermal_robot.iso9283.measure import performance
from thermal_robot.iso9283.performance import Performance

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
