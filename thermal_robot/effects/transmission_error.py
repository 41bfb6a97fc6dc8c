"""Eccentric gears and encoders: an error that is periodic in the joint position."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from thermal_robot.effects.effect import Array, Driver, Effect, Parameter, at_joint
from thermal_robot.effects.quantities import position_of, unit

if TYPE_CHECKING:
    from thermal_robot.observations import Observations


@dataclass(frozen=True)
class TransmissionError(Effect):
    """Every joint deviates periodically: q_actual = q_command + Σ_k a_k sin(k q) + b_k cos(k q).

    An eccentric wheel or encoder disc on the joint's side gives order 1, an oval one order 2; where the campaign
    states a gear ratio (``[gears]``), those of the motor's side give the ratio and twice that. Expected size 0.3 mrad,
    one minute of arc: catalogues of strain-wave gears state 1 to 2′ from peak to peak.

    Attributes
    ----------
    harmonics
        Orders a turn of the wheel, on either side.
    side
        Whose wheels err: ``joint``, ``motor``, or ``both``.
    """

    harmonics: tuple[int, ...] = (1, 2)
    side: str = "both"

    name: ClassVar[str] = "transmission_error"
    title: ClassVar[str] = "periodic transmission errors"
    singular: ClassVar[str] = "a periodic transmission error"

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
        for j, (joint, kind) in enumerate(zip(robot.joint_names, robot.joint_types, strict=True)):
            turns = [1.0] if kind != "prismatic" and self.side != "motor" else []
            turns += [float(gears[joint])] if joint in gears and self.side != "joint" else []
            orders = [ratio * k for ratio in turns for k in self.harmonics]
            own = unit(robot, joint)
            for order in orders:
                angle = order * observations.q[:, j]
                found += [
                    Parameter(f"sine, order {order:g}", own, 3e-4, "joint", joint, (at_joint(j, np.sin(angle)),)),
                    Parameter(f"cosine, order {order:g}", own, 3e-4, "joint", joint, (at_joint(j, np.cos(angle)),)),
                ]
        return tuple(found)

    def driver(self, observations: Observations, parameters: Sequence[Parameter], error: Array) -> Driver | None:
        """Return the joint's own position."""
        return position_of(observations, parameters[0].place)
