"""Drift of the base or of the instrument while the campaign runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.effects.arguments import NotNegative, Positive
from thermal_robot.effects.effect import TWIST, UNSOURCED, Driver, Effect, Parameter, at_base
from thermal_robot.effects.fading import Fading, ends
from thermal_robot.effects.quantities import driving

if TYPE_CHECKING:
    from thermal_robot.observations import Observations


@dataclass(frozen=True)
class Drift(Fading):
    """Drift: the base moves by a twist that grows with time from zero at the first measurement, exp(β(t)) T.

    Linear, β(t) = β (t − t₀)/span, or exponential, β(t) = β (1 − exp(−(t − t₀)/τ)) / (1 − exp(−span/τ)), so that β is
    the displacement over the campaign in both. Expected size 0.1 mm and 0.1 mrad. ``order`` takes the place of ``time``
    where there is no time column. A model holds what it had become by the end of the campaign. ``origin`` t₀ and
    ``span``, in the column's unit, are the campaign's; ``time_constant`` is τ over the span, 0 linear.
    """

    origin: float = 0.0
    span: Positive = 1.0
    time_constant: NotNegative = 0.0

    name: ClassVar[str] = "drift"
    title: ClassVar[str] = "drift of the base or the instrument"
    size_spread: ClassVar[float] = UNSOURCED

    def missing(self, observations: Observations) -> tuple[str, ...]:
        """Return ``time`` and ``order``, of which either will do, unless the clock (time, or else order) varies."""
        return () if observations.clock is not None and np.ptp(observations.clock) > 0 else ("time", "order")

    def reads(self, observations: Observations) -> tuple[str, ...]:
        """Return ``time``, or ``order`` in its place."""
        return ("time",) if "time" in observations.covariates else ("order",)

    def variants(self, observations: Observations) -> tuple[Effect, ...]:
        """Linear, and exponential with time constants of 0.1, 0.25 and 0.6 of the campaign."""
        clock = observations.clock
        if clock is None:
            return (self,)
        fitted = replace(self, origin=float(clock.min()), span=float(np.ptp(clock)) or 1.0)
        return tuple(replace(fitted, time_constant=share) for share in (0.0, 0.1, 0.25, 0.6))

    def elsewhere(self, observations: Observations) -> Drift:
        """Copy for another campaign: the same rate from its own beginning."""
        clock = observations.clock
        return self if clock is None else replace(self, origin=float(clock.min()), found=())

    def delivered(self, observations: Observations) -> Effect:
        """Copy with the campaign's first and last instant as the range, beyond which the drift stays what it was."""
        return self if observations.clock is None else replace(self, found=ends(observations.clock))

    def nearby(self, factor: float) -> tuple[Effect, ...]:
        """Neighbours of a setting: the time constant times and over a factor; for the linear law, long ones."""
        shares = (0.0, 1.0, 2.0) if self.time_constant == 0.0 else (1.0, factor, 1.0 / factor)
        base = self.time_constant or 1.0
        return tuple(replace(self, time_constant=base * share) for share in shares)

    def parameters(self, observations: Observations) -> tuple[Parameter, ...]:
        """Twist of the base over the campaign, in the root frame: m and rad."""
        clock = observations.clock
        if clock is None:
            return ()
        if self.found and self.fades:
            clock = np.clip(clock, self.found[0], self.found[1])
        elapsed = (clock - self.origin) / self.span
        tau = self.time_constant
        grown = elapsed if tau == 0.0 else np.expm1(-elapsed / tau) / np.expm1(-1.0 / tau)
        return tuple(
            Parameter(component, unit, 1e-4, "base", "base", (at_base(grown[:, None] * np.eye(6)[k]),))
            for k, (component, unit) in enumerate(TWIST)
        )

    def driver(self, observations: Observations, parameters: Sequence[Parameter], error: Array) -> Driver | None:
        """Time, or order in its place."""
        return driving(observations, "time" if "time" in observations.covariates else "order")
