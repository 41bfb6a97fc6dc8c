"""Extrapolation of effects with empirical curves: beyond the measured range they fade to their mean.

A function f(x), of mean m over the rows where it was found, is unchanged within their range. At a distance d beyond
that range of width r it is m + (f(x̂) − m) exp(−½ (d / (s r))²), x̂ the nearer end and s = :data:`settings.FADES`:
continuous, never further from m than at the edge, and a hundredth of that at three s r. The mean stays: it is a
constant error of the place, a zero or a frame, and what was fitted beside the function takes it for granted. Where only
the unknown frames were fitted beside it, m is the part of the function that frames fitted without it absorb: far from
the range the correction is registration alone.
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

    Beyond that range it ``fades``, or else keeps the value at the edge. ``means``: means of its functions over the rows
    where it was found, zero where absent; ``rests``: twists of the base (6) and of the tool (6) that the fitted frames
    absorb per unit of each parameter.
    """

    found: tuple[float, ...] = field(default=(), kw_only=True)
    means: tuple[float, ...] = field(default=(), kw_only=True)
    rests: tuple[float, ...] = field(default=(), kw_only=True)
    fades: bool = field(default=True, kw_only=True)

    def arguments(self) -> dict[str, Any]:
        """Return the constructor arguments for saving; those of the fading only where it has a range."""
        return {k: v for k, v in super().arguments().items() if self.found or k not in _OF_A_MODEL}

    def faded(self, functions: Array, left: Array) -> Array:
        """Functions (N, K) whose deviations from their means are multiplied by the fading factor ``left`` (N,)."""
        means = np.array(self.means) if self.means else np.zeros(functions.shape[1])
        return np.asarray(means + (functions - means) * left[:, None]) if self.fades else functions

    def registered(self, parameters: Sequence[Parameter], left: Sequence[Array]) -> tuple[Parameter, ...]:
        """Add to each parameter the base and tool motions that the frames absorbed, times 1 − its fading factor (N,).

        Unchanged where no such motions (``rests``) are known, or the effect does not fade.
        """
        if not self.rests or not self.fades:
            return tuple(parameters)
        twists = [np.outer(1.0 - own, self.rests[12 * k : 12 * k + 12]) for k, own in enumerate(left)]
        taken = [(at_base(twist[:, :6]), at_tool(twist[:, 6:])) for twist in twists]
        return tuple(replace(p, responses=(*p.responses, *t)) for p, t in zip(parameters, taken, strict=True))


def ends(values: Array) -> tuple[float, float]:
    """Return the range, minimum and maximum, of values (N,)."""
    return float(values.min()), float(values.max())


def left_at(values: Array, low: float, high: float) -> Array:
    """Fading factor (N,) of an effect at values of its driver: 1 in the range where it was found, Gaussian beyond."""
    beyond = (values - np.clip(values, low, high)) / (settings.FADES * ((high - low) or 1.0))
    return np.asarray(np.exp(-0.5 * beyond**2))
