"""Parameters over a fleet: which are shared by all, which differ between groups, and which robots stand out.

Each parameter of each effect is a :func:`~thermal_robot.fleet.population.population` of its own, of values that every
campaign tells whether the effect was found there or not (:mod:`thermal_robot.fleet.free`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.fleet import settings
from thermal_robot.fleet.population import Population, combined, population
from thermal_robot.fleet.table import Overview, Told, told

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


def shared(
    table: Path, known: Overview, effects: Sequence[str], progress: Callable[[str, int, int], None] = lambda *_: None
) -> tuple[tuple[Shared, ...], tuple[Apart, ...], int]:
    """Compare the parameters of the robots of a table.

    Parameters
    ----------
    table
        The file.
    known
        Its campaigns.
    effects
        Whose parameters are compared.
    progress
        Called with a stage, how many effects are compared, and how many there are.

    Returns
    -------
    tuple
        What is shared, most certain first; who stands out, most probable first; how many parameters were compared.
    """
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
