"""Rows set aside are evidence: gross errors are few, and they do not care for the pose or the load."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import bdtrc, chdtri, fdtrc, fdtri, gammaln

from thermal_robot.arrays import Array
from thermal_robot.diagnosis.remainder import Remainder
from thermal_robot.effects.quantities import quantities
from thermal_robot.inference import settings
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.robust import distance_limit
from thermal_robot.observations import Observations
from thermal_robot.percents import percent


def too_many(fit: Fit, left: Remainder) -> tuple[float, str]:
    """Return the p-value that so many rows are gross errors, and the reason.

    Instruments spoil :data:`~thermal_robot.inference.settings.SPOILT` of the rows at most. Where the tails of the other
    rows are heavier than normal, the share that Student's law sets aside is added.
    """
    aside = fit.explanation.outliers
    count, samples = int(aside.sum()), len(aside)
    share = settings.SPOILT + (_of_tails(left, samples) if _heavy(left) else 0.0)
    if count <= share * samples:
        return 1.0, ""
    p = float(bdtrc(count - 1, samples, share))
    told = f"{count} of {samples} rows were set aside ({percent(count / samples, 0)})"
    return p, f"{told}: more than gross errors account for"


def _heavy(left: Remainder) -> bool:
    """Tell whether the rows that are left have tails heavier than normal, by their kurtosis."""
    squares = left.white**2
    excess = float((squares**2).mean() / max(float(squares.mean()) ** 2, settings.TINY)) - 3.0
    # variance of the kurtosis of a normal sample: 24/n
    return excess > settings.HEAVY_SIGMAS * float(np.sqrt(24 / squares.size))


def _of_tails(left: Remainder, samples: int) -> float:
    """Share of the rows that are set aside where noise has a multivariate Student law of the same median distance."""
    measures = left.white.shape[1]
    normal, student = float(chdtri(measures, 0.5)) / measures, float(fdtri(measures, settings.TAILS, 0.5))
    limit = distance_limit(measures, samples) / measures
    return float(fdtrc(measures, settings.TAILS, limit * student / normal))


def alike(fit: Fit) -> tuple[float, str]:
    """Return the p-value that the rows set aside have nothing in common, and the reason.

    Asked is for each quantity whether they lie together: beyond a value, or between two. Given that the ends of such a
    range are rows set aside, how many of the others lie within has a hypergeometric law where rows are set aside
    whatever their quantity. Both the ranges and the quantities are counted (Bonferroni).
    """
    aside = fit.explanation.outliers
    count, samples = int(aside.sum()), len(aside)
    if count < settings.FEWEST_ASIDE or samples - count < count:
        return 1.0, ""
    asked = _asked(fit.corrected)
    found = {name: together(values, aside) for name, values in asked.items()}
    name = min(found, key=lambda n: found[n])
    p = min(1.0, found[name] * len(asked))
    return p, f"the {count} rows that were set aside are no gross errors: they lie together in {name}"


def together(values: Array, aside: NDArray[np.bool_]) -> float:
    """Return the p-value, all ranges counted, that the rows set aside lie together in a quantity (N,) by chance."""
    own = np.sort(values[aside])
    count, samples = len(own), len(values)
    ordered = np.sort(values)
    marks = own[np.unique(np.linspace(0, count - 1, min(count, settings.ASIDE_MARKS)).round().astype(int))]
    # a quantity that takes few values has many rows at each: an end includes all of them
    below, up_to = np.searchsorted(ordered, marks, "left"), np.searchsorted(ordered, marks, "right")
    before, until = np.searchsorted(own, marks, "left"), np.searchsorted(own, marks, "right")
    first, last = np.triu_indices(len(marks), 1)
    low = _tail(until - 1, count - 1, up_to - 1, samples - 1)
    high = _tail(count - before - 1, count - 1, samples - below - 1, samples - 1)
    inside = _tail(until[last] - before[first] - 2, count - 2, up_to[last] - below[first] - 2, samples - 2)
    ranges = 0.5 * count * (count - 1) + 2.0 * count
    return float(min(1.0, ranges * min(low.min(), high.min(), inside.min(initial=1.0))))


def _tail(held: NDArray[np.int64], drawn: int, good: NDArray[np.int64], total: int) -> Array:
    """Probability that of ``drawn`` of ``total`` rows at least ``held`` are among ``good`` ones (hypergeometric)."""
    k = np.arange(drawn + 1)[:, None]
    possible = (k <= good) & (drawn - k <= total - good)
    log = _choose(good, np.minimum(k, good)) + _choose(total - good, np.clip(drawn - k, 0, total - good))
    chance = np.where(possible & (k >= held), np.exp(log - _choose(np.array(total), np.array(drawn))), 0.0)
    return np.asarray(np.minimum(chance.sum(axis=0), 1.0))


def _choose(total: NDArray[np.int64], some: NDArray[np.int64]) -> Array:
    """Natural logarithm of the number of ways to take some of a total."""
    return np.asarray(gammaln(total + 1.0) - gammaln(some + 1.0) - gammaln(total - some + 1.0))


def _asked(observations: Observations) -> dict[str, Array]:
    """Return by name, in words, what rows may be set aside for: all quantities, torques, and approach times torque.

    The last tells where a joint is pressed against the side from which it came, and where against the other.
    """
    found = quantities(observations)
    if observations.torque is None:
        return found
    for joint, torque in zip(observations.robot.joint_names, observations.torque.T, strict=True):
        approach = observations.covariates.get(f"approach.{joint}")
        if np.ptp(torque) > settings.ROUNDING:
            found.setdefault(f"torque.{joint}", torque)
            if approach is not None:
                found[f"approach.{joint} × torque.{joint}"] = approach * torque
    return found
