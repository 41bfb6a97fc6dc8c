"""One verb: campaigns of one robot on several days go in; what moved, how fast and since when comes out."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from threadpoolctl import threadpool_limits

from thermal_robot.campaign import Campaign, read_campaign
from thermal_robot.campaign.names import did_you_mean
from thermal_robot.diagnosis import Diagnosis
from thermal_robot.diagnosis.cautions import usable
from thermal_robot.diagnosis.data_faults.misfit import another_motion
from thermal_robot.diagnosis.signs import as_counted
from thermal_robot.effects import RANDOM, choose, library
from thermal_robot.errors import CampaignError, EffectError, require
from thermal_robot.fleet import wear_settings as settings
from thermal_robot.fleet.wear_chance import scatter
from thermal_robot.fleet.wear_dates import days_since, moment
from thermal_robot.fleet.wear_moves import Series
from thermal_robot.fleet.wear_problem import Problem, problem, require_alike
from thermal_robot.fleet.wear_result import Visit, Wear
from thermal_robot.fleet.wear_search import explanations
from thermal_robot.fleet.wear_told import Told, comparable
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
    times = days_since(moments) if moments else np.arange(float(len(fits)))
    series = Series(whole.matrices, whole.vectors, times, np.ones(len(whole.keys), dtype=bool))
    series = replace(series, followed=comparable(whole, series))
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
    members = [_Member(_opened(given), None if date is None else moment(date)) for date, given in pairs]
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
