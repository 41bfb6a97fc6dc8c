"""Compiled loop over the edges of many discs; imported only where numba is installed."""

from __future__ import annotations

import math

from thermal_robot.arrays import Array
from thermal_robot.compiling import compiled


@compiled
def edge_sums(axes: Array, centre: Array, circle: Array, near: float, series: Array, found: Array) -> None:
    """Write means ``(2, N)`` of w (1 − exp(−h))/2h and of w exp(−h)/2h over the angles of ``circle`` ``(2, n)``.

    Symbols, ``axes`` and ``centre`` as in `planar`; ``series`` of (1 − exp(−h))/h stands for h below ``near``.
    """
    count = circle.shape[1]
    for n in range(len(axes)):
        a1, a2, b1, b2 = axes[n, 0], axes[n, 1], centre[n, 0], centre[n, 1]
        inside, outside = 0.0, 0.0
        for k in range(count):
            first, second = a1 * circle[0, k] - b1, a2 * circle[1, k] - b2
            half = 0.5 * (first * first + second * second)
            weight = a1 * a2 - b1 * a2 * circle[0, k] - b2 * a1 * circle[1, k]
            decay = math.exp(-half)
            outside += weight * decay / max(half, 1e-300)
            if half < near:
                mean = 0.0
                for term in series:
                    mean = mean * half + term
            else:
                mean = (1.0 - decay) / half
            inside += weight * mean
        found[0, n], found[1, n] = 0.5 * inside / count, 0.5 * outside / count
