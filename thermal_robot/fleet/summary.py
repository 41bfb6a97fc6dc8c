"""Empirical Bayes summary of a fleet: effects by robot, common parameters, outliers.

Each parameter of each effect is fitted as a :func:`~thermal_robot.fleet.population.population` of the estimates of all
campaigns, whether or not the effect was found there (:mod:`thermal_robot.fleet.rows`). The table is read in pieces, and
of parameters those of one effect at a time.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.diagnosis.values import jsonable
from thermal_robot.fleet import settings
from thermal_robot.fleet.population import Codes, combined, population
from thermal_robot.fleet.rows import CAMPAIGN, MODEL, ROBOT, needed

if TYPE_CHECKING:
    import pandas as pd


_FOUND = ("found", "contained", "confounded")


@dataclass(frozen=True)
class Count:
    """Numbers of robots in which one effect was found, is testable, and is confounded.

    Attributes
    ----------
    effect
        Name of the effect; discovered laws of one quantity count as one.
    found, testable
        Numbers of robots in which it was found, confounded or not, and in which it is testable.
    confounded
        Number of robots in which it is confounded with another effect.
    places
        Number of robots by the place with the largest share of the effect, most frequent first.
    parameters
        Whether it is a known effect, whose parameters can be compared, not a discovered law.
    """

    effect: str
    found: int
    testable: int
    confounded: int
    places: dict[str, int]
    parameters: bool


@dataclass(frozen=True)
class Gathered:
    """Effect that is over-represented in one group of robots.

    ``p_value`` is the upper tail of the hypergeometric distribution of ``found``, times the number of pairs of group
    and effect that were tested (Bonferroni).
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
    """Effect found in a campaign: its probability and place, rms distances (m) before and after the correction.

    ``shrinkage`` is the held-out share of the distance that it explains; ``confounded_with`` names effects that it may
    be instead. An empty ``effect`` means that no effect explains the campaign's gap.
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


@dataclass(frozen=True)
class Group:
    """Group of robots with an equal label: mean of a parameter over it, SI, and the mean's standard deviation."""

    group: str
    robots: int
    mean: float
    mean_std: float


@dataclass(frozen=True)
class Shared:
    """Distribution of a parameter over the fleet, SI.

    Attributes
    ----------
    effect, parameter, unit
        Names of effect and parameter, and unit.
    robots
        Number of robots that determine it.
    mean, mean_std
        Mean over the fleet, and its standard deviation.
    spread, spread_std
        Standard deviation between robots, without measurement errors, and its own standard deviation; within a group
        where groups differ.
    p_mean
        P-value of the hypothesis that the mean is zero, times the number of tests of parameters and labels.
    label, p_label
        Label whose groups' means differ by an F test, and its p-value with the same correction; empty and 1 if none.
    groups
        Groups of that label, farthest from the overall mean first.
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
    """Robot that is an outlier in a parameter: its value, the ``usual`` mean of its group, and the probability; SI."""

    robot: str
    effect: str
    parameter: str
    unit: str
    value: float
    std: float
    usual: float
    probability: float


SCHEMA = "thermal-robot/fleet/1"


@dataclass(frozen=True)
class Summary:
    """Summary of a fleet: counts, effects, common parameters, outliers; lists are cut at 500 entries, the table is not.

    Attributes
    ----------
    campaigns, robots
        Numbers of campaigns and robots.
    labels
        Labels by which robots were grouped, their type included.
    outcomes
        Numbers of campaigns that were ``diagnosed``, ``unusable`` (robot and table do not belong together) or
        ``failed``.
    failures
        Campaigns without a diagnosis: name, outcome, reason.
    effects
        Numbers of robots in which each effect was found, most frequent effect first.
    gathered
        Effects that were found in one group more often than chance allows, most striking first.
    shared
        Mean and spread of each parameter that differs significantly from zero over the fleet, or between groups.
    apart
        Robots that are outliers of their group in a parameter, most probable first.
    found
        Campaigns with the largest gaps, and the effects found in each.
    parameters
        Number of parameters compared.
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
        """JSON object of the format ``thermal-robot/fleet/1``, SI."""
        return dict(jsonable({"schema": SCHEMA, **asdict(self)}))


def summarise(
    table: Path, labels: Sequence[str] = (), progress: Callable[[str, int, int], None] = lambda *_: None
) -> Summary:
    """Summarise the Parquet table of a fleet: counts of effects, groups by labels, common parameters, outliers.

    ``progress`` is called with a stage, how many effects are compared, and how many there are.
    """
    campaigns = _campaigns(table, labels)
    groups = [name for name in (*labels, MODEL) if name != ROBOT]
    robots = campaigns.drop_duplicates(ROBOT).set_index(ROBOT)[groups]
    findings, cases = _findings(table, campaigns)
    effects = _counts(findings)
    known = [e.effect for e in effects if e.parameters]
    shared, apart, parameters = _shared(table, campaigns, robots, known, progress)
    excused = campaigns[campaigns["reason"] != ""].head(settings.MOST_LISTED)
    return Summary(
        campaigns=len(campaigns),
        robots=len(robots),
        labels=tuple(groups),
        outcomes=dict(sorted(Counter(campaigns["outcome"]).items())),
        failures=tuple(excused[[CAMPAIGN, "outcome", "reason"]].itertuples(index=False, name=None)),
        effects=effects,
        gathered=_gathered(findings, robots),
        shared=shared,
        apart=apart,
        found=_largest(cases),
        parameters=parameters,
    )


def _frames(table: Path, columns: Sequence[str]) -> Iterator[pd.DataFrame]:
    """Yield some columns of the table in chunks of rows."""
    with needed("pyarrow.parquet").ParquetFile(table) as file:
        for batch in file.iter_batches(settings.ROWS_AT_ONCE, columns=list(dict.fromkeys(columns))):
            yield batch.to_pandas()


def _campaigns(table: Path, labels: Sequence[str]) -> pd.DataFrame:
    """Read one row per campaign, in order: name, robot (else its name), labels, model, outcome, reason of a failure."""
    import pandas as pd

    columns = [CAMPAIGN, *labels, MODEL, "outcome", "reason"]
    first = pd.concat(frame.drop_duplicates(CAMPAIGN) for frame in _frames(table, columns))
    found = first.drop_duplicates(CAMPAIGN).reset_index(drop=True).astype(object)
    found = found.where(found.notna(), "")
    robot = found.get(ROBOT, "")
    found[ROBOT] = np.where(robot == "", found[CAMPAIGN], robot)
    return found


def _findings(table: Path, campaigns: pd.DataFrame) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Read the findings: one row by effect and robot (place, known, testable, at work, certain), and all cases.

    A case is an effect that is at work in a campaign, or a campaign whose gap no effect explains.
    """
    import pandas as pd

    robot_of = campaigns.set_index(CAMPAIGN)[ROBOT]
    columns = [CAMPAIGN, "rms_before", "rms_after", "effect", "status", "probability", "shrinkage", "quantity"]
    findings, cases = [], []
    for frame in _frames(table, [*columns, "places", "confounded_with", "unexplained"]):
        part = frame[frame["effect"].notna()].copy()
        part[ROBOT] = robot_of[part[CAMPAIGN]].to_numpy()
        part["known"] = part["quantity"].isna()
        part["effect"] = part["effect"].where(part["known"], "a law of " + part["quantity"].fillna(""))
        part["place"] = [places[0]["name"] if places is not None and len(places) else "" for places in part["places"]]
        part["alone"] = part["status"] != "confounded"
        part["testable"] = part["status"] != "not_testable"
        # of two that are confounded only the one that was fitted has a place
        part["at_work"] = part["status"].isin(_FOUND) & (part["alone"] | (part["place"] != ""))
        part["certain"] = part["at_work"] & part["alone"]
        findings.append(part[["effect", ROBOT, "place", "known", "testable", "at_work", "certain"]])
        doubtful = part["unexplained"].eq(True)
        cases.append(part.loc[part["at_work"] | doubtful].drop(columns=["unexplained", "quantity", "places", "status"]))
    every = pd.concat(cases, ignore_index=True)
    unexplained = ~every.groupby(CAMPAIGN)["at_work"].transform("any") & ~every[CAMPAIGN].duplicated()
    # the place is that of the first campaign in which the effect is at work
    first = pd.concat(findings, ignore_index=True).sort_values("at_work", ascending=False, kind="stable")
    flags = dict.fromkeys(("testable", "at_work", "certain"), "any")
    per_robot = first.groupby(["effect", ROBOT], sort=False).agg({"place": "first", "known": "all", **flags})
    return per_robot.reset_index(), every[every["at_work"] | unexplained]


def _counts(findings: pd.DataFrame) -> tuple[Count, ...]:
    counts = []
    for effect, rows in findings.groupby("effect", sort=False):
        found = rows[rows["at_work"]]
        counts.append(
            Count(
                effect=str(effect),
                found=len(found),
                testable=int(rows["testable"].sum()),
                confounded=int((~found["certain"]).sum()),
                places=dict(Counter(place for place in found["place"] if place).most_common()),
                parameters=bool(rows["known"].all()),
            )
        )
    return tuple(sorted(counts, key=lambda c: (-c.found, c.effect)))


def _largest(cases: pd.DataFrame) -> tuple[Case, ...]:
    """Return the 500 cases with the largest rms distance before correction, with the effect of each, if any."""
    found = []
    largest = cases.sort_values("rms_before", ascending=False, kind="stable").head(settings.MOST_LISTED)
    for row in largest.to_dict("records"):
        case = Case(row[ROBOT], row[CAMPAIGN], row["rms_before"], row["rms_after"])
        if row["at_work"]:
            others = () if row["alone"] or row["confounded_with"] is None else tuple(row["confounded_with"])
            told: dict[str, Any] = {
                name: None if row[name] != row[name] else row[name] for name in ("probability", "shrinkage")
            }
            case = replace(case, **told, effect=row["effect"], place=row["place"], confounded_with=others)
        found.append(case)
    return tuple(found)


def _gathered(findings: pd.DataFrame, robots: pd.DataFrame) -> tuple[Gathered, ...]:
    """Test by the hypergeometric distribution which effects are over-represented in a group (Bonferroni-corrected)."""
    from scipy.stats import hypergeom

    striking, tests = [], 0
    for label in robots.columns:
        group = findings[ROBOT].map(robots[label]).rename("group")
        tested = findings[findings["testable"]].groupby(["effect", group])["at_work"]
        counts = tested.agg(found="sum", robots="size")
        every = counts.groupby("effect").transform("sum")
        asked = (counts["robots"] >= settings.FEWEST_IN_GROUP) & (counts["robots"] < every["robots"])
        tests += int(asked.sum())
        here, every = counts[asked], every[asked]
        chance = hypergeom.sf(here["found"] - 1, every["robots"], every["found"], here["robots"])
        told = here.join((every - here).add_suffix("_elsewhere")).assign(p_value=chance).reset_index()
        striking += [Gathered(label=label, **row) for row in told.to_dict("records")]
    fair = [replace(g, p_value=min(g.p_value * tests, 1.0)) for g in striking]
    kept = sorted((g.p_value, g.effect, g.label, g.group, g) for g in fair if g.p_value < settings.STRIKING)
    return tuple(g for *_, g in kept[: settings.MOST_LISTED])


def _parameter_values(table: Path, effect: str) -> Iterator[tuple[str, str, pd.DataFrame]]:
    """Yield name and unit of each parameter of one effect, with a data frame of estimates and sigmas by campaign."""
    pa, compute = needed("pyarrow"), needed("pyarrow.compute")
    of_effect = [("effect", "==", effect)]
    read = needed("pyarrow.parquet").read_table(table, columns=[CAMPAIGN, "free"], filters=of_effect).combine_chunks()
    free = pa.Table.from_struct_array(compute.list_flatten(read["free"])).to_pandas()
    free[CAMPAIGN] = read[CAMPAIGN].take(compute.list_parent_indices(read["free"])).to_pandas()
    for (name, unit), rows in free.groupby(["name", "unit"], sort=False):
        yield name, unit, rows


def _shared(
    table: Path,
    campaigns: pd.DataFrame,
    robots: pd.DataFrame,
    effects: Sequence[str],
    progress: Callable[[str, int, int], None],
) -> tuple[tuple[Shared, ...], tuple[Apart, ...], int]:
    """Fit the population of each parameter; return significant ones, outlying robots, and the number compared.

    Significance is Bonferroni-corrected; both lists begin with the most certain.
    """
    import pandas as pd

    codes, names = pd.factorize(campaigns[ROBOT])
    robot_of = pd.Series(codes, index=campaigns[CAMPAIGN])
    labels = {name: pd.factorize(robots[name]) for name in robots.columns}
    together: list[Shared] = []
    apart: list[Apart] = []
    for k, effect in enumerate(effects, 1):
        for name, unit, rows in _parameter_values(table, effect):
            owners = robot_of[rows[CAMPAIGN]].to_numpy()
            who, values, deviations = combined(rows["value"].to_numpy(), rows["std"].to_numpy(), owners)
            if len(who) >= settings.FEWEST_ROBOTS:
                found, usual, unlike = _compared((effect, name, unit), values, deviations, who, labels)
                together.append(found)
                per_robot = zip(names[who], values, deviations, usual, unlike, strict=True)
                some = ((robot, *map(float, rest)) for robot, *rest in per_robot if rest[-1] >= settings.NAMED)
                apart += [Apart(robot, effect, name, unit, *rest) for robot, *rest in some]
        progress("effects compared", k, len(effects))
    tests = len(together) * (1 + len(labels))
    fair = [replace(s, p_mean=min(s.p_mean * tests, 1.0), p_label=min(s.p_label * tests, 1.0)) for s in together]
    fair = [s if s.p_label < settings.STRIKING else replace(s, label="", p_label=1.0, groups=()) for s in fair]
    kept = [s for s in fair if s.label or s.p_mean < settings.STRIKING]
    kept.sort(key=lambda s: (min(s.p_mean, s.p_label), -abs(s.mean) / s.mean_std, s.effect, s.parameter))
    apart.sort(key=lambda a: (-a.probability, -abs(a.value - a.usual) / a.std, a.robot, a.effect, a.parameter))
    return tuple(kept), tuple(apart[: settings.MOST_LISTED]), len(together)


def _compared(
    what: tuple[str, str, str],
    values: Array,
    deviations: Array,
    who: Codes,
    labels: dict[str, tuple[Codes, Any]],
) -> tuple[Shared, Array, Array]:
    """Fit the population of a parameter as one group and by each label; the label with the smallest F test is kept.

    Also returns each robot's usual value and outlier probability, within its group if the label is significant.
    """
    whole = population(values, deviations)
    mean, std = float(whole.means[0]), float(whole.deviations[0])
    found = Shared(*what, len(who), mean, std, whole.spread, whole.spread_std, whole.nothing)
    usual, unlike = np.full(len(who), mean), whole.apart
    splits = []
    for label, (codes, names) in labels.items():
        kept = np.bincount(codes[who])[codes[who]] >= settings.FEWEST_IN_GROUP
        groups, own = np.unique(codes[who][kept], return_inverse=True)
        if len(groups) > 1:
            splits.append((label, population(values[kept], deviations[kept], own), kept, own, names[groups]))
    if not splits:
        return found, usual, unlike
    label, by, kept, own, names = min(splits, key=lambda split: split[1].p_equal_means)
    per_group = zip(names, np.bincount(own).tolist(), by.means.tolist(), by.deviations.tolist(), strict=True)
    groups_told = sorted(
        (Group(*group) for group in per_group), key=lambda g: (-abs(g.mean - mean) / g.mean_std, g.group)
    )
    found = replace(found, label=label, p_label=by.p_equal_means, groups=tuple(groups_told[: settings.MOST_GROUPS]))
    if by.p_equal_means < settings.STRIKING:
        found = replace(found, spread=by.spread, spread_std=by.spread_std)
        unlike = np.where(kept, 0.0, unlike)
        usual[kept], unlike[kept] = by.means[own], by.apart
    return found, usual, unlike
