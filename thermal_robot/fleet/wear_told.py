"""From explanations to what is told of each parameter: kind, day, rate, limit, alarm."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.fleet import wear_settings as settings
from thermal_robot.fleet.wear_chance import chances
from thermal_robot.fleet.wear_dates import in_words
from thermal_robot.fleet.wear_moves import Move, Series
from thermal_robot.fleet.wear_problem import Problem
from thermal_robot.fleet.wear_result import Crossing, Jump, Rate, Worn
from thermal_robot.fleet.wear_search import Explanations, Moves
from thermal_robot.fleet.wear_state import State, fieller

HIDDEN = "unknown frames, or the poses, hide its changes"
ABSENT = "fewer than two campaigns have the columns that it needs"


@dataclass(frozen=True, eq=False)
class Told:
    """What all parameters are told from.

    Attributes
    ----------
    problem, found
        Campaigns, and what explains them.
    first
        Date of the first campaign; ``None`` without dates.
    limits
        By effect.
    false_alarm
        Stated rate.
    """

    problem: Problem
    found: Explanations
    first: datetime | None
    limits: Mapping[str, float]
    false_alarm: float

    def worn(self) -> tuple[Worn, ...]:
        """Return all parameters: those that ring first, then by how probably they moved."""
        series = self.found.series
        chance = chances(series, self.found.grid, self.found.best)
        worn = [self._one(p, float(chance[p])) for p in range(len(series.followed))]
        return tuple(sorted(worn, key=lambda w: (not w.alarm, not w.comparable, w.chance if w.alarm else -w.moved)))

    def _one(self, parameter: int, chance: float) -> Worn:
        series, (effect, name) = self.found.series, self.problem.keys[parameter]
        bare, size = self.problem.parameters[parameter], float(self.problem.sizes[parameter])
        comparable = bool(series.followed[parameter])
        ways = self.found.of_parameter(parameter)
        alarm = comparable and chance <= self.false_alarm and bool(ways)
        kinds = _kinds(ways)
        kind = max(kinds, key=lambda k: kinds[k] if not alarm or k != "constant" else -1.0)
        move = max((w for w in ways if w.kind == kind), key=ways.__getitem__, default=None)
        moves = self._beside(parameter, move)
        state = State.of(series, self.found.grid, moves)
        fitted, _ = state.over_time(parameter)
        values, stds = State.free(series, self.found.grid, moves, parameter).over_time(parameter)
        change, change_std = self._change(state, move, fitted)
        few = int(self.problem.has[:, parameter].sum()) < 2
        seen = self.problem.has[:, parameter] & comparable
        return Worn(
            effect,
            self.problem.titles[parameter],
            name,
            bare.place,
            bare.unit,
            comparable,
            "" if comparable else (ABSENT if few else HIDDEN),
            alarm,
            chance,
            1.0 - kinds["constant"] if comparable else 0.0,
            kind if comparable else "constant",
            kinds,
            self._jump(state, move, ways, size) if comparable else None,
            self._rate(state, move, size) if comparable else None,
            size * change,
            size * change_std,
            tuple(v if s else None for v, s in zip((size * values).tolist(), seen, strict=True)),
            tuple(v if s else None for v, s in zip((size * stds).tolist(), seen, strict=True)),
            tuple((size * fitted).tolist()),
            self._crossing(state, parameter, move, size, float(fitted[-1])) if comparable else None,
            self._alike(parameter) if comparable else (),
        )

    def _beside(self, parameter: int, move: Move | None) -> Moves:
        """Return the most probable combination in which a parameter moves just so, or stays."""
        for moves in self.found.moves:
            own = [m for m in moves if m.parameter == parameter]
            if own == ([] if move is None else [move]):
                return moves
        return tuple(m for m in self.found.best if m.parameter != parameter)

    def _change(self, state: State, move: Move | None, fitted: Array) -> tuple[float, float]:
        if move is None:
            return 0.0, 0.0
        if move.kind != "walk":
            return state.amount(self.found.series.spans(move)[0])
        own = [len(self.found.series.followed) + state.columns.index(c) for c in self.found.series.spans(move)]
        return float(fitted[-1] - fitted[0]), float(np.sqrt(state.covariance[np.ix_(own, own)].sum()))

    def _jump(self, state: State, move: Move | None, ways: Mapping[Move, float], size: float) -> Jump | None:
        if move is None or move.kind != "jump":
            return None
        days = np.zeros(self.found.series.count - 1)
        for way, probability in ways.items():
            if way.kind == "jump":
                days[way.after] += probability
        days = days / days.sum()
        likely = np.argsort(-days, kind="stable")
        enough = likely[: int(np.searchsorted(np.cumsum(days[likely]), 0.95)) + 1]
        amount, std = state.amount(self.found.series.spans(move)[0])
        return Jump(
            move.after, float(days[move.after]), tuple(days.tolist()), int(enough.min()), int(enough.max()) + 1,
            size * amount, size * std,
        )  # fmt: skip

    def _rate(self, state: State, move: Move | None, size: float) -> Rate | None:
        if move is None or move.kind != "trend" or self.first is None:
            return None
        value, std = state.amount(self.found.series.spans(move)[0])
        return Rate(size * value / self.found.series.span, size * std / self.found.series.span)

    def _crossing(self, state: State, parameter: int, move: Move | None, size: float, now: float) -> Crossing | None:
        effect = self.problem.keys[parameter][0]
        if effect not in self.limits:
            return None
        limit, kind = self.limits[effect], move.kind if move else "constant"
        if abs(size * now) >= limit:
            return Crossing(limit, "passed")
        if kind in ("constant", "jump") or move is None:
            return Crossing(limit, "never")
        if kind == "walk" or self.first is None:
            return Crossing(limit, "unknown")
        reached = fieller(*state.line(parameter, self.found.series.spans(move)[0]), limit / size)
        if reached is None:
            return Crossing(limit, "never")
        last = float(self.found.series.times[-1])
        day, low, high = last + reached[0], last + reached[1], None if reached[2] is None else last + reached[2]
        dates = in_words(self.first, day), in_words(self.first, low), "" if high is None else in_words(self.first, high)
        return Crossing(limit, "expected", day, low, high, dates)

    def _alike(self, parameter: int) -> tuple[str, ...]:
        """Return the names of parameters of whose changes the data cannot tell this one's."""
        series = self.found.series
        middle = np.arange(len(series.followed)) * series.count + (series.count - 2) // 2
        own = series.information[np.ix_(middle, middle)]
        length = np.sqrt(np.maximum(np.diag(own), 1e-300))
        alike = np.abs(own[parameter] / length[parameter] / length) > settings.SUBSTITUTE
        others = [p for p in np.flatnonzero(alike & series.followed).tolist() if p != parameter]
        return tuple(self.problem.keys[p][1] for p in others)


def comparable(problem: Problem, series: Series) -> NDArray[np.bool_]:
    """(P,) which parameters campaigns can be compared in: a change of the expected size would be seen at all."""
    middle = np.arange(len(problem.keys)) * series.count + (series.count - 2) // 2
    known = np.maximum(np.diag(series.information)[middle], 0.0)
    enough = problem.has.sum(axis=0) >= 2
    return np.asarray(enough & (known * settings.COMPARABLE**2 > 1.0))


def _kinds(ways: Mapping[Move, float]) -> dict[str, float]:
    found = dict.fromkeys(("constant", *settings.KINDS), 0.0)
    for way, probability in ways.items():
        found[way.kind] += probability
    found["constant"] = max(1.0 - sum(found.values()), 0.0)
    return found
