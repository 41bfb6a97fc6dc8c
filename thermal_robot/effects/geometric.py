"""Manufacturing and assembly errors of the joint placements."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.effects.effect import TWIST, Driver, Effect, Parameter, at_segment
from thermal_robot.effects.quantities import position_of, unit

if TYPE_CHECKING:
    from thermal_robot.observations import Observations

SIZE = 5e-4
"""m and rad a component: see :class:`Geometric`."""
NEARLY_PARALLEL = 0.1
"""Sine of the angle of two successive axes below which a turn across both stands for a shift along one, whose effect
then is that of a neighbour's (Hayati and Mirmirani, *Journal of Robotic Systems* 2, 1985)."""


@dataclass(frozen=True)
class Geometric(Effect):
    """Every segment's placement is off by a constant twist: P_s exp(ξ_s), ξ_s = (translation, rotation), LOCAL.

    Expected size 0.5 mm and 0.5 mrad a component, what uncalibrated industrial arms show (Mooring, Roth and
    Driels 1991; the UR and ABB arms of the public campaigns); an arm that its maker calibrated shows tenths of that, a
    light one several times as much.

    The six parameters of a segment are redundant along and about parallel axes and with unknown frames; the prior
    sizes hold what the data do not determine. It contains :class:`JointOffset`, :class:`InstrumentScale` and
    :class:`ThermalElongation` at constant temperature.
    """

    name: ClassVar[str] = "geometric"
    title: ClassVar[str] = "geometric errors of the links"
    size_spread: ClassVar[float] = 1.0
    constant: ClassVar[bool] = True

    def parameters(self, observations: Observations) -> tuple[Parameter, ...]:
        """Three translations (m) and three rotations (rad) a segment, in the placement's own frame."""
        twists, segments = np.eye(6), observations.robot.segments
        # a fixed frame before a joint is part of the body that the joint's own placement describes
        last = max(s for s, segment in enumerate(segments) if segment.movable)
        return tuple(
            Parameter(
                f"{component} of {segment.name}", one, SIZE, "link", segment.parent_link, (at_segment(s, twists[k]),)
            )
            for s, segment in enumerate(segments)
            if segment.movable or s > last
            for k, (component, one) in enumerate(TWIST)
        )

    def independent(self, observations: Observations) -> tuple[Parameter, ...]:
        """Errors of the parameters of Denavit and Hartenberg (1955) but for the zeros, which are the joints' own.

        Of each joint's axis: its distance from the axis before it, its twist about their common normal, its shift along
        itself, or its turn if the joint slides (a, α, d, θ); where both are nearly parallel also a turn across (β).
        """
        chain, robot = observations.commanded, observations.robot
        found, before = [], None
        for s, segment in enumerate(robot.segments):
            if not segment.movable:
                continue
            turned, origin = chain.rotations[0, segment.index], chain.positions[0, segment.index]
            axis = turned @ robot.chain.axes[segment.index]
            slides = segment.joint is not None and unit(robot, segment.joint) == "m"
            for label, measured, shift, turn in _of_axis(before, (origin, axis), slides):
                twist = np.concatenate([turned.T @ shift, turned.T @ turn])
                name = f"{label} of {segment.name}"
                found.append(Parameter(name, measured, SIZE, "link", segment.parent_link, (at_segment(s, twist),)))
            before = origin, axis
        return tuple(p for p in found if not self.places or p.place in self.places)

    def driver(self, observations: Observations, parameters: Sequence[Parameter], error: Array) -> Driver | None:
        """Return the position of the joint whose placement it is, or of the one that it mimics."""
        joint = observations.robot.segments[parameters[0].responses[0].index].joint
        return position_of(observations, joint) if joint else None


def _of_axis(
    before: tuple[Array, Array] | None, own: tuple[Array, Array], slides: bool
) -> Iterator[tuple[str, str, Array, Array]]:
    """Yield label, unit and unit twist (shift of its origin, turn) of an axis (origin, direction), root frame.

    Turns are about the foot of the common normal, so that the distance stays.
    """
    origin, axis = own
    still = np.zeros(3)
    if before is not None:
        first, along = before
        normal, span = np.cross(along, axis), first - origin
        parallel = float(np.linalg.norm(normal)) < NEARLY_PARALLEL
        if parallel:
            normal = span - (span @ axis) * axis
            normal = normal if normal @ normal > 0.0 else np.cross(axis, np.eye(3)[int(np.abs(axis).argmin())])
        normal = normal / np.linalg.norm(normal)
        foot = 0.0 if parallel else float(np.cross(span, along) @ np.cross(axis, along)) / (1.0 - (axis @ along) ** 2)
        yield "distance a", "m", normal, still
        yield "twist α", "rad", np.cross(normal, -foot * axis), normal
        if parallel:
            yield "turn β", "rad", still, np.cross(axis, normal)
    yield ("turn θ", "rad", still, axis) if slides else ("shift d", "m", axis, still)
