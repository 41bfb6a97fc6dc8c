"""Compiled loops for the probability of a disc: cases one by one, angles in vector lanes.

Imported only where numba is installed. The same integral along the edge as in `planar`, from the same numbers of angles
and the same principal axes; cases outside its range are NaN. Where constants of `planar` are changed, touch this file:
numba looks at nothing else to see whether what it has kept is old.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from thermal_robot.arrays import Array
from thermal_robot.assembly.probability.planar import BESIDES, FRACTION, MOST, NEAR, PER_DEVIATION, SERIES
from thermal_robot.compiling import compiled

_LOG2E, _LN2 = 1.4426950408889634, (6.93147180369123816490e-01, 1.90821492927058770002e-10)
"""log₂ e, and ln 2 in two parts: the product of the first with a whole number below 2¹⁰ is exact (fdlibm, e_exp.c)."""
_ROUND = 6755399441055744.0
"""1.5 · 2⁵²: a number added to it is rounded to a whole one, which stands in the last bits."""
_EXP = tuple(1.0 / math.factorial(k) for k in range(13, 1, -1))
"""Taylor series of eˣ without its first two terms: below 2⁻⁵⁶ off for |x| ≤ ½ ln 2."""
_LEAST = -700.0
_SURE = 9.0
"""Wide deviations from the mean to the edge beyond which the chance outside, below 3e-18, is nothing beside one."""
_SPLIT = 134217729.0


def _reordered(function: Any) -> Any:
    """Compile a loop with reassociated sums, for vector instructions."""
    return compiled(function, {"contract", "reassoc"})


def _exact(function: Any) -> Any:
    """Compile with strict floating-point rounding."""
    return compiled(function, False)


@_exact
def _product(p: float, q: float) -> tuple[float, float]:
    """Dekker's error-free product ``p q``: rounded value, and its rounding error."""
    head, p1, q1 = p * q, p * _SPLIT, q * _SPLIT
    ph, qh = p1 - (p1 - p), q1 - (q1 - q)
    pl, ql = p - ph, q - qh
    return head, ((ph * qh - head) + ph * ql + pl * qh) + pl * ql


@_exact
def variances(a: float, b: float, c: float) -> tuple[float, float]:
    """Eigenvalues, larger first, of a covariance ((a, b), (b, c)) scaled to about one."""
    large = 0.5 * (a + c + math.hypot(a - c, 2.0 * b))
    one, one_low = _product(a, c)
    two, two_low = _product(b, b)
    return large, max((one - two) + (one_low - two_low), 0.0) / large


@_reordered
def _decays(room: Array, bits: npt.NDArray[np.int64], count: int) -> None:
    """Write exp(−h) of the first row of the work array into the second; ``bits`` is its integer view."""
    for k in range(count):
        room[1, k] = max(-room[0, k], _LEAST) * _LOG2E + _ROUND
    for k in range(count):
        whole = room[1, k] - _ROUND
        x = (max(-room[0, k], _LEAST) - whole * _LN2[0]) - whole * _LN2[1]
        total = 0.0
        for term in _EXP:
            total = total * x + term
        room[2, k] = 1.0 + (x + x * x * total)
    for k in range(count):
        bits[1, k] = (bits[1, k] << 52) + (1023 << 52)
    for k in range(count):
        room[1, k] *= room[2, k]


@_reordered
def _edge(
    axes: tuple[float, float], at: tuple[float, float], circle: Array, room: Array, bits: npt.NDArray[np.int64]
) -> tuple[float, float]:
    """Trapezoidal sums of a disc's probabilities inside and outside along its edge, at the angles of ``circle`` (2, n).

    Means of w (1 − exp(−h))/2h and, before `_poles`, of w exp(−h)/2h, with the edge's weight w and h = |z|²/2 of
    `planar`; ``axes`` and ``at`` are its a and b.
    """
    count = circle.shape[1]
    area, by_cosine, by_sine, least = axes[0] * axes[1], -at[0] * axes[1], -at[1] * axes[0], np.inf
    for k in range(count):
        first, second = axes[0] * circle[0, k] - at[0], axes[1] * circle[1, k] - at[1]
        room[0, k] = 0.5 * (first * first + second * second)
        least = min(least, room[0, k])
    _decays(room, bits, count)
    inside, outside = 0.0, 0.0
    for k in range(count):
        decay = room[1, k]
        share = (area + by_cosine * circle[0, k] + by_sine * circle[1, k]) / max(room[0, k], 1e-300)
        outside += share * decay
        inside += share * (1.0 - decay)
    if least < NEAR:
        inside = 0.0
        for k in range(count):
            h, weight = room[0, k], area + by_cosine * circle[0, k] + by_sine * circle[1, k]
            series = 0.0
            for term in SERIES:
                series = series * h + term
            inside += weight * (series if h < NEAR else (1.0 - room[1, k]) / h)
    return 0.5 * inside / count, 0.5 * outside / count


@_exact
def _poles(axes: tuple[float, float], at: tuple[float, float], count: int) -> float:
    """Pole correction to add to the trapezoidal mean of w exp(−h)/2h (outside) over ``count`` angles; see `planar`."""
    lead, low = 0.5 * (axes[0] + axes[1]), 0.5 * (axes[0] - axes[1])
    middle = complex(at[0], at[1])
    root = np.sqrt(middle * middle - 4.0 * lead * low)
    if (middle.conjugate() * root).real < 0.0:
        root = -root
    larger, total = 0.5 * (middle + root), 0.0
    for number in range(2):
        if number == 0:
            pole = larger / lead
        elif larger != 0.0:
            pole = low / larger
        else:
            continue
        power, square, left = complex(1.0, 0.0), pole, count
        while left:
            if left & 1:
                power *= square
            square *= square
            left >>= 1
        total += (power / (1.0 + power)).real
    return total


@_exact
def circles(
    matrices: Array,
    means: Array,
    diameters: Array,
    nodes: npt.NDArray[np.int64],
    table: Array,
    quarters: Array,
    start: int,
    stop: int,
    found: Array,
) -> None:
    """Write to ``found`` (2, N) the probabilities of normal deviations in, and out of, discs about the origin.

    Cases from ``start`` to ``stop``; NaN where the rule does not apply. ``nodes`` (K,) numbers of angles; ``table``
    (K, 2, most) their cosines and sines, ``quarters`` (K, 2, most / 4) those of the first quarter.
    """
    room = np.empty((3, table.shape[2]))
    bits = room.view(np.int64)
    for n in range(start, stop):
        found[0, n] = found[1, n] = np.nan
        a, b, c = matrices[n, 0, 0], 0.5 * (matrices[n, 0, 1] + matrices[n, 1, 0]), matrices[n, 1, 1]
        size, radius = max(a, c), 0.5 * diameters[n]
        m1, m2 = means[n, 0], means[n, 1]
        # what is no covariance, or no disc of any width, is looked at by those who say so
        proper = 0.0 < size < np.inf and a >= 0.0 and c >= 0.0 and 0.0 < radius < np.inf and b * b <= a * c
        proper = proper and abs(matrices[n, 0, 1] - matrices[n, 1, 0]) <= 1e-9 * size and math.isfinite(m1 + m2)
        if not proper:
            continue
        scale = math.ldexp(1.0, math.frexp(size)[1])
        large, small = variances(a / scale, b / scale, c / scale)
        wide, narrow = math.sqrt(large * scale), math.sqrt(small * scale)
        central = m1 == 0.0 and m2 == 0.0
        if narrow <= 0.0:
            continue
        u, v = m1, m2
        if not central:
            angle = 0.5 * math.atan2(2.0 * b, a - c)
            cosine, sine = math.cos(angle), math.sin(angle)
            u, v = m1 * cosine + m2 * sine, m2 * cosine - m1 * sine
        axes, at = (radius / wide, radius / narrow), (u / wide, v / narrow)
        needed = PER_DEVIATION * (axes[1] + math.hypot(u / narrow, at[1])) + BESIDES
        if not needed <= MOST:
            if radius - math.hypot(u, v) > _SURE * wide:
                found[0, n] = 1.0
            continue
        k = np.searchsorted(nodes, needed)
        count = nodes[k]
        circle = quarters[k, :, : count // 4] if central else table[k, :, :count]
        inside, outside = _edge(axes, at, circle, room, bits)
        if 1.0 - inside < FRACTION:
            outside += _poles(axes, at, count)
        else:
            outside = 1.0 - inside
        if math.isfinite(inside) and math.isfinite(outside):
            found[0, n], found[1, n] = min(max(inside, 0.0), 1.0), min(max(outside, 0.0), 1.0)
