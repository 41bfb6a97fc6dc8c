"""Manufacturing and assembly errors of the joint placements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from thermal_robot.effects.effect import TWIST, Array, Driver, Effect, Parameter, at_segment
from thermal_robot.effects.quantities import position_of

if TYPE_CHECKING:
    from thermal_robot.observations import Observations


@dataclass(frozen=True)
class Geometric(Effect):
    """Every segment's placement is off by a constant twist: P_s exp(ξ_s), ξ_s = (translation, rotation), LOCAL.

    Expected size 0.5 mm and 0.5 mrad a component, what uncalibrated industrial arms show (Mooring, Roth and
    Driels 1991; the UR and ABB arms of the public campaigns).

    The six parameters of a segment are redundant along and about parallel axes and with unknown frames; the prior
    sizes hold what the data do not determine. It contains :class:`JointOffset`, :class:`InstrumentScale` and
    :class:`ThermalElongation` at constant temperature.
    """

    name: ClassVar[str] = "geometric"
    title: ClassVar[str] = "geometric errors of the links"

    def parameters(self, observations: Observations) -> tuple[Parameter, ...]:
        """Three translations (m) and three rotations (rad) a segment, in the placement's own frame."""
        twists, segments = np.eye(6), observations.robot.segments
        # a fixed frame before a joint is part of the body that the joint's own placement describes
        last = max(s for s, segment in enumerate(segments) if segment.movable)
        return tuple(
            Parameter(
                f"{component} of {segment.name}", unit, 5e-4, "link", segment.parent_link, (at_segment(s, twists[k]),)
            )
            for s, segment in enumerate(segments)
            if segment.movable or s > last
            for k, (component, unit) in enumerate(TWIST)
        )

    def driver(self, observations: Observations, parameters: Sequence[Parameter], error: Array) -> Driver | None:
        """Return the position of the joint whose placement it is, or of the one that it mimics."""
        joint = observations.robot.segments[parameters[0].responses[0].index].joint
        return position_of(observations, joint) if joint else None
