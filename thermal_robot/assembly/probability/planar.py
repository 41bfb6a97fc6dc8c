"""Probability that a planar deviation lies in a disc or a rectangle: normal, plus uniform along one segment.

The plane is turned so that the segment, or else the normal part's shorter principal axis, is the second axis. Given
the first coordinate ``x`` the second is then normal plus uniform on a line, whose interval probability is closed form
(`kernels`), and one integral over ``x`` remains. Inside and outside are integrals of their own, neither is one minus
the other, so both are relatively accurate.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np
import numpy.typing as npt

from thermal_robot.arrays import Array
from thermal_robot.assembly.probability.discs import disc_chances
from thermal_robot.assembly.probability.kernels import inside_probability, outside_probability
from thermal_robot.assembly.probability.principal import Principal
from thermal_robot.assembly.probability.quadrature import integrate_panels
from thermal_robot.assembly.probability.regions import Disc, Rectangle, Region

_GRADING = 4.0  # neighbouring panels at a critical point differ by this factor; adaptation halves what needs it
_MILD = 0.02  # shortest scale over the region's width from which even panels resolve everything
_ROWS = 512  # integrals whose breakpoints are found together: they take some megabytes
_ROOT_2PI = np.sqrt(2.0 * np.pi)


@dataclass(frozen=True)
class Frame:
    """Normal parts in the frames of their chords: ``x`` normal, ``y`` given ``x`` normal about a line.

    Parameters
    ----------
    rotation
        Rows are the two axes in the plane, shape ``(..., 2, 2)``.
    spread
        Standard deviation of ``x``, shape ``(...)``.
    slope, remainder
        ``y = slope x`` on the average, with this standard deviation about it.
    half_width
        Half length of the uniform part, along ``y``.
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
        """Return the frames of some rows."""
        return Frame(*(getattr(self, field.name)[chosen] for field in fields(self)))


def planar_probability(
    covariance: Array, means: Array, sizes: Array, *, shape: str, segment: Array | None = None, outside: bool = False
) -> Array:
    """Probability of ``N`` planar deviations to lie in, or out of, their regions.

    Parameters
    ----------
    covariance
        Normal part, shape ``(2, 2)`` or ``(N, 2, 2)``, positive semidefinite.
    means
        Shape ``(N, 2)``.
    sizes
        Diameters ``(N, 1)`` for ``shape="circle"``, side lengths ``(N, 2)`` for ``shape="rectangle"``; finite and
        positive.
    segment
        End of the uniform part, which runs from ``-segment`` to ``segment``, shape ``(2,)`` or ``(N, 2)``; ``None`` for
        none.
    outside
        The probability of lying outside, computed directly.

    Returns
    -------
    Array
        Shape ``(N,)``.
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
    """Return steps of the graded panels of each row; 0 where even panels do, as the normal part is wide."""
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
