"""Generalised least squares: the linear problem whitened by the covariance of each row."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.inference.problem import Linear


def generalised(linear: Linear, covariance: Array, noise: Array) -> Linear:
    """Return the problem with each row multiplied by diag(noise) L⁻¹, where L Lᵀ is its covariance (Aitken 1935).

    All rows then have the covariance diag(noise²).

    Parameters
    ----------
    linear
        The problem, N rows of m components.
    covariance
        (N, m, m) of the residual of each row: m², m rad, rad².
    noise
        (m,) one sigma of each component of the result: m, rad.
    """
    root = np.linalg.cholesky(covariance)

    def white(columns: Array) -> Array:
        return np.asarray(noise[:, None] * np.linalg.solve(root, columns))

    return Linear(
        white(linear.gap[:, :, None])[:, :, 0],
        white(linear.frames),
        tuple(replace(block, source=white(block.columns)) for block in linear.blocks),
    )
