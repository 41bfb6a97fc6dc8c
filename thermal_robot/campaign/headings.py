"""Headers as other programs write them: another case, a unit in brackets, joints by their numbers; and what each says.

A name that the format defines counts first. Where it is not there, ``X [mm]``, ``X (mm)`` or ``x_mm`` is x,
``joint_1/position`` is joint_1 (what ros2_controllers and PlotJuggler write), and as many numbered columns as the chain
has joints are its joints in order: A1 … A6 (KUKA), J1 … J6 (Fanuc), target_q_0 … target_q_5 (the recordings of
Universal Robots' RTDE). A unit in a header is that of its column, whatever is declared of the others.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from thermal_robot.campaign import names
from thermal_robot.campaign.names import listed
from thermal_robot.campaign.table import Cells, Table
from thermal_robot.campaign.units import ANGLE_UNITS, LENGTH_UNITS, SI, Units, unit_of
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


@dataclass(frozen=True)
class Heading:
    """What a header says: the column as the file calls it, and the unit that it names, ``None`` for none."""

    column: str
    unit: str | None


def bare(column: str) -> Heading:
    """Return a header without its unit, and that unit as this program spells it."""
    for pattern in (_IN_BRACKETS, _BEHIND):
        if found := pattern.fullmatch(column.strip()):
            unit = _unit(found["square"] or found.groupdict().get("round") or "")
            if unit is not None:
                return Heading(found["name"], unit)
    return Heading(column.strip(), None)


def _unit(word: str) -> str | None:
    """Return a unit as this program spells it; ``None`` for a word that is none."""
    word = word.strip().lower()
    end = next((end for end in _RATES if word.endswith(end)), "")
    word = word.removesuffix(end)
    word = _SPELLED.get(word, word)
    return word + _RATES.get(end, "") if any(word in units for units in _KINDS) else None


def size(unit: str | None, other: str) -> float | None:
    """Return how many of another unit one is, 1 where a header names none; ``None`` where they are of two kinds."""
    if unit is None or unit == other:
        return 1.0
    (one, rate), (base, other_rate) = unit.partition("/")[::2], other.partition("/")[::2]
    kind = next((kind for kind in _KINDS if one in kind and base in kind), None)
    return None if kind is None or rate != other_rate else kind[one] / kind[base]


def wanted(name: str, robot: Robot, units: Units = SI) -> str:
    """Return the unit in which a campaign's column stands in a file, those of several targets as that of one."""
    return unit_of((names.target_of(name) or (name,))[0], robot, units)


def joint_columns(columns: Iterable[str], joints: Sequence[str]) -> dict[str, str]:
    """Return the column of each joint that is there by name: its own, ``<joint>/position``, ``…/<joint>/position``."""
    there = list(dict.fromkeys(columns))
    found = {}
    for joint in joints:
        own = [name for name in (joint, f"{joint}/position", f"{joint}.position") if name in there]
        series = [name for name in there if name.endswith(f"/{joint}/position")]
        if own or len(series) == 1:
            found[joint] = (own or series)[0]
    return found


def headings(columns: Iterable[str], robot: Robot) -> dict[str, Heading]:
    """Return what is found in a table under another name or with a unit, by the campaign's names.

    Parameters
    ----------
    columns
        Names of the table's columns.
    robot
        Whose joints and links they may name.

    Returns
    -------
    dict
        Columns that have the campaign's own name are not in it; nor is what two columns could be, or whose unit is of
        another kind.
    """
    there = [str(name).strip() for name in columns]
    conditions = names.conditions(robot.joint_names, robot.urdf_links)
    defined = dict.fromkeys((*robot.joint_names, *names.RESERVED, *conditions))
    needed = {*robot.joint_names, *names.MEASURED, *names.SIMULATED}
    small = {name.lower(): name for name in defined}
    said: dict[str, list[Heading]] = {}
    plain = {column: bare(column) for column in there if column not in defined and not names.target_of(column)}
    for column, heading in plain.items():
        low = heading.column.lower()
        meant = heading.column if heading.column in defined else small.get(low, low if names.target_of(low) else "")
        # what need not be there is asked about where its name alone is written otherwise
        sure = meant in needed or names.target_of(meant) or heading.unit is not None
        if meant and sure and size(heading.unit, wanted(meant, robot)) is not None:
            said.setdefault(meant, []).append(replace(heading, column=column))
    found = {name: several[0] for name, several in said.items() if name not in there and len(several) == 1}
    by_name = joint_columns([*there, *(h.column for h in plain.values())], robot.joint_names)
    original = {heading.column: replace(heading, column=column) for column, heading in plain.items()}
    for joint, column in by_name.items():
        if column != joint:
            found.setdefault(joint, original.get(column, Heading(column, None)))
    if not any(joint in there or joint in found for joint in robot.joint_names):
        found |= _numbered(plain, robot.joint_names)
    return found


def _numbered(plain: dict[str, Heading], joints: Sequence[str]) -> dict[str, Heading]:
    """Return the columns of joints that are known by their numbers, from 0 or from 1; nothing where none are."""
    stems: dict[str, dict[int, Heading]] = {}
    for column, heading in plain.items():
        if known := _NUMBERED.fullmatch(heading.column):
            stem = known["stem"].lower().replace(" ", "_")
            stems.setdefault(stem, {})[int(known["number"])] = replace(heading, column=column)
    whole = {
        stem: [each[number] for number in sorted(each)]
        for stem, each in stems.items()
        if sorted(each) in (list(range(len(joints))), list(range(1, len(joints) + 1)))
    }
    taken = next((stem for stem in _STEMS if stem in whole), None)
    if taken is None:
        return {}
    found = dict(zip(joints, whole[taken], strict=True))
    read = next((stem for stem in _REPORTED if stem in whole and stem != taken), None)
    more = () if read is None else zip((f"encoder.{joint}" for joint in joints), whole[read], strict=True)
    return {**found, **dict(more)}


def named(table: Table, robot: Robot, units: Units) -> Table:
    """Return a table in the campaign's names and in the units of the file, with what was found out as warnings.

    Parameters
    ----------
    table
        As read.
    robot
        Whose joints and links the columns name.
    units
        That are declared of the columns.

    Raises
    ------
    CampaignError
        Text where a number should be that is to be converted.
    """
    known = headings(table.columns, robot)
    if not known:
        return table
    called = {heading.column: name for name, heading in known.items()}
    columns: dict[str, Cells] = {}
    other: dict[tuple[str, str], list[str]] = {}
    for column, cells in table.columns.items():
        name = called.get(column, column)
        unit = wanted(name, robot, units)
        scale = 1.0 if name == column else size(known[name].unit, unit)
        columns[name] = cells if scale in (1.0, None) else table.numbers(column, gaps=True) * scale
        if columns[name] is not cells:
            other.setdefault((known[name].unit or "", unit), []).append(column)
    told = [
        f"read in {own}, as headers say, not in {unit} as is declared: {listed(of)}"
        for (own, unit), of in other.items()
    ]
    joints = {joint: known[joint].column for joint in robot.joint_names if joint in known}
    if any(joint.lower() not in column.lower() for joint, column in joints.items()):
        told.append(f"columns {listed(joints.values())} are read as the joints {listed(joints)}")
    return replace(table, columns=columns, warnings=(*table.warnings, *told))
