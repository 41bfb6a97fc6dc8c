"""Probability that a planar deviation lies in a disc or a rectangle: normal, plus uniform along one segment.

The plane is turned so that the segment, or else the normal part's shorter principal axis, is the second axis. Given
the first coordinate ``x`` the second is then normal plus uniform on a line, whose interval probability is closed form
(`kernels`), and one integral over ``x`` remains. Inside and outside are integrals of their own, neither is one minus
the other, so both are relatively accurate.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from thermal_robot.assembly.probability.kernels import inside_probability, outside_probability
from thermal_robot.assembly.probability.quadrature import integrate_panels
from thermal_robot.assembly.probability.regions import Disc, Rectangle, Region

Array = npt.NDArray[np.float64]

_GRADING = 4.0  # neighbouring panels at a critical point differ by this factor; adaptation halves what needs it
_MILD = 0.02  # shortest scale over the region's width from which even panels resolve everything
_ROOT_2PI = np.sqrt(2.0 * np.pi)


def _difference_of_products(a: float, b: float, c: float, d: float) -> float:
    """Return ``a b - c d`` correct to rounding (Dekker's exact products), also where it nearly cancels."""

    def product(p: float, q: float) -> tuple[float, float]:
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
    """A 2x2 covariance by its principal axes.

    Parameters
    ----------
    large, small
        Variances along the axes, ``large >= small >= 0``.
    direction
        Unit vector of the axis with the larger variance.
    """

    large: float
    small: float
    direction: Array

    @classmethod
    def of(cls, covariance: Array) -> Principal:
        """Decompose; the smaller variance comes from the determinant, which keeps its digits next to a large one."""
        scale = float(np.max(np.abs(covariance)))
        if scale == 0.0:
            return cls(0.0, 0.0, np.array([1.0, 0.0]))
        scale = float(np.ldexp(1.0, np.frexp(scale)[1]))  # a power of two: to divide by it rounds nothing
        a, b, c = (float(v) / scale for v in (covariance[0, 0], covariance[0, 1], covariance[1, 1]))
        large = 0.5 * (a + c + float(np.hypot(a - c, 2.0 * b)))
        small = max(_difference_of_products(a, c, b, b), 0.0) / large
        angle = 0.5 * float(np.arctan2(2.0 * b, a - c))
        return cls(large * scale, small * scale, np.array([np.cos(angle), np.sin(angle)]))


@dataclass(frozen=True)
class Frame:
    """The normal part in the frame of the chords: ``x`` normal, ``y`` given ``x`` normal about a line.

    Parameters
    ----------
    rotation
        Rows are the two axes in the plane.
    spread
        Standard deviation of ``x``.
    slope, remainder
        ``y = slope x`` on the average, with this standard deviation about it.
    half_width
        Half length of the uniform part, along ``y``.
    """

    rotation: Array
    spread: float
    slope: float
    remainder: float
    half_width: float

    @classmethod
    def along(cls, principal: Principal, second: Array, half_width: float) -> Frame:
        """Frame whose second axis is the unit vector ``second``."""
        first = np.array([second[1], -second[0]])
        e1 = principal.direction
        e2 = np.array([-e1[1], e1[0]])
        p1, p2, s1, s2 = first @ e1, first @ e2, second @ e1, second @ e2
        variance = principal.large * p1**2 + principal.small * p2**2
        if variance > 0.0:
            slope = (principal.large * p1 * s1 + principal.small * p2 * s2) / variance
            remainder = principal.large * (principal.small / variance)
        else:
            slope, remainder = 0.0, principal.large * s1**2 + principal.small * s2**2
        return cls(
            np.stack([first, second]), float(np.sqrt(variance)), float(slope), float(np.sqrt(remainder)), half_width
        )


def planar_probability(
    covariance: Array, means: Array, sizes: Array, *, shape: str, segment: Array | None = None, outside: bool = False
) -> Array:
    """Probability of ``N`` planar deviations with one covariance to lie in, or out of, their regions.

    Parameters
    ----------
    covariance
        Normal part, shape ``(2, 2)``, positive semidefinite.
    means
        Shape ``(N, 2)``.
    sizes
        Diameters ``(N, 1)`` for ``shape="circle"``, side lengths ``(N, 2)`` for ``shape="rectangle"``; finite and
        positive.
    segment
        End of the uniform part, which runs from ``-segment`` to ``segment``; ``None`` for none.
    outside
        The probability of lying outside, computed directly.

    Returns
    -------
    Array
        Shape ``(N,)``.
    """
    principal = Principal.of(covariance)
    length = 0.0 if segment is None else float(np.hypot(*segment))
    if segment is not None and length > 0.0:
        second = segment / length
    elif shape == "rectangle":
        second = np.array([0.0, 1.0])  # chords along a side: the region has no kinks then
    else:
        second = np.array([-principal.direction[1], principal.direction[0]])
    frame = Frame.along(principal, second, length)
    region: Region
    if shape == "circle":
        region = Disc(0.5 * sizes[:, 0])
    else:
        region = Rectangle(0.5 * sizes, frame.rotation)
    centres = means @ frame.rotation.T
    chance = outside_probability if outside else inside_probability
    return _integrate(frame, region, centres, chance, outside)


def _integrate(
    frame: Frame, region: Region, centres: Array, chance: Callable[[Array, Array, float, float], Array], outside: bool
) -> Array:
    """Integrate the chord's probability over ``x``, and add what lies beyond the region's ends."""
    count = len(centres)
    every = np.arange(count)
    ends = region.breaks()[:, [0, -1]]
    low_x, high_x = (region.abscissa(every, ends[:, [k]])[0][:, 0] for k in (0, 1))

    def chord_probability(owner: npt.NDArray[np.intp], t: Array) -> tuple[Array, Array, Array]:
        x, rate = region.abscissa(owner, t)
        low, high = region.chord(owner, t)
        offset = x - centres[owner, 0][:, None]
        middle = centres[owner, 1][:, None] + frame.slope * offset
        return offset, rate, chance(low - middle, high - middle, frame.remainder, frame.half_width)

    if frame.spread == 0.0:
        # x does not vary: a single chord, or none.
        at = region.parameter(centres[:, :1])
        result = chord_probability(every, at)[2][:, 0]
        missed = (centres[:, 0] < low_x) | (centres[:, 0] > high_x)
        return np.where(missed, 1.0 if outside else 0.0, result)

    def integrand(owner: npt.NDArray[np.intp], t: Array) -> Array:
        offset, rate, probability = chord_probability(owner, t)
        weight = np.exp(-0.5 * (offset / frame.spread) ** 2) / (_ROOT_2PI * frame.spread)
        return np.asarray(weight * rate * probability)

    result = integrate_panels(integrand, _breakpoints(frame, region, centres))
    if outside:
        result = result + outside_probability(low_x - centres[:, 0], high_x - centres[:, 0], frame.spread, 0.0)
    return result


def _breakpoints(frame: Frame, region: Region, centres: Array) -> Array:
    """Panels graded geometrically towards every point where the integrand may change quickly.

    These are the mean, the places where the middle and the edges of the strip of ``y`` cross the boundary, the
    region's ends and kinks, and the likeliest points of the integrand found on the panels so far. Where the normal
    part is as wide as the region nothing is quick, and eight even panels do.
    """
    every = np.arange(len(centres))
    breaks = region.breaks()
    span = (breaks[:, -1] - breaks[:, 0])[:, None]
    width = np.ptp(region.abscissa(every, breaks[:, [0, -1]])[0], axis=1)
    finest = float(np.min(_finest_scale(frame) / np.maximum(width, np.finfo(float).tiny)))
    if finest > _MILD and frame.remainder > 0.0:
        even = breaks[:, :1] + span * np.linspace(0.0, 1.0, 9)
        return np.sort(np.concatenate([breaks, even], axis=1), axis=1)
    steps = int(np.clip(np.ceil(np.log(1.0 / max(finest, 1e-18)) / np.log(_GRADING)), 1, 30))
    ladder = _GRADING ** -np.arange(steps + 1.0)
    ladder = np.concatenate([-ladder, [0.0], ladder[::-1]])

    def graded(points: Array) -> Array:
        spread_out = points[:, :, None] + span[:, :, None] * ladder
        return np.clip(spread_out.reshape(len(points), -1), breaks[:, :1], breaks[:, -1:])

    middle = centres[:, 1] - frame.slope * centres[:, 0]
    strip = np.array([0.0, -frame.half_width, frame.half_width] if frame.half_width > 0.0 else [0.0])
    crossings = region.crossings(frame.slope, middle[:, None] + strip)
    critical = region.parameter(np.concatenate([centres[:, :1], crossings], axis=1))
    points = np.sort(
        np.concatenate([breaks, critical, graded(np.concatenate([breaks, critical], axis=1))], axis=1), axis=1
    )
    likeliest = _likeliest(frame, region, centres, points)
    return np.sort(np.concatenate([points, graded(likeliest)], axis=1), axis=1)


def _finest_scale(frame: Frame) -> float:
    """Shortest distance in ``x`` over which the integrand changes."""
    scales = [frame.spread]
    if frame.remainder > 0.0:
        scales.append(frame.remainder / max(abs(frame.slope), 1.0))
    return 0.25 * min(scales)


def _likeliest(frame: Frame, region: Region, centres: Array, points: Array) -> Array:
    """Up to three local maxima per integral of the normal density within reach of the inside and of the outside.

    Far from the mean the integrand is a narrow peak about the nearest point of the region, or of its complement, in
    units of the standard deviations; its place is where the exponent is least, and three zooms find it to a sixteenth
    cubed of a panel.
    """

    def exponents(t: Array) -> tuple[Array, Array]:
        every = np.arange(len(t))
        x, _ = region.abscissa(every, t.reshape(len(t), -1))
        low, high = region.chord(every, t.reshape(len(t), -1))
        offset = x - centres[:, :1]
        y = centres[:, 1:] + frame.slope * offset
        into = np.maximum(np.maximum(low - y, y - high) - frame.half_width, 0.0)
        out = np.maximum(np.minimum(high - y, y - low) - frame.half_width, 0.0)
        along = (offset / frame.spread) ** 2
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            pair = tuple(along + np.where(gap > 0.0, (gap / frame.remainder) ** 2, 0.0) for gap in (into, out))
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
