"""Importers of tables and lists of points: by a mapping (docs/importers.md), two joined ones, and public data sets.

Source of SpatialAnalyzer's layout: New River Kinematics, *SpatialAnalyzer User's Manual*, "Exporting ASCII Formatted
Points": a line holds the collection, the group and the target, or the last two, or the last, or none of them, then x y
z, separated by blanks or commas; lines that begin with // are comments. What else can be exported (tolerances,
uncertainties, time stamps) stands behind in an order that the manual does not give: it is left out here.

A generic list has the same lines, or a header. Several targets of one pose, where the mapping names their column, make
one row.

Public data sets are a mapping each. P. Jacobi, github.com/pauljac7700/serial_robots_datasets, README, "Data Format":
target positions x_t y_t z_t and their differences from the positions that were reached x_dif y_dif z_dif, mm; commanded
joints joint_1 …, degrees; step_order. Measured is target + difference: that sum has six decimals in every row, the
difference of the two has not.

Landgraf et al. (2021), github.com/christianlandgraf/ipa-robot-accuracy, README and the headers of its tables: commanded
joints by their names in the URDF, rad; measurement_x y z, mm, and measurement_rx ry rz, degrees, of the T-Mac in the
tracker's frame; measurement_temperature of the air, °C; Timestamp as 20200714163904. That rx ry rz turn about the
moving axes x, y, z in this order is not written there: this convention agrees with the joints to 2 mrad, where each
other leaves more than 20. In some series the time stamps are rounded to 2,02011E+13: then the order of the rows takes
their place. The T-Mac sits about 93 mm before the flange, which is where its place is looked for first.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from thermal_robot.campaign.importers.plan import JOINING, Format, Plan, Source, column_name, planned
from thermal_robot.campaign.names import POSITION, listed
from thermal_robot.campaign.table import PLAIN, Cells, Layout, Table, read_table
from thermal_robot.errors import CampaignError

_FEW = 3  # Names of either table that a sentence shows: enough to see how the two spell them


def commands(file: Path, plan: Plan) -> Table:
    """Read the table of commands, the second of two, with the layout in ``[commands]`` of the mapping, else a guess.

    Tried in turn are the layout of ``[table]``, the same with or without a header, and the default, until the header is
    no row of numbers and the first row no header.
    """
    if plan.sections.get("commands"):
        return read_table(file, plan.layout("commands"))
    first = plan.layout()
    for layout in (first, replace(first, header=not first.header), PLAIN):
        try:
            table = read_table(file, layout)
        except CampaignError:
            continue
        rest = table.take(np.arange(1, len(table.rows)))
        titled = any(table.first_text(name) == 0 and rest.first_text(name) is None for name in table.columns)
        if len(table.columns) > 1 and not (table.headless if table.header is not None else titled):
            return table
    return read_table(file, first)


def joined(measured: Table, commanded: Table, key: str = "") -> tuple[Table, tuple[str, ...]]:
    """Inner join of two tables by point names or row by row, with sentences on what was left out.

    A point that was measured several times makes several rows, in the order of the measurements. ``key`` is the column
    of the measured table that holds the names of points; that of the commands is the one that has most of them. Without
    it the rows of both are in the same order. Refused are tables of different lengths without names, a point that is
    commanded twice, and no name in common; messages speak of rows and columns of the measured table.
    """
    taken, notes = "", [f"rows of {measured.file} and {commanded.file} joined in their order"]
    if key:
        taken = _names_of(measured, commanded, key)
        measured, commanded, notes = _by_name(measured, commanded, key, taken)
    elif len(measured.rows) != len(commanded.rows):
        headless = measured.headless or commanded.headless
        together = f"has not as many rows as {commanded.file}, and no names that tell which belong together"
        found = f"{len(measured.rows)} and {len(commanded.rows)} rows{', without that line' if headless else ''}"
        expected = "as many, in the same order, or a column of names in both"
        raise CampaignError(measured.file, f"{together}{headless}", found=found, expected=expected)
    # numbers at once, as one of the tables may have decimal commas
    columns, first = {**measured.columns, **measured.numeric()}, len(measured.columns)
    for k, (name, cells) in enumerate({**commanded.columns, **commanded.numeric()}.items(), start=1):
        # columns without names are known by their numbers, which go on from those of the first table
        called = str(first + k) if commanded.unnamed else name
        if name != taken and called in columns:
            problem = f"has a column that {measured.file} has, too"
            raise commanded.error(problem, name, expected="every column in one of the two tables")
        columns |= {called: cells} if name != taken else {}
    header = None if commanded.unnamed else measured.header
    return Table(f"{measured.file} with {commanded.file}", columns, measured.rows, header), tuple(notes)


def _names_of(measured: Table, commanded: Table, key: str) -> str:
    """Find the column of the commands that shares most names with the measured column ``key``; refused if none does."""
    points = measured.text(key)
    common = {name: len({*points} & {*commanded.text(name)} - {""}) for name in commanded.columns}
    best = max(common, key=lambda name: common[name])
    if not common[best]:
        such = listed((f"{name} {commanded.text(name)[0]}" for name in commanded.columns), _FEW)
        problem, expected = (
            f"no point has a name that stands in {commanded.file}",
            f"names of one column, such as {such}",
        )
        raise CampaignError(measured.file, problem, column=key, found=listed(points, _FEW), expected=expected)
    return best


def _by_name(measured: Table, commanded: Table, key: str, taken: str) -> tuple[Table, Table, list[str]]:
    """Inner join by point name: rows of both tables in the order of the measured ones, and notes on those left out."""
    points, called = measured.text(key), commanded.text(taken)
    where = {name: row for row, name in reversed([*enumerate(called)])}
    again = np.array([where[name] != row for row, name in enumerate(called)])
    first = [commanded.rows[where[name]] for name in called]
    problem, expected = "a point is commanded more than once", "each name once"
    commanded.refuse(again, problem, taken, expected, lambda row: f"{called[row]!r}, as in row {first[row]}")
    unknown, unmeasured = [name for name in points if name not in where], sorted({*where} - {*points})
    notes = [f"{len(unknown)} points left out, not commanded: {listed(unknown, _FEW)}"] if unknown else []
    if unmeasured:
        notes.append(f"{len(unmeasured)} commands left out, not measured: {listed(unmeasured, _FEW)}")
    order = np.array([where.get(name, -1) for name in points])
    return measured.take(order >= 0), commanded.take(order[order >= 0]), notes


def _read_table(files: Sequence[Path], plan: Plan) -> Source:
    """Read one table, or two joined by the names in ``[table] key``, else row by row."""
    if plan.get("table", "targets") is not None:
        expected = 'the format `points`; or the columns of each target, "x.1" = …, in [columns]'
        raise CampaignError(plan.file, "is for lists of points", column="table.targets", expected=expected)
    table = read_table(files[0], plan.layout())
    if len(files) == 1:
        return Source(table, Plan())
    key = plan.get("table", "key")
    both, notes = joined(table, commands(files[1], plan), "" if key is None else column_name(table, key))
    return Source(both, Plan(), notes)


TABLE = Format(
    "any table, by a mapping; or two, of what was measured and of what was commanded",
    "TABLE, or MEASURED COMMANDED",
    _read_table,
)


COMMENT = "//"
_NAMES = ("collection", "group", "target")


def _read_points(files: Sequence[Path], plan: Plan) -> Source:
    """Read points and commands, joined by name, or without names row by row."""
    laid_out = set(plan.sections.get("table", {})) - set(JOINING)
    table = _called(read_table(files[0], plan.layout() if laid_out else _laid_out(files[0])), plan)
    stated, targets = plan.get("table", "key"), plan.get("table", "targets")
    key = column_name(table, stated) if stated else _NAMES[-1]
    columns, told = {axis: axis for axis in POSITION}, []
    if targets:
        (table, note), columns = grouped(table, key, targets), {}
        told.append(note)
    named = key in table.columns
    both, notes = joined(table, commands(files[1], plan), key if named else "")
    columns |= {"pose": key} if named else {}
    return Source(both, planned({"columns": columns}), (*told, *notes))


def _laid_out(file: Path) -> Layout:
    """Detect the layout of a list of points: comments by //, and a header if the first line has no number."""
    layout = Layout(header=False, comment=COMMENT)
    table = read_table(file, layout)
    if len(table.columns) < len(POSITION):
        expected = "lines of names and x y z, separated by blanks, commas or tabs"
        raise CampaignError(str(file), "is no list of points", expected=expected)
    first = table.take(np.array([0]))
    return replace(layout, header=all(first.first_text(name) is not None for name in first.columns))


def _called(table: Table, plan: Plan) -> Table:
    """Rename the columns of a list of points to collection, group, target, x, y, z, by header or by position."""
    there = list(table.columns)
    if table.header is not None:
        axes = {name: name.lower() for name in there if name.lower() in POSITION}
        first = min((there.index(name) for name in axes), default=0)
    else:
        first = _names_before(table)
        axes = dict(zip(there[first:], POSITION, strict=False))
    if sorted(axes.values()) != list(POSITION) and not plan.sections.get("columns"):
        problem, expected = "x, y and z of the points are not found", "names, then x y z; or [columns] in the mapping"
        found = listed(there) if table.header is not None else f"{len(there)} fields in a line"
        raise CampaignError(table.file, problem, row=table.header, found=found, expected=expected)
    titles = dict(zip(there[:first], _NAMES[max(0, len(_NAMES) - first) :], strict=False))
    return replace(table, columns={{**titles, **axes}.get(name, name): cells for name, cells in table.columns.items()})


def _names_before(table: Table) -> int:
    """Return the number (0 to 3) of leading columns that are names: text, or integers if three columns follow."""
    for count, name in enumerate(list(table.columns)[: len(_NAMES)]):
        spare = len(table.columns) - count > len(POSITION)
        if table.first_text(name) is None and not (spare and all(map(str.isdigit, table.text(name)))):
            return count
    return min(len(_NAMES), len(table.columns))


def grouped(table: Table, key: str, targets: str) -> tuple[Table, str]:
    """Reshape to one row for each visit of a pose, with a sentence on the targets.

    Each line of the table is a point, x y z. Targets are numbered as they first appear. One that is measured again at a
    pose begins another visit. A target that a visit lacks has empty cells there. ``key`` and ``targets`` are the
    columns of the names of poses and of targets; a single target is refused.
    """
    import pandas as pd

    poses, called = (table.text(column_name(table, each)) for each in (key, targets))
    lines = pd.DataFrame({"pose": poses, "called": called})
    order = list(lines["called"].unique())
    if len(order) < 2:
        problem, expected = "holds a single target of each pose", "names of several targets, or no [table] targets"
        raise CampaignError(table.file, problem, column=targets, found=listed(order), expected=expected)
    lines["visit"] = lines.groupby(["pose", "called"]).cumcount()
    row = lines.groupby(["pose", "visit"], sort=False).ngroup().to_numpy()
    _, first = np.unique(row, return_index=True)
    values = np.full((len(first), len(order), 3), np.nan)
    values[row, lines["called"].map(order.index)] = np.stack([table.numbers(a, gaps=True) for a in POSITION], axis=1)
    columns: dict[str, Cells] = {key: list(lines["pose"].iloc[first])}
    columns |= {f"{axis}.{k + 1}": values[:, k, i] for k in range(len(order)) for i, axis in enumerate(POSITION)}
    both = Table(table.file, columns, table.rows[first], table.header, warnings=table.warnings)
    return both, f"{len(order)} targets of each pose, numbered so: {listed(order)}"


POINTS = Format(
    "points of a laser tracker by name (SpatialAnalyzer, lists of names and x y z), and a table of commands",
    "POINTS COMMANDS.csv",
    _read_points,
    least=2,
)


_JACOBI: dict[str, Any] = {
    "measurements": {"angle_unit": "deg", "length_unit": "mm"},
    "columns": {**{axis: {"sum": [f"{axis}_t", f"{axis}_dif"]} for axis in "xyz"}, "order": "step_order"},
}
_IPA: dict[str, Any] = {
    "measurements": {"angle_unit": "rad", "length_unit": "mm"},
    "frames": {"target": [0.0, 0.0, 93.0]},
    "columns": {**{a: f"measurement_{a}" for a in "xyz"}, "temperature": "measurement_temperature"},
    "orientation": {
        "kind": "euler",
        "sequence": "XYZ",
        "unit": "deg",
        "columns": [f"measurement_r{a}" for a in "xyz"],
    },
}
"""What published sets are, as mappings."""


def _ipa_ur10(files: Sequence[Path], plan: Plan) -> Source:
    table, stamp = read_table(files[0], plan.layout()), "Timestamp"
    whole = stamp in table.columns and all(re.fullmatch(r"\d{14}", each) for each in table.text(stamp))
    clock: dict[str, Any] = {"time": {"column": stamp, "time": "%Y%m%d%H%M%S"}} if whole else {"order": {"count": True}}
    notes = () if whole else ("the time stamps are no instants: the order of the rows is taken",)
    return Source(table, planned({**_IPA, "columns": {**_IPA["columns"], **clock}}), notes)


JACOBI = Format(
    "the data sets of P. Jacobi: UR5 and WAM, laser tracker",
    "3D_UR5_uncalibrated_grid_cleaned.csv",
    lambda files, plan: Source(read_table(files[0], plan.layout()), planned(_JACOBI)),
    most=1,
)
IPA_UR10 = Format(
    "the data set of Landgraf et al.: UR10, laser tracker with T-Mac", "measurements_grid.csv", _ipa_ur10, most=1
)
