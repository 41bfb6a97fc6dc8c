"""Effects that only a curve through measured rows tells: beyond these rows they fall back to their mean.

A function of x, of mean m over the rows where it was found, is there what it is. At a distance d beyond the range of
width r it is m + (f(x̂) − m) exp(−½ (d / (s r))²), x̂ the nearer end and s = :data:`settings.FADES`: continuous, never
further from m than at the edge, and a hundredth of that at three s r. The mean stays: it is a constant error of the
place, a zero or a frame, and what was fitted beside the function takes it for granted. Where nothing was but the
unknown frames, m is what these take over of the function as they are fitted without it: there is registration alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.effects import settings
from thermal_robot.effects.effect import Driver, Effect, Parameter, at_base, at_joint, at_tool
from thermal_robot.effects.quantities import position_of, unit

if TYPE_CHECKING:
    from thermal_robot.observations import Observations

_OF_A_MODEL = ("found", "means", "rests", "fades")


@dataclass(frozen=True)
class Fading(Effect):
    """An effect with the range of its driver in which it was ``found``; empty where it is to have no end.

    It ``fades`` beyond, or keeps the value of the edge. ``means``: of each of its functions over the rows where it was
    found, zero where absent; ``rests``: twists of the base (6) and of the tool (6) that frames take over of a unit of
    each parameter.
    """

    found: tuple[float, ...] = field(default=(), kw_only=True)
    means: tuple[float, ...] = field(default=(), kw_only=True)
    rests: tuple[float, ...] = field(default=(), kw_only=True)
    fades: bool = field(default=True, kw_only=True)

    def arguments(self) -> dict[str, Any]:
        """Return the constructor's arguments, for saving; the range only where it has one."""
        given = super().arguments()
        return {k: v for k, v in given.items() if self.found or k not in _OF_A_MODEL}

    @property
    def endless(self) -> Effect:
        """It without a range."""
        return replace(self, found=(), means=(), rests=())

    def unfaded(self) -> Effect:
        """Return it as it keeps the value of the edge."""
        return replace(self, fades=False) if self.found else self

    def faded(self, functions: Array, left: Array) -> Array:
        """(N, K) functions, of which so much (N,) or (N, K) is left of what they differ by from their means."""
        means = np.array(self.means) if self.means else np.zeros(functions.shape[1])
        return np.asarray(means + (functions - means) * left.reshape(len(functions), -1)) if self.fades else functions

    def registered(self, parameters: Sequence[Parameter], left: Sequence[Array]) -> tuple[Parameter, ...]:
        """Return parameters with what the frames take over of each where so much, (N,) each, is left of it."""
        if not self.rests or not self.fades:
            return tuple(parameters)
        twists = [np.outer(1.0 - own, self.rests[12 * k : 12 * k + 12]) for k, own in enumerate(left)]
        taken = [(at_base(twist[:, :6]), at_tool(twist[:, 6:])) for twist in twists]
        return tuple(replace(p, responses=(*p.responses, *t)) for p, t in zip(parameters, taken, strict=True))


def ends(values: Array) -> tuple[float, float]:
    """Return the least and the largest of (N,) values."""
    return float(values.min()), float(values.max())


def left_at(values: Array, low: float, high: float) -> Array:
    """(N,) what is left of an effect at values of what drives it, found from one end to the other."""
    beyond = (values - np.clip(values, low, high)) / (settings.FADES * ((high - low) or 1.0))
    return np.asarray(np.exp(-0.5 * beyond**2))


@dataclass(frozen=True)
class OfPosition(Fading):
    """Functions of the joints' own positions: all that a joint has end together, as they may cancel in part.

    Over less than a turn a gain, slow waves and laws look alike, and only their sum is known. What has seen a whole
    turn is known everywhere, if it comes back after a turn or is a gain; so is the gain of a joint that slides.
    """

    def ended(self, observations: Observations, joint: int, order: float = 0.0) -> tuple[Array, Array]:
        """Return (N,) positions at which functions of a joint are read, and what is left of them; order 0 is a gain."""
        x, slides = observations.q[:, joint], observations.robot.joint_types[joint] == "prismatic"
        if not self.found:
            return x, np.ones(len(x))
        low, high = self.found[2 * joint : 2 * joint + 2]
        turns = (high - low) / (2.0 * np.pi)
        if (slides and not order) or (not slides and turns >= 1.0 and not order % 1.0):
            return x, np.ones(len(x))
        return np.clip(x, low, high), left_at(x, low, high)

    def driver(self, observations: Observations, parameters: Sequence[Parameter], error: Array) -> Driver | None:
        """Return the joint's own position."""
        return position_of(observations, parameters[0].place)

    def elsewhere(self, observations: Observations) -> Effect:
        """Return the functions without a range: another campaign has its own."""
        return self.endless

    def waves(self, observations: Observations, of: Sequence[tuple[str, float, str, float]]) -> tuple[Parameter, ...]:
        """Return two amplitudes for each joint, order, words and expected size; rad, or m where it slides."""
        robot, found, parts = observations.robot, [], []
        for k, (joint, order, words, size) in enumerate(of):
            j, own = robot.joint_names.index(joint), unit(robot, joint)
            x, left = self.ended(observations, j, order)
            part = replace(self, means=self.means[2 * k : 2 * k + 2])
            functions = part.faded(np.column_stack([np.sin(order * x), np.cos(order * x)]), left)
            for what, values in zip(("sine", "cosine"), functions.T, strict=True):
                label = f"{what}, order {order:.6g}{words}"
                found.append(Parameter(label, own, size, "joint", joint, (at_joint(j, values),)))
                parts.append(left)
        return self.registered(found, parts)

    def delivered(self, observations: Observations) -> Effect:
        """Return the functions with the range of each joint, and the mean of each there."""
        means = [float(np.mean(p.responses[0].values)) for p in self.endless.parameters(observations)]
        return replace(self, found=tuple(end for q in observations.q.T for end in ends(q)), means=tuple(means))
