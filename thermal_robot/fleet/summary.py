"""What is wrong with which robot of a fleet, and what several share.

Each parameter of each effect is a :func:`~thermal_robot.fleet.population.population` of its own, of values that every
campaign tells whether the effect was found there or not (:mod:`thermal_robot.fleet.rows`).
"""

from __future__ import annotations

import heapq
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.diagnosis.values import jsonable
from thermal_robot.fleet import settings
from thermal_robot.fleet.population import Population, combined, population
from thermal_robot.fleet.rows import CAMPAIGN, Overview, Told, findings, overview, told

_FOUND = ("found", "contained", "confounded")


@dataclass(frozen=True)
class Count:
    """How often an effect was found.

    Attributes
    ----------
    effect
        Its name; laws that were discovered count as one by what they follow.
    found, testable
        In how many robots; found where the data cannot tell it from another, too.
    confounded
        In how many of those in which it was found the data cannot tell it from another.
    places
        In how many of them which place has the largest share, most often first.
    parameters
        Whether it is a known effect, whose parameters can be compared.
    """

    effect: str
    found: int
    testable: int
    confounded: int
    places: dict[str, int]
    parameters: bool


@dataclass(frozen=True)
class Gathered:
    """An effect that is found in one group more often than elsewhere.

    ``p_value`` is that of so many by chance (hypergeometric law), times the number of groups and effects that were
    looked at.
    """

    effect: str
    label: str
    group: str
    found: int
    robots: int
    found_elsewhere: int
    robots_elsewhere: int
    p_value: float


@dataclass(frozen=True)
class Case:
    """An effect that was found in a campaign: with what probability, which share of the gap (m) it has, and where.

    ``confounded_with`` names what the data cannot tell it from. Without a name it is a gap that no effect explains.
    """

    robot: str
    campaign: str
    rms_before: float
    rms_after: float
    effect: str = ""
    probability: float | None = None
    shrinkage: float | None = None
    place: str = ""
    confounded_with: tuple[str, ...] = ()


@dataclass
class _Tally:
    """Of one effect: the robots in which it can be tested, was found, and found beyond doubt, and the places."""

    robots: int
    testable: NDArray[np.bool_] = field(init=False)
    found: NDArray[np.bool_] = field(init=False)
    alone: NDArray[np.bool_] = field(init=False)
    places: Counter[str] = field(default_factory=Counter)
    known: bool = True

    def __post_init__(self) -> None:
        self.testable, self.found, self.alone = (np.zeros(self.robots, dtype=bool) for _ in range(3))


def _counted(table: Path, known: Overview) -> tuple[tuple[Count, ...], tuple[Gathered, ...], tuple[Case, ...]]:
    """Return how often each effect was found, what gathers in a group, and the campaigns with the largest gaps."""
    names, robot_of = list(known.robots.values), known.robot_of()
    tallies: dict[str, _Tally] = {}
    worst: list[tuple[float, int, int, Case]] = []
    for name, rows in groupby(findings(table), key=lambda row: row[CAMPAIGN]):
        campaign, told = known.numbers[name], []
        robot = robot_of[campaign]
        for row in rows:
            effect = row["effect"] if row["quantity"] is None else f"a law of {row['quantity']}"
            tally = tallies.setdefault(effect, _Tally(len(names), known=row["quantity"] is None))
            tally.testable[robot] |= row["status"] != "not_testable"
            if _at_work(row):
                told.append(_case(names[robot], effect, row))
                if not tally.found[robot] and told[-1].place:
                    tally.places[told[-1].place] += 1
                tally.found[robot] = True
                tally.alone[robot] |= row["status"] != "confounded"
        if not told and row["unexplained"]:
            told = [Case(names[robot], name, row["rms_before"], row["rms_after"])]
        for number, case in enumerate(told):
            (heapq.heappush if len(worst) < settings.MOST_LISTED else heapq.heappushpop)(
                worst, (case.rms_before, -campaign, -number, case)
            )
    found = tuple(case for *_, case in sorted(worst, key=lambda w: (-w[0], -w[1], -w[2])))
    return _counts(tallies), _gathered(tallies, known), found


def _at_work(row: dict[str, Any]) -> bool:
    """Whether an effect explains the gap, or a part of it: of two that are confounded only the one that was fitted."""
    return row["status"] in _FOUND and (row["status"] != "confounded" or bool(row["places"]))


def _case(robot: str, effect: str, row: dict[str, Any]) -> Case:
    told = {name: row[name] for name in ("rms_before", "rms_after", "probability", "shrinkage")}
    place = row["places"][0]["name"] if row["places"] else ""
    others = tuple(row["confounded_with"] or ()) if row["status"] == "confounded" else ()
    return Case(robot=robot, campaign=row[CAMPAIGN], effect=effect, place=place, confounded_with=others, **told)


def _counts(tallies: dict[str, _Tally]) -> tuple[Count, ...]:
    counts = [
        Count(
            effect,
            int(t.found.sum()),
            int((t.testable | t.found).sum()),
            int((t.found & ~t.alone).sum()),
            dict(t.places.most_common()),
            t.known,
        )
        for effect, t in tallies.items()
    ]
    return tuple(sorted(counts, key=lambda c: (-c.found, c.effect)))


def _gathered(tallies: dict[str, _Tally], known: Overview) -> tuple[Gathered, ...]:
    """Return what was found more often in a group than chance allows, however many groups were looked at."""
    from scipy.stats import hypergeom

    looked, tests = [], 0
    for label, of in known.labels.items():
        code, groups = known.label_of(label), list(of.values)
        for effect, tally in tallies.items():
            tried = tally.testable | tally.found
            robots = np.bincount(code[tried], minlength=len(groups))
            found = np.bincount(code[tally.found], minlength=len(groups))
            asked = np.flatnonzero((robots >= settings.FEWEST_IN_GROUP) & (robots < robots.sum()))
            tests += len(asked)
            chance = hypergeom.sf(found[asked] - 1, robots.sum(), found.sum(), robots[asked])
            for k, p in zip(asked.tolist(), chance.tolist(), strict=True):
                if p < settings.STRIKING:
                    own = int(found[k]), int(robots[k])
                    rest = int(found.sum()) - own[0], int(robots.sum()) - own[1]
                    looked.append(Gathered(effect, label, groups[k], *own, *rest, p))
    striking = [replace(g, p_value=min(g.p_value * tests, 1.0)) for g in looked]
    kept = [g for g in striking if g.p_value < settings.STRIKING]
    return tuple(sorted(kept, key=lambda g: (g.p_value, g.effect, g.label, g.group))[: settings.MOST_LISTED])


Codes = NDArray[np.int64]


@dataclass(frozen=True)
class Group:
    """A group of robots and its mean, SI, with one sigma."""

    group: str
    robots: int
    mean: float
    mean_std: float


@dataclass(frozen=True)
class Shared:
    """A parameter over the fleet, SI.

    Attributes
    ----------
    effect, parameter, unit
        Which.
    robots
        How many tell it.
    mean, mean_std
        Over the fleet, and one sigma.
    spread, spread_std
        Between robots, one sigma, deviations of measurement taken out; and how well that is known. Where groups
        differ it is that within a group.
    p_mean
        P value of the mean being zero, times the number of parameters and labels that were looked at.
    label, p_label
        By which robots differ, and the p value of that being chance, times the same; empty and 1 where they do not.
    groups
        Of that label, farthest from the mean of all first.
    """

    effect: str
    parameter: str
    unit: str
    robots: int
    mean: float
    mean_std: float
    spread: float
    spread_std: float
    p_mean: float
    label: str = ""
    p_label: float = 1.0
    groups: tuple[Group, ...] = ()


@dataclass(frozen=True)
class Apart:
    """A robot that is unlike its group in a parameter, SI: with which probability."""

    robot: str
    effect: str
    parameter: str
    unit: str
    value: float
    std: float
    usual: float
    probability: float


def _shared(
    table: Path, known: Overview, effects: Sequence[str], progress: Callable[[str, int, int], None] = lambda *_: None
) -> tuple[tuple[Shared, ...], tuple[Apart, ...], int]:
    """Return what robots share, who stands out, the surest first each, and how many parameters were compared."""
    robots, labels = known.robot_of(), {name: known.label_of(name) for name in known.labels}
    together, apart = [], []
    for k, effect in enumerate(effects):
        for parameter in told(table, effect, known.numbers):
            found = _compared(parameter, robots, labels, known)
            if found is not None:
                together.append(found[0])
                apart += found[1]
        progress("effects compared", k + 1, len(effects))
    tests = len(together) * (1 + len(labels))
    fair = [replace(s, p_mean=min(s.p_mean * tests, 1.0), p_label=min(s.p_label * tests, 1.0)) for s in together]
    fair = [s if s.p_label < settings.STRIKING else replace(s, label="", p_label=1.0, groups=()) for s in fair]
    kept = [s for s in fair if s.label or s.p_mean < settings.STRIKING]
    kept.sort(key=lambda s: (min(s.p_mean, s.p_label), -abs(s.mean) / s.mean_std, s.effect, s.parameter))
    apart.sort(key=lambda a: (-a.probability, -abs(a.value - a.usual) / a.std, a.robot, a.effect, a.parameter))
    return tuple(kept), tuple(apart[: settings.MOST_LISTED]), len(together)


def _compared(
    item: Told, robots: Codes, labels: dict[str, Codes], known: Overview
) -> tuple[Shared, list[Apart]] | None:
    """Fit the population of a parameter, as one and by each label; ``None`` where too few robots tell it."""
    who, values, deviations = combined(item.values, item.deviations, robots[item.campaigns])
    if len(who) < settings.FEWEST_ROBOTS:
        return None
    whole = population(values, deviations)
    mean, std = float(whole.means[0]), float(whole.deviations[0])
    spread = whole.spread, whole.spread_std
    found = Shared(item.effect, item.parameter, item.unit, len(who), mean, std, *spread, whole.nothing)
    usual, unlike = np.full(len(who), mean), whole.apart
    splits = ((name, _split(values, deviations, codes[who])) for name, codes in labels.items())
    known_splits = [(name, split) for name, split in splits if split is not None]
    if known_splits:
        name, (by, kept, groups, own) = min(known_splits, key=lambda item: item[1][0].alike)
        told_by = _groups(by, groups, list(known.labels[name].values), mean)
        found = replace(found, label=name, p_label=by.alike, groups=told_by)
        if by.alike < settings.STRIKING:
            found = replace(found, spread=by.spread, spread_std=by.spread_std)
            unlike = np.where(kept, 0.0, unlike)
            usual[kept], unlike[kept] = by.means[own], by.apart
    named = np.flatnonzero(unlike >= settings.NAMED).tolist()
    names = list(known.robots.values) if named else []
    what = item.effect, item.parameter, item.unit
    return found, [
        Apart(names[who[k]], *what, float(values[k]), float(deviations[k]), float(usual[k]), float(unlike[k]))
        for k in named
    ]


def _groups(by: Population, groups: Codes, names: Sequence[str], mean: float) -> tuple[Group, ...]:
    """Return the groups of a population, the most different from the mean of all first."""
    rows = zip(groups.tolist(), by.counts.tolist(), by.means.tolist(), by.deviations.tolist(), strict=True)
    found = [Group(names[g], robots, own, std) for g, robots, own, std in rows]
    found.sort(key=lambda g: (-abs(g.mean - mean) / g.mean_std, g.group))
    return tuple(found[: settings.MOST_GROUPS])


def _split(values: Array, deviations: Array, codes: Codes) -> tuple[Population, NDArray[np.bool_], Codes, Codes] | None:
    """Fit a population by groups, those too small left out: with who is in it, which groups, and the number of each."""
    counts = np.bincount(codes)
    kept = counts[codes] >= settings.FEWEST_IN_GROUP
    groups, own = np.unique(codes[kept], return_inverse=True)
    if len(groups) < 2:
        return None
    return population(values[kept], deviations[kept], own), kept, groups, own


SCHEMA = "thermal-robot/fleet/1"


@dataclass(frozen=True)
class Summary:
    """A fleet in short. Lists of robots hold the worst of them where there are many; the table holds all.

    Attributes
    ----------
    campaigns, robots
        How many.
    labels
        By which robots were grouped, their type included.
    outcomes
        How many campaigns were ``diagnosed``, ``unusable`` (robot and table do not belong together) or ``failed``.
    failures
        Those without a diagnosis: name, outcome, reason.
    effects
        How often each effect was found, most often first.
    gathered
        Effects that were found in one group more often than chance allows, most striking first.
    shared
        Per parameter that differs from zero over the whole fleet, or between groups: mean and spread.
    apart
        Robots that stand out, most probable first, each against its group.
    found
        What is wrong with which robot: the campaigns with the largest gaps.
    parameters
        How many were compared.
    """

    campaigns: int
    robots: int
    labels: tuple[str, ...]
    outcomes: dict[str, int]
    failures: tuple[tuple[str, str, str], ...]
    effects: tuple[Count, ...]
    gathered: tuple[Gathered, ...]
    shared: tuple[Shared, ...]
    apart: tuple[Apart, ...]
    found: tuple[Case, ...]
    parameters: int

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON object of the format ``thermal-robot/fleet/1``; SI throughout."""
        return dict(jsonable({"schema": SCHEMA, **asdict(self)}))


def summarise(
    table: Path, labels: Sequence[str] = (), progress: Callable[[str, int, int], None] = lambda *_: None
) -> Summary:
    """Summarise the table of a fleet.

    Parameters
    ----------
    table
        As :func:`~thermal_robot.fleet.rows.write_rows` writes it.
    labels
        Names of its labels.
    progress
        Called with a stage, how many effects are compared, and how many there are.
    """
    known = overview(table, labels)
    effects, gathered, found = _counted(table, known)
    together, apart, parameters = _shared(table, known, [e.effect for e in effects if e.parameters], progress)
    return Summary(
        campaigns=len(known.numbers),
        robots=len(known.robots.values),
        labels=tuple(known.labels),
        outcomes=dict(sorted(known.outcomes.items())),
        failures=tuple(known.excused),
        effects=effects,
        gathered=gathered,
        shared=together,
        apart=apart,
        found=found,
        parameters=parameters,
    )
