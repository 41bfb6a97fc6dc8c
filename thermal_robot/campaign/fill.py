"""Filling the gaps of a covariate, once, by one rule per quantity, so that no other room meets a NaN."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from thermal_robot.campaign.names import split_name

_ZERO = ("approach", "velocity", "acceleration")
_HELD = ("payload", "speed")


def fill(column: str, values: NDArray[np.float64]) -> tuple[NDArray[np.float64], str]:
    """Return a covariate without NaN, and in plain words how its gaps were filled.

    A direction, velocity or acceleration that nobody noted is 0, which says "unknown" or "at rest". A payload
    or speed stays until it is changed. Everything else varies smoothly from row to row: linear in between,
    held at both ends.

    Parameters
    ----------
    column
        Name of the covariate.
    values
        (N,) with at least one number.
    """
    gaps = np.isnan(values)
    quantity, _ = split_name(column)
    if quantity in _ZERO:
        return np.where(gaps, 0.0, values), "taken as 0"
    present = np.flatnonzero(~gaps)
    if quantity in _HELD:
        before = np.searchsorted(present, np.arange(len(values)), side="right") - 1
        return values[present[np.maximum(before, 0)]], "the previous row's value held"
    return np.interp(np.arange(len(values)), present, values[present]), "interpolated between rows"
