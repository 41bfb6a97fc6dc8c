"""From values to displacement: what a set of fitted effects does to the robot."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.effects.effect import Effect, Parameter
from thermal_robot.effects.gate import checked, missing
from thermal_robot.errors import EffectError
from thermal_robot.kinematics import Displacement

if TYPE_CHECKING:
    from thermal_robot.observations import Observations


def displacement(
    observations: Observations, effects: Sequence[tuple[Effect, Array]]
) -> tuple[Displacement, Array | None]:
    """Displacement of the chain's four channels by fitted values (P,) of effects, and of the measured point (N, 3), m.

    The latter stands in the measurement frame, ``None`` where no effect acts on the instrument. Raises
    :class:`EffectError` if parameters break the contract, or are not as many as the values: the rows lack what the
    effect reads.
    """
    samples, robot = observations.campaign.samples, observations.robot
    joint = np.zeros((samples, robot.n))
    segment = np.zeros((samples, len(robot.segments), 6))
    base, tool = np.zeros((samples, 6)), np.zeros((samples, 6))
    instrument: Array | None = None
    for effect, values in effects:
        for parameter, value in zip(_as_many(effect, observations, len(values)), values, strict=True):
            for response in parameter.responses:
                moved = value * response.values
                if response.channel == "joint":
                    joint[:, response.index] += moved
                elif response.channel == "segment":
                    segment[:, response.index] += moved
                elif response.channel == "base":
                    base += moved
                elif response.channel == "tool":
                    tool += moved
                else:
                    instrument = moved if instrument is None else instrument + moved
    return Displacement(joint=joint, segment=segment, base=base, tool=tool), instrument


def _as_many(effect: Effect, observations: Observations, values: int) -> tuple[Parameter, ...]:
    """Return the parameters of an effect that has so many values."""
    found = checked(effect, observations)
    if len(found) != values:
        lacking = ", ".join(missing(effect, observations))
        raise EffectError(
            f"effect {effect.name!r} was fitted with {values} parameters and has {len(found)} in these rows"
            + (f", which lack {lacking}" if lacking else "")
        )
    return found
