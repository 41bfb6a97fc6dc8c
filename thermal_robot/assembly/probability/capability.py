"""Process capability ``C_p`` of a joint, and required clearance: from probability to ``C_p`` and back."""

from __future__ import annotations

from typing import Literal

import numpy as np
import numpy.typing as npt
from scipy.special import log_ndtr, ndtri, ndtri_exp

from thermal_robot.arrays import Array
from thermal_robot.assembly.probability.joining import (
    Law,
    Randomised,
    Shape,
    Thermal,
    check_covariance,
)
from thermal_robot.assembly.probability.spread import UniformSpread

Convention = Literal["two_sided", "one_sided"]

_CLOSE, _NOISE = 1e-11, 1e-13  # relative of a clearance, and of a quantile, below which nothing is left to find
_STEPS, _SECANTS = 120, 12  # before a bounded law, whose failing probability may end abruptly, is halved
_SURE = 40.0  # standard deviations beyond which nothing fails in double precision


def capability(
    probability: npt.ArrayLike | None = None,
    *,
    failing: npt.ArrayLike | None = None,
    convention: Convention = "two_sided",
) -> Array:
    """Process capability ``C_p`` equivalent to a probability of joining.

    Parameters
    ----------
    probability
        Probability ``P`` of joining. Give this or ``failing``.
    failing
        Probability ``1 - P``; prefer it near ``P = 1``, where ``P`` has no digits left.
    convention
        ``"two_sided"`` (default, the one that reproduces the paper): ``P = 2 Phi(3 C_p) - 1``, as if the error were
        one normal coordinate between limits at ``±3 C_p`` standard deviations. ``"one_sided"``: ``P = Phi(3 C_p)``,
        one limit. (The classical ratio of clearance to six standard deviations needs no probability:
        `capability_ratio`.)

    Returns
    -------
    Array
        ``C_p``, of the shape given; ``inf`` when nothing fails.

    Raises
    ------
    ValueError
        Unless exactly one of the two is given, within [0, 1].
    """
    if (probability is None) == (failing is None):
        raise ValueError("give either the probability or the failing probability")
    with np.errstate(divide="ignore"):
        if failing is not None:
            log_failing = np.log(_share(failing))
        else:
            log_failing = np.log1p(-_share(probability))
    if convention == "two_sided":
        return np.asarray(-ndtri_exp(log_failing - np.log(2.0)) / 3.0 + 0.0)
    if convention == "one_sided":
        with np.errstate(divide="ignore", invalid="ignore"):
            # ndtri_exp has no digits left for logarithms near zero: there P itself has them.
            joined = -np.expm1(log_failing) if probability is None else _share(probability)
            return np.asarray(
                np.where(log_failing < -0.7, -ndtri_exp(np.minimum(log_failing, 0.0)), ndtri(joined)) / 3.0
            )
    raise ValueError(f"convention must be 'two_sided' or 'one_sided', not {convention!r}")


def capability_ratio(
    covariance: npt.ArrayLike, clearance: npt.ArrayLike, *, thermal: UniformSpread | None = None
) -> Array:
    """Classical capability ``C_p = L / (6 sigma)``, with ``sigma`` the largest standard deviation over directions.

    Mean and shape of the distribution do not enter. With a thermal part its covariance is added (Eq 20).

    Parameters
    ----------
    covariance
        Shape ``(..., 2, 2)``.
    clearance
        Diameter ``L``, shape ``(...)``.
    thermal
        Uniform part.
    """
    matrices = check_covariance(covariance)
    if thermal is not None:
        matrices = matrices + thermal.covariance
    with np.errstate(divide="ignore"):
        return np.asarray(np.asarray(clearance, dtype=float) / (6.0 * np.sqrt(np.linalg.eigvalsh(matrices)[..., -1])))


def failing_from_capability(value: npt.ArrayLike, *, convention: Convention = "two_sided") -> Array:
    """Failing probability ``1 - P`` of a capability ``C_p``; the inverse of `capability`."""
    return np.exp(_log_failing(value, convention))


def _log_failing(value: npt.ArrayLike, convention: Convention) -> Array:
    index = np.asarray(value, dtype=float)
    if convention == "two_sided":
        if np.any(index < 0.0):
            raise ValueError("a two-sided capability is not negative")
        return np.asarray(log_ndtr(-3.0 * index) + np.log(2.0))
    if convention == "one_sided":
        return np.asarray(log_ndtr(-3.0 * index))
    raise ValueError(f"convention must be 'two_sided' or 'one_sided', not {convention!r}")


def required_clearance(
    covariance: npt.ArrayLike,
    *,
    capability: float | None = None,
    probability: float | None = None,
    failing: float | None = None,
    mean: npt.ArrayLike = 0.0,
    shape: Shape = "circle",
    sides: npt.ArrayLike = (1.0, 1.0),
    thermal: Thermal = None,
    randomised: Randomised = "uniform",
    segments: npt.ArrayLike | None = None,
    convention: Convention = "two_sided",
) -> float | Array:
    """Clearance at which a joint reaches a capability or a probability: Eq 22 solved for ``L``.

    Parameters
    ----------
    covariance
        Shape ``(..., 2, 2)``.
    capability, probability, failing
        What is required; exactly one. ``capability`` in the given ``convention``.
    mean, shape, thermal, randomised, segments
        As in `joining_probability`.
    sides
        For a rectangle the proportion of its sides; the result multiplies it.
    convention
        As in `capability`.

    Returns
    -------
    float or Array
        Diameter of the disc, or the factor on ``sides``; relative error below 1e-10. Zero if nothing is required, and
        ``inf`` for a probability of one unless the law is bounded. One for each of the broadcast leading axes of the
        covariance, the mean and a thermal shift; ``float`` where there are none.

    Raises
    ------
    ValueError
        Unless exactly one requirement is given, within its range; for a matrix that is no covariance.
    """
    if (capability is not None) + (probability is not None) + (failing is not None) != 1:
        raise ValueError("give exactly one of capability, probability and failing")
    with np.errstate(divide="ignore"):
        if capability is not None:
            target = float(_log_failing(capability, convention))
        elif probability is not None:
            target = float(np.log1p(-_share(probability)))
        else:
            target = float(np.log(_share(failing)))
    proportion = np.asarray(sides, dtype=float)
    if proportion.shape != (2,) or not np.all(np.isfinite(proportion) & (proportion > 0.0)):
        raise ValueError("sides must be two positive numbers")
    law = Law.of(covariance, mean, thermal, randomised, segments)
    leading = law.leading
    law = law.flat(leading)
    found = np.full(len(law.means), 0.0 if target == 0.0 else np.inf)
    if target < 0.0 and np.isfinite(target):
        found = _clearances(law, target, shape, np.ones(1) if shape == "circle" else proportion)
    return found.reshape(leading) if leading else float(found[0])


def _clearances(law: Law, log_failing: float, shape: Shape, proportion: Array) -> Array:
    """Clearances ``(N,)``, as factors on ``proportion``, with a given failing probability: bracketed secant method.

    The failing probability as a standard normal quantile is nearly a straight line in the size wherever little fails,
    so that few steps are enough. The first comes from Wilson and Hilferty's approximation of the squared error.
    """
    wanted = -float(ndtri_exp(log_failing))
    mean, variance = law.square()
    if not np.all(mean > 0.0):
        raise ValueError("without any error every clearance will do")
    ratio = np.maximum(variance / (9.0 * mean * mean), 1e-3)
    share = np.maximum(1.0 - ratio + wanted * np.sqrt(ratio), 0.05)
    size = 2.0 * np.sqrt(mean) * share**1.5 / np.mean(proportion)
    slope = share / (1.5 * np.sqrt(ratio) * size)
    low, high = np.zeros_like(size), np.full_like(size, np.inf)
    last, value, left = size.copy(), np.empty_like(size), np.arange(len(size))
    for number in range(_STEPS):
        here = size[left]
        with np.errstate(divide="ignore", invalid="ignore"):
            fails = np.log(law.rows(left).probability(here[:, None] * proportion, shape, True))
            now = np.clip(-ndtri_exp(np.minimum(fails, 0.0)), -_SURE, _SURE) - wanted
            slope[left] = (now - value[left]) / (here - last[left]) if number else slope[left]
            following = here - now / slope[left]
        low[left], high[left] = np.where(now < 0.0, here, low[left]), np.where(now < 0.0, high[left], here)
        last[left], value[left] = here, now
        lost = ~((following > low[left]) & (following < high[left])) | (number > _SECANTS)
        halved = np.where(np.isinf(high[left]), 2.0 * here, 0.5 * (low[left] + high[left]))
        size[left] = np.where(np.abs(now) < _NOISE, here, np.where(lost, halved, following))
        left = left[np.abs(size[left] - here) > _CLOSE * here]
        if not len(left):
            break
    return size


def _share(value: npt.ArrayLike | None) -> Array:
    share = np.asarray(value, dtype=float)
    if not np.all((share >= 0.0) & (share <= 1.0)):
        raise ValueError("a probability lies between 0 and 1")
    return share
