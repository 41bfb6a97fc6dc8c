"""Robust weights: the noise of a residual, its gross errors, and what correlated rows are worth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from thermal_robot.inference import settings
from thermal_robot.inference.evidence import Gram
from thermal_robot.inference.problem import Linear, Whitening, scores

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Noise:
    """The instrument's one-sigma per axis, m and rad; ``None`` where it is not given."""

    position: float | None = None
    orientation: float | None = None

    def parts(self, measures: int) -> tuple[float | None, ...]:
        """Return the noise of positions, and with six components that of orientations."""
        return (self.position, self.orientation)[: measures // 3]


def distance_limit(measures: int, rows: int) -> float:
    """Return the squared distance, in units of the noise, beyond which one of so many rows is a gross error."""
    return settings.GROSS_FACTOR * float(chdtri(measures, settings.GROSS_LEVEL / max(rows, 1)))


def robust_noise(remainder: Array, leverage: float = 0.0) -> Array:
    """Return one sigma per axis of positions and of orientations, from the median squared length of a residual.

    The ``leverage``, the share of the equations that the fit has taken up, is given back to the noise.
    """
    parts = remainder.reshape(len(remainder), -1, 3)
    middle = np.median((parts**2).sum(axis=2), axis=0) / float(chdtri(3, 0.5))
    return np.asarray(np.maximum(np.sqrt(middle / (1.0 - leverage)), settings.ROUNDING))


def settled_noise(measured: Array, noise: Noise, measures: int) -> tuple[Array, float]:
    """Return the noise of each component, never below what is stated, and the degrees of freedom of its prior.

    The stated noise counts. Where the residual is well above it, the residual sets the scale by which effects are
    judged, and the prior has no weight.
    """
    stated = noise.parts(measures)
    sigma = np.array(
        [
            m if g is None else max(g, m if m > settings.NOISE_SLACK * g else g)
            for g, m in zip(stated, measured, strict=True)
        ]
    )
    firm = all(g is not None and s <= g for g, s in zip(stated, sigma, strict=True))
    return np.repeat(sigma, 3), settings.GIVEN_NOISE_DOF if firm else 0.0


def first_whitening(linear: Linear, noise: Noise, use: NDArray[np.bool_]) -> Whitening:
    """Give all rows in use the same weight, and take the noise from the median of the gap."""
    weights = use.astype(float)
    sigma, held = settled_noise(robust_noise(linear.gap[use]), noise, linear.measures)
    return Whitening(weights, sigma, held)


def reweigh(
    remainder: Array, noise: Noise, use: NDArray[np.bool_], leverage: float, measures: int
) -> tuple[Whitening, NDArray[np.bool_]]:
    """Set gross errors aside and give the tail less weight (Huber 1964), at the noise of the remainder.

    Parameters
    ----------
    remainder
        (N, m) what an explanation leaves.
    noise
        As stated.
    use
        (N,) rows that may be used; no more than a quarter of them is set aside.
    leverage
        Of the explanation: the share of the equations that it takes up.
    measures
        m.

    Returns
    -------
    whitening
        Weights and noise.
    aside
        (N,) rows set aside.
    """
    sigma, held = settled_noise(robust_noise(remainder[use], leverage), noise, measures)
    distance2 = ((remainder / sigma) ** 2).sum(axis=1) / (1.0 - leverage)
    aside = use & (distance2 > distance_limit(measures, int(use.sum())))
    if aside.sum() > settings.MOST_OUTLIERS * use.sum():
        worst = np.argsort(np.where(use, -distance2, np.inf))[: int(settings.MOST_OUTLIERS * use.sum())]
        aside = np.isin(np.arange(len(use)), worst) & aside
    bend = float(chdtri(measures, settings.BEND_LEVEL))
    weights = np.where(use & ~aside, np.minimum(1.0, np.sqrt(bend / np.maximum(distance2, settings.TINY))), 0.0)
    return Whitening(weights, sigma, held), aside


def design_effect(
    linear: Linear, problem: Gram, remainder: Array, whitening: Whitening, groups: Sequence[NDArray[np.int64]]
) -> float:
    """Return the design effect: how many rows are worth one independent row (Kish, *Survey Sampling*, 1965).

    Residuals of rows that belong together may be correlated. The design effect is the variance of the scores summed
    within groups, over what it would be if rows were independent. The largest over the groupings counts; it is 1 where
    chance alone could give as much.
    """
    if not groups or not problem.slices or not problem.slices[-1].stop:
        return 1.0
    used = np.flatnonzero(whitening.weights > 0)
    each = scores(linear, whitening, problem, remainder)
    alone = (each**2).sum(axis=0) + settings.TINY
    value = np.linalg.eigvalsh(problem.matrix / np.sqrt(np.outer(np.diag(problem.matrix), np.diag(problem.matrix))))
    independent = value.sum() ** 2 / (value**2).sum()
    worst = 1.0
    for labels in groups:
        kept = labels[used]
        together = np.stack([np.bincount(kept, column) for column in each.T], axis=1)
        ratio = float(np.mean((together**2).sum(axis=0) / alone))
        pairs = float((np.bincount(kept).astype(float) ** 2).sum()) / len(used) - 1.0
        chance = np.sqrt(2.0 * max(pairs, 0.0) / (len(used) * independent))
        worst = max(worst, ratio if ratio > 1.0 + settings.DESIGN_SIGMAS * chance else 1.0)
    return worst
