"""Many planar deviations at once, each against a disc of its own: the cheap integral that is exact for each.

The edge of the disc (`boundary`) where so many angles as `boundary.NODES` holds resolve it, chords across the narrow
axis (`chords`) where 64 nodes do. What neither resolves, and tails that want all digits, are left to `planar`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from thermal_robot.assembly.probability.boundary import NODES, angles_needed, disc_by_edge, segment_by_edge
from thermal_robot.assembly.probability.chords import chords_resolve, disc_by_chords
from thermal_robot.assembly.probability.principal import Principal

Array = npt.NDArray[np.float64]
Found = tuple[Array, Array, Array]

_CELLS = 1 << 17  # numbers of an array that stays in cache, eight bytes each
_FEWEST = 1e-5  # chance outside, as one minus that inside: below it fewer than ten digits are left
_FEWEST_CHORDS = 1e-7  # the same by chords, which add tails
_SHORT = 1.0  # half segments in standard deviations up to which a mean over it is a sum of so many nodes
_UNITS, _SHARES = np.polynomial.legendre.leggauss(16)


@dataclass(frozen=True)
class Chances:
    """What is known of N deviations and their discs.

    Parameters
    ----------
    inside, outside
        Shape ``(N,)``: ``P`` to rounding, and ``1 - P`` to ten of its digits.
    rate
        Shape ``(N,)``: the derivative of ``P`` to the logarithm of the radius.
    known
        Shape ``(N,)``: the others are NaN.
    """

    inside: Array
    outside: Array
    rate: Array
    known: npt.NDArray[np.bool_]


def disc_chances(principal: Principal, means: Array, radii: Array, segments: Array | None = None) -> Chances:
    """Chances of ``N`` deviations to lie in, and out of, discs about the origin.

    Parameters
    ----------
    principal
        Covariances of the normal parts, ``N`` of them.
    means
        Shape ``(N, 2)``.
    radii
        Shape ``(N,)``, positive and finite.
    segments
        Ends of the uniform parts, which run from ``-segment`` to ``segment``, shape ``(N, 2)``; ``None`` for none.
    """
    count = len(means)
    result = np.full((3, count), np.nan)
    varies = principal.large > 0.0
    deviations = np.sqrt(np.stack([principal.large, principal.small], axis=1))
    centre = principal.turned(means)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        axes = radii[:, None] / deviations
        at = np.where(deviations > 0.0, centre / deviations, 0.0)
    half = np.zeros((count, 2)) if segments is None else principal.turned(segments)
    long = np.any(half != 0.0, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = np.where(half != 0.0, half / deviations, 0.0)
        needed = angles_needed(axes, np.abs(at) + np.abs(ends))
    needed[~(varies & np.isfinite(needed))] = np.inf
    which = np.searchsorted(NODES, needed)
    for k in np.unique(which[which < len(NODES)]):
        same, angles = which == k, int(NODES[k])
        plain, short = same & ~long, same & long & (np.hypot(*ends.T) <= _SHORT)
        far = same & long & ~short
        central = plain & ~np.any(at, axis=1)

        def edge(rows: npt.NDArray[np.intp], angles: int = angles) -> Found:
            return disc_by_edge(axes[rows], at[rows], angles)

        def about_the_centre(rows: npt.NDArray[np.intp], angles: int = angles) -> Found:
            return disc_by_edge(axes[rows], at[rows], angles, central=True)

        def along_short(rows: npt.NDArray[np.intp], angles: int = angles) -> Found:
            shifted = at[rows][:, None] + _UNITS[:, None] * ends[rows][:, None]
            every = disc_by_edge(np.repeat(axes[rows], len(_UNITS), axis=0), shifted.reshape(-1, 2), angles)
            one, two, three = (0.5 * part.reshape(len(rows), -1) @ _SHARES for part in every)
            return one, two, three

        def along(rows: npt.NDArray[np.intp], angles: int = angles) -> Found:
            inside, rate = segment_by_edge(axes[rows], at[rows], ends[rows], angles)
            return inside, 1.0 - inside, rate

        _fill(result, about_the_centre, central, angles // 4)
        _fill(result, edge, plain & ~central, angles)
        _fill(result, along_short, short, angles * len(_UNITS))
        _fill(result, along, far, angles)
        result[:, far & (result[1] < _FEWEST)] = np.nan
    rest = np.flatnonzero((which == len(NODES)) & varies & ~long)
    with np.errstate(divide="ignore"):
        over_radius = np.stack([at[rest, 0], centre[rest, 1] / radii[rest]], axis=1)
    resolved = chords_resolve(axes[rest], over_radius)
    rest, over_radius = rest[resolved], over_radius[resolved]
    for start in range(0, len(rest), _CELLS // 64):
        rows = slice(start, start + _CELLS // 64)
        result[:, rest[rows]] = disc_by_chords(axes[rest[rows]], over_radius[rows])
    result[:, rest[result[1, rest] < _FEWEST_CHORDS]] = np.nan
    return Chances(result[0], result[1], result[2], np.isfinite(result[0]))


def _fill(result: Array, chance: Callable[..., Found], chosen: npt.NDArray[np.bool_], cells: int) -> None:
    """Fill in the rows that are chosen, so many at a time that their arrays stay in cache."""
    rows = np.flatnonzero(chosen)
    step = max(_CELLS // cells, 1)
    for start in range(0, len(rows), step):
        part = rows[start : start + step]
        result[:, part] = chance(part)
