"""Thermal expansion of links, instantaneous or with a first-order lag: virtual prismatic joints (Kluz et al.)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.effects.arguments import Celsius, Instants, NotNegative
from thermal_robot.effects.effect import Driver, Effect, Parameter, Response, at_segment
from thermal_robot.effects.quantities import began, driving

if TYPE_CHECKING:
    from thermal_robot.observations import Observations


_POINTS = 500  # points of a history that are kept
_FOLLOWED = 64  # histories and lags of which it is kept how far a body is behind: all settings ask for each


@dataclass(frozen=True)
class History:
    """Recorded temperature, linear between its points: increasing times (K,), s, and temperatures, °C."""

    times: tuple[float, ...]
    temperatures: tuple[float, ...]

    @classmethod
    def of(cls, times: Array, temperatures: Array) -> History:
        """Build the record from rows in any order; equal times are averaged, a long record is thinned."""
        instants, which = np.unique(times, return_inverse=True)
        values = np.bincount(which, temperatures) / np.bincount(which)
        kept = np.unique(np.linspace(0, len(instants) - 1, min(len(instants), _POINTS)).round().astype(int))
        return cls(tuple(instants[kept].tolist()), tuple(values[kept].tolist()))

    def followed(self, lag: float, times: Array, temperatures: Array) -> Array:
        """Temperature (N,) of a body that follows the record with a first-order lag: dT/dt = (T_recorded − T) / lag.

        It is in balance at the first point; ``lag`` in s. Between two points the solution is exact: T = u(t) − r·lag +
        (T_i − u_i + r·lag) exp(−(t − t_i)/lag), where u runs at the rate r. Rows are asked for by times and
        temperatures (N,), s and °C: beyond the record the row's own is taken to have held since its end; before it the
        body is in balance with it.
        """
        t, u = np.array(self.times), np.array(self.temperatures)
        rate = np.diff(u) / np.diff(t)
        behind = np.array(_temperature_lag(self, lag))
        i = np.clip(np.searchsorted(t, times, side="right") - 1, 0, len(t) - 1)
        late = times >= t[-1]
        rate = np.append(rate, 0.0)[i]
        since = np.maximum(times - t[i], 0.0)
        lagging = (behind[i] + rate * lag) * np.exp(-since / lag) - rate * lag
        inside = u[i] + rate * since + lagging
        after = temperatures + (u[-1] + behind[-1] - temperatures) * np.exp(-since / lag)
        return np.where(times < t[0], temperatures, np.where(late, after, inside))


@lru_cache(maxsize=_FOLLOWED)
def _temperature_lag(history: History, lag: float) -> tuple[float, ...]:
    """Excess (K,) of a lagging body's temperature over the record at its points, K; 0 at the first."""
    t, u = np.array(history.times), np.array(history.temperatures)
    behind = [0.0]
    for gain, decay in zip(np.diff(u) / np.diff(t) * lag, np.exp(-np.diff(t) / lag), strict=True):
        behind.append((behind[-1] + gain) * decay - gain)
    return tuple(behind)


_SIZE = 1.5e-5  # 1/K
_LENGTH = 1e-9  # m: a shorter segment does not grow
_LAGS = (600.0, 1500.0, 3600.0)
_SHORTEST, _LONGEST = 300.0, 10800.0  # s: walls of 2 mm, and castings of 20 mm in still air
_START = 3.0  # K between a link and what its sensor lets expect, at switching on: half of what motors of 100 W bring
_SPREAD = 0.3  # of the common coefficient: steel and aluminium lie 30 % below and above their mean


@dataclass(frozen=True)
class ThermalElongation(Effect):
    """Thermal expansion: every segment lengthens with its link's temperature, Δl_s = α_s l_s (T_link − T_reference).

    Equation 5 of Kluz et al. (2018), along the virtual prismatic joint of their Eqs 6-8, with a coefficient of its own
    for each segment, a ``common`` one for all, or a common one with a smaller deviation above it for each (partial
    pooling; ``spread``: its expected size, 0 for none). No link shrinks when it becomes warmer. Expected size 1.5e-5 /K
    (steel 1.2e-5, aluminium 2.3e-5; zinc 3e-5); of a polymer ``[priors]`` says more. Where one sensor reads the air or
    a place on the robot, the links follow it with a time constant: dT_link/dt = (T_recorded − T_link) / lag, minutes to
    an hour for a cast link (mass · heat capacity / surface · film coefficient: 600 to 3600 s).

    A steady rise with time resembles :class:`Drift`, but moves the tool by an amount that depends on the pose; constant
    temperature is :class:`Geometric`. A lag shows only where the temperature turns or jumps within the campaign.

    ``times`` and ``temperatures``: the campaign's record, s and °C, kept where there is a ``lag``, s. ``starts``:
    instants, s, from which it holds: the first row, and the first of each session. ``balanced``: the links are then as
    warm as the record lets expect; else they differ by some kelvin, of which exp(−(t − start) / lag) is left at t.
    """

    common: bool = False
    lag: NotNegative = 0.0
    times: Instants = ()
    temperatures: tuple[Celsius, ...] = ()
    spread: NotNegative = 0.0
    starts: tuple[float, ...] = ()
    balanced: bool = True

    name: ClassVar[str] = "thermal_elongation"
    title: ClassVar[str] = "thermal elongation of the links"
    sided_by: ClassVar[tuple[str, ...]] = ("temperature",)

    def missing(self, observations: Observations) -> tuple[str, ...]:
        """Column ``temperature``, unless a temperature that applies to a segment varies."""
        return () if any(observations.varies(column) for column in _columns(observations)) else ("temperature",)

    def reads(self, observations: Observations) -> tuple[str, ...]:
        """Temperatures that apply to the segments; with a lag, the time, too."""
        return (*_columns(observations), "time") if self.lag else _columns(observations)

    def variants(self, observations: Observations) -> tuple[Effect, ...]:
        """Return the settings: a coefficient a link, one for all, one for all with deviations; each with lags, too.

        A lag of 10 to 60 min is tried with each of the three: with the wrong one it may be worse than none.
        """
        one = replace(self, common=True, spread=0.0, balanced=True)
        plain = (replace(one, common=False), one, replace(one, spread=_SPREAD))
        if not _follows(observations):
            return plain
        told = [own._recorded(observations) for own in plain]
        return (*plain, *(replace(own, lag=lag) for own in told for lag in _LAGS))

    def elsewhere(self, observations: Observations) -> ThermalElongation:
        """Copy for another campaign, with its temperature record; without the lag where it has no times."""
        if not self.lag:
            return self
        if not _follows(observations):
            return replace(self, lag=0.0, times=(), temperatures=(), starts=(), balanced=True)
        return self._recorded(observations)

    def _recorded(self, observations: Observations) -> ThermalElongation:
        record = History.of(observations.covariates["time"], observations.covariates["temperature"])
        starts = tuple(sorted(began(observations, observations.covariates["time"]).values()))
        return replace(self, times=record.times, temperatures=record.temperatures, starts=starts)

    def nearby(self, factor: float) -> tuple[Effect, ...]:
        """Neighbours of a setting: lags times and over a factor, 5 min to 3 h; other groupings of links."""
        if not self.lag:
            return (self,)
        near = (float(np.clip(self.lag * share, _SHORTEST, _LONGEST)) for share in (1.0, factor, 1.0 / factor))
        lags = (replace(self, lag=lag) for lag in near)
        # what is common to all links is in none of them alone
        if self.places:
            return tuple(dict.fromkeys(lags))
        shared = [replace(self, common=one, spread=part) for one, part in ((False, 0.0), (True, 0.0), (True, _SPREAD))]
        balanced = [replace(self, balanced=state) for state in (True, False)] if self.starts else []
        return tuple(dict.fromkeys((*lags, *shared, *balanced)))

    def parameters(self, observations: Observations) -> tuple[Parameter, ...]:
        """One coefficient of expansion a segment, or one for all, with the segments' deviations from it; 1/K.

        Then, where the links start out of balance, one strain for each start, which decays with the lag.
        """
        reference, responses = observations.campaign.reference_temperature, {}
        for s, segment in enumerate(observations.robot.segments):
            temperature = self._temperature(observations, segment.parent_link)
            if temperature is not None and segment.length >= _LENGTH:
                responses[segment] = _grown(observations, s, temperature - reference)
        found = []
        if self.common:
            found.append(Parameter("strain per kelvin", "1/K", _SIZE, "link", "", tuple(responses.values()), True))
        if self.spread or not self.common:
            label, size = ("deviation", self.spread * _SIZE) if self.common else ("strain per kelvin", _SIZE)
            for own, grown in responses.items():
                found.append(Parameter(f"{label} of {own.name}", "1/K", size, "link", own.parent_link, (grown,), True))
        return (*found, *self._began(observations, [grown.index for grown in responses.values()]))

    def driver(self, observations: Observations, parameters: Sequence[Parameter], error: Array) -> Driver | None:
        """Return the recorded temperature of the link, or of the robot."""
        own = f"temperature.{parameters[0].place}"
        return driving(observations, own if own in observations.covariates else "temperature")

    def _began(self, observations: Observations, grown: Sequence[int]) -> Iterator[Parameter]:
        """Yield one strain for each start: initial excess over the record, which decays with the lag."""
        for k, start in enumerate(() if self.balanced or not self.lag else self.starts):
            since = observations.covariates["time"] - start
            left = np.where(since >= 0.0, np.exp(-np.maximum(since, 0.0) / self.lag), 0.0)
            responses = tuple(_grown(observations, s, left) for s in grown)
            yield Parameter(f"strain at start {k + 1}", "1", _START * _SIZE, "link", "", responses)

    def _temperature(self, observations: Observations, link: str) -> Array | None:
        recorded = observations.temperature(link)
        if recorded is None or not self.lag:
            return recorded
        return History(self.times, self.temperatures).followed(self.lag, observations.covariates["time"], recorded)


def _grown(observations: Observations, s: int, strain: Array) -> Response:
    """Twist of a segment by a strain (N,), along its virtual prismatic joint."""
    segment = observations.robot.segments[s]
    return at_segment(s, strain[:, None] * np.concatenate([segment.direction, np.zeros(3)]) * segment.length)


def _follows(observations: Observations) -> bool:
    """Whether a lag may be fitted: a single sensor serves all links, and time was recorded and varies."""
    return observations.varies("time") and _columns(observations) == ("temperature",)


def _columns(observations: Observations) -> tuple[str, ...]:
    """Return the recorded temperatures that apply to segments: the links' own, and the robot's for all others."""
    links = dict.fromkeys(s.parent_link for s in observations.robot.segments if s.length > _LENGTH)
    own = [f"temperature.{link}" for link in links if f"temperature.{link}" in observations.covariates]
    general = ["temperature"] if len(own) < len(links) and "temperature" in observations.covariates else []
    return (*own, *general)
