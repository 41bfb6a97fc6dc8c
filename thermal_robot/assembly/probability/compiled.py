"""Probabilities of large batches of discs by numba (the extra ``fast``), on all processors."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import numpy.typing as npt

from thermal_robot.arrays import Array
from thermal_robot.assembly.probability.planar import ANGLES
from thermal_robot.compiling import in_pieces, loads

MANY = 20_000
"""Cases from which it is worth while: the first call loads numba, which takes a second, and compiles."""


def circle_chances(covariance: npt.ArrayLike, diameter: npt.ArrayLike, mean: npt.ArrayLike) -> Array | None:
    """Probabilities (2, ...) that bivariate normal deviations lie in, and out of, discs about the origin.

    Inputs broadcast and need not be valid: an invalid case, or one outside this method's range, gives NaN. The result
    is ``None`` for fewer than `MANY` cases, without numba, or where the shapes do not fit.
    """
    matrices, sizes, means = np.asarray(covariance, float), np.asarray(diameter, float), np.asarray(mean, float)
    if not means.ndim and means == 0.0:
        means = np.zeros(2)
    if matrices.shape[-2:] != (2, 2) or means.shape[-1:] != (2,):
        return None
    try:
        leading = np.broadcast_shapes(matrices.shape[:-2], sizes.shape, means.shape[:-1])
    except ValueError:
        return None
    if math.prod(leading) < MANY or not loads("thermal_robot.assembly.probability.loops"):
        return None
    from thermal_robot.assembly.probability import loops

    flat = (
        np.broadcast_to(matrices, (*leading, 2, 2)).reshape(-1, 2, 2),
        np.broadcast_to(means, (*leading, 2)).reshape(-1, 2),
        np.broadcast_to(sizes, leading).reshape(-1),
    )
    found = np.empty((2, len(flat[0])))
    in_pieces(loops.circles, (*flat, *_angles()), len(flat[0]), (found,))
    return found.reshape(2, *leading)


@cache
def _angles() -> tuple[npt.NDArray[np.int64], Array, Array]:
    """Numbers (K,) of midpoint angles, and tables (K, 2, n) of their cosines and sines: full circle, first quarter."""
    table = np.zeros((len(ANGLES), 2, int(ANGLES[-1])))
    for row, count in zip(table, ANGLES, strict=True):
        angle = (2.0 * np.pi / count) * (np.arange(count) + 0.5)
        row[0, :count], row[1, :count] = np.cos(angle), np.sin(angle)
    return ANGLES.astype(np.int64), table, table[:, :, : int(ANGLES[-1]) // 4].copy()
