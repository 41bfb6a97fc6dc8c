"""Extrapolation of effects with empirical curves: beyond the measured range they fade to their mean.

A function of x, of mean m over the rows where it was found, is there what it is. At a distance d beyond the range of
width r it is m + (f(x̂) − m) exp(−½ (d / (s r))²), x̂ the nearer end and s = :data:`settings.FADES`: continuous, never
further from m than at the edge, and a hundredth of that at three s r. The mean stays: it is a constant error of the
place, a zero or a frame, and what was fitted beside the function takes it for granted. Where nothing was but the
unknown frames, m is what these take over of the function as they are fitted without it: there is registration alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.effects import settings
from thermal_robot.effects.effect import Effect, Parameter, at_base, at_tool

_OF_A_MODEL = ("found", "means", "rests", "fades")


@dataclass(frozen=True)
class Fading(Effect):
    """Effect with the range of its driver in which it was ``found``; empty where it does not fade.

    It ``fades`` beyond, or keeps the value of the edge. ``means``: of each of its functions over the rows where it was
    found, zero where absent; ``rests``: twists of the base (6) and of the tool (6) that the fitted frames absorb per
    unit of each parameter.
    """

    found: tuple[float, ...] = field(default=(), kw_only=True)
    means: tuple[float, ...] = field(default=(), kw_only=True)
    rests: tuple[float, ...] = field(default=(), kw_only=True)
    fades: bool = field(default=True, kw_only=True)

    def arguments(self) -> dict[str, Any]:
        """Return the constructor arguments for saving; the range only where it has one."""
        return {k: v for k, v in super().arguments().items() if self.found or k not in _OF_A_MODEL}

    def faded(self, functions: Array, left: Array) -> Array:
        """Functions (N, K) whose deviations from their means are multiplied by the factor (N,)."""
        means = np.array(self.means) if self.means else np.zeros(functions.shape[1])
        return np.asarray(means + (functions - means) * left[:, None]) if self.fades else functions

    def registered(self, parameters: Sequence[Parameter], left: Sequence[Array]) -> tuple[Parameter, ...]:
        """Parameters with the part that the frames absorb at the fading factors (N,)."""
        if not self.rests or not self.fades:
            return tuple(parameters)
        twists = [np.outer(1.0 - own, self.rests[12 * k : 12 * k + 12]) for k, own in enumerate(left)]
        taken = [(at_base(twist[:, :6]), at_tool(twist[:, 6:])) for twist in twists]
        return tuple(replace(p, responses=(*p.responses, *t)) for p, t in zip(parameters, taken, strict=True))


def ends(values: Array) -> tuple[float, float]:
    """Range, least and largest, of (N,) values."""
    return float(values.min()), float(values.max())


def left_at(values: Array, low: float, high: float) -> Array:
    """Fading factor (N,), 1 to 0, of an effect at values of its driver, for the range in which it was found."""
    beyond = (values - np.clip(values, low, high)) / (settings.FADES * ((high - low) or 1.0))
    return np.asarray(np.exp(-0.5 * beyond**2))
