"""Eccentric gears and encoders: an error that is periodic in the joint position."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, ClassVar

import numpy as np

from thermal_robot.effects.arguments import Order
from thermal_robot.effects.effect import SOURCED, Effect, Parameter
from thermal_robot.effects.fading import OfPosition
from thermal_robot.schema import word

if TYPE_CHECKING:
    from thermal_robot.observations import Observations

_AMPLITUDE = 3e-4  # rad
_WHEELS = 2  # orders up to this one are alike in size; above it sizes fall as one over the order
_CURVE = tuple(range(1, 9))
_NOT_LEARNT = 0.05  # of the logarithm of its size: a curve that could grow would follow ripple and steps, too


@dataclass(frozen=True)
class TransmissionError(OfPosition):
    """Every joint deviates periodically: q_actual = q_command + Σ_k a_k sin(k q) + b_k cos(k q).

    An eccentric wheel or encoder disc on the joint's side gives order 1, an oval one order 2; where the campaign states
    a gear ratio (``[gears]``), those of the motor's ``side`` give the ratio and twice that. Expected size 0.3 mrad, one
    minute of arc: catalogues of strain-wave gears state 1 to 2′ from peak to peak.

    Over part of a turn orders 1 and 2 are nearly a line and a parabola. Where a joint errs by neither, they come out
    many times too large (4 mrad in a UR10, for 0.3 mrad over 2 rad). Its error curve has all orders from 1 to 8, above
    2 of sizes that fall as one over the order, and all together as large as one wave. It could take any shape: its size
    is that of the source, not learnt. ``harmonics`` are orders a turn of the wheel, on either side.
    """

    harmonics: tuple[Order, ...] = (1, 2)
    side: Annotated[str, word(("joint", "motor", "both"))] = "both"

    name: ClassVar[str] = "transmission_error"
    title: ClassVar[str] = "periodic transmission errors"
    singular: ClassVar[str] = "a periodic transmission error"
    sized_as: ClassVar[str] = "peak to peak"

    @property
    def size_spread(self) -> float:  # type: ignore[override]  # read like the constant of other effects
        """Of a curve, which could take any shape, the size is that of the catalogues."""
        return _NOT_LEARNT if set(_CURVE) <= set(self.harmonics) else SOURCED

    def in_full(self) -> Effect | None:
        """Return the error curve of each joint: all orders from 1 to 8."""
        return replace(self, harmonics=_CURVE) if set(self.harmonics) < set(_CURVE) else None

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
            found += [(joint, ratio * k, "", _amplitude(k, self.harmonics)) for ratio, k in every]
        return self.waves(observations, found)


def _amplitude(order: int, harmonics: tuple[int, ...]) -> float:
    """Return the expected size of one wave; rad. Those of a curve have the mean square of one alone between them."""
    falling = [min(1.0, _WHEELS / k) for k in harmonics]
    whole = np.linalg.norm(falling) if set(_CURVE) <= set(harmonics) else 1.0
    return float(_AMPLITUDE * min(1.0, _WHEELS / order) / whole)
