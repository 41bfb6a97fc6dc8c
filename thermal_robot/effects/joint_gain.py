"""Encoder or gear-ratio error: proportional to the joint position."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

from thermal_robot.effects.effect import Parameter, at_joint
from thermal_robot.effects.fading import OfPosition

if TYPE_CHECKING:
    from thermal_robot.observations import Observations


@dataclass(frozen=True)
class JointGain(OfPosition):
    """Every joint moves by a little more or less than commanded: q_actual = q_command + g_j q_command.

    Expected size 5e-4, and seldom above 1e-3: a belt's pitch, a ball screw's lead or a mis-set ratio, where the encoder
    sits on the motor.
    Over a small range of a joint it cannot be told from one period of :class:`TransmissionError`.
    """

    name: ClassVar[str] = "joint_gain"
    title: ClassVar[str] = "joint gain errors"
    singular: ClassVar[str] = "a gain error"

    def parameters(self, observations: Observations) -> tuple[Parameter, ...]:
        """One gain error a joint; dimensionless."""
        found, parts = [], []
        for j, joint in enumerate(observations.robot.joint_names):
            x, left = self.ended(observations, j)
            values = replace(self, means=self.means[j : j + 1]).faded(x[:, None], left)[:, 0]
            found.append(Parameter("gain error", "1", 5e-4, "joint", joint, (at_joint(j, values),)))
            parts.append(left)
        return self.registered(found, parts)
