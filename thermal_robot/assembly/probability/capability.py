"""Process capability ``C_p`` of a joint, and required clearance: from probability to ``C_p`` and back."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq
from scipy.special import log_ndtr, ndtri, ndtri_exp

from thermal_robot.arrays import Array
from thermal_robot.assembly.probability.joining import (
    Law,
    Randomised,
    Shape,
    Thermal,
    check_covariance,
    failing_probability,
)
from thermal_robot.assembly.probability.planar import disc_clearances
from thermal_robot.assembly.probability.spread import UniformSpread

Convention = Literal["two_sided", "one_sided"]

_SMALLEST = 700.0  # factors of e below the size of the errors at which a clearance is taken for zero


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

    It knows neither the mean nor the form of the law. With a thermal part its covariance is added (Eq 20).

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
        Unless exactly one requirement is given, within its range; for a covariance that is none.
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
        found = _clearances(law, target, shape, proportion)
    return found.reshape(leading) if leading else float(found[0])


def _clearances(law: Law, target: float, shape: Shape, proportion: Array) -> Array:
    """Return the required clearances ``(N,)``: in batch where cheap integrals suffice, by Brent's method elsewhere."""
    found = np.full(len(law.means), np.nan)
    pieces = () if law.spread is None else law.spread.pieces
    if shape == "circle" and len(pieces) < 2 and all(piece.generators.shape[1] < 2 for piece in pieces):
        means, segments = law.means, law.segments
        for piece in pieces:
            means = means + piece.centre
            segments = np.broadcast_to(piece.generators[:, 0], means.shape) if piece.generators.shape[1] else segments
        found = disc_clearances(law.matrices, means, target, segments)
    for k in np.flatnonzero(np.isnan(found)):
        found[k] = _one_clearance(law.rows(np.array([k])), target, shape, proportion)
    return found


def _one_clearance(law: Law, target: float, shape: Shape, proportion: Array) -> float:
    """Return the required clearance of a single law, by Brent's method."""

    def excess(log_size: float) -> float:
        size = np.exp(log_size) * (1.0 if shape == "circle" else proportion)
        fails = float(
            failing_probability(
                law.matrices[0], size, law.means, shape=shape, thermal=law.spread, segments=law.segments
            )[0]
        )
        # Bounded below so that a bounded law, which stops failing altogether, still has a change of sign.
        return max(float(np.log(fails)) if fails > 0.0 else -np.inf, -1e4) - target

    return _solve(excess, np.log(_typical_size(law)))


def _typical_size(law: Law) -> float:
    """Start value of the search: the size of the errors."""
    square = float(np.trace(law.matrices[0])) + float(np.sum(np.square(law.means)))
    if law.spread is not None:
        square += float(np.trace(law.spread.covariance) + np.sum(law.spread.mean**2))
    if law.segments is not None:
        square += float(np.sum(np.square(law.segments)))
    if square == 0.0:
        raise ValueError("without any error every clearance will do")
    return 4.0 * float(np.sqrt(square))


def _solve(excess: Callable[[float], float], start: float) -> float:
    """Root of a decreasing function of the log size: bracket by doubling, then Brent's method."""
    low = high = start
    step = np.log(2.0)
    while excess(high) > 0.0:
        low, high, step = high, high + step, 1.5 * step
    step = np.log(2.0)
    while excess(low) < 0.0:
        high, low, step = low, low - step, 1.5 * step
        if low < start - _SMALLEST:
            return 0.0
    # The failing probability carries rounding of its own; asking for less than 1e-14 of the size finds nothing more.
    return float(np.exp(brentq(excess, low, high, xtol=1e-15, rtol=1e-15 * 8)))


def _share(value: npt.ArrayLike | None) -> Array:
    share = np.asarray(value, dtype=float)
    if not np.all((share >= 0.0) & (share <= 1.0)):
        raise ValueError("a probability lies between 0 and 1")
    return share
