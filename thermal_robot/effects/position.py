"""Periodic and linear errors of a joint in its own position: gain, eccentricity, gear ripple."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import TYPE_CHECKING, Annotated, ClassVar

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.effects.arguments import Count, Order, Positive
from thermal_robot.effects.effect import Driver, Effect, Parameter, at_joint
from thermal_robot.effects.fading import Fading, ends, left_at
from thermal_robot.effects.quantities import position_of, unit
from thermal_robot.schema import word

if TYPE_CHECKING:
    from thermal_robot.observations import Observations

_GAIN = 5e-4
_ECCENTRIC, _RIPPLE = 3e-4, 1e-4  # rad or m
_WHEELS = 2  # orders up to this one are alike in size; above it sizes fall as one over the order
_NEVER = 1e-300  # prior probability of a ripple without waves
_NEAR = 0.2  # orders: as near as a wave's peak tells an order, over a good part of a turn


@dataclass(frozen=True)
class OfPosition(Fading):
    """Errors as functions of the joint's own position, which fade together beyond its measured range.

    After a whole turn, gains and waves of integer order are known everywhere; so is the gain of a prismatic joint.
    """

    def _ended(self, observations: Observations, joint: int, order: float) -> tuple[Array, Array]:
        """Positions (N,) of a joint clipped to where the effect was found, and the fading factor; order 0 is a gain."""
        x, slides = observations.q[:, joint], observations.robot.joint_types[joint] == "prismatic"
        if not self.found:
            return x, np.ones(len(x))
        low, high = self.found[2 * joint : 2 * joint + 2]
        turned = (high - low) / (2.0 * np.pi) >= 1.0
        if (slides and not order) or (not slides and turned and not order % 1.0):
            return x, np.ones(len(x))
        return np.clip(x, low, high), left_at(x, low, high)

    def curves(self, observations: Observations, of: Sequence[tuple[str, float, str, float]]) -> tuple[Parameter, ...]:
        """Make parameters by joint, order, words and size: amplitudes of sine and cosine, or one gain for order 0."""
        robot, parts = observations.robot, []
        found: list[Parameter] = []
        for joint, order, words, size in of:
            j = robot.joint_names.index(joint)
            x, left = self._ended(observations, j, order)
            functions, labels, own = x[:, None], [words], "1"
            if order:
                functions, own = np.column_stack([np.sin(order * x), np.cos(order * x)]), unit(robot, joint)
                labels = [f"{wave}, order {order:.6g}{words}" for wave in ("sine", "cosine")]
            first = len(found)
            part = replace(self, means=self.means[first : first + len(labels)])
            for label, values in zip(labels, part.faded(functions, left).T, strict=True):
                found.append(Parameter(label, own, size, "joint", joint, (at_joint(j, values),)))
                parts.append(left)
        return self.registered(found, parts)

    def driver(self, observations: Observations, parameters: Sequence[Parameter], error: Array) -> Driver | None:
        """Position of the joint."""
        return position_of(observations, parameters[0].place)

    def elsewhere(self, observations: Observations) -> Effect:
        """Copy for another campaign, without the range where it was found."""
        return replace(self, found=(), means=(), rests=())

    def delivered(self, observations: Observations) -> Effect:
        """Copy with the measured range of each joint, and the mean of each function there."""
        own = self.elsewhere(observations).parameters(observations)
        means = tuple(float(np.mean(p.responses[0].values)) for p in own)
        return replace(self, found=tuple(end for q in observations.q.T for end in ends(q)), means=means)


@dataclass(frozen=True)
class JointGain(OfPosition):
    """Gain error of an encoder or gear ratio: q_actual = q_command + g_j q_command.

    Expected size 5e-4, and seldom above 1e-3: a belt's pitch, a ball screw's lead or a mis-set ratio, where the encoder
    sits on the motor. Over a small range of a joint it cannot be told from one period of :class:`TransmissionError`.
    """

    name: ClassVar[str] = "joint_gain"
    title: ClassVar[str] = "joint gain errors"
    singular: ClassVar[str] = "a gain error"

    def parameters(self, observations: Observations) -> tuple[Parameter, ...]:
        """One gain error a joint; dimensionless."""
        return self.curves(
            observations, [(joint, 0.0, "gain error", _GAIN) for joint in observations.robot.joint_names]
        )


@dataclass(frozen=True)
class TransmissionError(OfPosition):
    """Transmission error of low order: q_actual = q_command + Σ_k a_k sin(k q) + b_k cos(k q).

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

    def variants(self, observations: Observations) -> tuple[Effect, ...]:
        """Return the settings: all orders, or one alone; with a stated gear ratio, wheels of both sides, or of one."""
        stated = set(observations.campaign.gears) & set(observations.robot.joint_names)
        sides = [replace(self, side=side) for side in ("joint", "motor")] if stated else [self]
        alone = [replace(own, harmonics=(k,)) for own in sides for k in self.harmonics if len(self.harmonics) > 1]
        return tuple(dict.fromkeys((self, *sides, *alone)))

    def parameters(self, observations: Observations) -> tuple[Parameter, ...]:
        """Two amplitudes a joint and order; rad. Prismatic joints have a period only with a ratio in rad/m."""
        robot, gears, of = observations.robot, observations.campaign.gears, []
        for joint, kind in zip(robot.joint_names, robot.joint_types, strict=True):
            turns = [1.0] if kind != "prismatic" and self.side != "motor" else []
            turns += [float(gears[joint])] if joint in gears and self.side != "joint" else []
            every = itertools.product(turns, self.harmonics)
            of += [(joint, ratio * k, "", _ECCENTRIC * min(1.0, _WHEELS / k)) for ratio, k in every]
        return self.curves(observations, of)


@dataclass(frozen=True)
class JointRipple(OfPosition):
    """Transmission error of high order, ripple: q_actual = q_command + Σ_k a_k sin(n_k q) + b_k cos(n_k q).

    Teeth, balls and the motor's own wheel come round n times in a turn of the joint; n need be no whole number.
    Expected size 0.1 mrad: strain-wave gears are rated for 1 to 2 minutes of arc peak to peak, most of it twice a turn
    of the motor; the waves of three UR robots have amplitudes of 0.02 to 0.33 mrad. An order near a whole or half
    multiple of a stated gear ratio is reported as the motor's.

    ``orders`` (rad per rad; rad/m where the joint slides) are looked for in what remains, joint by joint
    (:mod:`thermal_robot.inference.generate`); ``tried`` is among how many waves all of these were picked, the product
    of the numbers for each. Without waves the effect does nothing.
    """

    joints: tuple[str, ...] = ()
    orders: tuple[Positive, ...] = ()
    tried: Count = 1.0

    name: ClassVar[str] = "joint_ripple"
    title: ClassVar[str] = "ripple of the gears"
    singular: ClassVar[str] = "a ripple of the gear"

    @property
    def share(self) -> float:
        """Prior probability 1/``tried``, as the orders were picked among many; next to none without waves."""
        return 1.0 / self.tried if self.orders else _NEVER

    def having(self, joint: str, order: float, tried: float) -> JointRipple:
        """Copy with one wave more, selected among so many."""
        product = self.tried * max(tried, 1.0)
        return replace(self, joints=(*self.joints, joint), orders=(*self.orders, order), tried=product)

    def parameters(self, observations: Observations) -> tuple[Parameter, ...]:
        """Two amplitudes a wave; rad, or m where the joint slides."""
        gears, pairs = observations.campaign.gears, zip(self.joints, self.orders, strict=True)
        of = [(joint, order, _of_motor(order, gears.get(joint)), _RIPPLE) for joint, order in pairs]
        return self.curves(observations, of)


def _of_motor(order: float, ratio: float | None) -> str:
    """Say how often a wave comes round in a turn of the motor, if that is near a whole or half number; else empty."""
    if ratio is None:
        return ""
    times = Fraction(order / ratio).limit_denominator(2)
    return f" ({times} a turn of the motor)" if times and abs(order - float(times) * ratio) < _NEAR else ""
