"""Rows of a campaign from recordings in motion: one for each time that the robot stood still."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from thermal_robot.campaign.importers.streams import Array, Stream

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
