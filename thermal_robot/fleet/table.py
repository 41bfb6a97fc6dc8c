"""The table of a fleet, read again: campaigns, what was found in them, and one parameter of all robots at a time.

The table is read in pieces, and of an effect only its own columns: the memory holds numbers of one effect alone.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.fleet import settings
from thermal_robot.fleet.extra import needed
from thermal_robot.fleet.listed import CAMPAIGN, ROBOT
from thermal_robot.fleet.rows import FAILED

MODEL = "model"
"""The robot's type, as its description names it: a label of every campaign."""
Codes = NDArray[np.int64]


@dataclass
class Labels:
    """One label of all campaigns: a number each, and what the numbers stand for."""

    codes: list[int] = field(default_factory=list)
    values: dict[str, int] = field(default_factory=dict)

    def add(self, value: str) -> None:
        """Label the next campaign."""
        self.codes.append(self.values.setdefault(value, len(self.values)))


@dataclass(frozen=True, eq=False)
class Overview:
    """The campaigns of a table.

    Attributes
    ----------
    numbers
        Of the campaigns, by name.
    robots
        Which robot each is of.
    labels
        The others, by name, the robot's type included.
    outcomes
        How many campaigns had each outcome.
    excused
        Some of those that have no diagnosis: name, outcome, reason.
    """

    numbers: dict[str, int]
    robots: Labels
    labels: dict[str, Labels]
    outcomes: dict[str, int]
    excused: list[tuple[str, str, str]]

    def robot_of(self) -> Codes:
        """(C,) number of each campaign's robot."""
        return np.array(self.robots.codes, dtype=np.int64)

    def label_of(self, name: str) -> Codes:
        """(R,) number of each robot's label: that of its first campaign."""
        first = np.unique(self.robot_of(), return_index=True)[1]
        return np.array(self.labels[name].codes, dtype=np.int64)[first]


def overview(table: Path, names: Sequence[str]) -> Overview:
    """Read who is in a table, and what became of each.

    Parameters
    ----------
    table
        The file.
    names
        Of the labels.
    """
    groups = [name for name in (*names, MODEL) if name != ROBOT]
    found = Overview({}, Labels(), {name: Labels() for name in groups}, {}, [])
    for row in _records(table, [CAMPAIGN, *names, MODEL, "outcome", "reason"]):
        name, outcome = row[CAMPAIGN], row["outcome"]
        if name in found.numbers:
            continue
        found.numbers[name] = len(found.numbers)
        found.robots.add(row.get(ROBOT) or name)
        for group in groups:
            found.labels[group].add(row[group] or "")
        found.outcomes[outcome] = found.outcomes.get(outcome, 0) + 1
        if row["reason"] and len(found.excused) < settings.MOST_LISTED:
            found.excused.append((name, outcome, row["reason"]))
    return found


def findings(table: Path) -> Iterator[dict[str, Any]]:
    """Yield the row of every effect of every campaign that has one: what is needed to count it."""
    columns = [
        CAMPAIGN,
        "rms_before",
        "rms_after",
        "effect",
        "status",
        "probability",
        "shrinkage",
        "quantity",
        "places",
        "confounded_with",
        "unexplained",
    ]
    return (row for row in _records(table, columns) if row["effect"] is not None)


@dataclass(frozen=True, eq=False)
class Told:
    """One parameter as the campaigns tell it: numbers of the campaigns, values, one sigma, SI; and its unit."""

    effect: str
    parameter: str
    unit: str
    campaigns: Codes
    values: NDArray[np.float64]
    deviations: NDArray[np.float64]


def told(table: Path, effect: str, numbers: dict[str, int]) -> Iterator[Told]:
    """Yield the parameters of one effect, each as all campaigns tell it."""
    parquet, compute = needed("pyarrow.parquet"), needed("pyarrow.compute")
    read = parquet.read_table(table, columns=[CAMPAIGN, "free"], filters=[("effect", "==", effect)])
    owners = np.array([numbers[name] for name in read[CAMPAIGN].to_pylist()], dtype=np.int64)
    which = compute.list_parent_indices(read["free"]).to_numpy()
    flat = compute.list_flatten(read["free"])
    if not len(flat):
        return
    names = compute.struct_field(flat, "name").to_pylist()
    units = compute.struct_field(flat, "unit").to_pylist()
    values = compute.struct_field(flat, "value").to_numpy()
    deviations = compute.struct_field(flat, "std").to_numpy()
    keys = dict.fromkeys(zip(names, units, strict=True))
    number = {key: k for k, key in enumerate(keys)}
    code = np.array([number[key] for key in zip(names, units, strict=True)])
    for key, k in number.items():
        own = code == k
        yield Told(effect, *key, owners[which[own]], values[own], deviations[own])


def _records(table: Path, columns: Sequence[str]) -> Iterator[dict[str, Any]]:
    parquet = needed("pyarrow.parquet")
    with parquet.ParquetFile(table) as file:
        for batch in file.iter_batches(settings.ROWS_AT_ONCE, columns=list(dict.fromkeys(columns))):
            yield from batch.to_pylist()


__all__ = ["FAILED", "Labels", "Overview", "Told", "findings", "overview", "told"]
