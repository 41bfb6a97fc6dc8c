"""Recordings of a robot and of an instrument, each by its own clock; rows of a campaign where the robot stood still."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.errors import CampaignError

WINDOW = 0.2
"""s over which the velocity of a joint is taken: it averages the steps of an encoder, 1e-5 rad of which are then
1e-4 rad/s at most."""
VELOCITY = 1e-3
"""rad/s or m/s: slower than that a joint stands. In the tolerance of a pair a target 1 m away then moves 50 µm at most,
and mostly not at all."""
STANDSTILL = 0.5
"""s that a robot stands at least: shorter is a turning point, or still swings."""
SETTLING = 0.25
"""s after stopping that are not used: arms swing out at some 10 Hz, and controllers settle."""
TOLERANCE = 0.05
"""s between a row's instant and the sample paired with it; instruments measure twenty times a second or more."""


@dataclass(frozen=True)
class Stream:
    """N samples of k quantities.

    Attributes
    ----------
    file
        Where they come from, for messages.
    time
        (N,) s, increasing.
    values
        (N, k) in the unit of the recording.
    names
        Of the k columns: joints, or x y z and perhaps qw qx qy qz.
    """

    file: str
    time: Array
    values: Array
    names: tuple[str, ...]

    def between(self, times: Array) -> Array:
        """Return (M, k) values between the samples, on straight lines; held beyond the ends."""
        return np.column_stack([np.interp(times, self.time, column) for column in self.values.T])

    def scaled(self, scale: Array) -> Stream:
        """Return the stream in other units, (k,) of them to one of its own."""
        return replace(self, values=self.values * scale)

    def nearest(self, times: Array) -> NDArray[np.int64]:
        """Return (M,) indices of the samples that are nearest in time."""
        after = np.clip(np.searchsorted(self.time, times), 1, len(self.time) - 1)
        earlier = times - self.time[after - 1] < self.time[after] - times
        return np.where(earlier, after - 1, after)


def stream(file: str, time: Array, values: Array, names: Sequence[str]) -> Stream:
    """Return a stream in the sequence of its clock, without samples that have a gap and without repeated instants.

    Raises
    ------
    CampaignError
        Fewer than two samples.
    """
    kept = ~(np.isnan(time) | np.isnan(values).any(axis=1))
    _, first = np.unique(time[kept], return_index=True)
    if len(first) < 2:
        raise CampaignError(
            file, "has fewer than two samples", found=f"{len(first)} of {', '.join(names)}", expected="a recording"
        )
    return Stream(file, time[kept][first], values[kept][first], tuple(names))


@dataclass(frozen=True)
class Pairs:
    """Samples of two recordings at standstill.

    Attributes
    ----------
    times
        (M,) s, of the robot's clock.
    joints, target
        (M, n) and (M, k) of the samples nearest in time.
    short
        How many standstills were too short.
    lonely
        How many had no sample of the target within the tolerance.
    """

    times: Array
    joints: Array
    target: Array
    short: int
    lonely: int


def paired(
    joints: Stream,
    target: Stream,
    lag: float,
    *,
    tolerance: float = TOLERANCE,
    standstill: float = STANDSTILL,
    velocity: float = VELOCITY,
    settling: float = SETTLING,
) -> Pairs:
    """Return a pair for each standstill, in its middle once the arm has settled.

    Parameters
    ----------
    joints, target
        The recordings.
    lag
        s: the robot's clock shows that much more than the instrument's.
    tolerance, standstill, velocity, settling
        As the constants of this module.
    """
    times = joints.time
    moved = joints.between(times + WINDOW / 2) - joints.between(times - WINDOW / 2)
    still = np.abs(moved).max(axis=1) <= velocity * WINDOW
    edges = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(int)))
    begins, ends = edges[::2], edges[1::2] - 1
    long = times[ends] - times[begins] >= standstill
    middles = (times[begins] + np.minimum(settling, (times[ends] - times[begins]) / 2) + times[ends])[long] / 2
    own, seen = joints.nearest(middles), target.nearest(middles - lag)
    near = np.abs(target.time[seen] + lag - middles) <= tolerance
    return Pairs(
        middles[near], joints.values[own[near]], target.values[seen[near]], int((~long).sum()), int((~near).sum())
    )
