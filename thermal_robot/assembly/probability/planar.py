"""Probability that a planar deviation lies in a disc or a rectangle: normal, plus uniform along one segment.

**Edge** (Green's theorem): discs without a uniform part whose normal part is not too narrow. In the principal axes of
the normal part, each in its standard deviation, the disc's edge about the mean is ``z(t) = (a1 cos t - b1, a2 sin t -
b2)`` with ``a = R / sigma`` and ``b = mean / sigma``. The field

    F(z) = z (1 - exp(-|z|**2 / 2)) / (2 pi |z|**2)        div F = exp(-|z|**2 / 2) / (2 pi)

is entire, so that a trapezoidal sum over ``n`` even angles converges faster than any power: with ``h = |z|**2 / 2`` and
``w = z1 dz2/dt - z2 dz1/dt = a1 a2 - b1 a2 cos t - b2 a1 sin t``

    P = mean of w (1 - exp(-h)) / (2 h)        1 - P = mean of w exp(-h) / (2 h), for a mean within the disc.

The second is a sum of positive terms and keeps its digits however small it is; its poles (``z1 + i z2 = 0``, two roots
in ``exp(it)``) change the sum by a known amount, which is taken out.

**Chords**: everything else. The plane is turned so that the segment, or else the wider principal axis, is the second
axis. Given the first coordinate ``x`` the second is then normal plus uniform on a line, whose interval probability is
closed form (`kernels`), and one integral over ``x`` remains. It runs over the part of the region within reach of the
mean, in panels that end where the middle and the edges of the law's strip cross the boundary, and that halve
themselves. Inside and outside are integrals of their own, so that both are relatively accurate.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from thermal_robot.arrays import Array
from thermal_robot.assembly.probability.kernels import inside_probability, integrate_panels, outside_probability

Rows = npt.NDArray[np.intp]

_ANGLES = np.array([32, 48, 64, 96, 128, 192, 256, 384, 512, 768, 1024])
# Numbers of angles that are used; beyond them chords are cheaper.
_PER_DEVIATION, _BESIDES = 8.0, 16.0
# Angles per standard deviation, the shorter one, from the disc's farther edge to the mean, and besides: the absolute
# error is then below 2e-15 and that of a small 1 - P below 1e-11 of it.
_SMALL = 0.05  # a failing probability above this is one minus the other
_CELLS = 1 << 17  # numbers of an array that stays in cache, eight bytes each
_REACH = 39.0  # standard deviations beyond which the normal density is zero in double precision
_LEVELS = np.array([-20.0, -9.0, -4.0, 0.0, 4.0, 9.0, 20.0])  # standard deviations from the mean at which panels end
_ROOT_2PI = np.sqrt(2.0 * np.pi)


@dataclass(frozen=True)
class Principal:
    """Principal axes of 2x2 covariances: variances ``large >= small >= 0``, and the unit vector of the first."""

    large: Array
    small: Array
    direction: Array

    @classmethod
    def of(cls, covariance: Array) -> Principal:
        """Decompose; the smaller variance comes from the determinant, which keeps its digits next to a large one."""
        size = np.max(np.abs(covariance), axis=(-2, -1))
        nothing = size == 0.0
        # a power of two: to divide by it rounds nothing
        scale = np.where(nothing, 1.0, np.ldexp(1.0, np.frexp(size)[1]))
        a, b, c = (covariance[..., i, j] / scale for i, j in ((0, 0), (0, 1), (1, 1)))
        large = 0.5 * (a + c + np.hypot(a - c, 2.0 * b))
        (one, one_low), (two, two_low) = _product(a, c), _product(b, b)
        determinant = np.maximum((one - two) + (one_low - two_low), 0.0)
        angle = 0.5 * np.arctan2(2.0 * b, a - c)
        direction = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        return cls(large * scale, determinant / np.where(nothing, 1.0, large) * scale, direction)

    def turned(self, vectors: Array) -> Array:
        """Coordinates of vectors ``(N, 2)`` along the axes, the one with the larger variance first."""
        return np.stack([np.sum(vectors * self.direction, axis=1), np.sum(vectors * across(self.direction), axis=1)], 1)


def across(vectors: Array) -> Array:
    """Vectors ``(..., 2)`` turned left by a right angle."""
    return np.stack([-vectors[..., 1], vectors[..., 0]], axis=-1)


def _product(p: Array, q: Array) -> tuple[Array, Array]:
    """Return a product and what it rounded away (Dekker)."""
    head, p1, q1 = p * q, p * 134217729.0, q * 134217729.0
    ph, qh = p1 - (p1 - p), q1 - (q1 - q)
    pl, ql = p - ph, q - qh
    return head, ((ph * qh - head) + ph * ql + pl * qh) + pl * ql


def planar_probability(
    covariance: Array, means: Array, sizes: Array, *, shape: str, segment: Array | None = None, outside: bool = False
) -> Array:
    """``(N,)`` probability of planar deviations to lie in, or ``outside`` of, their regions, integrated directly.

    Covariance ``(..., 2, 2)`` of the normal part, means ``(N, 2)``, diameters ``(N, 1)`` of a ``"circle"`` or sides
    ``(N, 2)`` of a ``"rectangle"``, finite and positive; the uniform part runs from ``-segment`` to ``segment``,
    ``(..., 2)``.
    """
    count = len(means)
    matrices = np.broadcast_to(covariance, (count, 2, 2))
    ends = np.zeros((count, 2)) if segment is None else np.broadcast_to(segment, (count, 2))
    principal, half, result = Principal.of(matrices), 0.5 * sizes, np.full(count, np.nan)
    if shape == "circle":
        deviations = np.sqrt(np.stack([principal.large, principal.small], axis=1))
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            axes, centre = half / deviations, principal.turned(means) / deviations
            distance = np.hypot(centre[:, 0] * deviations[:, 0] / deviations[:, 1], centre[:, 1])
            needed = _PER_DEVIATION * (axes[:, 1] + distance) + _BESIDES
        needed[np.any(ends != 0.0, axis=1) | ~np.isfinite(needed)] = np.inf
        which = np.searchsorted(_ANGLES, needed)
        for number in np.unique(which[which < len(_ANGLES)]):
            rows, angles = np.flatnonzero(which == number), int(_ANGLES[number])
            for part in np.array_split(rows, -(-len(rows) * angles // _CELLS)):
                result[part] = disc_by_edge(axes[part], centre[part], angles)[int(outside)]
    left = np.isnan(result)
    if np.any(left):
        result[left] = by_chords(matrices[left], means[left], half[left], shape, ends[left], outside)
    return result


def disc_by_edge(axes: Array, centre: Array, count: int) -> tuple[Array, Array]:
    """Chances in and out of discs about the origin by ``count`` angles on the edge.

    ``axes`` and ``centre`` ``(N, 2)``: radius and mean over standard deviation along both principal axes. ``1 - P`` is
    relatively accurate for a mean within the disc.
    """
    angle = (2.0 * np.pi / count) * (np.arange(count) + 0.5)
    circle = np.stack([np.cos(angle), np.sin(angle)])
    first, second = (axes[:, k : k + 1] * circle[k] - centre[:, k : k + 1] for k in (0, 1))
    half = 0.5 * (first * first + second * second)
    weight = (axes[:, :1] * axes[:, 1:]) - (centre * axes[:, ::-1]) @ circle
    with np.errstate(divide="ignore", invalid="ignore"):
        share = 0.5 * weight / half
        inside = np.mean(np.where(half > 0.0, -share * np.expm1(-half), 0.5 * weight), axis=1)
    outside = 1.0 - inside
    small = np.flatnonzero(outside < _SMALL)
    poles = _poles(axes[small], centre[small], count)
    outside[small] = np.mean(share[small] * np.exp(-half[small]), axis=1) + poles
    return inside, outside


def _poles(axes: Array, centre: Array, count: int) -> Array:
    """Return what the poles add to the sum of ``exp(-h)``: one for each root of ``z1 + i z2`` in ``exp(it)``.

    Over the ``n`` roots of -1 the mean of ``z / (z - c)`` is ``1 / (1 + c**n)``.
    """
    lead, low = 0.5 * (axes[:, 0] + axes[:, 1]), 0.5 * (axes[:, 0] - axes[:, 1])
    middle = centre[:, 0] + 1j * centre[:, 1]
    root = np.sqrt(middle * middle - 4.0 * lead * low)
    root = np.where((np.conj(middle) * root).real >= 0.0, root, -root)
    larger = 0.5 * (middle + root)
    with np.errstate(divide="ignore", invalid="ignore"):
        poles = np.stack([larger / lead, np.where(larger == 0.0, 0.0, low / larger)])
        power = poles**count
        return np.asarray(np.sum((power / (1.0 + power)).real, axis=0))


def by_chords(matrices: Array, means: Array, half: Array, shape: str, ends: Array, outside: bool) -> Array:
    """Integrate the probability of chords over their place; half sides ``(N, 2)`` or radii ``(N, 1)``."""
    axes, law = _frame(Principal.of(matrices), means, ends, shape)
    region: Disc | Rectangle = Disc(half[:, 0]) if shape == "circle" else Rectangle(half, axes)
    chance = outside_probability if outside else inside_probability
    reach = region.reach()[0]
    first, last = -reach - law.x, reach - law.x  # ends of the region, from the mean
    low, high = (np.clip(sign * _REACH * law.spread, first, last) for sign in (-1.0, 1.0))
    span = high - low

    def probability(owner: Rows, offset: Array, left: Array, right: Array) -> Array:
        """Chance on the chord at an offset from the mean, so far from the region's left and right end."""
        ends_of_chord = region.chord(owner, left, right)
        middle = law.y[owner][:, None] + law.slope[owner][:, None] * offset
        widths = law.rest[owner][:, None], law.half_width[owner][:, None]
        return chance(ends_of_chord[0] - middle, ends_of_chord[1] - middle, *widths)

    def integrand(owner: Rows, t: Array) -> Array:
        """At ``offset = low + span sin²(pi t / 2)``, in which chords end smoothly at both ends."""
        rows = [v[owner][:, None] for v in (low, span, low - first, last - high, law.spread)]
        beside, width, before, after, spread = rows
        share, rest = np.sin(0.5 * np.pi * t) ** 2, np.cos(0.5 * np.pi * t) ** 2
        offset = beside + width * share
        weight = np.exp(-0.5 * (offset / spread) ** 2) / (_ROOT_2PI * spread)
        chances = probability(owner, offset, before + width * share, after + width * rest)
        return np.asarray(weight * 0.5 * np.pi * width * np.sin(np.pi * t) * chances)

    result = integrate_panels(integrand, _breaks(law, region, low, span))
    if outside:
        result = result + outside_probability(first, last, law.spread, np.zeros_like(first))
    fixed = np.flatnonzero(law.spread == 0.0)  # x does not vary: a single chord, or none
    if len(fixed):
        there = (-first[fixed, None], last[fixed, None])
        met = np.minimum(*there)[:, 0] >= 0.0
        result[fixed] = np.where(met, probability(fixed, np.zeros((len(fixed), 1)), *there)[:, 0], float(outside))
    return result


def _breaks(law: _Law, region: Disc | Rectangle, low: Array, span: Array) -> Array:
    """Return panel ends ``(N, M)`` in ``t``: deviations from the mean, and where the law's strip meets the boundary.

    None where the span is zero.
    """
    edge, soft = law.half_width, law.rest
    strip = np.stack([0.0 * edge, np.abs(edge - 9.0 * soft), edge, edge + 9.0 * soft, edge + _REACH * soft])
    lines = law.y[:, None] + np.concatenate([-strip, strip]).T
    crossings = region.crossings(law.x[:, None], lines, law.slope[:, None])
    kinks = region.reach()[1] - law.x[:, None]
    offsets = np.concatenate([law.spread[:, None] * _LEVELS, crossings, kinks], axis=1)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        shares = np.clip(np.nan_to_num((offsets - low[:, None]) / span[:, None]), 0.0, 1.0)
    points = np.pad(np.arcsin(np.sqrt(shares)) * 2.0 / np.pi, ((0, 0), (1, 1)), constant_values=(0.0, 1.0))
    return np.where(span[:, None] > 0.0, np.sort(points, axis=1), 0.0)


@dataclass(frozen=True)
class _Law:
    """Normal parts in the frames of their chords, each ``(N,)``.

    ``x`` and ``y`` are the mean; ``x`` has the standard deviation ``spread``; ``y`` runs along ``slope`` times the
    deviation of ``x``, with the deviation ``rest`` about it and the uniform part's ``half_width`` along it.
    """

    x: Array
    y: Array
    spread: Array
    slope: Array
    rest: Array
    half_width: Array


def _frame(principal: Principal, means: Array, ends: Array, shape: str) -> tuple[Array, _Law]:
    """Axes of the chords' frames, rows of ``(N, 2, 2)``, and the laws in them."""
    length = np.hypot(ends[:, 0], ends[:, 1])
    # chords along a side leave a rectangle without kinks
    second = np.tile([0.0, 1.0], (len(means), 1)) if shape == "rectangle" else principal.direction.copy()
    heated = length > 0.0
    second[heated] = ends[heated] / length[heated, None]
    first, large, small = -across(second), principal.large, principal.small
    p1, p2, s1, s2 = (
        np.sum(v * e, 1) for v in (first, second) for e in (principal.direction, across(principal.direction))
    )
    variance = large * p1**2 + small * p2**2
    varies = variance > 0.0
    divisor = np.where(varies, variance, 1.0)
    slope = np.where(varies, (large * p1 * s1 + small * p2 * s2) / divisor, 0.0)
    rest = np.where(varies, large * (small / divisor), large * s1**2 + small * s2**2)
    x, y = (np.sum(means * axis, axis=1) for axis in (first, second))
    return np.stack([first, second], 1), _Law(x, y, np.sqrt(variance), slope, np.sqrt(rest), length)


@dataclass(frozen=True)
class Disc:
    """Discs about the origin with radii ``(N,)``."""

    radius: Array

    def reach(self) -> tuple[Array, Array]:
        """Half width ``(N,)``, and abscissae of kinks ``(N, K)``."""
        return self.radius, np.empty((len(self.radius), 0))

    def chord(self, owner: Rows, left: Array, right: Array) -> tuple[Array, Array]:
        """Return the ends of the chord so far from the left and right end of the region ``owner``."""
        half = np.sqrt(np.maximum(left * right, 0.0))
        return -half, half

    def crossings(self, x: Array, y: Array, slope: Array) -> Array:
        """Offsets from ``x`` at which lines through ``(x, y)`` meet the boundary; the nearest approach if none."""
        square, linear = 1.0 + slope * slope, x + slope * y
        nearest = -linear / square
        missing = np.maximum(linear * linear - square * (x * x + y * y - self.radius[:, None] ** 2), 0.0)
        root = np.sqrt(missing) / square
        return np.concatenate([nearest - root, nearest + root], axis=1)


@dataclass(frozen=True)
class Rectangle:
    """Rectangles about the origin: half sides ``(N, 2)``, and their directions, columns ``(N, 2, 2)``."""

    half_sides: Array
    axes: Array

    def reach(self) -> tuple[Array, Array]:
        """As for discs; kinks are the two inner corners."""
        one, two = (np.abs(self.axes[:, 0]) * self.half_sides).T
        inner = np.abs(one - two)
        return one + two, np.stack([-inner, inner], axis=1)

    def chord(self, owner: Rows, left: Array, right: Array) -> tuple[Array, Array]:
        """As for discs: where the vertical line is within both strips ``|axis . point| <= half side``."""
        reach = self.reach()[0][owner][:, None]
        x = np.where(left < right, left - reach, reach - right)
        low, high = np.full_like(x, -np.inf), np.full_like(x, np.inf)
        for k in (0, 1):
            over, along = (self.axes[owner, row, k][:, None] for row in (0, 1))
            half = self.half_sides[owner, k][:, None]
            crossed = along != 0.0  # a side along the chords does not end them
            ends = [(side - over * x) / np.where(crossed, along, 1.0) for side in (-half, half)]
            low = np.where(crossed, np.maximum(low, np.minimum(*ends)), low)
            high = np.where(crossed, np.minimum(high, np.maximum(*ends)), high)
        return low, np.maximum(low, high)

    def crossings(self, x: Array, y: Array, slope: Array) -> Array:
        """As for discs, of the four sides' lines."""
        over, along, half = self.axes[:, 0, :, None], self.axes[:, 1, :, None], self.half_sides[:, :, None]
        here, rate = over * x[:, None] + along * y[:, None], over + along * slope[:, None]
        with np.errstate(divide="ignore", invalid="ignore"):
            found = np.concatenate([(side - here) / rate for side in (-half, half)], axis=1)
        return np.asarray(np.nan_to_num(found.reshape(len(x), -1), posinf=0.0, neginf=0.0))
