"""Links that bow because one side is warmer than the other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.effects.beam import beams, cross_axes
from thermal_robot.effects.effect import UNSOURCED, Driver, Effect, Parameter, at_segment

if TYPE_CHECKING:
    from thermal_robot.observations import Observations

_STEADY = 1e-9  # K


@dataclass(frozen=True)
class ThermalBending(Effect):
    """Every segment bows with how much warmer its link is than the robot: κ = g (T_link − T).

    What heats a link from one side (a motor, the sun, a drive) leaves its flanks unlike, and in proportion to how far
    the link has left the rest. A constant curvature κ about an axis across the segment turns its end by κ L and
    displaces it by ½ κ L². T is ``temperature``, or the mean of the links' where that is not recorded. Two parameters
    a segment, 1/(m·K), one for each axis across it. Expected size 1.5e-4 /(m·K): α/h for flanks that differ by as much
    as the link from the robot, with α = 1.2e-5 (steel) to 2.3e-5 /K (aluminium) and h = 0.1 m across the section
    (Boley and Weiner, *Theory of Thermal Stresses*, 1960, a beam with a gradient).

    :class:`ThermalElongation` displaces the end along the segment, this across it and turns all beyond. Where all
    differences are steady it is :class:`Geometric`; where they go with time it resembles :class:`Drift`, but turns
    with the pose.
    """

    name: ClassVar[str] = "thermal_bending"
    title: ClassVar[str] = "links that bow with heat"
    size_spread: ClassVar[float] = UNSOURCED

    def missing(self, observations: Observations) -> tuple[str, ...]:
        """Return the links' temperatures, unless the difference of one to the robot's varies."""
        differences = (_difference(observations, link) for link in _links(observations))
        if any(d is not None and np.ptp(d) > _STEADY for d in differences):
            return ()
        return tuple(f"temperature.{link}" for link in _links(observations))

    def reads(self, observations: Observations) -> tuple[str, ...]:
        """Return the links' temperatures that were recorded, and the robot's."""
        own = [f"temperature.{link}" for link in _links(observations)]
        own = [column for column in own if column in observations.covariates]
        return (*own, "temperature") if own and "temperature" in observations.covariates else tuple(own)

    def parameters(self, observations: Observations) -> tuple[Parameter, ...]:
        """Return two curvatures per kelvin for each segment whose link's temperature is recorded; 1/(m·K)."""
        robot = observations.robot
        found = []
        for s in beams(robot):
            segment = robot.segments[s]
            difference = _difference(observations, segment.parent_link)
            if difference is None:
                continue
            for k, axis in enumerate(cross_axes(robot, s)):
                shift = 0.5 * segment.length**2 * np.cross(axis, segment.direction)
                twist = difference[:, None] * np.concatenate([shift, segment.length * axis])
                label = f"curvature per kelvin of {segment.name}, axis {k + 1}"
                found.append(Parameter(label, "1/(m·K)", 1.5e-4, "link", segment.parent_link, (at_segment(s, twist),)))
        return tuple(found)

    def driver(self, observations: Observations, parameters: Sequence[Parameter], error: Array) -> Driver | None:
        """Return how much warmer the link is than the robot."""
        link = parameters[0].place
        difference = _difference(observations, link)
        return None if difference is None else (f"{link} warmer than the robot by", "K", difference)


def _links(observations: Observations) -> tuple[str, ...]:
    robot = observations.robot
    return tuple(dict.fromkeys(robot.segments[s].parent_link for s in beams(robot)))


def _difference(observations: Observations, link: str) -> Array | None:
    """(N,) how much warmer a link is than the robot, K; ``None`` where the link's temperature is not recorded."""
    recorded = observations.covariates
    own = recorded.get(f"temperature.{link}")
    if own is None:
        return None
    general = recorded.get("temperature")
    if general is None:
        columns = (f"temperature.{other}" for other in _links(observations))
        general = np.mean([recorded[column] for column in columns if column in recorded], axis=0)
    return np.asarray(own - general)
