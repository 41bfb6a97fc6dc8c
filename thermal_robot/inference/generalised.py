"""The linear problem in the covariance of a scatter: rows in units in which all are equally sure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from thermal_robot.inference.problem import Linear

Array = NDArray[np.float64]


def generalised(linear: Linear, covariance: Array, noise: Array) -> Linear:
    """Return the problem multiplied with diag(noise) L⁻¹ in each row, L Lᵀ its covariance (Aitken 1935).

    Parameters
    ----------
    linear
        The problem, N rows of m components.
    covariance
        (N, m, m) of what is left in each row: m², m rad, rad².
    noise
        (m,) one sigma of each component that the result shall have: m, rad.
    """
    root = np.linalg.cholesky(covariance)

    def white(columns: Array) -> Array:
        return np.asarray(noise[:, None] * np.linalg.solve(root, columns))

    return Linear(
        white(linear.gap[:, :, None])[:, :, 0],
        white(linear.frames),
        tuple(replace(block, columns=white(block.columns)) for block in linear.blocks),
    )
