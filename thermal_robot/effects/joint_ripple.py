"""Ripple of the gears: errors that come back many times in a turn of the joint, of orders that the data tell."""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction
from typing import TYPE_CHECKING, ClassVar

from thermal_robot.effects.arguments import Count, Positive
from thermal_robot.effects.effect import Effect, Parameter
from thermal_robot.effects.fading import OfPosition

if TYPE_CHECKING:
    from thermal_robot.observations import Observations

_AMPLITUDE = 1e-4  # rad or m
_NEVER = 1e-300
_NEAR = 0.2  # orders: as near as a wave's peak tells an order, over a good part of a turn


@dataclass(frozen=True)
class JointRipple(OfPosition):
    """A joint errs by waves of its own position: q_actual = q_command + Σ_k a_k sin(n_k q) + b_k cos(n_k q).

    Teeth, balls and the motor's own wheel come round n times in a turn of the joint; n need be no whole number. Strain
    wave gears are rated for a transmission error of 1 to 2 minutes of arc peak to peak, most of it twice a turn of the
    motor; the waves of three UR robots have amplitudes of 0.02 to 0.33 mrad. Expected size 0.1 mrad. What comes round
    once or twice in a turn is :class:`TransmissionError`. Where the campaign states a gear ratio, an order near a whole
    or half multiple of it is said to be the motor's.

    ``orders`` (rad per rad; rad/m where the joint slides) are no parameters: they are looked for in what remains, joint
    by joint, and join one after another (:mod:`thermal_robot.inference.generate`); ``tried`` is among how many
    waves all of these were picked, the product of the numbers for each. Without waves the effect does nothing.
    """

    joints: tuple[str, ...] = ()
    orders: tuple[Positive, ...] = ()
    tried: Count = 1.0

    name: ClassVar[str] = "joint_ripple"
    title: ClassVar[str] = "ripple of the gears"
    singular: ClassVar[str] = "a ripple of the gear"
    sized_as: ClassVar[str] = "peak to peak"

    @property
    def share(self) -> float:
        """Of the prior probability: the orders are some of many. Without waves nothing can be at work."""
        return 1.0 / self.tried if self.orders else _NEVER

    def having(self, joint: str, order: float, tried: float) -> JointRipple:
        """Return the ripple with one wave more, that was picked among so many."""
        return replace(
            self, joints=(*self.joints, joint), orders=(*self.orders, order), tried=self.tried * max(tried, 1.0)
        )

    def parameters(self, observations: Observations) -> tuple[Parameter, ...]:
        """Two amplitudes a wave; rad, or m where the joint slides."""
        gears, pairs = observations.campaign.gears, zip(self.joints, self.orders, strict=True)
        of = [(joint, order, _of_motor(order, gears.get(joint)), _AMPLITUDE) for joint, order in pairs]
        return self.waves(observations, of)

    def at(self, place: str) -> Effect | None:
        """Waves have joints of their own."""
        return None


def _of_motor(order: float, ratio: float | None) -> str:
    """Return in words how often a wave comes round in a turn of the motor, where that is a whole or a half number."""
    if ratio is None:
        return ""
    times = Fraction(order / ratio).limit_denominator(2)
    return f" ({times} a turn of the motor)" if times and abs(order - float(times) * ratio) < _NEAR else ""
