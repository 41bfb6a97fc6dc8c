"""Probability that a planar deviation lies in a disc or a rectangle: normal, plus uniform along one segment.

There are two integrators. A disc's integral runs along its edge where so many angles as `ANGLES` holds resolve it; all
else is summed over chords.

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

**Chords** along the segment, or else along the longer principal axis (of a rectangle: along a side). Given the
coordinate ``x`` across them the coordinate along them is normal plus uniform, whose interval probability is closed form
(`kernels`). In standard deviations of ``x`` the integral runs over the window ``z = c + w sin t`` of the region where
the density is not zero; ``sin t`` takes the root out of a chord that shrinks to nothing at the window's end. With 64
nodes chords of a normal part that is narrow one way are exact to rounding, as long as they do not change by many wide
deviations; else panels are halved until they are. Inside and outside are integrals of their own, neither is one minus
the other, so that both are relatively accurate.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import product

import numpy as np
import numpy.typing as npt
from scipy.special import ndtr

from thermal_robot.arrays import Array
from thermal_robot.assembly.probability.kernels import inside_probability, integrate_panels, outside_probability
from thermal_robot.compiling import in_pieces

ANGLES = np.array([32, 48, 64, 96, 128, 192, 256, 384, 512, 768, 1024])
"""Numbers of angles that are used; multiples of four."""
PER_DEVIATION, BESIDES = 8.0, 16.0
# Angles per standard deviation, the shorter one, from the disc's farther edge to the mean, and besides: measured
# against the chords' integral, the absolute error is then below 2e-15 and that of a small 1 - P below 1e-11 of it.
MOST = 256  # angles beside which chords are worth their while
NEAR = 0.01  # squared distances (halved) of a node from the mean below which (1 - exp(-h)) / h is taken by its series
SERIES = (-1.0 / 720.0, 1.0 / 120.0, -1.0 / 24.0, 1.0 / 6.0, -0.5, 1.0)
FRACTION = 0.05  # a failing probability above this is one minus the other
_CELLS = 1 << 17  # numbers of an array that stays in cache, eight bytes each
_TOLD, _TOLD_BY_CHORDS = 1e-5, 2e-6
# Least 1 - P that an edge with a segment gives as one minus P to ten digits, and that 64 chords give.
_SHORT = 1.0  # half segments in standard deviations up to which a mean over it is a sum of so many nodes
_UNITS, _SHARES = np.polynomial.legendre.leggauss(16)
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(64)
_SURE = 9.0  # wide deviations from the mean to the edge beyond which less than 3e-18 lies outside
_CHANGE = 12.0  # wide standard deviations by which a chord may change for 64 nodes to follow
_REACH, _FAR = 8.5, 38.0
# Standard deviations either side of the mean: what lies beyond is below 2e-17, and zero in double precision.
_STRIP = np.array([-38.0, -12.0, -4.0, -1.0, 0.0, 1.0, 4.0, 12.0, 38.0])
# Deviations along a chord, from its mean, between which its probability is smooth enough for a panel.
_EVEN = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 13)
_ROWS = 512  # integrals whose panels are summed together: they take some megabytes
_ROOT_2PI = np.sqrt(2.0 * np.pi)

Mask = npt.NDArray[np.bool_]
Rows = npt.NDArray[np.intp]


def _difference_of_products(a: Array, b: Array, c: Array, d: Array) -> Array:
    """Return ``a b - c d`` correct to rounding (Dekker's exact products), also where it nearly cancels."""

    def product(p: Array, q: Array) -> tuple[Array, Array]:
        head, p1, q1 = p * q, p * 134217729.0, q * 134217729.0
        ph, qh = p1 - (p1 - p), q1 - (q1 - q)
        pl, ql = p - ph, q - qh
        return head, ((ph * qh - head) + ph * ql + pl * qh) + pl * ql

    (one, one_low), (two, two_low) = product(a, b), product(c, d)
    return (one - two) + (one_low - two_low)


@dataclass(frozen=True)
class Principal:
    """Eigendecomposition of N 2x2 covariances: variances ``large >= small >= 0``, unit vectors (N, 2) of the first."""

    large: Array
    small: Array
    direction: Array

    @classmethod
    def of(cls, covariance: Array) -> Principal:
        """Decompose ``(N, 2, 2)``; the smaller eigenvalue, determinant over the larger, is relatively accurate."""
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
        (x, y), (u, v) = vectors.T, self.direction.T
        return np.stack([x * u + y * v, y * u - x * v], axis=1)

    def rows(self, chosen: Rows) -> Principal:
        """Select cases by row number."""
        return Principal(self.large[chosen], self.small[chosen], self.direction[chosen])


def planar_probability(
    covariance: Array, means: Array, sizes: Array, *, shape: str, segment: Array | None = None, outside: bool = False
) -> Array:
    """Probability ``(N,)`` that planar deviations lie in, or ``outside`` of, their regions, integrated directly.

    Covariance ``(..., 2, 2)`` of the normal part, means ``(N, 2)``, diameters ``(N, 1)`` of a ``"circle"`` or sides
    ``(N, 2)`` of a ``"rectangle"``, finite and positive; the uniform part runs from ``-segment`` to ``segment``,
    ``(..., 2)``. Large batches run in threads.
    """
    count = len(means)
    matrices = np.broadcast_to(covariance, (count, 2, 2))
    ends = np.zeros((count, 2)) if segment is None else np.broadcast_to(segment, (count, 2))

    def piece(start: int, stop: int, result: Array) -> None:
        principal, found = Principal.of(matrices[start:stop]), result[start:stop]
        off = np.hypot(*means[start:stop].T) + np.hypot(*ends[start:stop].T)
        sure = 0.5 * np.min(sizes[start:stop], axis=1) - off > _SURE * np.sqrt(principal.large)
        found[:] = np.where(sure & (not outside), 1.0, np.nan)
        left = np.flatnonzero(np.isnan(found))
        if shape == "circle":
            case = (principal.rows(left), means[start:stop][left], 0.5 * sizes[start:stop][left, 0])
            found[left] = disc_chances(*case, ends[start:stop][left])[int(outside)]
            left = left[np.isnan(found[left])]
        for first in range(0, len(left), _ROWS):
            rows = left[first : first + _ROWS]
            middle, size, end = (array[start:stop][rows] for array in (means, sizes, ends))
            found[rows] = by_chords(principal.rows(rows), middle, size, end, shape, outside)
        np.clip(found, 0.0, 1.0, out=found)  # sums on the edge are off by rounding

    found = np.empty(count)
    in_pieces(piece, (), count, (found,))
    return found


def disc_chances(principal: Principal, means: Array, radii: Array, segments: Array) -> Array:
    """Probabilities ``(2, N)`` that normal plus uniform deviations lie in, and out of, discs about the origin.

    Means and half segments ``(N, 2)``. Inside to rounding, outside to ten digits; NaN where that is not reached.
    A segment of at most a standard deviation is averaged over sixteen Gauss-Legendre nodes.
    """
    result = np.full((2, len(means)), np.nan)
    deviations = np.sqrt(np.stack([principal.large, principal.small], axis=1))
    centre, half = principal.turned(means), principal.turned(segments)
    heated = np.any(half != 0.0, axis=1)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        axes = radii[:, None] / deviations
        at, ends = (np.where(v != 0.0, v / deviations, 0.0) for v in (centre, half))
        far = heated & (np.hypot(*ends.T) > _SHORT)
        # the farther edge and the mean in the smaller deviation; a segment smooths what is far from its middle
        distance = np.where(far, 0.0, np.hypot(centre[:, 0] / deviations[:, 1], at[:, 1]))
        needed = PER_DEVIATION * (axes[:, 1] + distance) + BESIDES
    plain, central = ~heated, ~heated & ~np.any(at, axis=1)
    edge = np.isfinite(needed) & (far | (needed <= MOST)) & (principal.large > 0.0)
    which = np.where(edge & (far | plain), np.searchsorted(ANGLES, needed), len(ANGLES))
    for k in np.unique(which[which < len(ANGLES)]):
        same, count = which == k, int(ANGLES[k])
        for middle, every in ((True, same & central), (False, same & plain & ~central)):
            edges = partial(_disc_by_edge, axes, at, count, middle)
            _fill(result, edges, every, count // (4 if middle else 1))
        _fill(result, partial(_segment_by_edge, axes, at, ends, count), same & far, count)
    result[1, far & (result[1] < _TOLD)] = np.nan
    narrow = plain & ~edge & (principal.large > 0.0)
    _fill(result, lambda rows: _disc_by_chords(deviations[rows], centre[rows], radii[rows]), narrow, 64)
    result[1, narrow & (result[1] < _TOLD_BY_CHORDS)] = np.nan
    short = np.flatnonzero(heated & ~far)
    for start in range(0, len(short), _ROWS):
        rows = short[start : start + _ROWS]
        shifted = (means[rows][:, None] + _UNITS[:, None] * segments[rows][:, None]).reshape(-1, 2)
        every = np.repeat(rows, len(_UNITS))
        parts = disc_chances(principal.rows(every), shifted, radii[every], np.zeros_like(shifted))
        result[:, rows] = 0.5 * np.reshape(parts, (2, len(rows), -1)) @ _SHARES
    return result


def _fill(result: Array, chance: Callable[[Rows], tuple[Array, Array]], chosen: Mask, cells: int) -> None:
    """Write ``chance(rows)`` to the ``chosen`` columns of ``result`` ``(2, N)``, in chunks that fit the cache."""
    rows = np.flatnonzero(chosen)
    step = max(_CELLS // cells, 1)
    for start in range(0, len(rows), step):
        part = rows[start : start + step]
        result[:, part] = chance(part)


def _disc_by_edge(axes: Array, centre: Array, count: int, central: bool, rows: Rows) -> tuple[Array, Array]:
    """Probabilities of normal deviations in and out of discs about the origin: trapezoidal rule along the edge.

    ``axes`` and ``centre`` ``(N, 2)``: radius and mean over standard deviation along both principal axes; where the
    means are zero (``central``) a quarter of the ``count`` angles suffices by symmetry.
    """
    axes, centre = axes[rows], centre[rows]
    angle = (2.0 * np.pi / count) * (np.arange(count // 4 if central else count) + 0.5)
    circle = np.stack([np.cos(angle), np.sin(angle)])
    inside, outer = _edge_sums(axes, centre, circle, central)
    outside = 1.0 - inside
    small = np.flatnonzero(outside < FRACTION)
    outside[small] = outer[small] + _poles(axes[small], centre[small], count)
    return inside, outside


def _edge_sums(axes: Array, centre: Array, circle: Array, central: bool) -> tuple[Array, Array]:
    """Trapezoidal sums ``(N,)`` of discs' probabilities inside, and outside before `_poles`, along their edges.

    Means of w (1 - exp(-h)) / 2h and of w exp(-h) / 2h, see the module, over the angles of ``circle`` ``(2, n)``.
    """
    area, count = axes[:, 0] * axes[:, 1], circle.shape[1]
    half, second = np.multiply.outer(axes[:, 0], circle[0]), np.multiply.outer(axes[:, 1], circle[1])
    weight: Array = area[:, None]
    if not central:
        half -= centre[:, :1]
        second -= centre[:, 1:]
        weight = weight - (centre * axes[:, ::-1]) @ circle
    half *= half
    second *= second
    half += second
    half *= 0.5  # h
    decay = np.exp(np.negative(half, out=second), out=second)
    close = np.min(half, axis=1) < NEAR
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.divide(weight, half, out=None if np.any(close) else half)
    outer = 0.5 * np.einsum("nk,nk->n", share, decay) / count
    inside = 0.5 * np.einsum("nk,nk->n", share, np.subtract(1.0, decay, out=decay)) / count
    if np.any(close):
        near = half[close]
        with np.errstate(divide="ignore", invalid="ignore"):
            mean = np.where(near < NEAR, np.polyval(SERIES, near), (1.0 - np.exp(-near)) / near)
        inside[close] = 0.5 * np.mean(np.broadcast_to(weight, half.shape)[close] * mean, axis=1)
    return inside, outer


def _poles(axes: Array, centre: Array, count: int) -> Array:
    """Pole corrections (N,) of the trapezoidal mean of ``w exp(-h) / 2h``, summed over both poles in ``exp(it)``.

    Over the ``n`` roots of -1 the mean of ``z / (z - c)`` is ``1 / (1 + c**n)``.
    """
    lead, low = 0.5 * (axes[:, 0] + axes[:, 1]), 0.5 * (axes[:, 0] - axes[:, 1])
    middle = centre[:, 0] + 1j * centre[:, 1]
    root = np.sqrt(middle * middle - 4.0 * lead * low)
    root = np.where((np.conj(middle) * root).real >= 0.0, root, -root)
    larger = 0.5 * (middle + root)
    with np.errstate(divide="ignore", invalid="ignore"):
        powers = [pole**count for pole in (larger / lead, np.where(larger == 0.0, 0.0, low / larger))]
        return np.asarray(sum((power / (1.0 + power)).real for power in powers))


def _segment_by_edge(axes: Array, centre: Array, segment: Array, count: int, rows: Rows) -> tuple[Array, Array]:
    """Probabilities in and out of discs, normal with the mean uniform on a segment: trapezoidal rule along the edge.

    Arguments as for `_disc_by_edge`; ``segment`` ``(N, 2)`` is the half segment over the standard deviations, longer
    than one: then the angles that a centred disc needs are enough. The absolute error is rounding.
    """
    axes, centre, segment = axes[rows], centre[rows], segment[rows]
    angle = (2.0 * np.pi / count) * (np.arange(count) + 0.5)
    circle = np.stack([np.cos(angle), np.sin(angle)])
    length = np.hypot(*segment.T)[:, None]
    along = segment / length
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    u, v = ((e * axes) @ circle - np.sum(e * centre, axis=1)[:, None] for e in (along, across))
    step = (across * axes) @ np.stack([-circle[1], circle[0]])
    # G is odd: 1/2 less the tail beyond |u|, which vanishes without rounding far out.
    near, far = length - np.abs(u), -length - np.abs(u)
    tail = near * ndtr(near) - far * ndtr(far)
    tail += (np.exp(-0.5 * near * near) - np.exp(-0.5 * far * far)) / _ROOT_2PI
    level = np.copysign(0.5 - tail / (2.0 * length), u)
    inside = (_ROOT_2PI / count) * np.einsum("nk,nk,nk->n", np.exp(-0.5 * v * v), level, step)
    return inside, 1.0 - inside


@dataclass(frozen=True)
class _Window:
    """Integration interval of ``z``, ``x`` from its mean in its standard deviations, with ``z = centre + half sin t``.

    It ends ``reach`` from the mean or at the region's ends. ``gaps``: distances ``(2, N)`` in ``x`` to those ends, zero
    where the region ends it; ``step``: ``half`` in the unit of ``x``.
    """

    centre: Array
    half: Array
    gaps: Array
    step: Array

    @classmethod
    def of(cls, mean: Array, spread: Array, extent: Array, reach: float) -> _Window:
        room = np.stack([extent + mean, extent - mean])  # below and above the mean
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            limits = np.fmin(room / spread, reach)
        low, high = -limits[0], limits[1]
        gaps = np.where(limits < reach, 0.0, room - reach * spread)
        half = np.maximum(0.5 * (high - low), 0.0)
        return cls(np.where(half > 0.0, 0.5 * (high + low), 0.0), half, np.clip(gaps, 0.0, 2.0 * extent), spread * half)

    def at(self, rows: Rows | slice, t: Array) -> tuple[Array, Array, Array]:
        """Deviations ``z`` at ``t`` ``(N, K)``, and distances from the region's lower and upper end."""
        centre, half, step = (v[rows][:, None] for v in (self.centre, self.half, self.step))
        low, high = (gap[rows][:, None] for gap in self.gaps)
        quarter = 0.25 * np.pi
        below, above = (2.0 * step * np.sin(quarter + side * 0.5 * t) ** 2 for side in (1.0, -1.0))
        return centre + half * np.sin(t), low + below, high + above

    def panels(self, breaks: Array) -> Array:
        """Ascending ends in ``t`` of panels between ``breaks`` in ``z`` ``(N, K)`` and even ones."""
        with np.errstate(divide="ignore", invalid="ignore"):
            sine = (breaks - self.centre[:, None]) / self.half[:, None]
        t = np.arcsin(np.clip(np.nan_to_num(sine), -1.0, 1.0))
        return np.sort(np.concatenate([np.tile(_EVEN, (len(t), 1)), t], axis=1), axis=1)


def _disc_by_chords(deviations: Array, centre: Array, radii: Array) -> tuple[Array, Array]:
    """Probabilities of normal deviations in and out of discs about the origin: Gauss-Legendre sum over 64 chords.

    ``deviations`` and ``centre`` ``(N, 2)``: standard deviation, the second may be zero, and mean along the principal
    axes. NaN where chords change by more than `_CHANGE` wide deviations. The absolute error is rounding.
    """
    (wide, narrow), (along, across) = deviations.T, centre.T
    window = _Window.of(across, narrow, radii, _REACH)
    ends = np.sqrt(window.gaps * (2.0 * radii - window.gaps))
    inside_top = (window.gaps < radii).all(axis=0)
    top = np.where(inside_top, radii, np.max(ends, axis=0))
    resolved = top - np.min(ends, axis=0) <= _CHANGE * wide
    angle = 0.5 * np.pi * _NODES
    z, below, above = window.at(slice(None), np.broadcast_to(angle, (len(radii), 64)))
    weight = np.exp(-0.5 * z * z) * (window.half[:, None] * (0.5 * np.pi / _ROOT_2PI * _WEIGHTS * np.cos(angle)))
    chord = np.sqrt(below * above)
    missed = sum(ndtr((side * along[:, None] - chord) / wide[:, None]) for side in (-1.0, 1.0))
    missed = np.einsum("nk,nk->n", weight, missed)
    with np.errstate(divide="ignore", invalid="ignore"):
        beyond = ndtr((across - radii) / narrow) + ndtr((-across - radii) / narrow)
    inside = np.sum(weight, axis=1) - missed
    return np.where(resolved, inside, np.nan), np.where(resolved, missed + beyond, np.nan)


@dataclass(frozen=True)
class _Frame:
    """Bivariate normal laws in axes across (``x``) and along (``y``) the chords: law of x, and that of y given x.

    Rows of ``rotation`` are the two axes in the plane; ``spread`` is the standard deviation of ``x``; ``y = slope x``
    on the average, with the deviation ``remainder`` about it.
    """

    rotation: Array
    spread: Array
    slope: Array
    remainder: Array

    @classmethod
    def along(cls, principal: Principal, second: Array) -> _Frame:
        """Frame whose second axis is the unit vector ``second``, shape ``(N, 2)``."""
        turn = np.array([[0.0, -1.0], [1.0, 0.0]])
        first, e2 = second @ turn, principal.direction @ turn.T
        p1, p2, s1, s2 = (np.sum(one * two, axis=1) for one in (first, second) for two in (principal.direction, e2))
        large, small = principal.large, principal.small
        variance = large * p1**2 + small * p2**2
        varies = variance > 0.0
        divisor = np.where(varies, variance, 1.0)
        slope = np.where(varies, (large * p1 * s1 + small * p2 * s2) / divisor, 0.0)
        remainder = np.where(varies, large * (small / divisor), large * s1**2 + small * s2**2)
        return cls(np.stack([first, second], axis=1), np.sqrt(variance), slope, np.sqrt(remainder))


@dataclass(frozen=True)
class _Disc:
    """Regions to integrate over: discs about the origin, radii ``extent`` ``(N,)``."""

    extent: Array

    def chord(self, owner: Rows, below: Array, above: Array) -> tuple[Array, Array]:
        """Return both ends in ``y`` of chords at distances ``below`` and ``above`` from the disc's ends in ``x``."""
        high = np.sqrt(below * above)
        return -high, high

    def crossings(self, slope: Array, intercept: Array) -> Array:
        """Abscissae where lines ``(N, K)`` meet the edge; a line that misses gives its nearest approach."""
        square = 1.0 + slope * slope
        middle = -slope * intercept / square
        root = np.sqrt(np.maximum(self.extent[:, None] ** 2 * square - intercept**2, 0.0)) / square
        return np.concatenate([middle - root, middle + root], axis=1)


@dataclass(frozen=True)
class _Rectangle:
    """Rectangles about the origin, half sides ``(N, 2)``; their directions in the frame are rows, ``(N, 2, 2)``."""

    half: Array
    sides: Array

    @property
    def extent(self) -> Array:
        """Half width along the frame's first axis."""
        return np.asarray(np.sum(np.abs(self.sides[:, :, 0]) * self.half, axis=1))

    def chord(self, owner: Rows, below: Array, above: Array) -> tuple[Array, Array]:
        """Return both ends in ``y`` of chords at distances ``below``, ``above`` from the rectangle's ends in ``x``."""
        low, high = np.full_like(below, -np.inf), np.full_like(below, np.inf)
        for k in (0, 1):
            across, along = self.sides[owner, k].T[..., None]
            crossed = along != 0.0  # a side along the chords does not end them
            middle, step = across * 0.5 * (above - below), self.half[owner, k, None]
            ends = [(middle + side * step) / np.where(crossed, along, 1.0) for side in (-1.0, 1.0)]
            low = np.where(crossed, np.maximum(low, np.minimum(*ends)), low)
            high = np.where(crossed, np.minimum(high, np.maximum(*ends)), high)
        return low, np.maximum(low, high)

    def crossings(self, slope: Array, intercept: Array) -> Array:
        """Abscissae of the corners, and where lines ``(N, K)`` meet the four sides' lines."""
        one, two = (self.sides[:, [k], 0] * self.half[:, [k]] for k in (0, 1))
        found = [one + two, one - two, -one - two, two - one]
        for k, sign in product((0, 1), (-1.0, 1.0)):
            rate = self.sides[:, k, :1] + self.sides[:, k, 1:] * slope
            found.append((sign * self.half[:, [k]] - self.sides[:, k, 1:] * intercept) / rate)
        return np.concatenate(found, axis=1)


def by_chords(principal: Principal, means: Array, sizes: Array, segments: Array, shape: str, outside: bool) -> Array:
    """Probabilities ``(N,)`` in, or ``outside``, regions: adaptive Gauss-Legendre integral of chords' probabilities.

    Panels end where a chord's probability may change quickly. Arguments as for `planar_probability`.
    """
    length, half = np.hypot(*segments.T), 0.5 * sizes
    second = principal.direction if shape == "circle" else np.tile([0.0, 1.0], (len(means), 1))
    second = np.where(length[:, None] > 0.0, segments / np.where(length > 0.0, length, 1.0)[:, None], second)
    frame = _Frame.along(principal, second)
    across, along = np.einsum("nij,nj->in", frame.rotation, means)
    if shape == "circle":
        region: _Disc | _Rectangle = _Disc(half[:, 0])
    else:
        region = _Rectangle(half, np.swapaxes(frame.rotation, 1, 2))
    window = _Window.of(across, frame.spread, region.extent, _FAR)
    chance = outside_probability if outside else inside_probability

    def chord(owner: Rows, t: Array) -> tuple[Array, Array]:
        z, below, above = window.at(owner, t)
        low, high = region.chord(owner, below, above)
        middle = along[owner, None] + (frame.slope * frame.spread)[owner, None] * z
        return z, chance(low - middle, high - middle, frame.remainder[owner, None], length[owner, None])

    def integrand(owner: Rows, t: Array) -> Array:
        z, probability = chord(owner, t)
        density = np.exp(-0.5 * z * z) / _ROOT_2PI
        return np.asarray(density * (window.half[owner, None] * np.cos(t)) * probability)

    strip = length[:, None, None] * ([[-1.0], [0.0], [1.0]] if np.any(length) else [[0.0]])
    strip = (strip + frame.remainder[:, None, None] * _STRIP).reshape(len(means), -1)
    with np.errstate(divide="ignore", invalid="ignore"):
        breaks = region.crossings(frame.slope[:, None], (along - frame.slope * across)[:, None] + strip)
        breaks = (breaks - across[:, None]) / frame.spread[:, None]
    result = integrate_panels(integrand, window.panels(breaks))
    point = np.flatnonzero(frame.spread == 0.0)  # a single chord, or none
    there = np.abs(across[point]) <= region.extent[point]
    result[point] = np.where(there, chord(point, np.zeros((len(point), 1)))[1][:, 0], 0.0)
    if outside:
        ends = -region.extent - across, region.extent - across
        result += outside_probability(*ends, frame.spread, np.zeros_like(across))
    return result
