"""The paper's flat-normal distribution (Eqs 16-20) as a `scipy.stats` distribution.

A positioning error is a normal kinematic part, standard deviation ``sigma``, plus an independent thermal part that is
uniform on ``±half_width``. The paper's parameter is ``r = sigma_t / sigma_k`` (Eq 17) with ``sigma_t = half_width /
sqrt(3)`` (Eq 19).

**Eq 18 as printed is not a density.** With ``sigma_k = 1`` the convolution (Eq 16) is the mean of the normal density
over the interval ``eta ± sqrt(3) r`` of length ``2 sqrt(3) r``:

    PDF(eta) = 1 / (2 sqrt(3) r) * 1 / sqrt(2 pi) * integral of exp(-zeta**2 / 2)  =  1 / (2 sqrt(6 pi) r) * integral

The text has ``2 sqrt(6) pi r`` in the denominator; the area is then ``sqrt(6 pi) / (sqrt(6) pi) = 1 / sqrt(pi) =
0.5642`` (`eq18_printed_area`). The root covers ``pi`` too.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import stats
from scipy.special import comb, ndtri

from thermal_robot.arrays import Array
from thermal_robot.assembly.probability.flat_normal_fit import fit_maximum_likelihood, fit_moments
from thermal_robot.assembly.probability.kernels import density, log_density, log_tail, tail

_ROOT_3 = np.sqrt(3.0)


def eq18_printed_area() -> float:
    """Area under Eq 18 as printed, for any ``r``: ``1 / sqrt(pi)``, not one."""
    return float(1.0 / np.sqrt(np.pi))


def _parts(r: npt.ArrayLike) -> tuple[Array, Array]:
    """Return the normal standard deviation and the uniform half width of total variance one."""
    ratio = np.asarray(r, dtype=float)
    with np.errstate(divide="ignore"):
        sigma = 1.0 / np.hypot(1.0, ratio)
        share = 1.0 / np.hypot(1.0, 1.0 / ratio)
    return sigma, _ROOT_3 * share


class FlatNormalGenerator(stats.rv_continuous):  # type: ignore[misc]  # scipy has no annotations
    r"""Sum of a normal and an independent uniform variable.

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
        """Estimate ``(r, loc, scale)``.

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
        """Fit to a sample; options as in `FlatNormalGenerator.fit`."""
        ratio, loc, scale = flat_normal.fit(data, **options)
        sigma, half_width = _parts(ratio)
        return cls(scale * sigma, scale * half_width, loc)


def _upper_quantile(q: Array, sigma: Array, half_width: Array) -> Array:
    """``x`` with P(X > x) = q.

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
    """Entropy; closed form in both limits, otherwise Gauss-Legendre panels over the half line."""
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
