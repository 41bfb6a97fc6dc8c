"""How measured moves follow commanded ones: cross-correlation on one clock, per pair of joints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.motion.log import Channel, Motion
from thermal_robot.motion.settings import STRIDE


def at(channel: Channel, times: Array) -> Array:
    """Return a channel at other instants, (n, joints), by linear interpolation, held beyond its ends.

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
    """Moves within :data:`STRIDE` of one motion, commanded and measured, (n, joints) each, every ``step`` s."""

    step: float
    time: Array  # (n,) s, of the middle
    commanded: Array
    measured: Array

    @classmethod
    def of(cls, motion: Motion, measured: Channel | None = None) -> Moves:
        """Take the moves of a motion on the grid of its encoder; 0 for a joint that has none."""
        measured = measured or motion.position
        step = usual_step(measured)
        half = max(1, round(STRIDE / step / 2.0))
        grid = np.arange(measured.time[0], measured.time[-1] + step / 2.0, step)
        both = (np.nan_to_num(at(channel, grid)) for channel in (motion.command, measured))
        commanded, found = (values[2 * half :] - values[: -2 * half] for values in both)
        return cls(step, grid[half:-half], commanded, found)
