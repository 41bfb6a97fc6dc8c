"""Importer of robot programs, KUKA's KRL and ABB's RAPID, with measured points.

Sources. KRL: KUKA, *System Software, Operating and Programming Instructions for System Integrators*, data types: AXIS
and E6AXIS hold A1 … A6 (degrees) and E1 … E6; FRAME, POS and E6POS hold X Y Z (mm) and A B C, degrees about Z, Y and X
of the moving frame in this order, and S and T, which tell the posture. Taught points stand in the .dat as ``DECL E6AXIS
XP1={A1 0.0,A2 -90.0,…}`` where the .src says ``PTP XP1``; it may say ``PTP {A1 0,…}`` as well.

RAPID: ABB 3HAC16581-1, *Technical reference manual, RAPID Instructions, Functions and Data types*: a jointtarget is
``[[rax_1, …, rax_6], [eax_a, …, eax_f]]`` in degrees, a robtarget ``[[x, y, z], [q1, q2, q3, q4], [cf1, cf4, cf6, cfx],
[eax_a, …]]`` in mm with a quaternion whose scalar is q1; 9E9 is an external axis that is not there.

Joint targets are commands. Cartesian targets are not, as several postures reach them: those of a second program count
as measured. Points are in the order of the motion statements, or without any in that of their declarations.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from thermal_robot.campaign.importers.plan import Format, Plan, Source, column_name, planned
from thermal_robot.campaign.importers.table import joined
from thermal_robot.campaign.table import LARGEST_TABLE, Table, read_table, table_from_frame
from thermal_robot.errors import CampaignError
from thermal_robot.files import is_file

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:E[-+]?\d+)?"
_AXIS = r"A\d|E\d|[re]ax_\w"
_ABSENT = 8.9e9  # An external axis that ABB's controller does not have is 9E9
_EXTERNAL = tuple(f"eax_{letter}" for letter in "abcdef")
_TARGETS = {
    (6, 6): (*(f"rax_{k}" for k in range(1, 7)), *_EXTERNAL),
    (3, 4, 4, 6): ("X", "Y", "Z", "q1", "q2", "q3", "q4", "cf1", "cf4", "cf6", "cfx", *_EXTERNAL),
}
"""Names of the figures of a jointtarget and of a robtarget, by how many stand in each bracket."""
Point = dict[str, Any]


def _aggregate(text: str) -> list[Point]:
    """Parse the fields of a KRL aggregate (``A1 0.0,A2 -90.0``) as a list of one point: number by upper-case name."""
    fields = re.findall(rf"(\w+)\s+({_NUMBER})", text, re.IGNORECASE)
    return [{key.upper(): float(value) for key, value in fields}]


def _targets(text: str) -> list[Point]:
    """Parse RAPID jointtargets or robtargets, one or an array, as numbers by name, without absent axes (9E9)."""
    brackets = re.findall(r"\[([^][]+)\]", text)
    numbers = [[float(part) for part in re.findall(_NUMBER, bracket, re.IGNORECASE)] for bracket in brackets]
    points, at = [], 0
    while at < len(numbers):
        kind = next((k for k in _TARGETS if tuple(map(len, numbers[at : at + len(k)])) == k), ())
        figures = [figure for bracket in numbers[at : at + len(kind)] for figure in bracket]
        named = zip(_TARGETS.get(kind, ()), figures, strict=True)
        points += [{key: value for key, value in named if abs(value) < _ABSENT}] if kind else []
        at += len(kind) or 1
    return points


class Language(NamedTuple):
    """Syntax of a manufacturer's robot programs: file endings, comment, pattern of statements, parser of points."""

    endings: tuple[str, ...]
    data: str  # ending of the file beside a program that declares its points
    comment: str  # to the end of the line
    statements: re.Pattern[str]  # a point that is declared (name) or moved to, by its figures or its name (to)
    points: Callable[[str], list[Point]]  # of the figures
    first: str  # column of the first axis
    orientation: dict[str, Any]  # of places, as the section of a mapping says it


_KRL = Language(
    (".dat", ".src"),
    ".dat",
    ";",
    re.compile(
        r"(?:(?<![$\w])(?P<name>(?!(?:TOOL|BASE|LOAD)_DATA)[A-Z_]\w*(?:\[\d+\])?)\s*=|\bS?(?:PTP|LIN)\b)\s*"
        r"(?:\{\s*(?:\w+\s*:)?(?P<figures>[^{}]*)\}|(?P<to>[A-Z_]\w*(?:\[\d+\])?))",
        re.IGNORECASE,
    ),
    _aggregate,
    "A1",
    {"kind": "euler", "sequence": "ZYX", "unit": "deg", "columns": ["A", "B", "C"]},
)
_RAPID = Language(
    (".mod", ".modx", ".prg", ".sys", ".sysx"),
    "",
    "!",
    re.compile(
        r"(?:(?P<name>[A-Z_]\w*)\s*(?:\{[\d,\s]+\})?\s*:=|\bMove(?:Abs)?[JL]\b)\s*"
        r"(?:(?P<figures>\[[^;\\]*)|(?P<to>[A-Z_]\w*))",
        re.IGNORECASE,
    ),
    _targets,
    "rax_1",
    {"kind": "quaternion", "order": "wxyz", "columns": ["q1", "q2", "q3", "q4"]},
)


def _program(file: Path, language: Language) -> Table:
    """Read a program's points as a table: those moved to, in order, else those declared; names, axes, positions."""
    import pandas as pd

    beside = [other for other in file.parent.glob(f"{file.stem}.*") if other.suffix.lower() == language.data]
    declared: dict[str, list[Point]] = {}
    moved: list[Point] = []
    for each in dict.fromkeys((*beside, file)):
        if not is_file(each) or each.stat().st_size > LARGEST_TABLE:
            raise CampaignError(str(each), "there is no such file, or it is too large", expected="a program")
        text = re.sub(rf"{language.comment}[^\n]*", "", each.read_bytes().decode("utf-8", errors="replace"))
        for found in language.statements.finditer(text):
            name, to = ((found[key] or "").upper() for key in ("name", "to"))
            points = declared.get(to, []) if to else language.points(found["figures"])
            points = [{"name": name or to, **point} for point in points if language.first in point or "X" in point]
            if not name:
                moved += points
            elif points:
                declared[name] = points
    named = moved or [point for several in declared.values() for point in several]
    return table_from_frame(pd.DataFrame(named or [{"name": ""}]), str(file))


def _read(files: Sequence[Path], plan: Plan, language: Language) -> Source:
    """Read two files, joint targets in a program and measured points in a table or program, and join them.

    The join is by point names where they agree, else row by row; the files may be in either order.
    """
    tables = [
        _program(file, language) if file.suffix.lower() in language.endings else read_table(file, plan.layout())
        for file in files
    ]
    driven = [table for table in tables if language.first in table.columns]
    if len(driven) != 1 or len(tables) != 2:
        problem = f"files with axes ({language.first} …), which are commands, and with places, which were measured"
        expected = "one of each: a place tells no posture, and is no command"
        named, found = " and ".join(map(str, files)), f"{len(driven)} and {len(tables) - len(driven)}"
        raise CampaignError(named, problem, found=found, expected=expected)
    measured = next(table for table in tables if table is not driven[0])
    there = {name: cells for name, cells in measured.columns.items() if not re.fullmatch(_AXIS, name)}
    whole = driven[0].take(~np.isnan(driven[0].numbers(language.first, gaps=True)))
    axes = {name: cells for name, cells in whole.columns.items() if re.fullmatch(_AXIS, name)}
    key, called = _named(measured, whole.text("name"), plan.get("table", "key"))
    sections: dict[str, dict[str, Any]] = {"measurements": {"angle_unit": "deg", "length_unit": "mm"}}
    commands = replace(whole, columns={**({"name of the command": called} if key else {}), **axes})
    if key:
        sections["columns"] = {"pose": key}
        _, first = np.unique(called, return_index=True)  # a program may go there again
        commands = commands.take(np.sort(first))
    if set(language.orientation["columns"]) <= set(measured.columns):
        sections["orientation"] = language.orientation
    both, notes = joined(replace(measured, columns=there), commands, key)
    return Source(both, planned(sections), notes)


def _named(measured: Table, points: Sequence[str], stated: str | None) -> tuple[str, list[str]]:
    """Find the measured column that has most of the program's point names; returns it and the points as spelled there.

    The column is empty without any. Case is ignored, and KUKA's variable XP1 is its point P1.
    """
    best, called, most = "", list(points), 0
    for column in [column_name(measured, stated)] if stated else measured.columns:
        spelled = {name.upper(): name for name in measured.text(column) if name}
        names = [spelled.get(point, spelled.get(point.removeprefix("X"), point)) for point in points]
        common = len({*names} & {*spelled.values()})
        if common > most:
            best, called, most = column, names, common
    return best, called


_FILES = "PROGRAM MEASURED, of which the second may be a program of places"
KUKA = Format("axes in KUKA's .dat or .src, and what was measured there", _FILES, partial(_read, language=_KRL))
RAPID = Format("jointtargets of ABB's RAPID, and what was measured there", _FILES, partial(_read, language=_RAPID))
