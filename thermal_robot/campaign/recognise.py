"""Recognition of columns: headers of other programs are translated, ambiguous ones refused.

A name that the format defines counts first. Where it is not there, ``X [mm]``, ``X (mm)`` or ``x_mm`` is x,
``joint_1/position`` is joint_1 (what ros2_controllers and PlotJuggler write), and as many numbered columns as the chain
has joints are its joints in order: A1 … A6 (KUKA), J1 … J6 (Fanuc), target_q_0 … target_q_5 (the recordings of
Universal Robots' RTDE). A unit in a header is that of its column, whatever is declared of the others.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from thermal_robot.campaign import names
from thermal_robot.campaign.names import did_you_mean, listed, nearest, split_name
from thermal_robot.campaign.table import Cells, Table
from thermal_robot.campaign.targets import FEWEST
from thermal_robot.campaign.units import ANGLE_UNITS, LENGTH_UNITS, Units, unit_of
from thermal_robot.robot import Robot

_KINDS: tuple[dict[str, float], ...] = (
    LENGTH_UNITS,
    ANGLE_UNITS,
    {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0},
    {"kg": 1.0, "g": 1e-3},
    {"°C": 1.0},
    {"N·m": 1.0},
    {"N": 1.0},
    {"": 1.0, "%": 0.01},
)
"""Units of one kind, and their sizes in the SI unit or in what the format takes."""
_SPELLED = {
    **{"µm": "um", "μm": "um", "°": "deg", "degree": "deg", "degrees": "deg", "radian": "rad", "radians": "rad"},
    **{"c": "°C", "°c": "°C", "degc": "°C", "n": "N", "nm": "N·m", "n*m": "N·m", "n·m": "N·m", "n m": "N·m"},
    **{"sec": "s", "-": "", '"': "in", "inches": "inch", "feet": "ft"},
}
"""Other spellings of units, in small letters."""
_RATES = {"/s2": "/s²", "/s^2": "/s²", "/s²": "/s²", "/s": "/s"}
_IN_BRACKETS = re.compile(r"(?P<name>.*?\S)\s*(?:\[(?P<square>[^][]*)\]|\((?P<round>[^()]*)\))")
_BEHIND = re.compile(r"(?P<name>.+)_(?P<square>mm|um|deg|rad)", re.IGNORECASE)
"""Units without brackets; not m, as ``x_m`` may be the x that was measured."""
_NUMBERED = re.compile(r"(?P<stem>.*?)[\s_.\[(]*(?P<number>\d{1,2})[\])]?(?:[/_. ]pos(?:ition)?)?")
_COMMANDED, _REPORTED = ("target_q", "q_target"), ("actual_q", "q_actual")
_STEMS = (*_COMMANDED, "q", "joint", "j", "a", "axis", "rax", "theta", *_REPORTED)
"""What numbered joints are called, the best first: what was commanded counts for more than what the encoders said."""


class Heading(NamedTuple):
    """Column name as the file has it, and the unit in it, ``None`` for none."""

    column: str
    unit: str | None


def bare(column: str) -> Heading:
    """Split a column header such as ``X [mm]`` or ``x_mm`` into name and unit; ``None`` without a known unit."""
    for pattern in (_IN_BRACKETS, _BEHIND):
        if found := pattern.fullmatch(column.strip()):
            word = (found["square"] or found.groupdict().get("round") or "").strip().lower()
            end = next((end for end in _RATES if word.endswith(end)), "")
            word = _SPELLED.get(word.removesuffix(end), word.removesuffix(end))
            if any(word in units for units in _KINDS):
                return Heading(found["name"], word + _RATES.get(end, ""))
    return Heading(column.strip(), None)


def size(unit: str | None, other: str) -> float | None:
    """Conversion factor from ``unit`` to ``other``; 1 where the header has no unit, ``None`` for another quantity."""
    if unit is None or unit == other:
        return 1.0
    (one, rate), (base, other_rate) = unit.partition("/")[::2], other.partition("/")[::2]
    kind = next((kind for kind in _KINDS if one in kind and base in kind), None)
    return None if kind is None or rate != other_rate else kind[one] / kind[base]


def joint_columns(columns: Iterable[str], joints: Sequence[str]) -> dict[str, str]:
    """Column of each joint found by name: its own name, ``<joint>/position``, or the only ``…/<joint>/position``."""
    there, found = [*columns], {}
    for joint in joints:
        own = [name for name in (joint, f"{joint}/position", f"{joint}.position") if name in there]
        series = {name for name in there if name.endswith(f"/{joint}/position")}
        if own or len(series) == 1:
            found[joint] = [*own, *series][0]
    return found


def defined(robot: Robot) -> dict[str, None]:
    """Column names that the format defines for a robot, in order, as keys of a dict, but for numbered targets.

    Columns of other kinds of measurement than position and pose are left out, too.
    """
    conditions = names.conditions(robot.joint_names, robot.urdf_links)
    return dict.fromkeys((*robot.joint_names, *names.RESERVED, *conditions))


def headings(columns: Iterable[str], robot: Robot) -> dict[str, Heading]:
    """Match headers of other programs to the campaign's column names: header and its unit, by the campaign's name.

    Columns that have the campaign's own name are not in it; nor is what two columns could be, or whose unit is of
    another kind.
    """
    there = [str(name).strip() for name in columns]
    known = defined(robot)
    needed = {*robot.joint_names, *names.MEASURED, *names.SIMULATED}
    small = {name.lower(): name for name in known}
    said: dict[str, list[Heading]] = {}
    plain = {column: bare(column) for column in there if column not in known and not names.target_of(column)}
    for column, (own, unit) in plain.items():
        low = own.lower()
        meant = own if own in known else small.get(low, low if names.target_of(low) else "")
        # what need not be there is asked about where its name alone is written otherwise
        sure = meant in needed or names.target_of(meant) or unit is not None
        if meant and sure and size(unit, unit_of(meant, robot)) is not None:
            said.setdefault(meant, []).append(Heading(column, unit))
    found = {name: several[0] for name, several in said.items() if name not in there and len(several) == 1}
    original = {own: Heading(column, unit) for column, (own, unit) in plain.items()}
    for joint, column in joint_columns([*there, *original], robot.joint_names).items():
        if column != joint:
            found.setdefault(joint, original.get(column, Heading(column, None)))
    if not any(joint in there or joint in found for joint in robot.joint_names):
        found |= _numbered(plain, robot.joint_names)
    return found


def _numbered(plain: dict[str, Heading], joints: Sequence[str]) -> dict[str, Heading]:
    """Match numbered columns (A1 … A6, target_q_0 …) to all joints in order; empty where there are none.

    Reported positions beside commanded ones are matched to ``encoder.<joint>``.
    """
    stems: dict[str, dict[int, Heading]] = {}
    for column, (own, unit) in plain.items():
        if known := _NUMBERED.fullmatch(own):
            stem = known["stem"].lower().replace(" ", "_")
            stems.setdefault(stem, {})[int(known["number"])] = Heading(column, unit)
    count, found = len(joints), dict[str, Heading]()
    for stem in _STEMS:
        numbers = sorted(stems.get(stem, ()))
        prefix = "encoder." if found else ""
        if numbers in (list(range(count)), list(range(1, count + 1))) and (not found or stem in _REPORTED):
            found |= {f"{prefix}{joint}": stems[stem][k] for joint, k in zip(joints, numbers, strict=True)}
        if len(found) == 2 * count:
            break
    return found


def named(table: Table, robot: Robot, units: Units) -> Table:
    """Rename foreign columns of a table to the campaign's names and convert units in headers to the declared ones.

    The warnings of the table name both.
    """
    known = headings(table.columns, robot)
    called = {heading.column: name for name, heading in known.items()}
    columns: dict[str, Cells] = {}
    other: dict[tuple[str, str], list[str]] = {}
    for column, cells in table.columns.items():
        name = called.get(column, column)
        unit = unit_of(name, robot, units)
        scale = size(known[name].unit, unit) if column in called else None
        columns[name] = cells
        if scale not in (1.0, None):
            columns[name] = table.numbers(column, gaps=True) * scale
            other.setdefault((known[name].unit or "", unit), []).append(column)
    told = [
        f"read in {own}, as headers say, not in {unit} as is declared: {listed(of)}"
        for (own, unit), of in other.items()
    ]
    joints = {joint: known[joint].column for joint in robot.joint_names if joint in known}
    if any(joint.lower() not in column.lower() for joint, column in joints.items()):
        told.append(f"columns {listed(joints.values())} are read as the joints {listed(joints)}")
    return replace(table, columns=columns, warnings=(*table.warnings, *told))


TYPING_ERROR = 0.85
"""Likeness (0..1, by :mod:`difflib`) from which a column of the user's own is taken for a typing error of a name that
the format defines: ``tme`` for ``time``, a letter lost in the shortest name, has 0.86; honest columns such as
``pressure`` or ``humidity`` stay below 0.6."""
_PERHAPS_MEANT = 0.4
"""Likeness from which a column that is there is named beside one that is lacking: the table must be mended anyway, so a
poor guess does less harm than none."""
_COVARIATE, _EXTRA, _IGNORED = "covariate", "extra", "ignored"


@dataclass(frozen=True)
class Columns:
    """Columns of a table by their role in the campaign."""

    covariates: tuple[str, ...]  # those that the format defines, except empty ones
    extra: tuple[str, ...]  # numeric columns that the format does not define
    labels: tuple[str, ...]  # ``session``, ``pose`` and ``path`` where present
    groups: tuple[tuple[str, ...], ...]  # of position and orientation, measured and simulated, those that are there
    has_noise: bool  # whether the noise of each row is there
    targets: tuple[int, ...]  # numbers of several targets of one pose, in their order; empty where there is one
    warnings: tuple[str, ...]  # columns left out, and names that look like typing errors
    kinds: tuple[str, ...] = ()  # of measurement; none where all rows are positions, or poses


def recognise(table: Table, robot: Robot, *, measured: bool, kind: str = "") -> Columns:
    """Classify a table's columns by role; with ``measured`` those that the kinds of measurement need are required.

    Rows are of the stated ``kind``, unless a column ``kind`` says otherwise. Without ``measured`` measured columns are
    ignored. A missing column of a joint or coordinate, an incomplete quaternion, a name with two meanings are refused.
    """
    _refuse_two_meanings(table, robot)
    beside = [name for name in robot.joint_names if name not in robot.chain.names]
    more = f", and so does {listed(beside)}, which moves it by joints that mimic" if beside else ""
    ends = f"{robot.root_frame!r} to {robot.tool_frame!r}"
    why = f"every movable joint of the chain from {ends} needs a column, one that stays where it is, too{more}"
    _require(table, robot.joint_names, why)
    kinds = _kinds(table, kind) if measured else ()
    plain = measured and not kinds
    targets, warnings = _targets(table, robot) if plain else ((), [])
    asked = [names.SIMULATED_POSITION, names.SIMULATED_ORIENTATION]
    if plain and not targets:
        _require(table, names.POSITION, "a measured position needs x, y and z")
        asked = [*names.POSES.values()]
    for own in kinds:
        _require(table, [c for group in names.KINDS[own] for c in group], f"rows of the kind {own!r} need it")
    groups = tuple(group for group in asked if _whole_group(table, group))
    if names.SIMULATED_ORIENTATION in groups:
        _require(table, names.SIMULATED_POSITION, "a simulated orientation needs a simulated position")
    has_noise = measured and names.NOISE in table.columns and not table.is_empty(names.NOISE)
    taken = {*robot.joint_names, *names.MEASURED, *names.SIMULATED, *names.LABELS}
    if kinds or kind or _by_columns(table) or names.KIND in table.columns:
        taken |= names.of_kinds()
    taken |= {names.NOISE} if has_noise or not measured else set()
    parts: dict[str, list[str]] = {_COVARIATE: [], _EXTRA: [], _IGNORED: []}
    for column in table.columns:
        if column not in taken and not names.target_of(column):
            part, doubt = _judge(table, column, robot)
            parts[part].append(column)
            warnings += [doubt] if doubt else []
    labels = tuple(label for label in names.LABELS if label in table.columns)
    sorted_out = tuple(parts[_COVARIATE]), tuple(parts[_EXTRA])
    return Columns(*sorted_out, labels, groups, has_noise, targets, tuple(warnings), kinds)


def _kinds(table: Table, stated: str) -> tuple[str, ...]:
    """Return the sorted kinds of measurement of the rows; empty where all are positions, or all are poses."""
    if not stated and names.KIND not in table.columns:
        stated = _by_columns(table)
    if names.KIND in table.columns:
        cells = np.array(table.text(names.KIND))
        unknown = ~np.isin(cells, (*names.KINDS, ""))
        table.refuse(unknown, "unknown kind of measurement", names.KIND, f"one of {', '.join(names.KINDS)}")
        table.refuse((cells == "") & (cells != "").any(), "a value is missing", names.KIND, "a kind")
    else:
        cells = np.array([stated])
    found = tuple(sorted({*cells.tolist()} - {""}))
    return () if set(found) <= {"position"} or set(found) == {"pose"} else found


def _by_columns(table: Table) -> str:
    """Infer the kind of measurement: the only one all of whose columns are in a table without positions; else empty."""
    if any(name in names.POSITION or names.target_of(name) for name in table.columns):
        return ""
    there = [k for k, (figures, labels) in names.KINDS.items() if labels and {*figures, *labels} <= {*table.columns}]
    return there[0] if len(there) == 1 else ""


def _targets(table: Table, robot: Robot) -> tuple[tuple[int, ...], list[str]]:
    """Return the numbers of several targets (columns x.1 …), with warnings on those left out; empty where there is one.

    A CampaignError refuses a missing axis, too few targets, and x, y, z without a number beside numbered ones.
    """
    named = (names.target_of(column) for column in table.columns if column not in robot.joint_names)
    known = sorted({target[1] for target in named if target})
    for number in known:
        _whole_group(table, names.axes_of(number))
    numbers = tuple(n for n in known if not all(table.is_empty(column) for column in names.axes_of(n)))
    if not numbers:
        return (), []
    beside = [column for column in names.POSITION if column in table.columns]
    if beside or len(numbers) < FEWEST:
        problem = "a target without a number stands beside those with one" if beside else "too few targets for a pose"
        found, column = f"{len(numbers)}{' with a number' if beside else ''}", (beside or names.axes_of(numbers[0]))[0]
        expected = f"at least {FEWEST} as x.1 y.1 z.1, x.2 …; or one, as x y z"
        raise table.error(problem, column, found=found, expected=expected)
    lost = [f"target {number} is seen in no row and counts as absent" for number in known if number not in numbers]
    turned = [column for column in names.ORIENTATION if column in table.columns]
    lost += [f"columns {listed(turned)} are left out: several targets tell the orientation"] if turned else []
    return numbers, lost


def _judge(table: Table, column: str, robot: Robot) -> tuple[str, str]:
    """Role (covariate, extra, ignored) of a column that is no joint, pose or label, and a warning or empty text."""
    quantity, place = split_name(column)
    if table.is_empty(column):
        return _IGNORED, f"column {column!r} is empty and counts as absent"
    if column in names.PLAIN_COVARIATES:
        return _COVARIATE, ""
    link = names.tilted(column) or (place if quantity in names.PER_LINK else "")
    joint = place if quantity in names.PER_JOINT else ""
    of, known = ("the chain has no joint", robot.joint_names) if joint else ("the robot has no link", robot.urdf_links)
    if (joint or link) and (joint or link) not in known:
        return _IGNORED, f"column {column!r} is ignored: {of} {joint or link!r}{did_you_mean(joint or link, known)}"
    if link and link not in {segment.parent_link for segment in robot.segments}:
        return _COVARIATE, f"column {column!r}: no length of the chain belongs to that link"
    if joint or link:
        return _COVARIATE, ""
    text = table.first_text(column)
    if text is not None:
        found = table.columns[column][text]
        return _IGNORED, f"column {column!r} is not numeric (row {table.rows[text]}: {found!r}) and is ignored"
    return _EXTRA, _doubt_of_extra(column, robot)


def _doubt_of_extra(column: str, robot: Robot) -> str:
    """Warning on a numeric column outside the format; empty without one."""
    if column in robot.urdf_joints:
        follows = any(segment.name == column and segment.movable for segment in robot.segments)
        which = "that mimics another" if follows else "outside the chain"
        return f"column {column!r} is a joint {which}: it is kept as an extra covariate only"
    if column in names.PER_JOINT:
        meant = f"did you mean '{column}.<joint>'?"
        return f"column {column!r} names no joint and is kept as an extra covariate; {meant}"
    known = [*names.RESERVED, *(f"{quantity}.{joint}" for quantity in names.PER_JOINT for joint in robot.joint_names)]
    meant = did_you_mean(column, known, cutoff=TYPING_ERROR)
    return f"column {column!r} is not defined by the format and is kept as an extra covariate{meant}" if meant else ""


def _refuse_two_meanings(table: Table, robot: Robot) -> None:
    for column in table.columns:
        quantity, place = split_name(column)
        of_a_joint = quantity in names.PER_JOINT and place in robot.joint_names
        if column in robot.joint_names and (column in names.RESERVED or names.target_of(column) or of_a_joint):
            problem = "this name is both a joint of the chain and a column that the format defines"
            remedy = "a joint of another name; rename it in the URDF and in the table"
            raise table.error(problem, column, expected=remedy)


def _require(table: Table, wanted: Sequence[str], why: str) -> None:
    """Raise a CampaignError if a table lacks a wanted column; it names the most similar columns."""
    there = [*table.columns, *table.unread]
    spare = [column for column in there if column not in wanted]
    for name in wanted:
        if name not in table.columns:
            close = nearest(name, spare, cutoff=_PERHAPS_MEANT)
            found = f"the nearest names {listed(close)}" if close else f"the columns {listed(there)}"
            problem = f"there is no such column; {why}{table.headless}"
            raise table.error(problem, name, found=found, expected=listed(wanted))


def _whole_group(table: Table, group: Sequence[str]) -> bool:
    """Whether all columns of a group are there; an incomplete group is an error."""
    here = [name for name in group if name in table.columns]
    if here and len(here) < len(group):
        lacking = next(name for name in group if name not in table.columns)
        problem = "the columns of this group stand together or not at all"
        raise table.error(problem, lacking, found=f"only {listed(here)}", expected=listed(group))
    return bool(here)
