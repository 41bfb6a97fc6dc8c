"""What a linear fit leaves on rows that are held out, from sums of products alone."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.inference.algebra import equations_of, ridge

Rows = NDArray[np.bool_]


def left_out(columns: Array, values: Array, flat: int, prior: Array, folds: Sequence[Rows]) -> float:
    """Return the sum of squares that fits to the other rows leave in each fold, in units of the noise.

    Parameters
    ----------
    columns
        (N, m, K) weighted, in units of the noise.
    values
        (N, m) the same of what is fitted.
    flat
        Number of leading columns without a prior.
    prior
        (K − flat,) one over the prior variance of each other column.
    folds
        (N,) rows of each fold.
    """
    stack = np.concatenate([columns, values[:, :, None]], axis=2)
    whole = _products(equations_of(stack))
    total = 0.0
    for fold in folds:
        held = equations_of(stack[fold])
        fitted = ridge(whole - _products(held), flat, prior)
        total += float(((held[:, -1] - held[:, :-1] @ fitted) ** 2).sum())
    return total


def _products(flat: Array) -> Array:
    return np.asarray(flat.T @ flat)
