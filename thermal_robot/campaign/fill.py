"""Filling the gaps of a covariate, once, by one rule per quantity, so that no other room meets a NaN."""

from __future__ import annotations

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.campaign.names import split_name

_ZERO = ("approach", "velocity", "acceleration")
_HELD = ("payload", "speed")


def fill(column: str, values: Array, clock: Array | None = None) -> tuple[Array, str]:
    """Return a covariate without NaN, and in plain words how its gaps were filled.

    A direction, velocity or acceleration that nobody noted is 0, which says "unknown" or "at rest". A payload
    or speed stays until it is changed. Everything else varies smoothly: linear in between, held at both ends.

    Parameters
    ----------
    column
        Name of the covariate.
    values
        (N,) with at least one number.
    clock
        (N,) when each row was measured: ``time``, or ``order``; the rows follow each other where it is absent.
    """
    gaps = np.isnan(values)
    quantity, _ = split_name(column)
    if quantity in _ZERO:
        return np.where(gaps, 0.0, values), "taken as 0"
    at = np.arange(float(len(values))) if clock is None else clock
    sequence = np.argsort(at, kind="stable")
    known = sequence[~gaps[sequence]]
    if quantity in _HELD:
        before = np.cumsum(~gaps[sequence]) - 1
        filled = np.empty(len(values))
        filled[sequence] = values[known[np.maximum(before, 0)]]
        return filled, f"the previous {'row' if clock is None else 'measurement'}'s value held"
    # repeats of one instant keep what each recorded
    between = np.interp(at, at[known], values[known])
    return np.where(gaps, between, values), f"interpolated {'between rows' if clock is None else 'in time'}"
