"""Attained poses: where a robot really was, cycle after cycle, and the barycentre of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal_robot.kinematics import log3

Array = NDArray[np.float64]
Three = tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Attained:
    """Poses of one target in n cycles, all in the same frame: that of the base where the standard is to be met.

    Attributes
    ----------
    position
        (n, 3) m.
    rotation
        (n, 3, 3), which turn vectors of the target's frame into that frame; ``None`` where only positions are known.
    """

    position: Array
    rotation: Array | None = None

    @property
    def cycles(self) -> int:
        """Number of cycles n."""
        return len(self.position)

    @property
    def barycentre(self) -> Array:
        """(3,) mean position, m."""
        return np.asarray(self.position.mean(axis=0))

    @property
    def mean_rotation(self) -> Array | None:
        """(3, 3) the rotation nearest to all; ``None`` where only positions are known."""
        return None if self.rotation is None else mean_rotation(self.rotation)

    def take(self, rows: NDArray[np.int64] | NDArray[np.bool_]) -> Attained:
        """Return some of the cycles."""
        return Attained(self.position[rows], None if self.rotation is None else self.rotation[rows])


def mean_rotation(rotations: Array) -> Array:
    """Return the (3, 3) rotation from which the sum of squared chordal distances to (n, 3, 3) rotations is least.

    Moakher, *SIAM J. Matrix Anal. Appl.* 24 (2002): the projection of the mean matrix onto the rotations.
    """
    u, _, vt = np.linalg.svd(rotations.mean(axis=0))
    return np.asarray(u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt)


def angles(rotations: Array, reference: Array) -> Array:
    """(..., 3) angles a, b, c from a reference to rotations, about the axes of their common frame, rad.

    They are the rotation vector of R R_refᵀ. The angles of the standard, turns about one axis after the other, are the
    same but for products of them: 1 µrad at 1 mrad.
    """
    return log3(rotations @ np.swapaxes(reference, -1, -2))


def three(values: ArrayLike) -> Three:
    """Return three numbers as plain values."""
    a, b, c = (float(v) for v in np.asarray(values))
    return a, b, c
