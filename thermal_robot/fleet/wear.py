"""Change over time of one robot's parameters over several campaigns: change-point analysis."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
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
from thermal_robot.diagnosis.data_checks import usable, with_corrected_signs
from thermal_robot.diagnosis.data_faults.misfit import another_motion
from thermal_robot.effects import RANDOM, Effect, choose, library
from thermal_robot.errors import CampaignError, EffectError, require
from thermal_robot.fleet import settings
from thermal_robot.fleet.wear_moves import Move, Moves, Series, State, chances, explanations, fieller, moves_of, scatter
from thermal_robot.fleet.wear_problem import Problem, problem, require_alike
from thermal_robot.fleet.wear_result import Crossing, Jump, Rate, Visit, Wear, Worn
from thermal_robot.inference.fit import Fit, fit

One: TypeAlias = "Campaign | Diagnosis | str | Path"
_EXPECTED = "campaigns, diagnoses or paths, or pairs (date, campaign)"
_A_DATE = "a date such as 2026-03-01, with an hour if need be, such as 2026-03-01T14:30"
HIDDEN = "unknown frames, or the poses, hide its changes"
ABSENT = "fewer than two campaigns have the columns that it needs"


def wear(
    campaigns: Iterable[One | tuple[Any, One]],
    *,
    dates: Sequence[Any] | None = None,
    limits: Mapping[str, float] | None = None,
    effects: Iterable[str] | None = None,
    false_alarm: float = settings.FALSE_ALARM,
    progress: Callable[[str], None] = lambda _: None,
) -> Wear:
    """Change-point analysis of a robot's parameters over time: constant, jump, linear trend or random walk.

    Each campaign is fitted alone for its effects, outliers and noise. Then all enter one linear problem: the parameters
    of all effects found in any campaign, and all joint zeros, are common constants; unknown frames are each campaign's
    own. Changes of parameters compete by marginal likelihood.

    Parameters
    ----------
    campaigns
        At least three of one robot: campaigns, their paths, or diagnoses, which need no new fit. In pairs with dates,
        ``[("2026-03-01", campaign), ...]``, in any order; else in the order of time.
    dates
        Dates of the campaigns, if not given in pairs: ISO 8601 text, or dates. Without dates a jump has its place
        between two campaigns, but a trend has no rate.
    limits
        Limits of the absolute value of an effect's parameters, SI: ``{"backlash": 5e-4}``.
    effects
        Names of the effects to consider; all where it is left out. The zeros of joints are always followed.
    false_alarm
        Probability of any alarm in a series without change.
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
    Over 5 campaigns of rv_m2: zero offset, joint_3 jumped by +0.30... ± 0.00... mrad between ... (2026-03-01) and ...
    """
    if not isinstance(false_alarm, (int, float)) or not 0.0 < false_alarm < 1.0:
        raise _wrong("is no rate of false alarms", "false_alarm", repr(false_alarm), "a probability, such as 0.01")
    members, moments = _members(campaigns, dates)
    limit = _limits(limits or {})
    candidates = choose(() if effects is None else effects)
    with threadpool_limits(1):
        fits = []
        for number, member in enumerate(members, 1):
            if not isinstance(member, Diagnosis):
                progress(f"campaign {number} of {len(members)}")
            fits.append(_fitted(member, candidates))
        progress("all campaigns together")
        return of_fits(fits, moments, limits=limit, false_alarm=false_alarm)


def of_fits(
    fits: Sequence[Fit],
    moments: Sequence[datetime] = (),
    *,
    limits: Mapping[str, float] | None = None,
    false_alarm: float = settings.FALSE_ALARM,
) -> Wear:
    """Change-point analysis of K fitted campaigns of one robot, in the order of time.

    ``moments`` are K dates, none where they are not known; limits and false alarm are as for :func:`wear`. Raises
    :class:`CampaignError` if they are of different robots.
    """
    require_alike(fits)
    whole = problem(fits)
    days = [(each - moments[0]) / timedelta(days=1) for each in moments]
    times = np.array(days or range(len(fits)), dtype=float)
    series = Series(whole.matrices, whole.vectors, times, np.ones(len(whole.keys), dtype=bool))
    series = replace(series, followed=comparable(whole, series))
    found = explanations(series)
    worn = results(whole, series, found, moments[0] if moments else None, limits or {}, false_alarm)
    dates = [each.isoformat(timespec="minutes").removesuffix("T00:00") for each in moments] or [""] * len(fits)
    visits = tuple(
        Visit(fit.campaign.name, date, float(time), int((~fit.explanation.outliers).sum()), fit.campaign.about)
        for fit, date, time in zip(fits, dates, times, strict=True)
    )
    factor = float(np.sqrt(scatter(series, next(iter(found)))))
    robot, notes = fits[0].campaign.robot.name, _notes(whole, visits, factor)
    return Wear(robot, visits, bool(moments), worn, false_alarm, factor, found[()], notes)


def _wrong(problem: str, column: str, found: str, expected: str) -> CampaignError:
    return CampaignError("wear", problem, column=column or None, found=found, expected=expected)


def _members(campaigns: Any, dates: Sequence[Any] | None) -> tuple[list[Campaign | Diagnosis], list[datetime]]:
    """Validate campaigns, at least three, and their dates; return both in the order of time, dates empty if none."""
    require("wear()", campaigns, (Iterable,), _EXPECTED)
    listed = list(campaigns)
    if dates is not None:
        if isinstance(dates, str) or len(dates) != len(listed):
            found = "one text" if isinstance(dates, str) else f"{len(dates)} dates for {len(listed)} campaigns"
            raise _wrong("dates do not fit", "dates", found, "one a campaign")
        listed = list(zip(dates, listed, strict=True))
    if len(listed) < settings.FEWEST:
        fewest = f"at least {settings.FEWEST}; fewer tell that something changed, not how"
        raise _wrong("too few campaigns", "", str(len(listed)), fewest)
    pairs = [each if isinstance(each, tuple) and len(each) == 2 else (None, each) for each in listed]
    undated = sum(date is None for date, _ in pairs)
    if 0 < undated < len(pairs):
        found = f"{undated} of {len(pairs)} without one"
        raise _wrong("some campaigns have dates, others not", "dates", found, "dates for all, or for none")
    members = [(_opened(given), None if undated else moment(date)) for date, given in pairs]
    if not undated:
        members.sort(key=lambda member: member[1] or datetime.min)
    return [given for given, _ in members], [date for _, date in members if date]


def _opened(given: Any) -> Campaign | Diagnosis:
    if isinstance(given, (str, os.PathLike)):
        return read_campaign(os.fspath(given))
    require("wear()", given, (Campaign, Diagnosis), _EXPECTED)
    return given  # type: ignore[no-any-return]


def _fitted(given: Campaign | Diagnosis, candidates: Sequence[Effect]) -> Fit:
    """Fit one campaign alone, or take the fit of its diagnosis; a campaign that is not usable is refused."""
    if isinstance(given, Diagnosis):
        if given.fit is None or not given.usable:
            why = given.reason if given.fit is not None else "was made without its fit: give the campaign itself"
            raise CampaignError(given.campaign, f"this diagnosis cannot be compared: {why}")
        return given.fit
    found = fit(with_corrected_signs(usable(given)[0]), candidates)
    if another_motion(found) is not None:
        expected = "a campaign that `thermal-robot diagnose` can use; it says what is wrong"
        raise CampaignError(given.name, "robot and table do not describe the same motion", expected=expected)
    return found


def _notes(whole: Problem, visits: Sequence[Visit], factor: float) -> tuple[str, ...]:
    """Remarks: campaigns that lack the columns of an effect found elsewhere, and overdispersion by ``factor``."""
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
            raise _wrong("is no limit", f"limits.{effect}", repr(limit), "SI, above 0")
    return {effect: float(limit) for effect, limit in limits.items()}


def moment(given: Any) -> datetime:
    """Parse a date as a time: midnight without an hour, converted to UTC from a time zone.

    Raises :class:`CampaignError` if it is no date.
    """
    found = given
    if isinstance(given, str):
        try:
            found = datetime.fromisoformat(given.strip())
        except ValueError:
            found = None
    if not isinstance(found, date):
        raise _wrong("is no date", "dates", repr(given), _A_DATE)
    if not isinstance(found, datetime):
        return datetime(found.year, found.month, found.day)
    return found if found.tzinfo is None else found.astimezone(timezone.utc).replace(tzinfo=None)


def as_date(first: datetime, day: float) -> str:
    """ISO date (without time) some days after the first; "later than 9999" beyond the calendar."""
    try:
        return (first + timedelta(days=round(day, 6))).date().isoformat()
    except OverflowError:  # the year 10000 is as good as never
        return "later than 9999"


def comparable(problem: Problem, series: Series) -> NDArray[np.bool_]:
    """Mask (P,) of the parameters whose changes can be compared between campaigns.

    At least two campaigns have their columns, and a step in the middle of the series is known to 0.3 expected sizes.
    """
    known = np.maximum(np.diag(series.information)[series.middle], 0.0)
    return np.asarray((problem.has.sum(axis=0) >= 2) & (known * settings.COMPARABLE**2 > 1.0))


def results(
    problem: Problem,
    series: Series,
    found: Mapping[Moves, float],
    first: datetime | None,
    limits: Mapping[str, float],
    false_alarm: float,
) -> tuple[Worn, ...]:
    """Assemble each parameter's kind of change, alarm and forecast; alarms first, then by probability of a change.

    ``found`` are the explanations of the series, the most probable first; ``first`` is the date of the first campaign,
    ``None`` without dates; ``limits`` are in SI, by effect.
    """
    result = []
    for number, chance in enumerate(chances(series, next(iter(found))).tolist()):
        ways = moves_of(found, number)
        alarm = bool(series.followed[number]) and chance <= false_alarm and bool(ways)
        moving = {kind: sum((p for way, p in ways.items() if way.kind == kind), 0.0) for kind in settings.KINDS}
        kinds = {"constant": max(1.0 - sum(moving.values()), 0.0), **moving}
        kind = max(moving if alarm else kinds, key=kinds.__getitem__)
        move = max((way for way in ways if way.kind == kind), key=ways.__getitem__, default=None)
        worn, line, covariance = _over_time(problem, series, number, _beside(found, number, move))
        worn = replace(worn, chance=chance, alarm=alarm, moved=1.0 - kinds["constant"], kind=kind, kinds=kinds)
        if move is not None and kind == "jump":
            worn = replace(worn, jump=_jump(series, move, ways, worn))
        if kind == "trend" and first is not None:
            worn = replace(worn, rate=Rate(worn.change / series.span, worn.change_std / series.span))
        if worn.comparable and worn.effect in limits:
            worn = replace(worn, crossing=_crossing(limits[worn.effect], kind, line, covariance, series, first))
        result.append(worn)
    return tuple(sorted(result, key=lambda w: (not w.alarm, not w.comparable, w.chance if w.alarm else -w.moved)))


def _beside(found: Mapping[Moves, float], parameter: int, move: Move | None) -> Moves:
    """Most probable combination of moves in which a parameter has the given move only, or with ``None`` stays."""
    own = [] if move is None else [move]
    return next(moves for moves in found if [m for m in moves if m.parameter == parameter] == own)


def _over_time(problem: Problem, series: Series, number: int, moves: Moves) -> tuple[Worn, Array, Array]:
    """Estimate a parameter under some moves: its result; last value and total change (2,); their covariance; SI."""
    bare, followed = problem.parameters[number], bool(series.followed[number])
    size, has = bare.size, problem.has[:, number]
    state, free = State.of(series, moves), State.of(series, moves, free=number)
    path = state.path(number)
    line, covariance = state.combinations(np.stack([path[-1], path[-1] - path[0]]))
    line, covariance = size * line, size**2 * covariance
    values, spread = free.combinations(free.path(number))
    stds, seen = np.sqrt(np.maximum(np.diag(spread), 0.0)), has & followed
    reason = ABSENT if has.sum() < 2 else HIDDEN
    worn = Worn(
        effect=problem.keys[number][0],
        title=problem.titles[number],
        parameter=problem.keys[number][1],
        place=bare.place,
        unit=bare.unit,
        comparable=followed,
        reason="" if followed else reason,
        change=float(line[1]),
        change_std=float(np.sqrt(max(covariance[1, 1], 0.0))),
        values=tuple(v if s else None for v, s in zip((size * values).tolist(), seen, strict=True)),
        stds=tuple(v if s else None for v, s in zip((size * stds).tolist(), seen, strict=True)),
        fitted=tuple((size * (path @ state.mean)).tolist()),
        confounded_with=_alike(problem, series, number) if followed else (),
    )
    return worn, line, covariance


def _jump(series: Series, move: Move, ways: Mapping[Move, float], worn: Worn) -> Jump:
    """Build the jump with the posterior of its date; its range spans the 95 % credible set of dates."""
    days = np.array([ways.get(Move(move.parameter, "jump", after), 0.0) for after in range(series.count - 1)])
    days = days / days.sum()
    likely = np.argsort(-days, kind="stable")
    enough = likely[: int(np.searchsorted(np.cumsum(days[likely]), 0.95)) + 1]
    return Jump(
        after=move.after,
        probability=float(days[move.after]),
        probabilities=tuple(days.tolist()),
        earliest=int(enough.min()),
        latest=int(enough.max()) + 1,
        size=worn.change,
        std=worn.change_std,
    )


def _crossing(
    limit: float, kind: str, line: Array, covariance: Array, series: Series, first: datetime | None
) -> Crossing:
    """Forecast when a parameter's absolute value reaches a limit, SI; for a trend by Fieller's interval."""
    if abs(line[0]) >= limit:
        return Crossing(limit, "passed")
    if kind in ("constant", "jump"):
        return Crossing(limit, "never")
    if kind == "walk" or first is None:
        return Crossing(limit, "unknown")
    a_day = np.array([1.0, 1.0 / series.span])
    reached = fieller(line * a_day, covariance * np.outer(a_day, a_day), limit)
    if reached is None:
        return Crossing(limit, "never")
    last = float(series.times[-1])
    day, low, high = last + reached[0], last + reached[1], None if reached[2] is None else last + reached[2]
    dates = as_date(first, day), as_date(first, low), "" if high is None else as_date(first, high)
    return Crossing(limit, "expected", day, low, high, dates)


def _alike(problem: Problem, series: Series, parameter: int) -> tuple[str, ...]:
    """Names of parameters whose middle steps correlate by more than 0.95 with this one's: confounded changes."""
    own = series.information[np.ix_(series.middle, series.middle)]
    length = np.sqrt(np.maximum(np.diag(own), 1e-300))
    alike = (np.abs(own[parameter] / length[parameter] / length) > settings.SUBSTITUTE) & series.followed
    return tuple(problem.keys[p][1] for p in np.flatnonzero(alike).tolist() if p != parameter)
