"""Clearances that many round joints need, by Newton steps that a bracket holds: Eq 22 solved for ``L``, all at once.

The failing probability as a standard normal quantile, ``z(R) = -Phi^-1(1 - P)``, is nearly a straight line in the
radius wherever little fails, so that few steps of

    R <- R + (z* - z) phi(z) / (dP/dR)

are enough. No deviation is longer than its mean, its segment and a normal deviation as wide all round as the widest
way, hence ``R <= |mean| + |segment| + s1 sqrt(-2 log(1 - P))``, where the search begins.
"""

from __future__ import annotations

import numpy as np
from scipy.special import ndtri_exp

from thermal_robot.arrays import Array
from thermal_robot.assembly.probability.discs import TOLD, disc_chances
from thermal_robot.assembly.probability.principal import Principal

_STEPS = 80  # halvings alone would take fifty
_CLOSE = 1e-14  # relative: less than the rounding of the failing probability moves it


def disc_clearances(covariance: Array, means: Array, log_failing: float, segments: Array | None = None) -> Array:
    """Diameters at which discs about the origin fail with a probability.

    Parameters
    ----------
    covariance
        Normal parts, shape ``(N, 2, 2)``.
    means
        Shape ``(N, 2)``.
    log_failing
        Logarithm of the failing probability, negative and finite.
    segments
        Ends of the uniform parts, which run from ``-segment`` to ``segment``, shape ``(N, 2)``; ``None`` for none.

    Returns
    -------
    Array
        Shape ``(N,)``; NaN where the integrals that are cheap do not resolve what is asked for.
    """
    principal = Principal.of(covariance)
    wanted, deep = -float(ndtri_exp(log_failing)), log_failing < np.log(TOLD)
    high = np.hypot(means[:, 0], means[:, 1]) + np.sqrt(-2.0 * log_failing * principal.large)
    if segments is not None:
        high = high + np.hypot(segments[:, 0], segments[:, 1])
    low, radius = np.zeros_like(high), high.copy()
    result = np.full(len(means), np.nan)
    left = np.flatnonzero(principal.large > 0.0)
    for _ in range(_STEPS):
        if not len(left):
            break
        here = radius[left]
        part = None if segments is None else segments[left]
        chances = disc_chances(principal.rows(left), means[left], here, part)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            quantile = -ndtri_exp(np.log(chances.outside))
            density = np.exp(-0.5 * quantile * quantile) / np.sqrt(2.0 * np.pi)
            step = (wanted - quantile) * density / chances.rate * here
        lost = np.isnan(chances.outside)  # less fails than the cheap integrals tell
        above = (quantile > wanted) | lost
        high[left], low[left] = np.where(above, here, high[left]), np.where(above, low[left], here)
        following = here + step
        inside = (following > low[left]) & (following < high[left])
        following = np.where(inside, following, 0.5 * (low[left] + high[left]))
        done = ~lost & ((np.abs(step) <= _CLOSE * here) | (high[left] - low[left] <= _CLOSE * here))
        result[left[done]] = np.where(np.abs(step) <= _CLOSE * here, here + step, here)[done]
        radius[left] = following
        left = left[~done & np.isfinite(chances.inside) & ~(lost & deep)]
    return 2.0 * result
