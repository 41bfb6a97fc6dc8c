"""The paper's flat-normal distribution (Eqs 16-20) as a `scipy.stats` distribution.

A positioning error is a normal kinematic part, standard deviation ``sigma``, plus an independent thermal part that is
uniform on ``±half_width``. The paper's parameter is ``r = sigma_t / sigma_k`` (Eq 17) with ``sigma_t = half_width /
sqrt(3)`` (Eq 19).

**Eq 18 as printed is not a density.** With ``sigma_k = 1`` the convolution (Eq 16) is the mean of the normal density
over the interval ``eta ± sqrt(3) r`` of length ``2 sqrt(3) r``:

    PDF(eta) = 1 / (2 sqrt(3) r) * 1 / sqrt(2 pi) * integral of exp(-zeta**2 / 2)  =  1 / (2 sqrt(6 pi) r) * integral

The text has ``2 sqrt(6) pi r`` in the denominator; the area is then ``sqrt(6 pi) / (sqrt(6) pi) = 1 / sqrt(pi) =
0.5642``. The root covers ``pi`` too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import stats
from scipy.optimize import minimize
from scipy.special import comb, logsumexp, ndtri

from thermal_robot.arrays import Array
from thermal_robot.assembly.probability.joining import joining_probability, link_nodes
from thermal_robot.assembly.probability.kernels import density, log_density, log_tail, tail
from thermal_robot.assembly.probability.spread import Parallelotope, UniformSpread
from thermal_robot.errors import EstimationError

_ROOT_3 = np.sqrt(3.0)


def _parts(r: npt.ArrayLike) -> tuple[Array, Array]:
    """Return the normal standard deviation and the uniform half width for the ratio ``r`` at total variance one."""
    ratio = np.asarray(r, dtype=float)
    with np.errstate(divide="ignore"):
        sigma = 1.0 / np.hypot(1.0, ratio)
        share = 1.0 / np.hypot(1.0, 1.0 / ratio)
    return sigma, _ROOT_3 * share


class FlatNormalGenerator(stats.rv_continuous):  # type: ignore[misc]  # scipy has no annotations
    r"""Flat-normal distribution: the sum of a normal and an independent uniform variable.

    The shape parameter is the paper's ``r`` (Eq 17), from 0 (normal) to ``inf`` (uniform), both exact. ``loc`` is the
    mean and ``scale`` the *total* standard deviation, the root of Eq 20; so that both limits are proper
    distributions, and

        sigma = scale / sqrt(1 + r**2)        half_width = sqrt(3) r scale / sqrt(1 + r**2)

    All methods of `scipy.stats.rv_continuous` are there; tails are relatively accurate to about 1e-14 ``(1 + z**2 /
    100)``. For given ``sigma`` and ``half_width`` use `FlatNormal`.
    """

    def _argcheck(self, r: Array) -> Array:
        return np.asarray(r >= 0.0)

    def _shape_info(self) -> list[Any]:
        return []

    def _get_support(self, r: Array, *_: Any) -> tuple[Array, Array]:
        edge = np.where(np.isinf(r), _ROOT_3, np.inf)
        return -edge, edge

    def _pdf(self, x: Array, r: Array) -> Array:
        return density(x, *_parts(r))

    def _logpdf(self, x: Array, r: Array) -> Array:
        return log_density(x, *_parts(r))

    def _sf(self, x: Array, r: Array) -> Array:
        return tail(x, *_parts(r))

    def _logsf(self, x: Array, r: Array) -> Array:
        return log_tail(x, *_parts(r))

    def _cdf(self, x: Array, r: Array) -> Array:
        return tail(-np.asarray(x), *_parts(r))

    def _logcdf(self, x: Array, r: Array) -> Array:
        return log_tail(-np.asarray(x), *_parts(r))

    def _isf(self, q: Array, r: Array) -> Array:
        return _upper_quantile(np.asarray(q, dtype=float), *_parts(r))

    def _ppf(self, q: Array, r: Array) -> Array:
        return np.asarray(-_upper_quantile(np.asarray(q, dtype=float), *_parts(r)))

    def _stats(self, r: Array) -> tuple[Any, Any, Any, Any]:
        sigma, half_width = _parts(r)
        # Fourth cumulants add, and only the uniform part has one: -6/5 of its squared variance.
        return 0.0 * sigma, 1.0 + 0.0 * sigma, 0.0 * sigma, -1.2 * (half_width**2 / 3.0) ** 2

    def _munp(self, order: int, r: Array) -> Array:
        sigma, half_width = _parts(r)
        total = np.zeros(np.shape(r))
        if order % 2 == 0:
            for k in range(0, order + 1, 2):
                normal = float(np.prod(np.arange(k - 1, 0, -2, dtype=float)))
                total = total + comb(order, k) * normal * sigma**k * half_width ** (order - k) / (order - k + 1)
        return total

    def _entropy(self, r: Array) -> Array:
        return np.asarray(np.vectorize(_entropy, otypes=[float])(*_parts(r)))

    def _rvs(self, r: Array, size: Any = None, random_state: Any = None) -> Array:
        sigma, half_width = _parts(r)
        return np.asarray(
            sigma * random_state.standard_normal(size) + half_width * random_state.uniform(-1.0, 1.0, size)
        )

    def fit(self, data: npt.ArrayLike, *_: Any, method: str = "MLE", **fixed: Any) -> tuple[float, float, float]:
        """Estimate ``(r, loc, scale)`` by maximum likelihood or by moments.

        Parameters
        ----------
        data
            Sample; at least four values, not all alike.
        method
            ``"MLE"``: maximum likelihood, started from the moments and from a grid of ``r``, both limits compared
            exactly. ``"MM"``: ``r`` from the excess kurtosis, zero where the sample is no flatter than a normal one.
        fixed
            ``floc``, ``fscale``, and ``f0`` or ``fr`` hold a parameter (MLE only).

        Raises
        ------
        EstimationError
            For data that do not determine a distribution.
        """
        sample = np.asarray(data, dtype=float).ravel()
        loc, scale = fixed.pop("floc", None), fixed.pop("fscale", None)
        ratio = fixed.pop("f0", fixed.pop("fr", None))
        fixed.pop("loc", None), fixed.pop("scale", None), fixed.pop("optimizer", None)  # starting values are ours
        if fixed:
            raise TypeError(f"unknown arguments: {sorted(fixed)}")
        if method.upper() == "MM":
            return fit_moments(sample)
        if method.upper() != "MLE":
            raise ValueError(f"method must be 'MLE' or 'MM', not {method!r}")
        return fit_maximum_likelihood(sample, ratio=ratio, loc=loc, scale=scale)


flat_normal = FlatNormalGenerator(name="flat_normal", shapes="r")


# scipy keeps the class of frozen continuous distributions private; this is it.
_Frozen: Any = type(stats.norm())


class FlatNormal(_Frozen):  # type: ignore[misc]  # scipy has no annotations
    """Frozen flat-normal distribution of given normal part, uniform part and mean, in the unit of the errors.

    Parameters
    ----------
    sigma
        Standard deviation of the normal (kinematic) part, ``sigma_k``; scalars or arrays that broadcast.
    half_width
        Half width of the uniform (thermal) part: half of the range in Eq 19.
    mean
        Mean.

    Raises
    ------
    ValueError
        If a width is negative or not finite, or both are zero.
    """

    def __init__(self, sigma: npt.ArrayLike, half_width: npt.ArrayLike, mean: npt.ArrayLike = 0.0) -> None:
        normal, uniform = np.asarray(sigma, dtype=float), np.asarray(half_width, dtype=float)
        if not (np.all(np.isfinite(normal) & (normal >= 0.0)) and np.all(np.isfinite(uniform) & (uniform >= 0.0))):
            raise ValueError("sigma and half_width must be finite and not negative")
        total = np.hypot(normal, uniform / _ROOT_3)
        if not np.all(total > 0.0):
            raise ValueError("sigma and half_width must not both be zero")
        with np.errstate(divide="ignore"):
            ratio = uniform / _ROOT_3 / normal
        super().__init__(FlatNormalGenerator(name="flat_normal", shapes="r"), ratio, loc=mean, scale=total)
        self.sigma, self.half_width, self.r = normal, uniform, ratio

    @classmethod
    def fitted(cls, data: npt.ArrayLike, **options: Any) -> FlatNormal:
        """Fit to a sample by maximum likelihood, or by moments; options as in `FlatNormalGenerator.fit`."""
        ratio, loc, scale = flat_normal.fit(data, **options)
        sigma, half_width = _parts(ratio)
        return cls(scale * sigma, scale * half_width, loc)


def _upper_quantile(q: Array, sigma: Array, half_width: Array) -> Array:
    """Inverse survival function of a centred normal plus a uniform variable on ±``half_width``: P(X > x) = q.

    Newton's iteration on ``log P(X > x)``, which is concave: started beyond the root it approaches it from there
    without overshooting, down to ``q = 1e-300`` and for any proportion of the two parts.
    """
    q, sigma, half_width = (np.array(v, dtype=float) for v in np.broadcast_arrays(q, sigma, half_width))
    share = np.minimum(q, 1.0 - q)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        target = np.log(share)
        # X <= half_width + sigma Z bounds the quantile from beyond; its uniform part alone is exact for sigma = 0.
        x = np.where(sigma > 0.0, half_width - sigma * ndtri(share), half_width * (1.0 - 2.0 * share))
        active = (sigma > 0.0) & (share > 0.0) & (share < 0.5)
        x = np.where(share == 0.5, 0.0, x)
        for _ in range(200):
            if not np.any(active):
                break
            at, width, edge = x[active], sigma[active], half_width[active]
            value = log_tail(at, width, edge)
            step = (value - target[active]) * np.exp(value - log_density(at, width, edge))
            moved = np.maximum(at + step, 0.0)
            x[active] = moved
            still = np.abs(moved - at) > 4e-16 * (np.abs(moved) + width)
            active[active] = still
    x = np.where(share == 0.0, np.where(sigma > 0.0, np.inf, half_width), x)
    return np.where(q <= 0.5, x, -x)


def _entropy(sigma: float, half_width: float) -> float:
    """Differential entropy of a normal plus a uniform variable: closed form in both limits, else Gauss-Legendre sum."""
    if sigma == 0.0:
        return float(np.log(2.0 * half_width))
    if half_width == 0.0:
        return float(0.5 * np.log(2.0 * np.pi * np.e) + np.log(sigma))
    nodes, weights = np.polynomial.legendre.leggauss(32)
    # Panels no wider than two sigma about the slope, and one over the plateau where there is one.
    start = max(0.0, half_width - 12.0 * sigma)
    edges = np.concatenate([[0.0], np.linspace(start, half_width + 40.0 * sigma, 27)])
    half = 0.5 * np.diff(edges)[:, None]
    points = edges[:-1, None] + half * (1.0 + nodes)
    log_values = log_density(points, sigma, half_width)
    return float(-2.0 * np.sum(half * weights * np.exp(log_values) * log_values))


Estimate = tuple[float, float, float]
Held = tuple[float | None, float | None, float | None]

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
    """Moment estimates ``(r, mean, total standard deviation)`` from first, second and fourth moments.

    The excess kurtosis is ``-6/5 (r**2 / (1 + r**2))**2``; a sample flatter than a uniform one gives ``inf``.
    """
    values = _checked(sample)
    mean, scale = float(np.mean(values)), float(np.std(values))
    excess = float(np.mean(((values - mean) / scale) ** 4)) - 3.0
    share = float(np.sqrt(np.clip(-excess / 1.2, 0.0, 1.0)))
    with np.errstate(divide="ignore"):
        return float(np.sqrt(np.float64(share) / (1.0 - np.float64(share)))), mean, scale


def log_likelihood(sample: Array, ratio: float, loc: float, scale: float) -> float:
    """Log-likelihood of a sample under the flat-normal distribution."""
    return float(np.sum(log_density(sample - loc, *(scale * part for part in _parts(ratio)))))


def fit_maximum_likelihood(
    sample: Array, *, ratio: float | None = None, loc: float | None = None, scale: float | None = None
) -> Estimate:
    """Maximum likelihood estimates ``(r, mean, total standard deviation)``; given ones are held.

    The search runs over mean, logarithm of the total standard deviation and ``arctan r``, in which both limits are at a
    finite distance. The limits themselves are compared by their own closed-form estimates, since a maximum often lies
    at ``r = 0``.
    """
    values = _checked(sample)
    centre, width = float(np.mean(values)), float(np.std(values))
    scaled = (values - centre) / width
    held = (
        None if loc is None else (loc - centre) / width,
        None if scale is None else float(np.log(scale / width)),
        None if ratio is None else float(np.arctan(ratio)),
    )
    candidates: list[tuple[float, Estimate]] = []
    for limit in (0.0, np.inf):
        if ratio is None or ratio == limit:
            place, size = _limit(scaled, limit, held[0], held[1])
            candidates.append((-log_likelihood(scaled, limit, place, size) / scaled.size, (limit, place, size)))
    candidates += _between_limits(scaled, held)
    if not candidates:
        candidates.append((0.0, _estimate(_completed(held, np.array([])))))
    # A limit wins a tie, the simpler law: by its closed form, for which it stands first, where the search ends on it.
    best = min(candidates, key=lambda item: (round(item[0], 11), item[1][0] not in (0.0, np.inf)))[1]
    return best[0], centre + width * best[1], width * best[2]


def _between_limits(scaled: Array, held: Held) -> list[tuple[float, Estimate]]:
    """Maximise the likelihood numerically from several starts; empty where all three parameters are held.

    Returns, for each start, the negative log-likelihood per value and the estimate ``(r, mean, size)``.
    """
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
    """Fill the ``None`` of ``held`` from ``point``, in order: mean, log of the total deviation, ``arctan r``."""
    rest = iter(point)
    place, size, angle = (float(next(rest)) if value is None else value for value in held)
    return place, size, angle


def _estimate(point: tuple[float, float, float]) -> Estimate:
    place, size, angle = point
    return float(np.tan(angle)), place, float(np.exp(size))


def _limit(scaled: Array, limit: float, loc: float | None, log_scale: float | None) -> tuple[float, float]:
    """Maximum likelihood of a normal (``limit = 0``) or uniform (``inf``) law: mean and standard deviation."""
    if limit == 0.0:
        place = float(np.mean(scaled)) if loc is None else loc
        size = float(np.sqrt(np.mean((scaled - place) ** 2)))
    else:
        place = 0.5 * float(np.max(scaled) + np.min(scaled)) if loc is None else loc
        size = float(np.max(np.abs(scaled - place))) * (1.0 + 1e-15) / float(_ROOT_3)
    return place, size if log_scale is None else float(np.exp(log_scale))


_LOG_2PI = np.log(2.0 * np.pi)
_CHUNK = 2_000_000  # numbers held at once


@dataclass(frozen=True)
class FlatNormalND:
    """Multivariate flat-normal distribution: ``mean + normal + uniform``, both parts independent.

    Parameters
    ----------
    normal_covariance
        Covariance of the normal part, shape ``(d, d)``, positive definite.
    spread
        Uniform part; it may have a mean of its own.
    offset
        Mean of the normal part, shape ``(d,)``.

    Raises
    ------
    ValueError
        For shapes that do not fit, or a covariance that is not positive definite: there is no density then
        (probabilities of joining do not need one, see `joining_probability`).
    """

    normal_covariance: Array
    spread: UniformSpread
    offset: Array

    def __post_init__(self) -> None:
        """Check shapes and definiteness."""
        size = self.spread.dimension
        if self.normal_covariance.shape != (size, size) or self.offset.shape != (size,):
            raise ValueError(f"covariance and mean must have shapes ({size}, {size}) and ({size},)")
        if not np.allclose(self.normal_covariance, self.normal_covariance.T, rtol=1e-9, atol=0.0):
            raise ValueError("covariance must be symmetric")
        if not np.all(np.linalg.eigvalsh(self.normal_covariance) > 0.0):
            raise ValueError("covariance must be positive definite for a density")

    @property
    def mean(self) -> Array:
        """Mean, shape ``(d,)``; exact."""
        return np.asarray(self.offset + self.spread.mean)

    @property
    def covariance(self) -> Array:
        """Covariance of both parts together, shape ``(d, d)``; exact (Eq 20)."""
        return np.asarray(self.normal_covariance + self.spread.covariance)

    def logpdf(self, x: npt.ArrayLike) -> Array:
        """Logarithm of the density.

        In units of the normal part, generators at right angles to each other (a segment; a box along the principal
        axes) give a product of one-dimensional flat-normal densities, correct far into the tails. Otherwise that
        holds for the longest one, and the others are Gauss-Legendre sums, relatively correct within nine standard
        deviations.

        Parameters
        ----------
        x
            Shape ``(..., d)``.
        """
        points = np.asarray(x, dtype=float)
        if points.shape[-1:] != self.offset.shape:
            raise ValueError(f"points must have shape (..., {self.offset.size}), not {points.shape}")
        flat = points.reshape(-1, self.offset.size) - self.offset
        terms = [np.log(piece.weight) + self._log_piece(flat - piece.centre, piece) for piece in self.spread.pieces]
        return np.asarray(logsumexp(terms, axis=0).reshape(points.shape[:-1]))

    def pdf(self, x: npt.ArrayLike) -> Array:
        """Density at points of shape ``(..., d)``; see `logpdf`."""
        return np.exp(self.logpdf(x))

    def rvs(self, size: int, random_state: int | np.random.Generator | None = None) -> Array:
        """Draw ``size`` points, shape ``(size, d)``."""
        generator = np.random.default_rng(random_state)
        normal = generator.standard_normal((size, self.offset.size)) @ np.linalg.cholesky(self.normal_covariance).T
        return self.offset + normal + self.spread.rvs(size, generator)

    def box_probability(self, lower: npt.ArrayLike, upper: npt.ArrayLike) -> Array:
        """Probability of ``lower <= X <= upper`` in the plane; infinite bounds make it the distribution function.

        Parameters
        ----------
        lower, upper
            Shape ``(..., 2)``.

        Raises
        ------
        ValueError
            In space, or for bounds in the wrong order.
        """
        if self.offset.size != 2:
            raise ValueError("box probabilities are for the plane")
        low, high = np.broadcast_arrays(np.asarray(lower, dtype=float), np.asarray(upper, dtype=float))
        if not np.all(low <= high):
            raise ValueError("a lower bound lies above its upper bound")
        reach = 50.0 * np.sqrt(np.diag(self.covariance))
        low = np.where(np.isneginf(low), np.minimum(self.mean - reach, high - reach), low)
        high = np.where(np.isposinf(high), np.maximum(self.mean + reach, low + reach), high)
        middle = 0.5 * (low + high)
        return joining_probability(
            self.normal_covariance, high - low, self.offset - middle, shape="rectangle", thermal=self.spread
        )

    def _log_piece(self, points: Array, piece: Parallelotope) -> Array:
        factor = np.linalg.cholesky(self.normal_covariance)
        white = np.linalg.solve(factor, points.T).T
        edges = np.linalg.solve(factor, piece.generators)
        lengths = np.linalg.norm(edges, axis=0)
        edges, lengths = edges[:, np.argsort(-lengths)], np.sort(lengths)[::-1]
        cosines = (edges / lengths).T @ (edges / lengths) - np.eye(lengths.size)
        log_scale = -float(np.sum(np.log(np.diag(factor))))
        if np.all(np.abs(cosines) < 1e-13):
            return log_scale + _log_product(white, edges, lengths)
        shifts, weights = link_nodes(np.eye(self.offset.size), edges[:, 1:])
        result = np.empty(len(white))
        step = max(1, _CHUNK // shifts.size)
        for start in range(0, len(white), step):
            part = white[start : start + step, None, :] - shifts
            values = _log_product(part.reshape(-1, self.offset.size), edges[:, :1], lengths[:1])
            result[start : start + step] = logsumexp(values.reshape(len(part), -1), b=weights, axis=1)
        return log_scale + result


def flat_normal_nd(covariance: npt.ArrayLike, spread: UniformSpread, mean: npt.ArrayLike | None = None) -> FlatNormalND:
    """Build a flat-normal distribution in the plane or in space.

    Parameters
    ----------
    covariance
        Covariance of the normal part, shape ``(d, d)``, positive definite.
    spread
        Uniform part, of dimension ``d``.
    mean
        Mean of the normal part, shape ``(d,)``; zero by default.
    """
    offset = np.zeros(spread.dimension) if mean is None else np.asarray(mean, dtype=float)
    return FlatNormalND(np.asarray(covariance, dtype=float), spread, offset)


def _log_product(white: Array, edges: Array, lengths: Array) -> Array:
    """Log density at whitened points (N, d): flat-normal along each of the orthogonal edges, standard normal across."""
    directions = edges / lengths
    along = white @ directions
    across = white - along @ directions.T
    rest = white.shape[1] - lengths.size
    total = -0.5 * np.sum(across**2, axis=1) - 0.5 * rest * _LOG_2PI
    for k, length in enumerate(lengths):
        total = total + log_density(along[:, k], 1.0, length)
    return np.asarray(total)
