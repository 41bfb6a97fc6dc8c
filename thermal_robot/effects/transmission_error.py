"""Eccentric gears and encoders: an error that is periodic in the joint position."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, ClassVar

from thermal_robot.effects.arguments import Order
from thermal_robot.effects.effect import SOURCED, Effect, Parameter
from thermal_robot.effects.fading import OfPosition
from thermal_robot.schema import word

if TYPE_CHECKING:
    from thermal_robot.observations import Observations

_AMPLITUDE = 3e-4  # rad
_WHEELS = 2  # orders up to this one are alike in size; above it sizes fall as one over the order


@dataclass(frozen=True)
class TransmissionError(OfPosition):
    """Every joint deviates periodically: q_actual = q_command + Σ_k a_k sin(k q) + b_k cos(k q).

    An eccentric wheel or encoder disc on the joint's side gives order 1, an oval one order 2; where the campaign states
    a gear ratio (``[gears]``), those of the motor's ``side`` give the ratio and twice that. Expected size 0.3 mrad, one
    minute of arc: catalogues of strain-wave gears state 1 to 2′ from peak to peak.

    ``harmonics`` are orders a turn of the wheel, on either side.
    """

    harmonics: tuple[Order, ...] = (1, 2)
    side: Annotated[str, word(("joint", "motor", "both"))] = "both"

    name: ClassVar[str] = "transmission_error"
    title: ClassVar[str] = "periodic transmission errors"
    singular: ClassVar[str] = "a periodic transmission error"
    sized_as: ClassVar[str] = "peak to peak"
    size_spread: ClassVar[float] = SOURCED

    def variants(self, observations: Observations) -> tuple[Effect, ...]:
        """All orders, or one alone; where the ratio of a motor is stated, wheels of both sides, or of one."""
        stated = set(observations.campaign.gears) & set(observations.robot.joint_names)
        sides = [replace(self, side=side) for side in ("joint", "motor")] if stated else [self]
        alone = [replace(own, harmonics=(k,)) for own in sides for k in self.harmonics if len(self.harmonics) > 1]
        return tuple(dict.fromkeys((self, *sides, *alone)))

    def parameters(self, observations: Observations) -> tuple[Parameter, ...]:
        """Two amplitudes a joint and order; rad. Prismatic joints have a period only with a ratio in rad/m."""
        robot, gears = observations.robot, observations.campaign.gears
        found = []
        for joint, kind in zip(robot.joint_names, robot.joint_types, strict=True):
            turns = [1.0] if kind != "prismatic" and self.side != "motor" else []
            turns += [float(gears[joint])] if joint in gears and self.side != "joint" else []
            every = itertools.product(turns, self.harmonics)
            found += [(joint, ratio * k, "", _amplitude(k)) for ratio, k in every]
        return self.waves(observations, found)


def _amplitude(order: int) -> float:
    """Return the expected size of one wave; rad."""
    return float(_AMPLITUDE * min(1.0, _WHEELS / order))
