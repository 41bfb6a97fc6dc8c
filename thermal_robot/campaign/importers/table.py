"""Any table, by a mapping (docs/importers.md); or two, measured and commanded: joined by names, or row by row."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from thermal_robot.campaign.importers.columns import found
from thermal_robot.campaign.importers.mapped import Format, Source
from thermal_robot.campaign.importers.plan import Plan
from thermal_robot.campaign.names import listed
from thermal_robot.campaign.table import Cells, Table
from thermal_robot.campaign.tabular import PLAIN, read_table
from thermal_robot.errors import CampaignError

_FEW = 3
"""Names of either table that a sentence shows: enough to see how the two spell them."""


def commands(file: Path, plan: Plan) -> Table:
    """Read the second of two tables, as ``[commands]`` says; without it as ``[table]`` does of the first, if it fits.

    A layout fits where the header, if it has any, is no row of numbers, and where no row is a header. What does not fit
    is tried with a header or without, and as any table is read.

    Raises
    ------
    CampaignError
        A table that cannot be read.
    """
    if plan.sections.get("commands"):
        return read_table(file, plan.layout("commands"))
    first = plan.layout()
    for layout in (first, replace(first, header=not first.header), PLAIN):
        try:
            table = read_table(file, layout)
        except CampaignError:
            continue
        if len(table.columns) > 1 and _fits(table):
            return table
    return read_table(file, first)


def _fits(table: Table) -> bool:
    if table.header is not None:
        return not table.headless
    rest = table.take(table.rows != table.rows[0])
    return not any(table.first_text(name) == 0 and rest.first_text(name) is None for name in table.columns)


def joined(measured: Table, commanded: Table, key: str = "") -> tuple[Table, tuple[str, ...]]:
    """Return one table with the columns of both, and in sentences what was left out.

    A point that was measured several times makes several rows. Rows come in the order of the measurements.

    Parameters
    ----------
    measured, commanded
        The tables. Messages speak of rows and columns of the measured one.
    key
        Column of the measured table that holds the names of points; that of the commands is the one that has most of
        them. Empty where the rows of both are in the same order.

    Raises
    ------
    CampaignError
        Tables of different lengths without names, a point that is commanded twice, no name in common.
    """
    taken = ""
    if not key:
        if len(measured.rows) != len(commanded.rows):
            headless = measured.headless or commanded.headless
            raise CampaignError(
                measured.file,
                f"has not as many rows as {commanded.file}, and no names that tell which belong together{headless}",
                found=f"{len(measured.rows)} and {len(commanded.rows)} rows{', without that line' if headless else ''}",
                expected="as many, in the same order, or a column of names in both",
            )
        order: Sequence[int] = range(len(commanded.rows))
        notes: tuple[str, ...] = (f"rows of {measured.file} and {commanded.file} joined in their order",)
    else:
        taken = _names_of(commanded, measured.text(key)) or _no_name(measured, commanded, key)
        measured, order, notes = _by_name(measured, commanded, key, taken)
    columns = _settled(measured, range(len(measured.rows)))
    header = None if commanded.unnamed else measured.header
    if commanded.unnamed:  # known by their numbers, which go on from those of the first table
        called = {name: str(len(columns) + k) for k, name in enumerate(commanded.columns, start=1)}
        commanded = replace(commanded, columns={called[name]: cells for name, cells in commanded.columns.items()})
        taken = called.get(taken, "")
    for name, cells in _settled(commanded, order).items():
        if name == taken:
            continue
        if name in columns:
            raise CampaignError(
                commanded.file,
                f"has a column that {measured.file} has, too",
                row=commanded.header,
                column=name,
                expected="every column in one of the two tables",
            )
        columns[name] = cells
    return Table(f"{measured.file} with {commanded.file}", columns, measured.rows, header), notes


def _names_of(commanded: Table, points: Sequence[str]) -> str:
    """Return the column of the commands that has most names of points; empty where none has any."""
    known = set(points) - {""}
    common = {name: len(known & set(commanded.text(name))) for name in commanded.columns}
    best = max(common, key=lambda name: common[name])
    return best if common[best] else ""


def _no_name(measured: Table, commanded: Table, key: str) -> str:
    first = {name: commanded.text(name)[0] for name in commanded.columns}
    raise CampaignError(
        measured.file,
        f"no point has a name that stands in {commanded.file}",
        column=key,
        found=listed(measured.text(key), _FEW),
        expected=f"names of one of its columns, such as {listed((f'{n} {c}' for n, c in first.items()), _FEW)}",
    )


def _by_name(measured: Table, commanded: Table, key: str, taken: str) -> tuple[Table, Sequence[int], tuple[str, ...]]:
    """Return the measured rows whose point is commanded, in which row it is, and what was left out."""
    points, commands = measured.text(key), commanded.text(taken)
    twice = [name for name, count in Counter(commands).items() if count > 1]
    if twice:
        rows = [int(row) for row, name in zip(commanded.rows, commands, strict=True) if name == twice[0]]
        raise CampaignError(
            commanded.file,
            "a point is commanded more than once",
            row=rows[1],
            column=taken,
            found=f"{twice[0]!r}, as in row {rows[0]}",
            expected="each name once",
        )
    where = {name: k for k, name in enumerate(commands)}
    known = np.array([name in where for name in points])
    unmeasured = sorted(set(commands) - set(points))
    notes = []
    if not known.all():
        unknown = [name for name, there in zip(points, known, strict=True) if not there]
        notes.append(f"{len(unknown)} points left out, not commanded: {listed(unknown, _FEW)}")
    if unmeasured:
        notes.append(f"{len(unmeasured)} commands left out, not measured: {listed(unmeasured, _FEW)}")
    order = [where[name] for name, there in zip(points, known, strict=True) if there]
    return measured.take(known), order, tuple(notes)


def _settled(table: Table, order: Sequence[int]) -> dict[str, Cells]:
    """Return columns in an order of rows, numbers where a column has nothing else: decimal commas are settled here."""
    columns: dict[str, Cells] = {}
    for name in table.columns:
        if table.first_text(name) is None:
            columns[name] = table.numbers(name, gaps=True)[list(order)]
        else:
            cells = table.text(name)
            columns[name] = [cells[k] for k in order]
    return columns


def _read(files: Sequence[Path], plan: Plan) -> Source:
    """Read one table, or two that are joined by the names in ``[table] key``, else row by row."""
    if plan.get("table", "targets") is not None:
        expected = 'the format `points`; or the columns of each target, "x.1" = …, in [columns]'
        raise CampaignError(plan.file, "is for lists of points", column="table.targets", expected=expected)
    table = read_table(files[0], plan.layout())
    if len(files) == 1:
        return Source(table, Plan())
    key = plan.get("table", "key")
    both, notes = joined(table, commands(files[1], plan), "" if key is None else found(table, key))
    return Source(both, Plan(), notes)


FORMAT = Format(
    "any table, by a mapping; or two, of what was measured and of what was commanded",
    "TABLE, or MEASURED COMMANDED",
    _read,
)
