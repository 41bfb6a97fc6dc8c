"""Probability that a planar deviation lies in a disc or a rectangle: normal, plus uniform along one segment.

A disc's integral runs along its edge where so many angles as `NODES` holds resolve it, along chords across the narrow
axis where 64 nodes do. Graded panels serve rectangles, discs that neither resolves, and tails to full relative
accuracy.

**Edge** (Green): a trapezoidal rule that is exact to rounding. In the principal axes of the normal part, each in its
standard deviation, the disc's edge about the mean is ``z(t) = (a1 cos t - b1, a2 sin t - b2)`` with ``a = R / sigma``
and ``b = mean / sigma``. The field

    F(z) = z (1 - exp(-|z|**2 / 2)) / (2 pi |z|**2)        div F = exp(-|z|**2 / 2) / (2 pi)

is entire, so that the sum over ``n`` even angles converges faster than any power: with ``h = |z|**2 / 2`` and ``w = z1
dz2/dt - z2 dz1/dt = a1 a2 - b1 a2 cos t - b2 a1 sin t``

    P = mean of w (1 - exp(-h)) / (2 h)        1 - P = mean of w exp(-h) / (2 h), for a mean within the disc.

The second is a sum of positive terms and keeps its digits however small it is; its poles (``z1 + i z2 = 0``, two roots
in ``exp(it)``) change the sum by a known amount, which is taken out. With a uniform part along a segment, ``z`` turned
so that the segment is the first axis and ``A`` its half length there,

    P = integral of phi(v) G(u) dv        G(u) = [I(u + A) - I(u - A)] / (2 A) - 1/2,        I(t) = t Phi(t) + phi(t).

**Chords** (erf) along the longer axis of a normal part much narrower one way, summed across. With ``x`` along the
*narrow* axis, ``x = R cos c`` and the half chord ``R sin c``,

    P = integral of phi((x - m2) / s2) / s2 [Phi((R sin c - m1) / s1) - Phi((-R sin c - m1) / s1)] R sin c dc

over the part of the disc within so many narrow deviations of the mean: there 64 Gauss nodes in ``c`` are exact to
rounding, as long as the chord does not change by many wide deviations (`chords_resolve`). All differences of ``x`` are
products, so that the narrow deviation may be as small as one likes; without any the chord through the mean remains.

**Graded panels.** The plane is turned so that the segment, or else the normal part's shorter principal axis, is the
second axis. Given the first coordinate ``x`` the second is then normal plus uniform on a line, whose interval
probability is closed form (`kernels`), and one integral over ``x`` remains. Inside and outside are integrals of their
own, neither is one minus the other, so both are relatively accurate.

**Clearances** that many round joints need are Newton steps that a bracket holds: Eq 22 solved for ``L``, all at once.
The failing probability as a standard normal quantile, ``z(R) = -Phi^-1(1 - P)``, is nearly a straight line in the
radius wherever little fails, so that few steps of

    R <- R + (z* - z) phi(z) / (dP/dR)

are enough. No deviation is longer than its mean, its segment and a normal deviation as wide all round as the widest
way, hence ``R <= |mean| + |segment| + s1 sqrt(-2 log(1 - P))``, where the search begins.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import partial
from typing import Protocol

import numpy as np
import numpy.typing as npt
from scipy.special import ndtr, ndtri_exp

from thermal_robot.arrays import Array
from thermal_robot.assembly.probability.kernels import inside_probability, integrate_panels, outside_probability


def _difference_of_products(a: Array, b: Array, c: Array, d: Array) -> Array:
    """Return ``a b - c d`` correct to rounding (Dekker's exact products), also where it nearly cancels."""

    def product(p: Array, q: Array) -> tuple[Array, Array]:
        head = p * q
        p1, q1 = p * 134217729.0, q * 134217729.0
        ph, qh = p1 - (p1 - p), q1 - (q1 - q)
        pl, ql = p - ph, q - qh
        return head, ((ph * qh - head) + ph * ql + pl * qh) + pl * ql

    one, one_low = product(a, b)
    two, two_low = product(c, d)
    return (one - two) + (one_low - two_low)


@dataclass(frozen=True)
class Principal:
    """Eigendecomposition of 2x2 covariances: variances ``large >= small >= 0``, unit vector of the first."""

    large: Array
    small: Array
    direction: Array

    @classmethod
    def of(cls, covariance: Array) -> Principal:
        """Decompose; the smaller variance comes from the determinant, accurate next to a large one."""
        size = np.max(np.abs(covariance), axis=(-2, -1))
        nothing = size == 0.0
        # a power of two: to divide by it rounds nothing
        scale = np.where(nothing, 1.0, np.ldexp(1.0, np.frexp(size)[1]))
        a, b, c = (covariance[..., i, j] / scale for i, j in ((0, 0), (0, 1), (1, 1)))
        large = 0.5 * (a + c + np.hypot(a - c, 2.0 * b))
        small = np.maximum(_difference_of_products(a, c, b, b), 0.0) / np.where(nothing, 1.0, large)
        angle = 0.5 * np.arctan2(2.0 * b, a - c)
        return cls(large * scale, small * scale, np.stack([np.cos(angle), np.sin(angle)], axis=-1))

    def turned(self, vectors: Array) -> Array:
        """Coordinates of vectors ``(N, 2)`` along the axes, the one with the larger variance first."""
        e1 = self.direction
        first = vectors[:, 0] * e1[..., 0] + vectors[:, 1] * e1[..., 1]
        return np.stack([first, vectors[:, 1] * e1[..., 0] - vectors[:, 0] * e1[..., 1]], axis=1)

    def rows(self, chosen: npt.NDArray[np.intp]) -> Principal:
        """Subset of the rows."""
        return Principal(self.large[chosen], self.small[chosen], self.direction[chosen])


NODES = np.array([32, 48, 64, 96, 128, 192, 256, 384, 512, 768, 1024])
"""Numbers of angles that are used; multiples of four."""

# Angles per standard deviation, the shorter one, from the disc's farther edge to the mean, and besides: measured
# against the chords' integral, the absolute error is then below 2e-15 and that of a small 1 - P below 1e-11 of it.
PER_DEVIATION, BESIDES = 8.0, 16.0
NEAR = 0.01  # squared distances (halved) of a node from the mean below which (1 - exp(-h)) / h is taken by its series
SERIES = (-1.0 / 720.0, 1.0 / 120.0, -1.0 / 24.0, 1.0 / 6.0, -0.5, 1.0)
FRACTION = 0.05  # a failing probability above this is one minus the other
_ROOT_2PI = np.sqrt(2.0 * np.pi)


def angles_needed(axes: Array, centre: Array) -> Array:
    """Return the number of angles ``(N,)`` that resolve discs with half axes ``(N, 2)`` about ``-centre``.

    A second axis last: the one with the smaller deviation.
    """
    ratio = axes[:, 1] / axes[:, 0]
    distance = np.hypot(centre[:, 0] * ratio, centre[:, 1])  # in the smaller deviation
    return np.asarray(PER_DEVIATION * (axes[:, 1] + distance) + BESIDES)


def disc_by_edge(axes: Array, centre: Array, count: int, *, central: bool = False) -> tuple[Array, Array, Array]:
    """Probabilities in and out of discs about the origin, and ``dP / d log radius``, by ``count`` angles on the edge.

    ``axes`` and ``centre`` ``(N, 2)``: radius and mean over standard deviation along both principal axes. ``count`` is
    at least `angles_needed`, a multiple of four; where the means are zero (``central``) a quarter of the edge says all.
    ``1 - P`` is relatively accurate for a mean within the disc.
    """
    angle = (2.0 * np.pi / count) * (np.arange(count // 4 if central else count) + 0.5)
    cosine, sine = np.cos(angle), np.sin(angle)
    area = axes[:, 0] * axes[:, 1]
    first, second = np.multiply.outer(axes[:, 0], cosine), np.multiply.outer(axes[:, 1], sine)
    if not central:
        first -= centre[:, :1]
        second -= centre[:, 1:]
    first *= first
    second *= second
    first += second
    half = first
    half *= 0.5  # h
    if central:
        weight: Array = area[:, None]
    else:
        slopes = np.stack([area, -centre[:, 0] * axes[:, 1], -centre[:, 1] * axes[:, 0]], axis=1)
        weight = slopes @ np.stack([np.ones_like(cosine), cosine, sine])
    decay = np.negative(half, out=second)
    np.exp(decay, out=decay)
    rate = area * np.mean(decay, axis=1)
    close = np.min(half, axis=1) < NEAR
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.divide(weight, half, out=None if np.any(close) else half)
    outer = 0.5 * np.einsum("nk,nk->n", share, decay) / len(angle)
    decay = np.subtract(1.0, decay, out=decay)
    inside = 0.5 * np.einsum("nk,nk->n", share, decay) / len(angle)
    if np.any(close):
        near = np.broadcast_to(weight, half.shape)[close] * _mean_decay(half[close])
        inside[close] = 0.5 * np.mean(near, axis=1)
    outside = 1.0 - inside
    small = np.flatnonzero(outside < FRACTION)
    outside[small] = outer[small] + _poles(axes[small], centre[small], count)
    return inside, outside, rate


def _mean_decay(half: Array) -> Array:
    """``(1 - exp(-h)) / h``, also at zero."""
    near = half < NEAR
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(near, np.polyval(SERIES, half), (1.0 - np.exp(-half)) / half)


def _poles(axes: Array, centre: Array, count: int) -> Array:
    """Pole corrections of the trapezoidal sum of ``exp(-h)``: one for each root of ``z1 + i z2`` in ``exp(it)``.

    Over the ``n`` roots of -1 the mean of ``z / (z - c)`` is ``1 / (1 + c**n)``.
    """
    lead, low = 0.5 * (axes[:, 0] + axes[:, 1]), 0.5 * (axes[:, 0] - axes[:, 1])
    middle = centre[:, 0] + 1j * centre[:, 1]
    root = np.sqrt(middle * middle - 4.0 * lead * low)
    root = np.where((np.conj(middle) * root).real >= 0.0, root, -root)
    larger = 0.5 * (middle + root)
    total = np.zeros(len(axes))
    with np.errstate(divide="ignore", invalid="ignore"):
        for pole in (larger / lead, np.where(larger == 0.0, 0.0, low / larger)):
            power = pole**count
            total += (power / (1.0 + power)).real
    return total


def segment_by_edge(axes: Array, centre: Array, segment: Array, count: int) -> tuple[Array, Array]:
    """``P`` of discs about the origin, the mean uniform on a segment about ``centre``, and ``dP / d log radius``.

    ``axes``, ``centre`` and ``count`` as for `disc_by_edge`; ``segment`` ``(N, 2)`` is half of it over the standard
    deviations, not short beside one: then the angles that a centred disc needs are enough. The absolute error is
    rounding.
    """
    angle = (2.0 * np.pi / count) * (np.arange(count) + 0.5)
    circle = np.stack([np.cos(angle), np.sin(angle)])
    length = np.hypot(segment[:, 0], segment[:, 1])[:, None]
    along = segment / length
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    u = (along * axes) @ circle - np.sum(along * centre, axis=1)[:, None]
    v = (across * axes) @ circle - np.sum(across * centre, axis=1)[:, None]
    step = (across * axes) @ np.stack([-circle[1], circle[0]])
    decay = np.exp(-0.5 * v * v)
    # G is odd: 1/2 less the tail beyond |u|, which vanishes without rounding far out.
    side = np.abs(u)
    near, far = length - side, -length - side
    after, before = ndtr(near), ndtr(far)
    tail = near * after - far * before
    tail += (np.exp(-0.5 * near * near) - np.exp(-0.5 * far * far)) / _ROOT_2PI
    level = np.copysign(0.5 - tail / (2.0 * length), u)
    inside = (_ROOT_2PI / count) * np.einsum("nk,nk,nk->n", decay, level, step)
    density = np.einsum("nk,nk->n", decay, after - before) / (2.0 * length[:, 0])
    return inside, axes[:, 0] * axes[:, 1] * (_ROOT_2PI / count) * density


_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(64)
_REACH = 9.0  # narrow standard deviations either side of the mean: what lies beyond is below 3e-19
_CHANGE = 12.0  # wide standard deviations by which a chord may change for 64 nodes to follow


def _window(narrow: Array, beside: Array) -> tuple[Array, Array, Array, Array]:
    """Integration window over chords: angle of the mean, limits about it, and distance beyond the edge.

    ``narrow`` and ``beside`` are the deviation and the mean's distance (not negative) over the radius. With ``1 - cos
    c = d`` the difference of two angles is ``2 asin`` of a quotient of products.
    """
    inner = np.clip(1.0 - beside, 0.0, 1.0)
    beyond = np.maximum(beside - 1.0, 0.0)
    start = 2.0 * np.arcsin(np.sqrt(0.5 * inner))
    low = -np.minimum(_REACH * narrow, inner)
    high = np.minimum(np.maximum(_REACH * narrow - beyond, 0.0), 2.0 - inner)
    ends = []
    for step in (low, high):
        here, there = 0.5 * inner, np.clip(0.5 * (inner + step), 0.0, 1.0)
        divisor = np.sqrt(there * (1.0 - here)) + np.sqrt(here * (1.0 - there))
        ends.append(2.0 * np.arcsin(np.clip(0.5 * step / np.where(divisor > 0.0, divisor, 1.0), -1.0, 1.0)))
    return start, ends[0], ends[1], beyond


def chords_resolve(axes: Array, centre: Array) -> npt.NDArray[np.bool_]:
    """Whether 64 nodes resolve the chords of each disc; arguments as for `disc_by_chords`."""
    narrow = 1.0 / axes[:, 1]
    start, low, high, _ = _window(narrow, np.abs(centre[:, 1]))
    ends = np.sin(start + low), np.sin(start + high)
    top = (start + low < 0.5 * np.pi) & (start + high > 0.5 * np.pi)
    change = np.where(top, 1.0 - np.minimum(*ends), np.abs(ends[1] - ends[0]))
    return np.asarray(axes[:, 0] * change <= _CHANGE)


def disc_by_chords(axes: Array, centre: Array) -> tuple[Array, Array, Array]:
    """``P`` and ``1 - P`` of discs about the origin, and ``dP / d log radius``, by 64 chords; each ``(N,)``.

    ``axes`` ``(N, 2)``: radius over standard deviation along the wide and the narrow axis, the second may be ``inf``;
    ``centre``: mean over standard deviation along the wide axis, over the *radius* along the narrow one. Absolute
    errors of rounding, relative ones of ``1 - P`` below 1e-11 where it exceeds 1e-7.
    """
    narrow, beside = 1.0 / axes[:, 1], np.abs(centre[:, 1])
    start, low, high, beyond = (v[:, None] for v in _window(narrow, beside))
    step = 0.5 * (high + low) + 0.5 * (high - low) * _NODES
    chord = np.sin(start + step)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        away = (2.0 * np.sin(start + 0.5 * step) * np.sin(0.5 * step) + beyond) / narrow[:, None]
        share = np.exp(-0.5 * away * away) * _WEIGHTS
        share *= 0.5 * (high - low) / (narrow[:, None] * _ROOT_2PI)
        weight = share * chord
        ends = ndtr((beside - 1.0) / narrow) + ndtr((-beside - 1.0) / narrow)
    point = narrow == 0.0
    weight[point] = np.where(beside[point] <= 1.0, 1.0 / len(_NODES), 0.0)[:, None]
    ends[point] = beside[point] > 1.0
    near, far = (axes[:, :1] * chord + sign * centre[:, :1] for sign in (-1.0, 1.0))
    missed = np.einsum("nk,nk->n", weight, ndtr(-near) + ndtr(-far))
    edge = (np.exp(-0.5 * near * near) + np.exp(-0.5 * far * far)) * (axes[:, :1] / _ROOT_2PI)
    share[point] = weight[point] / np.where(chord[point] > 0.0, chord[point], 1.0)
    return np.sum(weight, axis=1) - missed, missed + ends, np.einsum("nk,nk->n", share, edge)


Found = tuple[Array, Array, Array]

_CELLS = 1 << 17  # numbers of an array that stays in cache, eight bytes each
TOLD = 1e-5
"""Probability outside that every method gives: as one minus that inside, fewer than ten digits are left below it."""
_TOLD_BY_CHORDS = 1e-7  # the same by chords, which add tails
MOST = 256  # angles beside which chords are worth their while
_SHORT = 1.0  # half segments in standard deviations up to which a mean over it is a sum of so many nodes
_UNITS, _SHARES = np.polynomial.legendre.leggauss(16)


@dataclass(frozen=True)
class Chances:
    """Probabilities of N deviations in discs: ``P`` to rounding, ``1 - P`` to ten digits, ``dP / d log radius``.

    NaN where that needs another integral.
    """

    inside: Array
    outside: Array
    rate: Array


def disc_chances(principal: Principal, means: Array, radii: Array, segments: Array | None = None) -> Chances:
    """Probabilities of ``N`` deviations with means ``(N, 2)`` in, and out of, discs about the origin.

    Uniform parts run from ``-segment`` to ``segment``, ``(N, 2)``.
    """
    discs = _Discs.of(principal, means, radii, segments)
    result = np.full((3, len(means)), np.nan)
    for k in np.unique(discs.which[discs.which < len(NODES)]):
        same, angles = discs.which == k, int(NODES[k])
        plain = same & ~discs.far
        central = plain & ~np.any(discs.at, axis=1)
        _fill(result, partial(discs.about_the_centre, angles), central, angles // 4)
        _fill(result, partial(discs.edge, angles), plain & ~central, angles)
        _fill(result, partial(discs.along, angles), same & discs.far, angles)
    result[1, discs.far & (result[1] < TOLD)] = np.nan
    rest = np.flatnonzero((discs.which == len(NODES)) & (principal.large > 0.0) & ~discs.far)
    across = np.zeros(len(means), dtype=bool)
    across[rest] = chords_resolve(discs.axes[rest], discs.over_radius[rest])
    _fill(result, discs.chords, across, 64)
    result[1, across & (result[1] < _TOLD_BY_CHORDS)] = np.nan
    step = max(_CELLS // (64 * len(_UNITS)), 1)
    for start in range(0, len(discs.short), step):
        rows = discs.short[start : start + step]
        shifted = (means[rows][:, None] + _UNITS[:, None] * np.asarray(segments)[rows][:, None]).reshape(-1, 2)
        every = np.repeat(rows, len(_UNITS))
        each = disc_chances(principal.rows(every), shifted, radii[every])
        for row, part in enumerate((each.inside, each.outside, each.rate)):
            result[row, rows] = 0.5 * part.reshape(len(rows), -1) @ _SHARES
    return Chances(*result)


@dataclass(frozen=True)
class _Discs:
    """Discs and laws in principal axes: radius, mean and segment end over the deviations, ``(N, 2)``.

    ``over_radius``: the mean, along the second axis over the radius. ``far``: which have a segment longer than a
    deviation; ``short``: rows of those with one that is not, they are sums of others. ``which`` of `NODES` resolves
    them along the edge; their number where none does.
    """

    axes: Array
    at: Array
    ends: Array
    over_radius: Array
    far: npt.NDArray[np.bool_]
    short: npt.NDArray[np.intp]
    which: npt.NDArray[np.intp]

    @classmethod
    def of(cls, principal: Principal, means: Array, radii: Array, segments: Array | None) -> _Discs:
        deviations = np.sqrt(np.stack([principal.large, principal.small], axis=1))
        centre = principal.turned(means)
        half = np.zeros_like(centre) if segments is None else principal.turned(segments)
        heated = np.any(half != 0.0, axis=1)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            axes = radii[:, None] / deviations
            at, ends = (np.where(v != 0.0, v / deviations, 0.0) for v in (centre, half))
            far = heated & (np.hypot(ends[:, 0], ends[:, 1]) > _SHORT)
            needed = angles_needed(axes, np.where(far[:, None], 0.0, at))
        # without a segment chords are cheaper than so many angles
        needed[~np.isfinite(needed) | (~far & (needed > MOST)) | (principal.large == 0.0)] = np.inf
        short = heated & ~far
        which = np.where(short, len(NODES) + 1, np.searchsorted(NODES, needed))
        over_radius = np.stack([at[:, 0], centre[:, 1] / radii], axis=1)
        return cls(axes, at, ends, over_radius, far, np.flatnonzero(short), which)

    def about_the_centre(self, angles: int, rows: npt.NDArray[np.intp]) -> Found:
        return disc_by_edge(self.axes[rows], self.at[rows], angles, central=True)

    def edge(self, angles: int, rows: npt.NDArray[np.intp]) -> Found:
        return disc_by_edge(self.axes[rows], self.at[rows], angles)

    def along(self, angles: int, rows: npt.NDArray[np.intp]) -> Found:
        inside, rate = segment_by_edge(self.axes[rows], self.at[rows], self.ends[rows], angles)
        return inside, 1.0 - inside, rate

    def chords(self, rows: npt.NDArray[np.intp]) -> Found:
        return disc_by_chords(self.axes[rows], self.over_radius[rows])


def _fill(result: Array, chance: Callable[..., Found], chosen: npt.NDArray[np.bool_], cells: int) -> None:
    """Compute the chosen rows in chunks that fit the cache."""
    rows = np.flatnonzero(chosen)
    step = max(_CELLS // cells, 1)
    for start in range(0, len(rows), step):
        part = rows[start : start + step]
        result[:, part] = chance(part)


class Region(Protocol):
    """Protocol of convex regions about the origin, in a frame whose second axis runs along the chords.

    The coordinate ``t`` parametrises the first axis, ``x = x(t)``, so that the chords' ends are smooth in ``t``
    between the breaks.
    """

    def breaks(self) -> Array:
        """Return the ends and kinks in ``t``, ascending, shape ``(N, B)``."""
        ...

    def abscissa(self, owner: npt.NDArray[np.intp], t: Array) -> tuple[Array, Array]:
        """Abscissa ``x(t)`` and ``dx/dt`` of region ``owner``, in the shape of ``t`` (first axis: ``owner``)."""
        ...

    def parameter(self, x: Array) -> Array:
        """``t`` of abscissae of shape ``(N, K)``, clipped to the region."""
        ...

    def chord(self, owner: npt.NDArray[np.intp], t: Array) -> tuple[Array, Array]:
        """Lower and upper end of the chord at ``t``."""
        ...

    def crossings(self, slope: npt.ArrayLike, intercept: Array) -> Array:
        """Abscissae where lines ``y = slope x + intercept``, shape ``(N, K)``, meet the boundary, shape ``(N, C)``.

        The slope is one number, or of shape ``(N, 1)``.
        """
        ...


@dataclass(frozen=True)
class Disc:
    """Discs about the origin with radii of shape ``(N,)``; ``x = radius sin t``."""

    radius: Array

    def breaks(self) -> Array:
        """Return the ends in ``t``, a quarter turn to either side."""
        return np.tile([-0.5 * np.pi, 0.5 * np.pi], (self.radius.size, 1))

    def abscissa(self, owner: npt.NDArray[np.intp], t: Array) -> tuple[Array, Array]:
        """``radius sin t`` and its derivative."""
        radius = self.radius[owner][:, None]
        return radius * np.sin(t), radius * np.cos(t)

    def parameter(self, x: Array) -> Array:
        """Arc sine of the clipped ratio."""
        return np.asarray(np.arcsin(np.clip(x / self.radius[:, None], -1.0, 1.0)))

    def chord(self, owner: npt.NDArray[np.intp], t: Array) -> tuple[Array, Array]:
        """``-radius cos t`` and ``radius cos t``."""
        half = self.radius[owner][:, None] * np.cos(t)
        return -half, half

    def crossings(self, slope: npt.ArrayLike, intercept: Array) -> Array:
        """Both intersections of every line; a line that misses gives its nearest approach twice."""
        slope = np.asarray(slope)
        square = 1.0 + slope * slope
        middle = -slope * intercept / square
        root = np.sqrt(np.maximum(self.radius[:, None] ** 2 * square - intercept**2, 0.0)) / square
        return np.concatenate([middle - root, middle + root], axis=1)


@dataclass(frozen=True)
class Rectangle:
    """Rectangles about the origin: half sides ``(N, 2)``, and their directions, columns ``(..., 2, 2)``."""

    half_sides: Array
    axes: Array

    def _corners(self) -> tuple[Array, Array]:
        one, two = (np.multiply(self.half_sides[:, k : k + 1], self.axes[..., k]) for k in (0, 1))  # each (N, 2)
        corners = np.stack([one + two, one - two, -one - two, -one + two], axis=1)
        return corners[..., 0], corners[..., 1]

    def breaks(self) -> Array:
        """Abscissae of the corners."""
        return np.sort(self._corners()[0], axis=1)

    def abscissa(self, owner: npt.NDArray[np.intp], t: Array) -> tuple[Array, Array]:
        """``t`` itself."""
        return t, np.ones_like(t)

    def parameter(self, x: Array) -> Array:
        """``x`` clipped to the region."""
        ends = self.breaks()
        return np.clip(x, ends[:, :1], ends[:, -1:])

    def chord(self, owner: npt.NDArray[np.intp], t: Array) -> tuple[Array, Array]:
        """Interval of the vertical line at ``t`` within both strips ``|axis . point| <= half side``."""
        low, high = np.full_like(t, -np.inf), np.full_like(t, np.inf)
        axes = np.broadcast_to(self.axes, (len(self.half_sides), 2, 2))
        for k in (0, 1):
            across, along = axes[owner, 0, k][:, None], axes[owner, 1, k][:, None]
            half = self.half_sides[owner, k][:, None]
            crossed = along != 0.0  # a side along the chords does not end them
            ends = [(side - across * t) / np.where(crossed, along, 1.0) for side in (-half, half)]
            low = np.where(crossed, np.maximum(low, np.minimum(*ends)), low)
            high = np.where(crossed, np.minimum(high, np.maximum(*ends)), high)
        return low, np.maximum(low, high)

    def crossings(self, slope: npt.ArrayLike, intercept: Array) -> Array:
        """Abscissae where every line meets the four edges' lines."""
        result = []
        for k in (0, 1):
            across, along = self.axes[..., 0, k, None], self.axes[..., 1, k, None]
            rate = across + along * np.asarray(slope, dtype=float)
            half = self.half_sides[:, [k]]
            with np.errstate(divide="ignore", invalid="ignore"):
                for side in (-half, half):
                    result.append((side - along * intercept) / rate)
        return np.asarray(np.nan_to_num(np.concatenate(result, axis=1), nan=0.0, posinf=0.0, neginf=0.0))


_GRADING = 4.0  # neighbouring panels at a critical point differ by this factor; adaptation halves what needs it
_MILD = 0.02  # shortest scale over the region's width from which even panels resolve everything
_ROWS = 512  # integrals whose breakpoints are found together: they take some megabytes


@dataclass(frozen=True)
class Frame:
    """Normal laws in the frames of their chords: ``x`` normal, ``y`` given ``x`` normal about a line.

    Rows of ``rotation`` are the two axes in the plane; ``spread`` is the standard deviation of ``x``; ``y = slope x``
    on the average, with the deviation ``remainder`` about it, and the uniform part's ``half_width`` along it.
    """

    rotation: Array
    spread: Array
    slope: Array
    remainder: Array
    half_width: Array

    @classmethod
    def along(cls, principal: Principal, second: Array, half_width: npt.ArrayLike) -> Frame:
        """Frame whose second axis is the unit vector ``second``, shape ``(..., 2)``."""
        e1, second = np.broadcast_arrays(principal.direction, second)
        first, e2 = (
            np.stack([sign * v[..., 1], -sign * v[..., 0]], axis=-1) for v, sign in ((second, 1.0), (e1, -1.0))
        )
        p1, p2, s1, s2 = (np.sum(one * two, axis=-1) for one in (first, second) for two in (e1, e2))
        variance = principal.large * p1**2 + principal.small * p2**2
        varies = variance > 0.0
        divisor = np.where(varies, variance, 1.0)
        slope = np.where(varies, (principal.large * p1 * s1 + principal.small * p2 * s2) / divisor, 0.0)
        remainder = np.where(
            varies,
            principal.large * (principal.small / divisor),
            principal.large * s1**2 + principal.small * s2**2,
        )
        half = np.broadcast_to(np.asarray(half_width, dtype=float), variance.shape)
        return cls(np.stack([first, second], axis=-2), np.sqrt(variance), slope, np.sqrt(remainder), half)

    def rows(self, chosen: npt.NDArray[np.intp]) -> Frame:
        """Subset of the rows."""
        return Frame(*(getattr(self, field.name)[chosen] for field in fields(self)))


def planar_probability(
    covariance: Array, means: Array, sizes: Array, *, shape: str, segment: Array | None = None, outside: bool = False
) -> Array:
    """Probability ``(N,)`` that planar deviations lie in, or ``outside`` of, their regions, integrated directly.

    Covariance ``(..., 2, 2)`` of the normal part, means ``(N, 2)``, diameters ``(N, 1)`` of a ``"circle"`` or sides
    ``(N, 2)`` of a ``"rectangle"``, finite and positive; the uniform part runs from ``-segment`` to ``segment``,
    ``(..., 2)``.
    """
    count = len(means)
    principal = Principal.of(np.broadcast_to(covariance, (count, 2, 2)))
    ends = None if segment is None else np.broadcast_to(segment, (count, 2))
    if shape != "circle":
        return _graded(principal, means, sizes, shape, ends, outside)
    chances = disc_chances(principal, means, 0.5 * sizes[:, 0], ends)
    result = chances.outside if outside else chances.inside
    left = np.flatnonzero(np.isnan(result))
    if len(left):
        rest = None if ends is None else ends[left]
        result[left] = _graded(principal.rows(left), means[left], sizes[left], shape, rest, outside)
    return result


def _graded(
    principal: Principal, means: Array, sizes: Array, shape: str, segment: Array | None, outside: bool
) -> Array:
    """Integrate chords on panels that are graded to wherever the integrand may change quickly."""
    count = len(means)
    ends = np.zeros((count, 2)) if segment is None else segment
    length = np.hypot(ends[:, 0], ends[:, 1])
    if shape == "rectangle":
        second = np.tile([0.0, 1.0], (count, 1))  # chords along a side: the region has no kinks then
    else:
        second = np.stack([-principal.direction[:, 1], principal.direction[:, 0]], axis=1)
    heated = length > 0.0
    second[heated] = ends[heated] / length[heated, None]
    frame = Frame.along(principal, second, length)
    centres = np.einsum("nij,nj->ni", frame.rotation, means)
    result = np.empty(count)
    fixed, kinds = frame.spread == 0.0, _ladder_steps(frame, shape, sizes)
    for kind in np.unique(np.where(fixed, -1, kinds)):
        same = np.flatnonzero(np.where(fixed, -1, kinds) == kind)
        for start in range(0, len(same), _ROWS):
            chosen = same[start : start + _ROWS]
            part, half = frame.rows(chosen), 0.5 * sizes[chosen]
            region: Region = Disc(half[:, 0]) if shape == "circle" else Rectangle(half, part.rotation)
            chance = outside_probability if outside else inside_probability
            result[chosen] = _integrate(part, region, centres[chosen], chance, outside, int(kind))
    return result


def _integrate(
    frame: Frame,
    region: Region,
    centres: Array,
    chance: Callable[[Array, Array, Array, Array], Array],
    outside: bool,
    steps: int,
) -> Array:
    """Integrate the chord's probability over ``x``, and add what lies beyond the region's ends."""
    every = np.arange(len(centres))
    ends = region.breaks()[:, [0, -1]]
    low_x, high_x = (region.abscissa(every, ends[:, [k]])[0][:, 0] for k in (0, 1))

    def chord_probability(owner: npt.NDArray[np.intp], t: Array) -> tuple[Array, Array, Array]:
        x, rate = region.abscissa(owner, t)
        low, high = region.chord(owner, t)
        offset = x - centres[owner, 0][:, None]
        middle = centres[owner, 1][:, None] + frame.slope[owner][:, None] * offset
        widths = (frame.remainder[owner][:, None], frame.half_width[owner][:, None])
        return offset, rate, chance(low - middle, high - middle, *widths)

    if steps < 0:
        # x does not vary: a single chord, or none.
        at = region.parameter(centres[:, :1])
        result = chord_probability(every, at)[2][:, 0]
        missed = (centres[:, 0] < low_x) | (centres[:, 0] > high_x)
        return np.where(missed, 1.0 if outside else 0.0, result)

    def integrand(owner: npt.NDArray[np.intp], t: Array) -> Array:
        offset, rate, probability = chord_probability(owner, t)
        spread = frame.spread[owner][:, None]
        weight = np.exp(-0.5 * (offset / spread) ** 2) / (_ROOT_2PI * spread)
        return np.asarray(weight * rate * probability)

    result = integrate_panels(integrand, _breakpoints(frame, region, centres, steps))
    if outside:
        nothing = np.zeros(len(centres))
        result = result + outside_probability(low_x - centres[:, 0], high_x - centres[:, 0], frame.spread, nothing)
    return result


def _ladder_steps(frame: Frame, shape: str, sizes: Array) -> npt.NDArray[np.intp]:
    """Return the number of steps of the graded panels of each row; 0 where even panels suffice."""
    scales = np.where(
        frame.remainder > 0.0,
        np.minimum(frame.spread, frame.remainder / np.maximum(np.abs(frame.slope), 1.0)),
        frame.spread,
    )
    if shape == "circle":
        width = sizes[:, 0]
    else:
        width = np.sum(np.abs(frame.rotation[:, 0]) * sizes, axis=1)
    finest = 0.25 * scales / np.maximum(width, np.finfo(float).tiny)
    steps = np.clip(np.ceil(np.log(1.0 / np.maximum(finest, 1e-18)) / np.log(_GRADING)), 1, 30).astype(int)
    return np.where((finest > _MILD) & (frame.remainder > 0.0), 0, steps)


def _breakpoints(frame: Frame, region: Region, centres: Array, steps: int) -> Array:
    """Panels graded geometrically towards every point where the integrand may change quickly.

    These are the mean, the places where the middle and the edges of the strip of ``y`` cross the boundary, the
    region's ends and kinks, and the likeliest points of the integrand found on the panels so far. Without steps
    nothing is quick, and eight even panels do.
    """
    breaks = region.breaks()
    span = (breaks[:, -1] - breaks[:, 0])[:, None]
    if steps == 0:
        even = breaks[:, :1] + span * np.linspace(0.0, 1.0, 9)
        return np.sort(np.concatenate([breaks, even], axis=1), axis=1)
    ladder = _GRADING ** -np.arange(steps + 1.0)
    ladder = np.concatenate([-ladder, [0.0], ladder[::-1]])

    def graded(points: Array) -> Array:
        spread_out = points[:, :, None] + span[:, :, None] * ladder
        return np.clip(spread_out.reshape(len(points), -1), breaks[:, :1], breaks[:, -1:])

    slope = frame.slope[:, None]
    middle = centres[:, 1:] - slope * centres[:, :1]
    strip = frame.half_width[:, None] * ([0.0, -1.0, 1.0] if np.any(frame.half_width > 0.0) else [0.0])
    crossings = region.crossings(slope, middle + strip)
    critical = region.parameter(np.concatenate([centres[:, :1], crossings], axis=1))
    points = np.sort(
        np.concatenate([breaks, critical, graded(np.concatenate([breaks, critical], axis=1))], axis=1), axis=1
    )
    likeliest = _likeliest(frame, region, centres, points)
    return np.sort(np.concatenate([points, graded(likeliest)], axis=1), axis=1)


def _likeliest(frame: Frame, region: Region, centres: Array, points: Array) -> Array:
    """Up to three local maxima per integral of the normal density within reach of the inside and of the outside.

    Far from the mean the integrand is a narrow peak about the nearest point of the region, or of its complement, in
    units of the standard deviations; its place is where the exponent is least, and three zooms find it to a sixteenth
    cubed of a panel.
    """
    spread, slope, remainder, half_width = (
        v[:, None] for v in (frame.spread, frame.slope, frame.remainder, frame.half_width)
    )

    def exponents(t: Array) -> tuple[Array, Array]:
        every = np.arange(len(t))
        x, _ = region.abscissa(every, t.reshape(len(t), -1))
        low, high = region.chord(every, t.reshape(len(t), -1))
        offset = x - centres[:, :1]
        y = centres[:, 1:] + slope * offset
        into = np.maximum(np.maximum(low - y, y - high) - half_width, 0.0)
        out = np.maximum(np.minimum(high - y, y - low) - half_width, 0.0)
        along = (offset / spread) ** 2
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            pair = tuple(along + np.where(gap > 0.0, (gap / remainder) ** 2, 0.0) for gap in (into, out))
        return pair[0].reshape(t.shape), pair[1].reshape(t.shape)

    found = []
    coarse = exponents(points)
    for which in (0, 1):
        value = coarse[which]
        padded = np.pad(value, ((0, 0), (1, 1)), constant_values=np.inf)
        local = (value <= padded[:, :-2]) & (value <= padded[:, 2:])
        ranked = np.argsort(np.where(local, value, np.inf), axis=1)[:, :3]
        left = np.take_along_axis(points, np.maximum(ranked - 1, 0), axis=1)
        right = np.take_along_axis(points, np.minimum(ranked + 1, points.shape[1] - 1), axis=1)
        for _ in range(3):
            grid = left[..., None] + (right - left)[..., None] * np.linspace(0.0, 1.0, 17)
            best = np.argmin(exponents(grid)[which], axis=2)[..., None]
            left, right = (np.take_along_axis(grid, np.clip(best + k, 0, 16), axis=2)[..., 0] for k in (-1, 1))
        found.append(0.5 * (left + right))
    return np.concatenate(found, axis=1)


_STEPS = 80  # halvings alone would take fifty
_CLOSE = 1e-14  # relative: less than the rounding of the failing probability moves it


def disc_clearances(covariance: Array, means: Array, log_failing: float, segments: Array | None = None) -> Array:
    """Diameters ``(N,)`` at which discs about the origin have a failing probability; NaN where not applicable.

    Arguments as for `disc_chances`; ``log_failing``, the logarithm of that probability, is negative and finite.
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
