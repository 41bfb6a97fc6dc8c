"""Many planar deviations at once, each against a disc of its own: the cheap integral that is exact for each.

The edge of the disc (`boundary`) where so many angles as `boundary.NODES` holds resolve it, chords across the narrow
axis (`chords`) where 64 nodes do. What neither resolves, and tails that want all digits, are left to `planar`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
import numpy.typing as npt

from thermal_robot.arrays import Array
from thermal_robot.assembly.probability.boundary import NODES, angles_needed, disc_by_edge, segment_by_edge
from thermal_robot.assembly.probability.chords import chords_resolve, disc_by_chords
from thermal_robot.assembly.probability.principal import Principal

Found = tuple[Array, Array, Array]

_CELLS = 1 << 17  # numbers of an array that stays in cache, eight bytes each
TOLD = 1e-5
"""Chance outside that is told everywhere: as one minus that inside, fewer than ten digits are left below it."""
_TOLD_BY_CHORDS = 1e-7  # the same by chords, which add tails
MOST = 256  # angles beside which chords are worth their while
_SHORT = 1.0  # half segments in standard deviations up to which a mean over it is a sum of so many nodes
_UNITS, _SHARES = np.polynomial.legendre.leggauss(16)


@dataclass(frozen=True)
class Chances:
    """What is known of N deviations and their discs.

    Parameters
    ----------
    inside, outside
        Shape ``(N,)``: ``P`` to rounding, and ``1 - P`` to ten of its digits. NaN where that needs another integral.
    rate
        Shape ``(N,)``: the derivative of ``P`` to the logarithm of the radius.
    """

    inside: Array
    outside: Array
    rate: Array


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
    """Discs and laws along the principal axes.

    Parameters
    ----------
    axes, at, ends
        Radius, mean and end of the segment over the deviations, shape ``(N, 2)``.
    over_radius
        Mean over the deviation along the first axis, over the radius along the second, shape ``(N, 2)``.
    far
        Which have a segment that is longer than a deviation.
    short
        Rows of those with one that is not; they are sums of others.
    which
        Which of `NODES` resolves them along the edge; their number where none does.
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
    """Fill in the rows that are chosen, so many at a time that their arrays stay in cache."""
    rows = np.flatnonzero(chosen)
    step = max(_CELLS // cells, 1)
    for start in range(0, len(rows), step):
        part = rows[start : start + step]
        result[:, part] = chance(part)
