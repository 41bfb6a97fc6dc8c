"""Normal plus uniform on a line: density, tails and intervals without cancellation, down to both limits.

A deviation is ``X = sigma Z + half_width U`` with ``Z`` standard normal and ``U`` uniform on [-1, 1], independent.
With ``A = half_width / sigma`` and ``z = x / sigma`` its density and distribution function are

    f = [Phi(z + A) - Phi(z - A)] / (2 half_width)        F = [I(z + A) - I(z - A)] / (2 A)

where ``I(t) = t Phi(t) + phi(t)`` is the integral of ``Phi``. Written like this they lose every digit in the tails
and for small ``A``. Here everything is taken on the lower half (``z <= 0``), relative to ``exp(-p**2 / 2)`` with
``p`` the nearer edge, where the two terms differ by a factor; where they do not (``A max(1, |z|) <= 1``) the mean
over ``U`` is a sixteen-point Gauss-Legendre sum, which is then exact to rounding. ``sigma = 0`` is the uniform
distribution and ``half_width = 0`` the normal.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from scipy.special import erfcx, log_ndtr, ndtr

from thermal_robot.arrays import Array

NODES, WEIGHTS = np.polynomial.legendre.leggauss(16)
_HALF_WEIGHTS = WEIGHTS / 2.0
_LOG_ROOT_2PI = 0.5 * np.log(2.0 * np.pi)
_ROOT_HALF_PI = np.sqrt(np.pi / 2.0)
_ROOT_HALF = np.sqrt(0.5)
# Where the closed form 1 - t m(t) has lost a digit, the continued fraction needs forty terms; further out fewer.
_FRACTIONS = ((4.0, 9.0, 44), (9.0, np.inf, 14))
_UNDERFLOW = 39.0  # standard deviations beyond which the normal density is zero in double precision


def mills_ratio(t: Array) -> Array:
    """Mills's ratio ``Phi(-t) / phi(t)`` of the standard normal law, survival function over density; ``t >= 0``."""
    return np.asarray(_ROOT_HALF_PI * erfcx(t * _ROOT_HALF))


def second_mills_ratio(t: Array) -> Array:
    """Integral of the standard normal survival function beyond ``t >= 0``, over the density: ``1 - t m(t)``.

    ``m`` is Mills's ratio, ``m = 1 / (t + k)`` with ``k = 1 / (t + 2 / (t + 3 / ...))``, hence ``1 - t m = k m``, a
    product without cancellation.
    """
    t = np.asarray(t, dtype=float)
    ratio = mills_ratio(t)
    result = 1.0 - t * ratio
    for start, stop, terms in _FRACTIONS:
        far = (t > start) & (t <= stop)
        if np.any(far):
            distance = t[far]
            fraction = distance.copy()
            for term in range(terms, 1, -1):
                fraction = distance + term / fraction
            result[far] = ratio[far] / fraction
    return result


def _integral(t: Array) -> Array:
    """Integral ``I(t) = t Phi(t) + phi(t)`` of the standard normal distribution function; zero for ``t <= -39``."""
    size = np.abs(t)
    result = np.zeros(t.shape)
    within = size < _UNDERFLOW
    near = size[within]
    result[within] = np.exp(-0.5 * near**2 - _LOG_ROOT_2PI) * second_mills_ratio(near)
    return result + np.maximum(t, 0.0)


def _log_integral(t: Array) -> Array:
    """Logarithm of ``I(t) = t Phi(t) + phi(t)``, the integral of the standard normal distribution function."""
    size = np.abs(t)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        below = -0.5 * size**2 - _LOG_ROOT_2PI + np.log(second_mills_ratio(size))
        # I(t) = t + I(-t)
        above = np.log(size + np.exp(below))
    return np.where(t > 0.0, above, np.where(np.isinf(size), -np.inf, below))


def _log_difference(upper: Array, lower: Array) -> Array:
    """Logarithm of ``exp(upper) - exp(lower)`` for ``upper >= lower``."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(np.isneginf(lower), upper, upper + np.log1p(-np.exp(np.minimum(lower - upper, 0.0))))


def _split(*arguments: npt.ArrayLike) -> tuple[tuple[int, ...], tuple[Array, ...]]:
    """Broadcast the arguments; return their common shape, and them as arrays of it, at least one-dimensional."""
    arrays = np.broadcast_arrays(*(np.asarray(a, dtype=float) for a in arguments))
    return arrays[0].shape, tuple(map(np.atleast_1d, arrays))


def log_density(x: npt.ArrayLike, sigma: npt.ArrayLike, half_width: npt.ArrayLike) -> Array:
    """Log density at ``x`` of a centred normal plus an independent uniform variable on ±``half_width`` (Eqs 16-18).

    Arguments broadcast. Where ``sigma`` and ``half_width`` are both zero: ``inf`` at zero, ``-inf`` elsewhere.
    """
    shape, (x, sigma, half_width) = _split(x, sigma, half_width)
    distance = np.abs(x)
    result = np.empty(x.shape)
    flat = sigma <= 0.0
    if np.any(flat):
        edge, width = distance[flat], half_width[flat]
        with np.errstate(divide="ignore"):
            inside = -np.log(2.0 * width)
        result[flat] = np.where(edge < width, inside, np.where(edge > width, -np.inf, inside - np.log(2.0)))
        result[flat & (half_width <= 0.0)] = np.where(distance[flat & (half_width <= 0.0)] > 0.0, -np.inf, np.inf)
    rest = ~flat
    if np.any(rest):
        scale = sigma[rest]
        z, ratio = distance[rest] / scale, half_width[rest] / scale
        value = np.empty(z.shape)
        near = ratio * np.maximum(1.0, z) <= 1.0
        if np.any(near):
            shift = ratio[near][:, None] * NODES
            mean = np.exp(z[near][:, None] * shift - 0.5 * shift**2) @ _HALF_WEIGHTS
            value[near] = -0.5 * z[near] ** 2 - _LOG_ROOT_2PI + np.log(mean)
        apart = ~near
        if np.any(apart):
            step = ratio[apart]
            upper, lower = log_ndtr(step - z[apart]), log_ndtr(-step - z[apart])
            value[apart] = _log_difference(upper, lower) - np.log(2.0 * step)
        result[rest] = value - np.log(scale)
    return result.reshape(shape)


def log_tail(x: npt.ArrayLike, sigma: npt.ArrayLike, half_width: npt.ArrayLike) -> Array:
    """Log survival function log P(X > x) of a centred normal plus a uniform variable on ±``half_width``; broadcasts."""
    shape, (x, sigma, half_width) = _split(x, sigma, half_width)
    distance = np.abs(x)
    lower = np.empty(x.shape)  # logarithm of P(X > |x|)
    flat = sigma <= 0.0
    if np.any(flat):
        edge, width = distance[flat], half_width[flat]
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(width > 0.0, np.clip((width - edge) / (2.0 * width), 0.0, 0.5), 0.0)
            lower[flat] = np.log(share)
    rest = ~flat
    if np.any(rest):
        z, ratio = distance[rest] / sigma[rest], half_width[rest] / sigma[rest]
        value = np.empty(z.shape)
        near = ratio * np.maximum(1.0, z) <= 1.0
        if np.any(near):
            value[near] = _log_tail_near(z[near], ratio[near])
        apart = ~near
        if np.any(apart):
            step = ratio[apart]
            upper, below = _log_integral(step - z[apart]), _log_integral(-step - z[apart])
            value[apart] = _log_difference(upper, below) - np.log(2.0 * step)
        lower[rest] = value
    # Left of the mean the tail is the complement, and near one; a point mass is not beyond itself.
    with np.errstate(divide="ignore"):
        result = np.where(x < 0.0, np.log1p(-np.exp(lower)), lower)
    return result.reshape(shape)


def _log_tail_near(z: Array, ratio: Array) -> Array:
    """Log survival function at ``z >= 0``, in sigmas: log of the mean of ``Phi(-z + A u)`` over ``u`` in [-1, 1].

    ``A = ratio`` is the uniform half width in sigmas, ``A max(1, z) <= 1``; the mean is a sixteen-point Gauss sum.
    """
    with np.errstate(invalid="ignore", over="ignore"):
        shift = ratio[:, None] * NODES
        point = z[:, None] - shift
        beyond = mills_ratio(np.maximum(point, 0.0)) * np.exp(z[:, None] * shift - 0.5 * shift**2)
        # Nodes on the far side of the mean (only for z < 1): no scaling is needed there.
        crossed = ndtr(-point) * np.exp(0.5 * z[:, None] ** 2 + _LOG_ROOT_2PI)
        mean = np.where(point >= 0.0, beyond, crossed) @ _HALF_WEIGHTS
        value = -0.5 * z**2 - _LOG_ROOT_2PI + np.log(mean)
    return np.where(np.isinf(z), -np.inf, value)


def density(x: npt.ArrayLike, sigma: npt.ArrayLike, half_width: npt.ArrayLike) -> Array:
    """Density at ``x`` of a centred normal plus an independent uniform variable on ±``half_width``."""
    return np.exp(log_density(x, sigma, half_width))


def tail(x: npt.ArrayLike, sigma: npt.ArrayLike, half_width: npt.ArrayLike) -> Array:
    """Survival function P(X > x) of a centred normal plus an independent uniform variable on ±``half_width``.

    Cheaper than `log_tail`, but may underflow to zero below 1e-300.
    """
    shape, (x, sigma, half_width) = _split(x, sigma, half_width)
    if not np.any(half_width) and np.all(sigma > 0.0):
        return np.asarray(ndtr(-x / sigma)).reshape(shape)
    distance = np.abs(x)
    result = np.empty(x.shape)
    apart = (sigma > 0.0) & (half_width * np.maximum(sigma, distance) > sigma * sigma)
    if np.any(apart):
        scale = sigma[apart]
        z, step = distance[apart] / scale, half_width[apart] / scale
        result[apart] = (_integral(step - z) - _integral(-step - z)) / (2.0 * step)
    rest = ~apart
    if np.any(rest):
        result[rest] = np.exp(log_tail(distance[rest], sigma[rest], half_width[rest]))
    return np.where(x < 0.0, 1.0 - result, result).reshape(shape)


def outside_probability(low: Array, high: Array, sigma: npt.ArrayLike, half_width: npt.ArrayLike) -> Array:
    """Probability P(X < low or X > high) for X a centred normal plus a uniform variable on ±``half_width``.

    Relatively accurate. ``low <= high`` have one shape, the widths broadcast. A point mass on the edge is inside.
    """
    return tail(-low, sigma, half_width) + tail(high, sigma, half_width)


def inside_probability(low: Array, high: Array, sigma: npt.ArrayLike, half_width: npt.ArrayLike) -> Array:
    """Probability P(low <= X <= high) for X a centred normal plus a uniform variable on ±``half_width``.

    Relatively accurate; ``low <= high`` have one shape, the widths broadcast. An interval on one side of the mean is a
    difference of tails; one shorter than ``sigma / 2``, where they cancel, is a Gauss-Legendre sum of the density.
    """
    sigma, half_width = np.asarray(sigma, dtype=float), np.asarray(half_width, dtype=float)
    mirrored = low + high < 0.0
    near, far = np.where(mirrored, -high, low), np.where(mirrored, -low, high)  # near + far >= 0
    beside = near > 0.0
    # One sided: the nearer tail less the farther one. Else both are taken from one.
    nearer, farther = tail(np.abs(near), sigma, half_width), tail(far, sigma, half_width)
    result = np.where(beside, nearer - farther, 1.0 - nearer - farther)
    short = (far - near < 0.5 * sigma) & (far > near)
    if np.any(short):
        half = 0.5 * (far[short] - near[short])
        points = 0.5 * (far[short] + near[short])[:, None] + half[:, None] * NODES
        widths = (np.broadcast_to(v, short.shape)[short][:, None] for v in (sigma, half_width))
        result[short] = half * (density(points, *widths) @ WEIGHTS)
    if np.any(sigma <= 0.0):
        return np.where(sigma > 0.0, np.maximum(result, 0.0), _inside_uniform(low, high, half_width))
    return np.maximum(result, 0.0)


def _inside_uniform(low: Array, high: Array, half_width: Array) -> Array:
    """P(low <= X <= high) for X uniform on ±``half_width``; for X = 0 where ``half_width`` is zero."""
    overlap = np.minimum(high, half_width) - np.maximum(low, -half_width)
    point = np.where((low <= 0.0) & (high >= 0.0), 1.0, 0.0)
    share = np.maximum(overlap, 0.0) / np.where(half_width > 0.0, 2.0 * half_width, 1.0)
    return np.where(half_width > 0.0, share, point)


Owners = npt.NDArray[np.intp]
Integrand = Callable[[Owners, Array], Array]

_CHUNK = 16384  # panels evaluated together: 16384 x 16 doubles are 2 MB per temporary


def _panel_sums(integrand: Integrand, owner: Owners, left: Array, right: Array) -> Array:
    sums = np.empty(left.shape)
    for start in range(0, left.size, _CHUNK):
        part = slice(start, start + _CHUNK)
        half = 0.5 * (right[part] - left[part])
        points = 0.5 * (right[part] + left[part])[:, None] + half[:, None] * NODES
        sums[part] = half * (integrand(owner[part], points) @ WEIGHTS)
    return sums


def integrate_panels(integrand: Integrand, breakpoints: Array, *, tolerance: float = 1e-13, depth: int = 48) -> Array:
    """Integrate ``N`` non-negative functions by adaptive Gauss-Legendre panels, between own breakpoints ``(N, M)``.

    The integrand takes the number of the integral of each panel, ``(P,)``, and points ``(P, n)``. Breakpoints ascend. A
    panel is halved, at most ``depth`` times, while its two halves differ from it by more than the ``tolerance`` as a
    share of its integral's total; the halves are kept, so that the error is far smaller than that.
    """
    count = breakpoints.shape[0]
    left, right = breakpoints[:, :-1], breakpoints[:, 1:]
    kept = right > left
    owner = np.broadcast_to(np.arange(count)[:, None], kept.shape)[kept]
    left, right = left[kept], right[kept]
    settled = np.zeros(count)
    coarse = _panel_sums(integrand, owner, left, right)
    for level in range(depth):
        if not left.size:
            break
        middle = 0.5 * (left + right)
        halves = _panel_sums(
            integrand, np.concatenate([owner, owner]), np.concatenate([left, middle]), np.concatenate([middle, right])
        )
        first, second = halves[: left.size], halves[left.size :]
        fine = first + second
        total = settled + np.bincount(owner, weights=fine, minlength=count)
        done = np.abs(fine - coarse) <= tolerance * total[owner]
        if level == depth - 1:
            done[:] = True
        settled += np.bincount(owner[done], weights=fine[done], minlength=count)
        again = ~done
        coarse = np.concatenate([first[again], second[again]])
        owner = np.concatenate([owner[again], owner[again]])
        left, right = (
            np.concatenate([left[again], middle[again]]),
            np.concatenate([middle[again], right[again]]),
        )
    return settled
