"""Flat-normal errors, probability of joining, capability, clearance and tolerance polygons (Eqs 14-22).

The room knows no robot and no files: it takes means, covariances, bounds and columns of sensitivities.
"""

from thermal_robot.assembly.probability.capability import (
    capability,
    capability_ratio,
    failing_from_capability,
    required_clearance,
)
from thermal_robot.assembly.probability.flat_normal import (
    FlatNormal,
    FlatNormalND,
    flat_normal,
    flat_normal_nd,
)
from thermal_robot.assembly.probability.joining import failing_probability, joining_probability
from thermal_robot.assembly.probability.normality import (
    NormalityDecision,
    Power,
    normality_power,
    normality_test,
    sample_size_to_see,
    shapiro_wilk_critical,
)
from thermal_robot.assembly.probability.spread import (
    UniformSpread,
    Zonotope,
    plane_axes,
    planes,
    polygon_in_plane,
    zonotope,
)

__all__ = [
    "FlatNormal",
    "FlatNormalND",
    "NormalityDecision",
    "Power",
    "UniformSpread",
    "Zonotope",
    "capability",
    "capability_ratio",
    "failing_from_capability",
    "failing_probability",
    "flat_normal",
    "flat_normal_nd",
    "joining_probability",
    "normality_power",
    "normality_test",
    "plane_axes",
    "planes",
    "polygon_in_plane",
    "required_clearance",
    "sample_size_to_see",
    "shapiro_wilk_critical",
    "zonotope",
]
