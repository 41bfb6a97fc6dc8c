"""A segment as a straight beam: the two axes across it, about which it bends, and whether it can be seen to twist."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from thermal_robot.arrays import Array

if TYPE_CHECKING:
    from thermal_robot.robot import Robot


SHORTEST = 1e-6
"""m; a shorter segment does not bend."""
ALONG = 0.9
"""Cosine of the angle to a joint's axis from which a segment counts as lying along it."""


def beams(robot: Robot) -> tuple[int, ...]:
    """Return the segments that are long enough to bend."""
    return tuple(s for s, segment in enumerate(robot.segments) if segment.length > SHORTEST)


def shafts(robot: Robot) -> tuple[int, ...]:
    """Return the beams along the axis of neither joint at their ends: along one, a twist is a joint that yields."""
    chain = robot.chain

    def turns(s: int) -> bool:
        segment = robot.segments[s]
        e, along = segment.index, chain.rotations[segment.index] @ segment.direction
        cosines = [chain.axes[e] @ segment.direction, chain.axes[e - 1] @ along if e else 0.0]
        return bool(np.abs(cosines).max() > ALONG)

    return tuple(s for s in beams(robot) if not turns(s))


def cross_axes(robot: Robot, s: int) -> Array:
    """Two unit vectors (2, 3) across a segment, in its own frame.

    They are right angled to the segment in the frame of its parent link, the first also to that axis of the frame which
    lies most across the segment: the sections of links are drawn along the frames of links.
    """
    segment = robot.segments[s]
    rotation = robot.chain.rotations[segment.index]
    along = rotation @ segment.direction
    first = np.cross(along, np.eye(3)[np.argmin(np.abs(along))])
    first /= np.linalg.norm(first)
    return np.asarray(np.array([first, np.cross(along, first)]) @ rotation)
