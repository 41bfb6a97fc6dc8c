"""The clocks of a robot and of an instrument: by how much they differ, from one motion that both recorded.

Roughly from the speeds of the target, which need no frames: the lag at which they are most alike. Then the lag, the
place of the instrument and the place of the target are fitted together to what was measured in motion.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.campaign.importers.standstill import Stream
from thermal_robot.errors import CampaignError
from thermal_robot.kinematics import align, exp3, tool_poses
from thermal_robot.robot import Robot

FINEST = 0.005
"""s between the instants at which speeds are compared: faster than that no joint state is published as a rule."""
LONGEST = 2_000_000
"""Instants of either recording that are compared: three hours at the finest step; longer ones take a coarser step."""
UNEXPLAINED = 0.1
"""Share of the spread of the measured places that may be left once lag and frames are fitted: a robot that is bent by
millimetres leaves less than 0.01, two recordings that have nothing to do with each other more than 0.5."""
MOVING = 0.1
"""Share of the fastest speed from which a sample tells the time: at rest it does not."""
MOST = 2000
"""Samples in motion that are fitted; more take time and add little."""
BLOCKS = 10
"""Parts of the recording of which each is left out once: their scatter is the deviation of the lag, whatever the errors
of the robot that the fit knows nothing of (Tukey's jackknife)."""
LEAST = 60
"""Samples in motion that a fit of ten figures and its scatter want."""


@dataclass(frozen=True)
class Lag:
    """By how much the clocks differ.

    Attributes
    ----------
    value
        s: the robot's clock shows that much more than the instrument's at the same instant.
    std
        One standard deviation, s.
    left
        m rms: distance in motion that lag and frames leave.
    """

    value: float
    std: float
    left: float


def lag(joints: Stream, target: Stream, robot: Robot, place: Array) -> Lag:
    """Estimate by how much the clocks of two recordings differ.

    Parameters
    ----------
    joints
        Positions of the robot's joints, by its clock.
    target
        Positions of the target, by the instrument's clock, in any frame that stands still.
    robot
        The chain.
    place
        (3,) m: where the target roughly is on the tool frame.

    Raises
    ------
    CampaignError
        Recordings that do not show one motion, or hardly any.
    """
    # clocks that count from 1970 leave too few digits for a derivative by time: from here on both begin at 0
    begun = float(joints.time[0] - target.time[0])
    joints, target = (replace(each, time=each.time - each.time[0]) for each in (joints, target))
    rough = _by_speed(joints, target, robot, place)
    speed = _speeds(target, target.time)
    inside = (target.time + rough > joints.time[0]) & (target.time + rough < joints.time[-1])
    moving = np.flatnonzero(inside & (speed > MOVING * np.max(speed[inside], initial=0.0)))
    if len(moving) < LEAST:
        raise CampaignError(
            target.file,
            "too few samples are in motion to estimate the offset of the clocks",
            found=str(len(moving)),
            expected=f"at least {LEAST}; or [recording] offset in the mapping",
        )
    chosen = moving[np.linspace(0, len(moving) - 1, min(MOST, len(moving))).astype(int)]
    start = np.concatenate([[rough], np.zeros(6), place])
    whole, left = _fitted(joints, target, robot, chosen, start)
    spread = float(np.linalg.norm(target.values[chosen, :3].std(axis=0)))
    if not left <= UNEXPLAINED * spread:
        raise CampaignError(
            f"{joints.file} and {target.file}",
            "the joints do not move the target as it was measured, however the clocks differ",
            found=f"{1e3 * left:.0f} mm rms of {1e3 * spread:.0f} mm that no offset explains",
            expected="recordings of one motion of this robot",
        )
    parts = np.array_split(np.arange(len(chosen)), BLOCKS)
    without = [_fitted(joints, target, robot, np.delete(chosen, part), whole)[0][0] for part in parts]
    deviation = np.sqrt((BLOCKS - 1) / BLOCKS * np.sum((np.array(without) - np.mean(without)) ** 2))
    return Lag(begun + float(whole[0]), float(deviation), left)


def _by_speed(joints: Stream, target: Stream, robot: Robot, place: Array) -> float:
    """Return the lag at which the speeds of recordings that begin at 0 are most alike, s."""
    from scipy.signal import correlate, correlation_lags

    spans = [stream.time[-1] - stream.time[0] for stream in (joints, target)]
    usual = [float(np.median(np.diff(stream.time))) for stream in (joints, target)]
    step = max(FINEST, max(usual), max(spans) / LONGEST)
    grids = [np.arange(0.0, span, step) for span in spans]
    poses = tool_poses(robot, joints.values)
    reached = Stream(joints.file, joints.time, poses[:, :3, 3] + poses[:, :3, :3] @ place, ("x", "y", "z"))
    one, other = (_speeds(s, grid) for s, grid in ((reached, grids[0]), (target, grids[1])))
    one, other = one - one.mean(), other - other.mean()
    products = correlate(one, other, method="fft")
    best = int(np.argmax(products))
    steps = int(correlation_lags(len(one), len(other))[best])
    return float(steps * step)


def _speeds(stream: Stream, times: Array) -> Array:
    """Return (M,) m/s of the target at some instants, over two steps of them."""
    places = stream.between(times)[:, :3]
    speeds: Array = np.linalg.norm(np.gradient(places, times, axis=0), axis=1)
    return speeds


def _fitted(joints: Stream, target: Stream, robot: Robot, chosen: Any, start: Array) -> tuple[Array, float]:
    """Return lag, motion of the instrument's frame and place of the target that fit samples, and what is left, m rms.

    Least squares. The motion turns about the aligned start, so that ten figures near nothing are sought.
    """
    from scipy.optimize import least_squares

    times, measured = target.time[chosen], target.values[chosen, :3]

    def reached(figures: Array) -> Array:
        poses = tool_poses(robot, joints.between(times + figures[0]))
        places: Array = poses[:, :3, 3] + poses[:, :3, :3] @ figures[7:]
        return places

    frame = align(reached(start), measured, np.ones(len(times)))
    middle = measured.mean(axis=0)

    def gap(figures: Array) -> Array:
        seen: Array = reached(figures) @ frame[:3, :3].T + frame[:3, 3] - middle
        away: Array = seen @ exp3(figures[1:4]).T + middle + figures[4:7] - measured
        return np.ravel(away)

    begin = np.concatenate([start[:1], np.zeros(6), start[7:]])
    # the sizes of what is sought: a step of the clock, angles, metres
    found = least_squares(gap, begin, x_scale=np.array([0.01, *[0.01] * 3, *[0.01] * 6]))
    return found.x, float(np.sqrt(2 * found.cost / len(times)))
