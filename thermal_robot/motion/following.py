"""How measured moves follow commanded ones: cross-correlation on one clock, for each pair of joints."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.motion.log import Channel, Motion, MotionLog
from thermal_robot.motion.settings import CLUSTERS, LONGEST_LAG, STRIDE

_SMALL = 1e-12  # rad² below which nothing has moved


def at(channel: Channel, times: Array) -> Array:
    """Interpolate a channel linearly at other instants, (n, joints), constant beyond its ends.

    A joint's gaps are bridged; NaN where it has no sample at all.
    """
    values = np.full((len(times), channel.values.shape[1]), np.nan)
    for j, column in enumerate(channel.values.T):
        known = ~np.isnan(column)
        if known.any():
            values[:, j] = np.interp(times, channel.time[known], column[known])
    return values


def usual_step(channel: Channel) -> float:
    """Median of the steps of a channel's clock, s."""
    return float(np.median(np.diff(channel.time)))


@dataclass(frozen=True)
class Moves:
    """Differences over :data:`STRIDE` s of commanded and measured position, (n, joints), on one even clock."""

    step: float
    time: Array  # (n,) s, of the middle
    commanded: Array
    measured: Array

    @classmethod
    def of(cls, motion: Motion, step: float = 0.0) -> Moves:
        """Take the moves of a motion on an even grid, by default at the encoder's median step; 0 without samples."""
        measured = motion.position
        step = step or usual_step(measured)
        half = max(1, round(STRIDE / step / 2.0))
        grid = np.arange(measured.time[0], measured.time[-1] + step / 2.0, step)
        both = (np.nan_to_num(at(channel, grid)) for channel in (motion.command, measured))
        commanded, found = (values[2 * half :] - values[: -2 * half] for values in both)
        return cls(step, grid[half:-half], commanded, found)

    def parts(self, count: int) -> Iterator[Moves]:
        """Yield ``count`` consecutive parts of equal length."""
        for rows in np.array_split(np.arange(len(self.time)), count):
            yield replace(self, time=self.time[rows], commanded=self.commanded[rows], measured=self.measured[rows])


def clusters(log: MotionLog) -> list[Moves]:
    """Return the moves of each motion, cut into parts where motions are few: clusters taken as independent."""
    return [part for motion in log.motions for part in Moves.of(motion).parts(parts(log))]


def parts(log: MotionLog) -> int:
    """Return the number of parts of each motion with which there are at least :data:`CLUSTERS` clusters."""
    return -(-CLUSTERS // len(log.motions))


@dataclass(frozen=True)
class Correlation:
    """Cross-correlation of the moves, not normalised, rad²: (L, joints, joints) by lag, measured, commanded joint."""

    lags: Array  # (L,) s
    sums: Array
    commanded: Array  # (joints,) sum of squares, and measured
    measured: Array

    @classmethod
    def of(cls, moves: Moves, longest: float = LONGEST_LAG) -> Correlation:
        """Cross-correlate moves by FFT at lags up to ``longest`` s either way."""
        size = 1 << (2 * len(moves.time) - 1).bit_length()
        reach = min(round(longest / moves.step), len(moves.time) - 1)
        u, q = (np.fft.rfft(values, size, axis=0) for values in (moves.commanded, moves.measured))
        shifts = np.arange(-reach, reach + 1)
        each = [np.fft.irfft(np.conj(u) * q[:, [i]], size, axis=0)[shifts] for i in range(q.shape[1])]
        sums = np.stack(each, axis=1).astype(np.float64)
        squares = ((values**2).sum(axis=0) for values in (moves.commanded, moves.measured))
        return cls(np.array(shifts * moves.step, dtype=np.float64), sums, *squares)

    @property
    def peaks(self) -> Array:
        """(joints, joints) signed cross-correlation of largest size over lags, by measured and commanded joint."""
        best = np.abs(self.sums).argmax(axis=0)
        return np.asarray(np.take_along_axis(self.sums, best[None], axis=0)[0])

    @property
    def explained(self) -> Array:
        """(joints, joints) rad²: sum of squares of measured moves that each command explains at its best lag."""
        return self.peaks**2 / np.maximum(self.commanded, _SMALL)

    def best(self) -> tuple[float, float]:
        """Return the lag, s, at which commands explain the largest share of all measured moves, and that share.

        Neither a sign nor an exchange of joints matters.
        """
        norm = np.sqrt(np.maximum(np.outer(self.measured, self.commanded), _SMALL))
        told = ((self.sums / norm) ** 2).max(axis=2) @ self.measured / max(self.measured.sum(), _SMALL)
        k = int(np.clip(told.argmax(), 1, len(told) - 2))
        before, here, after = told[k - 1 : k + 2]
        curve = before - 2.0 * here + after
        shift = 0.5 * (before - after) / curve if curve < 0.0 else 0.0
        return float(self.lags[k] + np.clip(shift, -1.0, 1.0) * (self.lags[1] - self.lags[0])), float(here)


def slope(squares: Array, products: Array) -> tuple[Array, Array]:
    """Slope through the origin and its standard error by the scatter between clusters (sandwich estimator).

    Parameters
    ----------
    squares, products
        (clusters, k) sums of x·x and of x·y in each cluster.

    Returns
    -------
    tuple of ndarray
        (k,) slopes, NaN where no x; (k,) standard errors.
    """
    total = squares.sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        found = np.where(total > _SMALL, products.sum(axis=0) / total, np.nan)
        scores = products - found * squares
        count = max(len(squares), 2)
        errors = np.sqrt((scores**2).sum(axis=0) * count / (count - 1)) / total
    return found, errors
