"""A plan as text: what to expect of each effect, in a table."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from thermal_robot.campaign.write import write_commands, write_planned
from thermal_robot.planning.expected import Expected, ExpectedParameter
from thermal_robot.planning.plan import Plan

_HEAD = ("effect", "unit", "expected size", "1 sigma", "worst", "beside all", "told", "confounded with")
_NUMBERS = range(2, 7)


def text(plan: Plan) -> str:
    """Return the plan in words: how many rows, the approaches, and a line for each effect and unit.

    ``1 sigma`` and ``worst`` are the median and the largest over the parameters that are told, else over all, were the
    effect alone at work; ``beside all`` is the median were all of them; ``told`` counts the parameters known to less
    than half their expected size.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> from thermal_robot.planning import plan, text
    >>> print(text(plan(tr.load_robot("builtin:rv_m2", "tool0"), rows=12, effects=["joint_gain"])))
    12 rows: 12 poses. Joints come from below in ...
    ...
    joint_gain ...
    """
    rows = [_HEAD, *(line for expected in plan.effects for line in _lines(expected))]
    widths = [max(len(row[k]) for row in rows) for k in range(len(_HEAD))]
    table = [_row(row, widths) for row in rows]
    lacking = [f"{e.name} {_why(e)}" for e in plan.effects if not e.parameters]
    return "\n".join([_opening(plan), "", *table, *(["", *lacking] if lacking else [])])


def _opening(plan: Plan) -> str:
    commands = plan.commands
    names = commands.robot.joint_names
    shares = [float((commands.covariates[f"approach.{name}"] > 0.0).mean()) for name in names]
    poses = commands.samples // plan.repeats
    each = f", each {plan.repeats} times" if plan.repeats > 1 else ""
    return (
        f"{commands.samples} rows: {poses} poses{each}. Joints come from below in {100 * min(shares):.0f} to "
        f"{100 * max(shares):.0f} % of rows, if the robot goes direct from row to row."
    )


def _row(cells: tuple[str, ...], widths: list[int]) -> str:
    aligned = (c.rjust(w) if k in _NUMBERS else c.ljust(w) for k, (c, w) in enumerate(zip(cells, widths, strict=True)))
    return "  ".join(aligned).rstrip()


def _lines(expected: Expected) -> Iterator[tuple[str, ...]]:
    units = dict.fromkeys(parameter.unit for parameter in expected.parameters)
    for k, unit in enumerate(units):
        own = [parameter for parameter in expected.parameters if parameter.unit == unit]
        yield expected.name if k == 0 else "", *_figures(unit, own), ", ".join(expected.confounded) if k == 0 else ""


def _figures(unit: str, own: list[ExpectedParameter]) -> tuple[str, ...]:
    told = [parameter for parameter in own if parameter.told]
    meant = told or own
    figures = (
        np.median([p.size for p in own]),
        np.median([p.sigma for p in meant]),
        max(p.sigma for p in meant),
        np.median([p.beside for p in meant]),
    )
    return unit, *(f"{figure:.2g}" for figure in figures), f"{len(told)} of {len(own)}"


def _why(expected: Expected) -> str:
    """Say why nothing can be said of an effect."""
    lacks = expected.lacks
    if not lacks:
        return "has no columns before there are data: it is looked for in what is measured"
    return f"is not planned for: it needs {lacks[0]}{f' and {len(lacks) - 1} more' if len(lacks) > 1 else ''}"


TABLE = ".csv"
COMMENTS = (
    "Planned, not yet measured: go direct from row to row in this order, and fill in measurements.csv: time in s, "
    "temperature in °C as recorded, and the target's place.",
    "plan.csv holds the temperatures that were planned; a column that will not be recorded is taken out.",
)


def write_plan(plan: Plan, path: str | Path) -> Path:
    """Write a plan: a table where the name ends in ``.csv``, else a folder that is made if need be.

    Parameters
    ----------
    plan
        What to write, in the units of its commands. Approaches are left out: they follow from the order of the rows.
    path
        The table, or the folder: campaign.toml, plan.csv, measurements.csv with empty cells for what is measured, and
        the robot.

    Returns
    -------
    Path
        The table or the campaign.toml.

    Raises
    ------
    CampaignError
        What cannot be written; a folder that holds a campaign already.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> from thermal_robot.planning import plan, write_plan
    >>> found = plan(tr.load_robot("builtin:rv_m2", "tool0"), rows=12, effects=["joint_gain"])
    >>> sorted(path.name for path in write_plan(found, "hall_3").parent.iterdir())
    ['campaign.toml', 'measurements.csv', 'plan.csv', 'robot.urdf']
    """
    derived = [name for name in plan.commands.covariates if name.startswith("approach.")]
    if Path(path).suffix.lower() != TABLE:
        return write_planned(plan.commands, path, comments=COMMENTS, derived=derived)
    write_commands(plan.commands, path, derived=derived)
    return Path(path)
