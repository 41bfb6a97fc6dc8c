"""Integrals of positive functions to rounding: Gauss-Legendre panels, halved where they disagree, many at once."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from thermal_robot.arrays import Array
from thermal_robot.assembly.probability.kernels import NODES, WEIGHTS

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
    """Integrate ``N`` non-negative functions, each over its own breakpoints.

    Parameters
    ----------
    integrand
        Takes the number of the integral of each panel, shape ``(P,)``, and points, shape ``(P, n)``; returns ``(P,
        n)``.
    breakpoints
        Shape ``(N, M)``, ascending along the last axis; repeated points make empty panels, which cost nothing.
    tolerance
        A panel is halved while its two halves differ from it by more than this share of its integral's total. The
        halves are kept, so that the error is far smaller than that.
    depth
        Halvings allowed; a jump inside a panel is then located to ``2**-depth`` of the panel.

    Returns
    -------
    Array
        The integrals, shape ``(N,)``. All terms are positive, so the accuracy is relative.
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
