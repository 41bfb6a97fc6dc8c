"""Multi-directional pose accuracy variation vAP: what the direction of approach does (ISO 9283:1998, 7.2.3)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from thermal_robot.iso9283.attained import Attained, Three, angles, three


@dataclass(frozen=True)
class Variation:
    """Largest differences between barycentres of one pose that is reached from several directions.

    Attributes
    ----------
    position
        vAP_p, the largest distance, m.
    angles
        vAP_a, vAP_b, vAP_c, the largest angle about each axis, rad; ``None`` where only positions are known.
    """

    position: float
    angles: Three | None = None


def variation(attained: Sequence[Attained]) -> Variation:
    """Compute the variation from the attained poses of two directions or more."""
    pairs = list(combinations(attained, 2))
    away = max(float(np.linalg.norm(one.barycentre - other.barycentre)) for one, other in pairs)
    means = [(one.mean_rotation, other.mean_rotation) for one, other in pairs]
    turns = [np.abs(angles(one, other)) for one, other in means if one is not None and other is not None]
    return Variation(away, three(np.max(turns, axis=0)) if turns else None)
