"""Temperature to elongation to displacement, and back (Kluz et al. 2018, Eqs 5–13)."""

from thermal_robot.assembly.thermal.best_poses import BestPoses, best_poses
from thermal_robot.assembly.thermal.elongation import (
    displacement,
    elongation,
    expansion_coefficient,
    expansion_coefficients,
    segment_names,
    sensitivity,
)
from thermal_robot.assembly.thermal.identify import IdentifiedElongations, identify_elongations
from thermal_robot.assembly.thermal.mean_shift import MeanShift, mean_shift_test
from thermal_robot.assembly.thermal.warm_up import LinkWarmUp, warm_up

__all__ = [
    "BestPoses",
    "IdentifiedElongations",
    "LinkWarmUp",
    "MeanShift",
    "best_poses",
    "displacement",
    "elongation",
    "expansion_coefficient",
    "expansion_coefficients",
    "identify_elongations",
    "mean_shift_test",
    "segment_names",
    "sensitivity",
    "warm_up",
]
