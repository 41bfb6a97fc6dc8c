"""Pose accuracy AP: how far the barycentre of the attained poses is from the commanded pose (ISO 9283:1998, 7.2.1)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from thermal_robot.iso9283.attained import Attained, Three, angles, three


@dataclass(frozen=True)
class Accuracy:
    """From the commanded pose to the barycentre of the attained ones.

    Attributes
    ----------
    position
        AP_p, the distance, m.
    axes
        AP_x, AP_y, AP_z, m.
    angles
        AP_a, AP_b, AP_c, about the same axes, rad; ``None`` where only positions are known.
    """

    position: float
    axes: Three
    angles: Three | None = None


def accuracy(attained: Attained, commanded: Attained) -> Accuracy:
    """Compute the accuracy of one pose.

    Parameters
    ----------
    attained
        Of n cycles.
    commanded
        Of one row; or of n, where a model predicts every cycle by itself, as one does that knows of temperature.
    """
    away = attained.barycentre - commanded.barycentre
    is_, should = attained.mean_rotation, commanded.mean_rotation
    turned = None if is_ is None or should is None else three(angles(is_, should))
    return Accuracy(float(np.linalg.norm(away)), three(away), turned)
