"""Lists of measured points with names, as laser trackers and SpatialAnalyzer export them, joined with the commands.

Source of SpatialAnalyzer's layout: New River Kinematics, *SpatialAnalyzer User's Manual*, "Exporting ASCII Formatted
Points": a line holds the collection, the group and the target, or the last two, or the last, or none of them, then
x y z, separated by blanks or commas; lines that begin with // are comments. What else can be exported (tolerances,
uncertainties, time stamps) stands behind in an order that the manual does not give: it is left out here.

A generic list has the same lines, or a header. Several targets of one pose, where the mapping names their column, make
one row.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from thermal_robot.campaign.importers.columns import found
from thermal_robot.campaign.importers.mapped import Format, Source
from thermal_robot.campaign.importers.plan import JOINING, Plan, planned
from thermal_robot.campaign.importers.table import commands, joined
from thermal_robot.campaign.names import listed
from thermal_robot.campaign.table import Cells, Table
from thermal_robot.campaign.tabular import SPACE, Layout, read_table
from thermal_robot.errors import CampaignError

COMMENT = "//"
_NAMES = ("collection", "group", "target")
_AXES = ("x", "y", "z")


def _read(files: Sequence[Path], plan: Plan) -> Source:
    """Read points and commands, joined by the name of the point; without names, row by row."""
    laid_out = set(plan.sections.get("table", {})) - set(JOINING)
    layout = plan.layout() if laid_out else _laid_out(files[0])
    table = _named(read_table(files[0], layout), plan)
    key = plan.get("table", "key") or _NAMES[-1]
    targets = plan.get("table", "targets")
    told: list[str] = []
    if targets:
        table, note = grouped(table, key, targets)
        told.append(note)
    both, notes = joined(table, commands(files[1], plan), key if key in table.columns else "")
    sections = {"columns": {} if targets else {axis: axis for axis in _AXES}}
    if key in table.columns:
        sections["columns"]["pose"] = key
    return Source(both, planned(sections), (*told, *notes))


def _laid_out(file: Path) -> Layout:
    """Return how a list of points is laid out: its first line that is no comment tells."""
    separators = {separator: Layout(separator, 0, False, COMMENT) for separator in (",", ";", "\t", SPACE)}
    for layout in separators.values():
        try:
            table = read_table(file, layout)
        except CampaignError:  # another number of fields in some line: not this separator
            continue
        if len(table.columns) >= len(_AXES):
            first = table.take(table.rows == table.rows[0])
            named = not any(first.first_text(name) is None for name in first.columns)
            return Layout(layout.separator, 0, named, COMMENT)
    raise CampaignError(
        str(file), "is no list of points", expected="lines of names and x y z, separated by blanks, commas or tabs"
    )


def _named(table: Table, plan: Plan) -> Table:
    """Return the table with its columns called collection, group, target, x, y, z as far as they are there."""
    if table.header is not None:
        axes = {name: name.lower() for name in table.columns if name.lower() in _AXES}
        first = min((k for k, name in enumerate(table.columns) if name in axes), default=0)
    else:
        first = _names_before(table)
        axes = dict(zip(list(table.columns)[first:], _AXES, strict=False))
    if sorted(axes.values()) != list(_AXES) and not plan.sections.get("columns"):
        raise CampaignError(
            table.file,
            "x, y and z of the points are not found",
            row=table.header,
            found=listed(table.columns) if table.header is not None else f"{len(table.columns)} fields in a line",
            expected="at most three names, then x y z; or [columns] in the mapping",
        )
    titles = dict(zip(list(table.columns)[:first], _NAMES[max(0, len(_NAMES) - first) :], strict=False))
    return replace(table, columns={{**titles, **axes}.get(name, name): cells for name, cells in table.columns.items()})


def _names_before(table: Table) -> int:
    """Return how many fields of a line are names: text, or whole numbers throughout where three fields remain."""
    columns = list(table.columns)
    for count, name in enumerate(columns[: len(_NAMES)]):
        figures = table.first_text(name) is None
        if figures and (len(columns) - count <= len(_AXES) or not all(map(str.isdigit, table.text(name)))):
            return count
    return min(len(_NAMES), len(columns))


def grouped(table: Table, key: str, targets: str) -> tuple[Table, str]:
    """Return a table with a row for each visit of a pose, and in a sentence which targets there are.

    Targets are numbered as they first appear. One that is measured again at a pose begins another visit. A target that
    a visit lacks has empty cells there.

    Parameters
    ----------
    table
        A line a point, with the columns x, y and z.
    key, targets
        Columns of the names of poses, and of those of targets on the tool.

    Raises
    ------
    CampaignError
        A column that is not there; a single target.
    """
    import pandas as pd

    lines = pd.DataFrame({"pose": table.text(found(table, key)), "called": table.text(found(table, targets))})
    order = list(lines["called"].unique())
    if len(order) < 2:
        raise CampaignError(
            table.file,
            "holds a single target of each pose",
            column=targets,
            found=listed(order),
            expected="names of several targets, or no [table] targets",
        )
    lines["visit"] = lines.groupby(["pose", "called"]).cumcount()
    row = lines.groupby(["pose", "visit"], sort=False).ngroup().to_numpy()
    _, first = np.unique(row, return_index=True)
    values = np.full((len(first), len(order), 3), np.nan)
    values[row, lines["called"].map(order.index)] = np.stack([table.numbers(a, gaps=True) for a in _AXES], axis=1)
    columns: dict[str, Cells] = {key: list(lines["pose"].iloc[first])}
    columns |= {f"{axis}.{k + 1}": values[:, k, i] for k in range(len(order)) for i, axis in enumerate(_AXES)}
    both = Table(table.file, columns, table.rows[first], table.header, warnings=table.warnings)
    return both, f"{len(order)} targets of each pose, numbered so: {listed(order)}"


FORMAT = Format(
    "points of a laser tracker by name (SpatialAnalyzer, lists of names and x y z), and a table of commands",
    "POINTS COMMANDS.csv",
    _read,
    least=2,
)
