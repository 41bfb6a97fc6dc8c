"""What is wrong with which robot of a fleet, and what several share."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from thermal_robot.diagnosis.parts import jsonable
from thermal_robot.fleet.counted import Case, Count, Gathered, counted
from thermal_robot.fleet.shared import Apart, Shared, shared
from thermal_robot.fleet.table import overview

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
    effects, gathered, found = counted(table, known)
    together, apart, parameters = shared(table, known, [e.effect for e in effects if e.parameters], progress)
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
