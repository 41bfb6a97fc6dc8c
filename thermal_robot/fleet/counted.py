"""How often each effect was found, where, and whether that gathers in a group of robots."""

from __future__ import annotations

import heapq
from collections import Counter
from dataclasses import dataclass, field, replace
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.fleet import settings
from thermal_robot.fleet.listed import CAMPAIGN
from thermal_robot.fleet.table import Overview, findings

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


def counted(table: Path, known: Overview) -> tuple[tuple[Count, ...], tuple[Gathered, ...], tuple[Case, ...]]:
    """Count the effects of a table.

    Parameters
    ----------
    table
        The file.
    known
        Its campaigns.

    Returns
    -------
    tuple
        Counts; what gathers in a group; what was found in the campaigns with the largest gaps.
    """
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
