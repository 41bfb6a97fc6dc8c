"""Smooth laws of one quantity: the columns that a scan puts into a place."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from thermal_robot.inference import settings

Array = NDArray[np.float64]


def smooth_law(values: Array) -> Array:
    """Return (N, k) columns of a smooth function of a quantity, its constant removed.

    Levels for a quantity with few values, a natural cubic spline with five knots at its quantiles otherwise (Hastie,
    Tibshirani and Friedman, *The Elements of Statistical Learning*, 5.2.1).

    Empty (N, 0) where the quantity does not vary.
    """
    levels = np.unique(values)
    if len(levels) < 2:
        return np.zeros((len(values), 0))
    if len(levels) <= settings.FEW_LEVELS:
        columns = (values[:, None] == levels[1:]).astype(float)
    else:
        scaled = (values - values.min()) / np.ptp(values)
        knots = np.unique(
            np.quantile(scaled, np.linspace(settings.OUTER_KNOTS, 1.0 - settings.OUTER_KNOTS, settings.KNOTS))
        )
        columns = np.column_stack([scaled, *_natural(scaled, knots)])
    columns = columns - columns.mean(axis=0)
    u, s, _ = np.linalg.svd(columns, full_matrices=False)
    kept: Array = u[:, s > 1e-8 * s[0]] * np.sqrt(len(values))
    return kept


def _natural(x: Array, knots: Array) -> list[Array]:
    def term(k: int) -> Array:
        last = knots[-1]
        return np.asarray((np.maximum(x - knots[k], 0) ** 3 - np.maximum(x - last, 0) ** 3) / (last - knots[k]))

    return [term(k) - term(len(knots) - 2) for k in range(len(knots) - 2)] if len(knots) > 2 else []
