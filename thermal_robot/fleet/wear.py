"""One verb: campaigns of one robot on several days go in; what moved, how fast and since when comes out."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import date, datetime, timedelta, timezone
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign, read_campaign
from thermal_robot.campaign.names import did_you_mean
from thermal_robot.diagnosis import Diagnosis
from thermal_robot.diagnosis.data_checks import as_counted, usable
from thermal_robot.diagnosis.data_faults.misfit import another_motion
from thermal_robot.effects import RANDOM, choose, library
from thermal_robot.errors import CampaignError, EffectError, require
from thermal_robot.fleet import wear_settings as settings
from thermal_robot.fleet.wear_moves import (
    Explanations,
    Move,
    Moves,
    Series,
    State,
    chances,
    explanations,
    fieller,
    scatter,
)
from thermal_robot.fleet.wear_problem import Problem, problem, require_alike
from thermal_robot.fleet.wear_result import Crossing, Jump, Rate, Visit, Wear, Worn
from thermal_robot.inference.fit import Fit, fit

One: TypeAlias = "Campaign | Diagnosis | str | Path"
_EXPECTED = "campaigns, diagnoses or paths, or pairs (date, campaign)"


def wear(
    campaigns: Iterable[One | tuple[Any, One]],
    *,
    dates: Sequence[Any] | None = None,
    limits: Mapping[str, float] | None = None,
    effects: Iterable[str] | None = None,
    false_alarm: float = settings.FALSE_ALARM,
    progress: Callable[[str], None] = lambda _: None,
) -> Wear:
    """Say which parameter of a robot moves over time: at once, steadily, or without a direction.

    Each campaign is fitted by itself, which names effects, outliers and noise. Then all are put into one linear
    problem: the parameters of all effects that were named in any of them, and the zero of every joint, are constants
    that all share, the unknown frames of each campaign its own. What moves beside is weighed by marginal likelihood.

    Parameters
    ----------
    campaigns
        At least three of one robot: campaigns, their paths, or diagnoses, which need no new fit. In pairs with dates,
        ``[("2026-03-01", campaign), ...]``, in any order; else in the order of time.
    dates
        Of the campaigns, where they stand by themselves: ISO 8601 text, or dates. Without dates a jump has its place
        between two campaigns, but a trend has no rate.
    limits
        Of the absolute value of an effect's parameters, SI: ``{"backlash": 5e-4}``.
    effects
        Names of the effects to consider; all where it is left out. The zeros of joints are always followed.
    false_alarm
        Stated probability that a series without any change rings at all.
    progress
        Called with a few words at each stage.

    Returns
    -------
    Wear
        Prints as text, writes as JSON.

    Raises
    ------
    CampaignError
        If campaigns are fewer than three, of different robots, or of no use; if a date is none.
    EffectError
        If an effect's name is not known.
    EstimationError
        If a campaign has too few measurements for the unknown frames.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> def measured(day, zero):
    ...     known = dict(rows=40, noise=2e-5, seed=day, base_known=True, tool_known=True)
    ...     return tr.simulate("builtin:rv_m2", {"joint_offset": {"joint_3": zero}}, tool_frame="tool0", **known)
    >>> zeros = (1e-3, 1e-3, 1e-3, 1.3e-3, 1.3e-3)
    >>> series = [(f"2026-0{month}-01", measured(month, zero)) for month, zero in enumerate(zeros, 1)]
    >>> found = tr.wear(series, effects=["joint_offset"])
    >>> found
    Wear('rv_m2', 5 campaigns: zero offset, joint_3 (jump))
    >>> print(found.summary)
    Over 5 campaigns of rv_m2: joint zero offsets, zero offset, joint_3 jumped by ... between ... (2026-03-01) and ...
    """
    _require_probability(false_alarm)
    members = _members(campaigns, dates)
    limit = _limits(limits or {})
    chosen = () if effects is None else ((effects,) if isinstance(effects, str) else tuple(effects))
    choose(chosen, (), ())
    with threadpool_limits(1):
        fits = [_fitted(member, chosen, k, len(members), progress) for k, member in enumerate(members)]
        progress("all campaigns together")
        return of_fits(fits, [member.date for member in members if member.date], limits=limit, false_alarm=false_alarm)


def of_fits(
    fits: Sequence[Fit],
    moments: Sequence[datetime] = (),
    *,
    limits: Mapping[str, float] | None = None,
    false_alarm: float = settings.FALSE_ALARM,
) -> Wear:
    """Say what moved between campaigns that were fitted already.

    Parameters
    ----------
    fits
        K of one robot, in the order of time.
    moments
        K dates, not falling; none where they are not known.
    limits, false_alarm
        As for :func:`wear`.

    Raises
    ------
    CampaignError
        If they are of different robots.
    """
    require_alike(fits)
    whole = problem(fits)
    times = _days_since(moments) if moments else np.arange(float(len(fits)))
    series = Series(whole.matrices, whole.vectors, times, np.ones(len(whole.keys), dtype=bool))
    series = replace(series, followed=_comparable(whole, series))
    found = explanations(series)
    told = Told(whole, found, moments[0] if moments else None, limits or {}, false_alarm)
    nothing = sum(float(p) for m, p in zip(found.moves, found.probabilities, strict=True) if not m)
    dates = [_written(each) for each in moments] or [""] * len(fits)
    visits = tuple(
        Visit(fit.campaign.name, date, float(time), int((~fit.explanation.outliers).sum()))
        for fit, date, time in zip(fits, dates, times, strict=True)
    )
    factor = float(np.sqrt(scatter(series, found.grid, found.best)))
    robot, notes = fits[0].campaign.robot.name, _notes(whole, visits, factor)
    return Wear(robot, visits, bool(moments), told.worn(), false_alarm, factor, nothing, notes)


def _written(moment: datetime) -> str:
    return moment.isoformat(timespec="minutes").removesuffix("T00:00")


@dataclass(frozen=True, eq=False)
class _Member:
    """One campaign of the series, with its date if there is one."""

    given: Campaign | Diagnosis
    date: datetime | None


def _members(campaigns: Any, dates: Sequence[Any] | None) -> list[_Member]:
    """Return campaigns with their dates, in the order of time."""
    require("wear()", campaigns, (Iterable,), _EXPECTED)
    listed = list(campaigns)
    if dates is not None:
        if isinstance(dates, str) or len(dates) != len(listed):
            found = "one text" if isinstance(dates, str) else f"{len(dates)} dates for {len(listed)} campaigns"
            raise CampaignError("wear", "dates do not fit", column="dates", found=found, expected="one a campaign")
        listed = list(zip(dates, listed, strict=True))
    if len(listed) < settings.FEWEST:
        raise CampaignError(
            "wear", "too few campaigns", found=str(len(listed)),
            expected=f"at least {settings.FEWEST}; fewer tell that something changed, not how",
        )  # fmt: skip
    pairs = [each if isinstance(each, tuple) and len(each) == 2 else (None, each) for each in listed]
    undated = sum(date is None for date, _ in pairs)
    if 0 < undated < len(pairs):
        raise CampaignError(
            "wear", "some campaigns have dates, others not", column="dates",
            found=f"{undated} of {len(pairs)} without one", expected="dates for all, or for none",
        )  # fmt: skip
    members = [_Member(_opened(given), None if date is None else _moment(date)) for date, given in pairs]
    return members if undated else sorted(members, key=lambda m: m.date or datetime.min)


def _opened(given: Any) -> Campaign | Diagnosis:
    if isinstance(given, (str, os.PathLike)):
        return read_campaign(os.fspath(given))
    require("wear()", given, (Campaign, Diagnosis), _EXPECTED)
    return given  # type: ignore[no-any-return]


def _fitted(member: _Member, chosen: tuple[str, ...], number: int, count: int, progress: Callable[[str], None]) -> Fit:
    """Return the fit of one campaign by itself."""
    given = member.given
    if isinstance(given, Diagnosis):
        if given.fit is None or not given.usable:
            why = given.reason if given.fit is not None else "was made without its fit: give the campaign itself"
            raise CampaignError(given.campaign, f"this diagnosis cannot be compared: {why}")
        return given.fit
    progress(f"campaign {number + 1} of {count}")
    if given.position is None or not given.samples:
        raise CampaignError(given.name, "nothing was measured", expected="a campaign with measured positions")
    found = fit(as_counted(usable(given)[0]), choose(chosen, (), ()))
    if another_motion(found) is not None:
        raise CampaignError(
            given.name, "robot and table do not describe the same motion",
            expected="a campaign that `thermal-robot diagnose` can use; it says what is wrong",
        )  # fmt: skip
    return found


def _notes(whole: Problem, visits: Sequence[Visit], factor: float) -> tuple[str, ...]:
    """Return what a reader must know beside."""
    notes = []
    for effect in dict.fromkeys(effect for effect, _ in whole.keys):
        own = [k for k, (name, _) in enumerate(whole.keys) if name == effect]
        lacking = [visit.name for k, visit in enumerate(visits) if not whole.has[k, own].any()]
        if lacking:
            notes.append(
                f"{effect} was named, but {', '.join(lacking)} lack the columns that it needs: what it does there may "
                "pass for a change of something else"
            )
    if factor > settings.SCATTER_TOLD:
        notes.append(
            f"campaigns scatter {factor:.1f} times as much as their deviations say: something that no campaign named "
            "shifts them; deviations were widened by that factor"
        )
    return tuple(notes)


def _limits(limits: Mapping[str, float]) -> dict[str, float]:
    known = {*library()} - {*RANDOM}
    for effect, limit in limits.items():
        if effect not in known:
            raise EffectError(
                f"limits: no effect is named {effect!r}{did_you_mean(str(effect), known)}; "
                f"expected one of {', '.join(sorted(known))}"
            )
        if isinstance(limit, bool) or not isinstance(limit, (int, float)) or not 0.0 < limit < np.inf:
            raise CampaignError(
                "wear", "is no limit", column=f"limits.{effect}", found=repr(limit), expected="SI, above 0"
            )
    return {effect: float(limit) for effect, limit in limits.items()}


def _require_probability(false_alarm: Any) -> None:
    if not isinstance(false_alarm, (int, float)) or not 0.0 < false_alarm < 1.0:
        raise CampaignError(
            "wear", "is no rate of false alarms", column="false_alarm", found=repr(false_alarm),
            expected="a probability, such as 0.01",
        )  # fmt: skip


DAY = 86400.0
"""Seconds."""
_A_DATE = "a date such as 2026-03-01, with an hour if need be, such as 2026-03-01T14:30"


def _moment(given: Any) -> datetime:
    """Return a date as a moment: midnight where it has no hour, UTC where it has a time zone."""
    if isinstance(given, str):
        try:
            given = datetime.fromisoformat(given.strip())
        except ValueError:
            raise CampaignError("wear", "is no date", column="dates", found=repr(given), expected=_A_DATE) from None
    if not isinstance(given, date):
        raise CampaignError("wear", "is no date", column="dates", found=repr(given), expected=_A_DATE)
    if not isinstance(given, datetime):
        return datetime(given.year, given.month, given.day)
    return given if given.tzinfo is None else given.astimezone(timezone.utc).replace(tzinfo=None)


def _days_since(moments: Sequence[datetime]) -> NDArray[np.float64]:
    """(K,) days of moments since the first of them."""
    first = min(moments)
    return np.array([(each - first).total_seconds() / DAY for each in moments])


def _in_words(first: datetime, day: float) -> str:
    """Return the date of so many days after the first, rounded to a day; an hour is more than is known."""
    try:
        return (first + timedelta(days=round(day, 6))).date().isoformat()
    except OverflowError:  # the year 10000 is as good as never
        return "later than 9999"


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
        values, stds = State.of(series, self.found.grid, moves, free=parameter).over_time(parameter)
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
        first = self.first
        dates = _in_words(first, day), _in_words(first, low), "" if high is None else _in_words(first, high)
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


def _comparable(problem: Problem, series: Series) -> NDArray[np.bool_]:
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
