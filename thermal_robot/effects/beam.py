"""Straight beams: segments that bend, and beams that bow by a temperature difference."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.effects.effect import UNSOURCED, Driver, Effect, Parameter, at_segment

if TYPE_CHECKING:
    from thermal_robot.observations import Observations
    from thermal_robot.robot import Robot

SHORTEST = 1e-6
"""m; a shorter segment does not bend."""
_ALONG = 0.9  # cosine of the angle to a joint's axis from which a segment counts as lying along it
_STEADY = 1e-9  # K


def beams(robot: Robot) -> tuple[int, ...]:
    """Return the numbers of the segments that are longer than :data:`SHORTEST`, so that they can bend."""
    return tuple(s for s, segment in enumerate(robot.segments) if segment.length > SHORTEST)


def shafts(robot: Robot) -> tuple[int, ...]:
    """Return the beams that lie along neither adjacent joint axis: along one, twist is joint compliance."""
    chain, found = robot.chain, []
    for s in beams(robot):
        e, along = robot.segments[s].index, robot.segments[s].direction
        before = chain.axes[e - 1] @ chain.rotations[e] @ along if e else 0.0
        if max(abs(chain.axes[e] @ along), abs(before)) <= _ALONG:
            found.append(s)
    return tuple(found)


def cross_axes(robot: Robot, s: int) -> Array:
    """Two unit vectors (2, 3) across a segment, in its own frame.

    In the frame of the parent link both are perpendicular to the segment, the first also to the frame axis most nearly
    across it, as link sections are usually aligned with link frames.
    """
    segment = robot.segments[s]
    rotation = robot.chain.rotations[segment.index]
    along = rotation @ segment.direction
    first = np.cross(along, np.eye(3)[np.argmin(np.abs(along))])
    first /= np.linalg.norm(first)
    return np.asarray(np.array([first, np.cross(along, first)]) @ rotation)


@dataclass(frozen=True)
class ThermalBending(Effect):
    """Thermal bending: every segment bows with the excess of its link's temperature over the robot's, κ = g ΔT.

    ΔT = T_link − T. What heats a link from one side (a motor, the sun, a drive) leaves its flanks unlike, and in
    proportion to how far the link has left the rest. A constant curvature κ about an axis across the segment turns its
    end by κ L and displaces it by ½ κ L². T is ``temperature``, or the mean of the links' where that is not recorded.
    Two parameters a segment, 1/(m·K), one for each axis across it. Expected size 1.5e-4 /(m·K): α/h for flanks that
    differ by as much as the link from the robot, with α = 1.2e-5 (steel) to 2.3e-5 /K (aluminium) and h = 0.1 m across
    the section (Boley and Weiner, *Theory of Thermal Stresses*, 1960, a beam with a gradient).

    :class:`ThermalElongation` displaces the end along the segment, this across it and turns all beyond. Where all
    differences are steady it is :class:`Geometric`; where they go with time it resembles :class:`Drift`, but turns
    with the pose.
    """

    name: ClassVar[str] = "thermal_bending"
    title: ClassVar[str] = "links that bow with heat"
    size_spread: ClassVar[float] = UNSOURCED

    def missing(self, observations: Observations) -> tuple[str, ...]:
        """Link temperatures, unless the difference of one to the robot's varies."""
        differences = (_difference(observations, column) for column in _columns(observations))
        if any(d is not None and np.ptp(d) > _STEADY for d in differences):
            return ()
        return _columns(observations)

    def reads(self, observations: Observations) -> tuple[str, ...]:
        """Return the recorded link temperatures, and the robot's."""
        own = [column for column in _columns(observations) if column in observations.covariates]
        return (*own, "temperature") if own and "temperature" in observations.covariates else tuple(own)

    def parameters(self, observations: Observations) -> tuple[Parameter, ...]:
        """Two curvatures per kelvin for each segment whose link's temperature is recorded; 1/(m·K)."""
        robot, found = observations.robot, []
        for s in beams(robot):
            segment = robot.segments[s]
            difference = _difference(observations, f"temperature.{segment.parent_link}")
            if difference is None:
                continue
            for k, axis in enumerate(cross_axes(robot, s)):
                shift = 0.5 * segment.length**2 * np.cross(axis, segment.direction)
                bow = at_segment(s, difference[:, None] * np.concatenate([shift, segment.length * axis]))
                label = f"curvature per kelvin of {segment.name}, axis {k + 1}"
                found.append(Parameter(label, "1/(m·K)", 1.5e-4, "link", segment.parent_link, (bow,)))
        return tuple(found)

    def driver(self, observations: Observations, parameters: Sequence[Parameter], error: Array) -> Driver | None:
        """Excess of the link's temperature over the robot's."""
        link = parameters[0].place
        difference = _difference(observations, f"temperature.{link}")
        return None if difference is None else (f"{link} warmer than the robot by", "K", difference)


def _columns(observations: Observations) -> tuple[str, ...]:
    """Return the temperature columns of the links that bend, recorded or not."""
    robot = observations.robot
    return tuple(dict.fromkeys(f"temperature.{robot.segments[s].parent_link}" for s in beams(robot)))


def _difference(observations: Observations, column: str) -> Array | None:
    """Excess (N,) of a link's temperature over the robot's, K; ``None`` where it is not recorded."""
    recorded = observations.covariates
    if column not in recorded:
        return None
    general = recorded.get("temperature")
    if general is None:
        general = np.mean([recorded[other] for other in _columns(observations) if other in recorded], axis=0)
    return np.asarray(recorded[column] - general)
