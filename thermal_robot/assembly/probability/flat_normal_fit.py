"""Estimate a flat-normal distribution from a sample."""

from __future__ import annotations

import numpy as np
from scipy.optimize import minimize

from thermal_robot.arrays import Array
from thermal_robot.assembly.probability.kernels import log_density
from thermal_robot.errors import EstimationError

Estimate = tuple[float, float, float]
Held = tuple[float | None, float | None, float | None]

_ROOT_3 = np.sqrt(3.0)
_STARTS = (0.5, 1.0, 1.5, 3.0, 10.0)  # of r, beside the moments' one: the likelihood may have more than one peak
_BOUNDS = ((-2.0, 2.0), (-2.0, 2.0), (0.0, np.pi / 2.0 - 1e-4))
# Of mean and logarithm of the size, in the sample's own standard deviations, and of arctan r.


def _checked(sample: Array) -> Array:
    if not np.all(np.isfinite(sample)):
        raise EstimationError("the sample holds values that are not finite")
    if sample.size < 4:
        raise EstimationError(f"three parameters need at least four values, not {sample.size}")
    if np.ptp(sample) == 0.0:
        raise EstimationError("all values of the sample are equal: it determines no width")
    return sample


def fit_moments(sample: Array) -> Estimate:
    """``(r, mean, total standard deviation)`` by the first, second and fourth moment.

    The excess kurtosis is ``-6/5 (r**2 / (1 + r**2))**2``; a sample flatter than a uniform one gives ``inf``.
    """
    values = _checked(sample)
    mean, scale = float(np.mean(values)), float(np.std(values))
    excess = float(np.mean(((values - mean) / scale) ** 4)) - 3.0
    share = float(np.sqrt(np.clip(-excess / 1.2, 0.0, 1.0)))
    with np.errstate(divide="ignore"):
        return float(np.sqrt(np.float64(share) / (1.0 - np.float64(share)))), mean, scale


def log_likelihood(sample: Array, ratio: float, loc: float, scale: float) -> float:
    """Logarithm of the likelihood."""
    angle = np.arctan(ratio)
    half_width = scale * _ROOT_3 * np.sin(angle)
    sigma = 0.0 if np.isinf(ratio) else scale * np.cos(angle)
    return float(np.sum(log_density(sample - loc, sigma, half_width)))


def fit_maximum_likelihood(
    sample: Array, *, ratio: float | None = None, loc: float | None = None, scale: float | None = None
) -> Estimate:
    """``(r, mean, total standard deviation)`` of the largest likelihood; given ones are held.

    The search runs over mean, logarithm of the total standard deviation and ``arctan r``, in which both limits are at
    a finite distance. The limits themselves are compared by their own closed-form estimates, since a maximum often
    lies at ``r = 0``.

    Raises
    ------
    EstimationError
        For too few values, values that are not finite, or all alike.
    """
    values = _checked(sample)
    centre, width = float(np.mean(values)), float(np.std(values))
    scaled = (values - centre) / width
    held = (
        None if loc is None else (loc - centre) / width,
        None if scale is None else float(np.log(scale / width)),
        None if ratio is None else float(np.arctan(ratio)),
    )
    candidates = _between_limits(scaled, held)
    for limit in (0.0, np.inf):
        if ratio is None or ratio == limit:
            place, size = _limit(scaled, limit, held[0], held[1])
            candidates.append((-log_likelihood(scaled, limit, place, size) / scaled.size, (limit, place, size)))
    if not candidates:
        candidates.append((0.0, _estimate(_completed(held, np.array([])))))
    # A limit wins a tie: the simpler law.
    best = min(candidates, key=lambda item: (round(item[0], 11), item[1][0] not in (0.0, np.inf)))[1]
    return best[0], centre + width * best[1], width * best[2]


def _between_limits(scaled: Array, held: Held) -> list[tuple[float, Estimate]]:
    """Smallest losses, and where they are, from several starts; none where all three parameters are held."""
    free = [k for k in range(3) if held[k] is None]
    if not free:
        return []

    def loss(point: Array) -> float:
        ratio, place, size = _estimate(_completed(held, point))
        value = -log_likelihood(scaled, ratio, place, size) / scaled.size
        return value if np.isfinite(value) else 1e6

    bounds = [_BOUNDS[k] for k in free]
    found = []
    for start in {min(fit_moments(scaled)[0], 20.0), *_STARTS} if 2 in free else {1.0}:
        first = np.array([(0.0, 0.0, np.arctan(start))[k] for k in free])
        rough = minimize(loss, first, method="L-BFGS-B", bounds=bounds, options={"ftol": 1e-13})
        options = {"xatol": 1e-9, "fatol": 1e-13, "maxiter": 400}
        polished = minimize(loss, rough.x, method="Nelder-Mead", bounds=bounds, options=options)
        found.append((float(polished.fun), _estimate(_completed(held, polished.x))))
    return found


def _completed(held: Held, point: Array) -> tuple[float, float, float]:
    """Mean, logarithm of the size and angle: what is held, and the point's coordinates for the rest."""
    rest = iter(point)
    place, size, angle = (float(next(rest)) if value is None else value for value in held)
    return place, size, angle


def _estimate(point: tuple[float, float, float]) -> Estimate:
    place, size, angle = point
    return float(np.tan(angle)), place, float(np.exp(size))


def _limit(scaled: Array, limit: float, loc: float | None, log_scale: float | None) -> tuple[float, float]:
    """Mean and total standard deviation of the likeliest normal (``limit = 0``) or uniform (``inf``) distribution."""
    if limit == 0.0:
        place = float(np.mean(scaled)) if loc is None else loc
        size = float(np.sqrt(np.mean((scaled - place) ** 2)))
    else:
        place = 0.5 * float(np.max(scaled) + np.min(scaled)) if loc is None else loc
        size = float(np.max(np.abs(scaled - place))) * (1.0 + 1e-15) / float(_ROOT_3)
    return place, size if log_scale is None else float(np.exp(log_scale))
