"""Pose repeatability RP: how closely the attained poses lie about their barycentre (ISO 9283:1998, 7.2.2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from thermal_robot.iso9283.attained import Attained, Three, angles, three

Array = NDArray[np.float64]

SPREADS = 3.0
"""Standard deviations that the standard adds to the mean distance."""
FEWEST_FOR_INTERVAL = 3
"""Cycles from which an interval is told. Two lie equally far from their barycentre: nothing is known of the spread."""
DRAWS = 1000
"""Times that the test is repeated in simulation: the ends of the interval are then good to 1 % at 30 cycles."""
_LEVEL = (0.025, 0.975)


@dataclass(frozen=True)
class Repeatability:
    """Of the attained poses about their barycentre.

    Attributes
    ----------
    position
        RP_l: mean distance and three of its standard deviations, m.
    ci95
        Interval in which RP_l lies that endlessly many cycles would give, with a probability of 95 %, m; ``None`` with
        two cycles, or without scatter. RP_l of few cycles is too small in the mean, by a sixth with five: the
        interval counts that, and lies higher.
    angles
        RP_a, RP_b, RP_c: three standard deviations, to be read as ±, rad; ``None`` where only positions are known.
    """

    position: float
    ci95: tuple[float, float] | None = None
    angles: Three | None = None


def repeatability(attained: Attained) -> Repeatability:
    """Compute the repeatability of one pose from n ≥ 2 cycles."""
    deviations = attained.position - attained.barycentre
    value = float(_of(np.linalg.norm(deviations, axis=1)))
    mean, turned = attained.mean_rotation, None
    if attained.rotation is not None and mean is not None:
        turned = three(SPREADS * angles(attained.rotation, mean).std(axis=0, ddof=1))
    return Repeatability(value, _interval(deviations, value), turned)


def _of(distances: Array) -> Array:
    """RP_l of distances from the barycentre, the last axis being cycles."""
    return np.asarray(distances.mean(axis=-1) + SPREADS * distances.std(axis=-1, ddof=1))


def _interval(deviations: Array, value: float) -> tuple[float, float] | None:
    """95 % interval of RP_l for normal scatter of any shape, by repeating the test in simulation.

    What n cycles show, over what endlessly many would, depends on the shape of the scatter alone, not on its size. The
    shape is that of the sample: how far it spreads along its principal axes. The draws are the same in each call, so
    that the same table gives the same figures.
    """
    cycles = len(deviations)
    if cycles < FEWEST_FOR_INTERVAL or value == 0.0:
        return None
    spread = np.linalg.svd(deviations / value, compute_uv=False)[:3] / np.sqrt(cycles - 1.0)
    drawn = np.random.default_rng(0).standard_normal((DRAWS, cycles, len(spread))) * spread
    endless = _of(np.linalg.norm(drawn, axis=2).ravel())
    shown = _of(np.linalg.norm(drawn - drawn.mean(axis=1, keepdims=True), axis=2)) / endless
    low, high = np.quantile(shown, _LEVEL)
    return float(value / high), float(value / low)


def of_noise(sigma: float) -> float:
    """Return RP_l that an instrument with a standard deviation of ``sigma`` per axis (m) shows where nothing moves.

    The distances have Maxwell's law: mean 2 √(2/π) σ, standard deviation √(3 − 8/π) σ.
    """
    return float(sigma * (2.0 * np.sqrt(2.0 / np.pi) + SPREADS * np.sqrt(3.0 - 8.0 / np.pi)))
