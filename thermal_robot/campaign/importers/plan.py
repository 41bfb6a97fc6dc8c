"""Mapping of a foreign table to a campaign: sections as in campaign.toml, and sources for the columns.

Every importer ends with it. A campaign's column is a sum of table columns with scale and offset, a constant, a counter
or a time stamp; orientations are read from quaternions, Euler angles, rotation vectors or matrices.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.campaign import names
from thermal_robot.campaign.campaign import Campaign
from thermal_robot.campaign.checked import no_orientation, no_rotation
from thermal_robot.campaign.document import Document, fitted_sections, robot_reference
from thermal_robot.campaign.names import did_you_mean, listed
from thermal_robot.campaign.read import build_campaign
from thermal_robot.campaign.recognise import bare, defined, headings, size
from thermal_robot.campaign.settings import ANGLE_UNIT, LENGTH_UNIT, Settings, as_vector, given
from thermal_robot.campaign.settings import KINDS as OF_CAMPAIGN
from thermal_robot.campaign.table import SPACE, Cells, Layout, Table, listed_rows
from thermal_robot.campaign.units import ANGLE_UNITS, LENGTH_UNITS, unit_of
from thermal_robot.campaign.ur_kinematics import with_kinematics
from thermal_robot.errors import CampaignError
from thermal_robot.robot import Robot, load_robot
from thermal_robot.schema import NOT_NEGATIVE, POSITIVE, Kind, MisfitError, below, boolean, number, record, text, word
from thermal_robot.schema import listed as list_of
from thermal_robot.schema import whole as whole_number

JOINTS = "joints"  # Key of the list that names the columns of all joints, in the order of the chain


@dataclass(frozen=True)
class Column:
    """Source of a campaign column: a sum of table columns times ``scale`` plus ``offset``, a constant or a counter."""

    sources: tuple[str | int, ...] = ()  # names of columns, or numbers from 1; several are added
    scale: float = 1.0  # and offset: in the unit that the campaign's column has
    offset: float = 0.0
    time: str = ""  # pattern of an instant, as of :meth:`datetime.datetime.strptime`; empty for numbers
    since_first: bool = False  # whether the smallest value is taken off, as of a clock that began elsewhere
    value: float | str | None = None  # the same number or text in every row, instead of a source
    count: bool = False  # 0, 1, 2 … in the order of the rows, instead of a source

    def numbers(self, table: Table) -> Array:
        """Compute the column's numbers (N,), NaN where a cell is empty; text and times of another pattern are refused.

        Times, and with ``since_first`` any values, are counted from the smallest one.
        """
        rows = len(table.rows)
        if isinstance(self.value, str):
            problem, found = "text where a number should be", repr(self.value)
            raise CampaignError(table.file, problem, found=found, expected="a number")
        if self.count or self.value is not None:
            return np.arange(float(rows)) if self.count else np.full(rows, self.value)
        names = [column_name(table, source) for source in self.sources]
        read = [self._instants(table, name) if self.time else table.numbers(name, gaps=True) for name in names]
        values: Array = np.sum(read, axis=0) * self.scale + self.offset
        return values - np.fmin.reduce(values) if self.since_first or self.time else values

    def header_unit(self, table: Table) -> str | None:
        """Return the unit in its only source's header; ``None`` for a sum, offset, time, or scale other than ± 1."""
        plain = len(self.sources) == 1 and abs(self.scale) == 1.0 and not (self.offset or self.time)
        return bare(column_name(table, self.sources[0])).unit if plain else None

    def complete(self, table: Table, name: str = "") -> Array:
        """Compute the column's numbers (N,), refusing empty cells; ``name`` is the campaign's column in the message."""
        values = self.numbers(table)
        problem = "a value is missing" + (f", for the column {name!r} of the campaign" if name else "")
        column = " + ".join(map(str, self.sources))
        table.refuse(np.isnan(values), problem, column, "a number", lambda _: "an empty cell")
        return values

    def text(self, table: Table) -> list[str]:
        """Return the column's cells as N texts; those of several sources are joined by a blank."""
        if self.count or self.value is not None:
            return [str(k) if self.count else str(self.value) for k in range(len(table.rows))]
        cells = (table.text(column_name(table, each)) for each in self.sources)
        return [" ".join(row) for row in zip(*cells, strict=True)]

    def _instants(self, table: Table, name: str) -> Array:
        """Parse texts by the pattern ``time`` as time stamps (N,), s since 1970 UTC, NaN where empty; else refuse."""
        import pandas as pd

        cells = pd.Series(table.text(name), dtype=object)
        try:
            found = pd.to_datetime(cells, format=self.time, errors="coerce", utc=True)
        except ValueError as error:  # a directive that there is not
            problem = f"no pattern of an instant ({error})"
            raise table.error(problem, name, found=repr(self.time), expected="such as %Y%m%d%H%M%S") from error
        wrong = (found.isna() & (cells != "")).to_numpy()
        table.refuse(wrong, "no instant of this pattern", name, repr(self.time))
        return np.asarray((found - pd.Timestamp(0, tz="UTC")) / pd.Timedelta(seconds=1), dtype=float)


def column_name(table: Table, source: str | int) -> str:
    """Name of a table column by its name, its name without a unit, or its number from 1; an unknown one is refused."""
    names = list(table.columns)
    if source in names or (table.header is None and str(source) in names):  # without a header numbers are names
        return str(source)
    if isinstance(source, int) and source <= len(names):
        return names[source - 1]
    known = [name for name in names if bare(name).column == source]
    if len(known) == 1:
        return known[0]
    meant = did_you_mean(str(source), names) if isinstance(source, str) else ""
    there = f"the columns {listed(names)}" if table.header else f"{len(names)} columns without names"
    problem, expected = f"there is no such column{meant}{table.headless}", "a name or a number of one of them"
    raise table.error(problem, str(source), found=there, expected=expected)


def _either(of_text: Kind, other: Kind, kind: type) -> Kind:
    """Return a validator that applies ``of_text`` to values of the type ``kind``, and ``other`` to all else."""
    return lambda value, path: (of_text if isinstance(value, kind) else other)(value, path)


_SOURCE = _either(whole_number(1), text("the name of a column, or its number from 1"), int)
_FIELDS: dict[str, Kind] = {
    "column": _SOURCE,
    "sum": list_of(_SOURCE),
    "value": _either(text("a number or text"), number(), str),
    "count": boolean,
    "scale": number(),
    "offset": number(),
    "time": text("a pattern such as %Y%m%d%H%M%S"),
    "since_first": boolean,
}
_ORIGINS = ("column", "sum", "value", "count")


def column_kind(value: Any, path: str) -> Column:
    """Validate a column's source and build the Column: a name, a number from 1, or an inline table with one origin."""
    if not isinstance(value, Mapping):
        return Column((_SOURCE(value, path),))
    stated = record(_FIELDS, may_lack=_FIELDS)(value, path)
    if len([key for key in _ORIGINS if key in stated]) != 1:
        raise MisfitError(path, value, f"one of the keys {', '.join(_ORIGINS)}")
    sources = (stated.pop("column"),) if "column" in stated else stated.pop("sum", ())
    return Column(sources, **stated)


def columns_kind(value: Any, path: str) -> dict[str, Any]:
    """Validate the section ``columns`` of a mapping: a source by column, for ``joints`` a list of sources."""
    joints = list_of(column_kind)
    return {name: (joints if name == JOINTS else column_kind)(v, below(path, name)) for name, v in value.items()}


QUATERNION, EULER, VECTOR, MATRIX = "quaternion", "euler", "rotation_vector", "matrix"
_COUNTS = {QUATERNION: (4,), EULER: (3,), VECTOR: (3,), MATRIX: (9, 12, 16)}
"""Columns of each kind; a matrix has three rows of three, three of four with the position last, or four of four."""
_SEQUENCES = tuple(
    "".join(axes) for letters in ("XYZ", "xyz") for axes in itertools.product(letters, repeat=3)
    if axes[0] != axes[1] != axes[2]
)  # fmt: skip


@dataclass(frozen=True)
class Orientation:
    """Convention by which a table's columns hold orientations: quaternion, Euler angles, rotation vector or matrix."""

    kind: str  # one of those above
    columns: tuple[Column, ...]  # where the figures come from; of a matrix row by row
    order: str = "wxyz"  # of a quaternion
    # axes of Euler angles, in the order of the columns: capitals turn about the moving axes, small letters about the
    # fixed ones
    sequence: str = "XYZ"
    unit: str = "rad"  # of Euler angles and rotation vectors, ``"rad"`` or ``"deg"``, where no header names one
    inverse: bool = False  # whether they turn vectors of the measurement frame into the target's

    def quaternions(self, table: Table) -> Array:
        """Return the unit quaternions wxyz (N, 4), from the target's frame to the measurement frame.

        Refused are a missing figure, a quaternion whose length is not 1, a matrix that is no rotation.
        """
        from scipy.spatial.transform import Rotation

        figures = np.column_stack([column.complete(table) for column in self.columns])
        if self.kind in (EULER, VECTOR):
            figures *= [ANGLE_UNITS.get(c.header_unit(table) or "", ANGLE_UNITS[self.unit]) for c in self.columns]
        column, expected = str((self.columns[0].sources or ("orientation",))[0]), "an orientation"

        def told(row: int) -> str:
            return ", ".join(f"{figure:g}" for figure in figures[row])

        if self.kind == QUATERNION:
            table.refuse(no_orientation(figures), "a quaternion whose length is not 1", column, expected, told)
            turned = Rotation.from_quat(figures, scalar_first=self.order == "wxyz")
        elif self.kind == MATRIX:
            matrices = figures.reshape(len(figures), -1, 3 if len(self.columns) == 9 else 4)[:, :3, :3]
            table.refuse(no_rotation(matrices), "a matrix that is no rotation", column, expected, told)
            turned = Rotation.from_matrix(matrices)
        elif self.kind == EULER:
            turned = Rotation.from_euler(self.sequence, figures)
        else:
            turned = Rotation.from_rotvec(figures)
        return np.asarray((turned.inv() if self.inverse else turned).as_quat(scalar_first=True))

    @property
    def position(self) -> tuple[Column, ...]:
        """Sources of x, y and z in a homogeneous matrix of 12 or 16 entries; empty for other conventions."""
        return self.columns[3:12:4] if len(self.columns) > 9 else ()


_KEYS = {
    "kind": word(_COUNTS),
    "columns": list_of(column_kind),
    "order": word(("wxyz", "xyzw")),
    "sequence": word(_SEQUENCES),
    "unit": word(ANGLE_UNITS),
    "inverse": boolean,
}


def orientation_kind(value: Any, path: str) -> dict[str, Orientation]:
    """Validate the section ``orientation`` of a mapping; returns its Orientation under the only key ``stated``."""
    given = record(_KEYS, may_lack=("order", "sequence", "unit", "inverse"))(value, path)
    kind, counts = given["kind"], _COUNTS[given["kind"]]
    if len(given["columns"]) not in counts:
        expected = f"a list of {' or '.join(map(str, counts))} columns for a {kind}"
        raise MisfitError(f"{path}.columns", value["columns"], expected)
    for key, kinds in (("sequence", (EULER,)), ("unit", (EULER, VECTOR)), ("order", (QUATERNION,))):
        if (kind in kinds) != (key in given):
            problem, expected = ("is missing", "a value") if kind in kinds else (f"a {kind} has none", "none")
            raise MisfitError(f"{path}.{key}", given.get(key), expected, problem)
    return {"stated": Orientation(**given)}


JOINING = ("key", "targets")  # What ``[table]`` says of names, and not of how a file is laid out
_SEPARATORS = {"comma": ",", "semicolon": ";", "tab": "\t", "space": SPACE}
_NAME = text("a name")
_LAID_OUT: Mapping[str, Kind] = {
    "separator": word(_SEPARATORS),
    "skip": whole_number(0),
    "header": boolean,
    "comment": text("the first letters of a comment"),
}
KINDS: dict[str, Mapping[str, Kind] | Kind] = {
    **OF_CAMPAIGN,
    "measurements": {"angle_unit": ANGLE_UNIT, "length_unit": LENGTH_UNIT, "kind": word(tuple(names.KINDS))},
    "table": {**_LAID_OUT, **dict.fromkeys(JOINING, _NAME)},
    "commands": _LAID_OUT,
    "columns": columns_kind,
    "orientation": orientation_kind,
    "recording": {
        **dict.fromkeys(("joints", "pose", "sensor"), _NAME),
        "feature": whole_number(1),
        "offset": number(),
        **dict.fromkeys(("tolerance", "standstill", "velocity"), POSITIVE),
        "settling": NOT_NEGATIVE,
    },
}
"""What each key of each section may be: those of campaign.toml but the name of the table, and how tables are read."""


@dataclass(frozen=True)
class Plan:
    """Mapping of a foreign table: sections and keys as in campaign.toml."""

    file: str = ""  # the mapping that the user wrote; empty where there is none
    # values by section and key, each of its kind; what is not stated is absent
    sections: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    def get(self, section: str, key: str, default: Any = None) -> Any:
        """Return the value of a key in a section, or the default."""
        return self.sections.get(section, {}).get(key, default)

    def over(self, other: Plan) -> Plan:
        """Merge with another mapping; values of this one take precedence, key by key."""
        both = {*other.sections, *self.sections}
        merged = {each: {**other.sections.get(each, {}), **self.sections.get(each, {})} for each in both}
        return Plan(self.file or other.file, merged)

    def layout(self, section: str = "table") -> Layout:
        """Layout of a table (separator, skipped lines, header, comment) from the section ``table`` or ``commands``."""
        stated = {key: value for key, value in self.sections.get(section, {}).items() if key not in JOINING}
        if "separator" in stated:
            stated["separator"] = _SEPARATORS[stated["separator"]]
        return Layout(**stated)

    def robot(self) -> Robot:
        """Load the robot that the mapping names, with its kinematics.yaml if stated; none named is refused."""
        urdf = self.get("robot", "urdf")
        if urdf is None:
            expected = "--robot URDF, or [robot] urdf in the file of --mapping"
            raise CampaignError(self.file or "import", "no robot is named", expected=expected)
        ends = {key: self.get("robot", key) for key in ("root_frame", "gravity")}
        robot = load_robot(urdf, self.get("robot", "tool_frame", ""), **ends)
        measured = self.get("robot", "kinematics")
        return with_kinematics(robot, measured) if measured else robot

    def settings(self, robot: Robot) -> Settings:
        """Return the settings of a campaign in SI units; the units of angles and lengths are required."""
        for key in ("angle_unit", "length_unit"):
            if self.get("measurements", key) is None:
                expected = f"[measurements] {key} in the file of --mapping"
                raise CampaignError(self.file or "import", f"no {key} is stated", expected=expected)
        ends = {"tool_frame": robot.tool_frame, "root_frame": robot.root_frame, "gravity": as_vector(robot.gravity)}
        return Settings.stated(self.sections, urdf="", **ends)


IN_SI: dict[str, dict[str, Any]] = {"measurements": {"angle_unit": "rad", "length_unit": "m"}}
"""What a mapping says of a table in rad and m, as everywhere in ROS."""


def planned(sections: Mapping[str, Mapping[str, Any]], file: str = "import") -> Plan:
    """Build a mapping from sections in Python, validated like a user's file; errors name ``file``."""
    return Plan("", given(file, "", sections, lambda stated, _: fitted_sections(KINDS, stated)))


def read_mapping(path: Path) -> Plan:
    """Read a mapping; the robot's path is relative to the file. Errors name the line."""
    sections = Document(path, KINDS).sections
    for key, named in sections.get("robot", {}).items():
        if key in ("urdf", "kinematics"):
            sections["robot"][key] = str(robot_reference(named, path.parent))
    return Plan(str(path), sections)


@dataclass(frozen=True)
class Source:
    """Table read from a format's files, with the format's own mapping and notes."""

    table: Table  # rows of commands and measurements, in the columns of that program
    plan: Plan  # what the format says of these columns; the user's mapping counts for more
    notes: tuple[str, ...] = ()  # what was left out before, and why; what was found out. A sentence each.
    comments: tuple[str, ...] = ()  # sentences that belong into campaign.toml


@dataclass(frozen=True)
class Format:
    """Importable format: its description, its files, and its reader."""

    does: str  # what it reads, and files: which files, for the help
    files: str
    # makes a table of them, and says as a mapping would what its columns are
    read: Callable[[Sequence[Path], Plan], Source]
    least: int = 1  # and most: how many files it has
    most: int = 2


def files_of(files: Sequence[Path], expected: str, least: int, most: int) -> None:
    """Refuse a wrong number of files, naming what is expected."""
    if not least <= len(files) <= most:
        problem = "another number of files than this format has"
        raise CampaignError("FILES", problem, found=str(len(files)), expected=expected)


def campaign_of(source: Source, plan: Plan, robot: Robot, name: str) -> tuple[Campaign, tuple[str, ...]]:
    """Build a campaign from a foreign table by a mapping, with sentences on the rows and columns left out.

    ``plan`` is the user's mapping merged with the format's. Rows without a measured position are left out. Errors name
    row and column of the table.
    """
    table = source.table
    columns = _columns(table, plan, robot)
    headed = {name: column.header_unit(table) for name, column in columns.items()}
    # units of angles and lengths are those in the headers, of the first column that has one
    said = [headed[name] for name in reversed((*names.POSITION, *robot.joint_names)) if name in headed]
    kinds = {"angle_unit": ANGLE_UNITS, "length_unit": LENGTH_UNITS}
    units = {key: unit for key, kind in kinds.items() for unit in said if unit in kind}
    plan = plan.over(planned({"measurements": units}))
    settings = plan.settings(robot)
    for own, column in columns.items():
        unit = unit_of(own, robot, settings.units)
        factor = size(headed[own], unit) if unit else None
        columns[own] = column if factor is None else replace(column, scale=column.scale * factor)
    places = [name for name in columns if name in names.POSITION or names.target_of(name)]
    measured = np.full(len(table.rows), not places)  # rows of other kinds are measured without a position
    for axis in places:
        measured |= ~np.isnan(columns[axis].numbers(table))
    notes = [*source.notes, f"{len(table.rows)} rows read, {int(measured.sum())} taken"]
    if not measured.all() and (set(names.POSITION) <= set(columns) or any(map(names.target_of, places))):
        if not measured.any():
            raise CampaignError(table.file, "no row has a measured position", expected="x, y and z of a point")
        notes.append(f"{listed_rows(table.rows[~measured])} left out, without a measured position")
        table = table.take(measured)
    cells = _cells(table, columns, robot)
    used = list(columns.values())
    orientation = plan.get("orientation", "stated")
    if orientation is not None:
        cells.update(zip(names.ORIENTATION, orientation.quaternions(table).T, strict=True))
        used += orientation.columns
    taken = {column_name(table, source) for column in used for source in column.sources}
    spare = [name for name in table.columns if name not in taken]
    if spare:
        notes.append(f"columns left out: {listed(spare)}")
    ready = Table(table.file, cells, table.rows, table.header, warnings=table.warnings, unread=tuple(spare))
    campaign = build_campaign(ready, settings, robot, name=name)
    # what follows from the order of the rows is not recorded: it will follow again
    kept = {name: values for name, values in campaign.covariates.items() if name not in campaign.derived}
    return replace(campaign, covariates=kept, derived=()), tuple(notes)


def _columns(table: Table, plan: Plan, robot: Robot) -> dict[str, Column]:
    """Source of each campaign column: the mapping's, else the table column of that name or of a known other name."""
    stated, orientation = dict(plan.sections.get("columns", {})), plan.get("orientation", "stated")
    joints = stated.pop(JOINTS, ())
    if joints and len(joints) != robot.n:
        found, expected = str(len(joints)), f"{robot.n}: {listed(robot.joint_names)}"
        problem, column = "another number of joints than the chain has", f"columns.{JOINTS}"
        raise CampaignError(plan.file or table.file, problem, column=column, found=found, expected=expected)
    known = {*defined(robot), *names.of_kinds()}
    own = {name: name for name in table.columns if name in known or names.target_of(name) is not None}
    own |= {name: heading.column for name, heading in headings(table.columns, robot).items()}
    columns = {name: Column((column,)) for name, column in own.items()}
    if orientation is not None:
        columns = {name: column for name, column in columns.items() if name not in names.ORIENTATION}
        columns |= dict(zip(names.POSITION, orientation.position, strict=False))
    return {**columns, **dict(zip(robot.joint_names, joints, strict=bool(joints))), **stated}


def _cells(table: Table, columns: dict[str, Column], robot: Robot) -> dict[str, Cells]:
    """Compute each campaign column's cells: text of labels, else numbers; gaps in joints and x, y, z are refused."""
    whole = [name for name in (*robot.joint_names, *names.POSITION) if name in columns]
    cells: dict[str, Cells] = {}
    for name in dict.fromkeys([*whole, *columns]):
        if name in (*names.LABELS, names.KIND, *names.OF_KINDS):
            cells[name] = columns[name].text(table)
        else:
            cells[name] = columns[name].complete(table, name) if name in whole else columns[name].numbers(table)
    return cells
