"""Columns of a log: which quantity of which joint each holds, and in which unit.

A column is called ``cmd.<joint>``, ``q.<joint>`` and so on, ``volts`` and ``temperature`` also without a joint.
``[channels]`` gives other names and units, of one column or, by a pattern with ``{joint}``, of a quantity:
``q = {column = "{joint}.pos", unit = "deg"}``.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from thermal_robot.campaign.names import did_you_mean, split_name
from thermal_robot.campaign.table import Table
from thermal_robot.campaign.units import ANGLE_UNITS, LENGTH_UNITS
from thermal_robot.errors import CampaignError
from thermal_robot.motion.log import CHANNELS
from thermal_robot.schema import Kind, MisfitError, number, record, text

FIELDS = dict(zip(("cmd", "q", "qd", "tau", "current", "volts", "temperature"), CHANNELS, strict=True))
"""Fields of a :class:`~thermal_robot.motion.Motion` by the quantity that stands before the joint's name."""
OF_ALL = ("volts", "temperature")  # Quantities that one column may give for all joints
_ANGLES = ANGLE_UNITS | {"rev": 2.0 * math.pi}
_SPEEDS = {f"{word}/s": scale for word, scale in (_ANGLES | LENGTH_UNITS).items()} | {"rpm": 2.0 * math.pi / 60.0}
UNITS: dict[str, Mapping[str, float]] = {
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9},
    "cmd": _ANGLES | LENGTH_UNITS,
    "q": _ANGLES | LENGTH_UNITS,
    "qd": _SPEEDS,
    "tau": {"Nm": 1.0, "N·m": 1.0, "mNm": 1e-3, "N": 1.0},
    "current": {"A": 1.0, "mA": 1e-3},
    "volts": {"V": 1.0, "mV": 1e-3},
    "temperature": {"°C": 1.0, "C": 1.0},
}
"""SI value of one of each unit, by quantity; the rad of an angle, °C of a temperature."""
JOINT = "{joint}"  # What stands for a joint's name in a pattern
_POSITIVE = number(above=0.0)


class Stated(NamedTuple):
    """What ``[channels]`` says of a column: its name or pattern, and its unit in SI; empty and 0 for the usual."""

    column: str = ""
    scale: float = 0.0


def _unit_kind(quantity: str) -> Kind:
    words = UNITS[quantity]

    def kind(value: Any, path: str) -> float:
        if isinstance(value, str) and value in words:
            return words[value]
        try:
            return float(_POSITIVE(value, path))
        except MisfitError:
            expected = f"one of {', '.join(words)}, or the SI value of one unit as a number above 0"
            raise MisfitError(path, value, expected, "unknown unit") from None

    return kind


def channels_kind(value: Any, path: str) -> dict[str, Stated]:
    """Check ``[channels]``, by channel a column's name or ``{column = …, unit = …}``; return name and SI unit."""
    if not isinstance(value, Mapping):
        raise MisfitError(path, value, "columns by channel")
    found = {}
    for channel, said in value.items():
        quantity, place, here = *split_name(str(channel)), f"{path}.{channel}"
        if quantity not in UNITS or (quantity == "time" and place):
            meant = did_you_mean(quantity, UNITS)
            raise MisfitError(here, channel, f"one of {', '.join(UNITS)}, or one of a joint", f"unknown channel{meant}")
        if not isinstance(said, Mapping):
            said = {"column": said}
        parts = {"column": text("the name of a column"), "unit": _unit_kind(quantity)}
        given = record(parts, may_lack=parts)(said, here)
        stated = Stated(given.get("column", ""), given.get("unit", 0.0))
        whole = not place and quantity not in (*OF_ALL, "time") and stated.column
        if whole and stated.column.count(JOINT) != 1:
            raise MisfitError(here, stated.column, f"a pattern with {JOINT}, such as {JOINT}.position")
        found[str(channel)] = stated
    return found


class Source(NamedTuple):
    """A column of one of the tables, and the quantity of a joint that it holds (joint empty: of all joints)."""

    table: int
    column: str
    quantity: str
    joint: str
    scale: float  # SI value of one unit, where ``[channels]`` states it; else 0


def sources(tables: Sequence[Table], channels: Mapping[str, Stated]) -> list[Source]:
    """Return which column of which table holds each quantity of each joint.

    Raises
    ------
    CampaignError
        A column that ``[channels]`` names and that is in no table, or a channel that two columns hold.
    """
    found: dict[tuple[str, str], Source] = {}
    for source in _sources(tables, channels):
        first = found.setdefault((source.quantity, source.joint), source)
        if first != source:
            files = " and ".join(dict.fromkeys(tables[each.table].file for each in (first, source)))
            problem = f"two columns hold this channel, {first.column!r} and {source.column!r}"
            channel = f"{source.quantity}.{source.joint}".rstrip(".")
            raise CampaignError(files, problem, column=channel, expected="one of them")
    return list(found.values())


def _sources(tables: Sequence[Table], channels: Mapping[str, Stated]) -> Iterator[Source]:
    def source(table: int, column: str, quantity: str, joint: str) -> Source:
        own, all_joints = (channels.get(name, Stated()).scale for name in (f"{quantity}.{joint}", quantity))
        return Source(table, column, quantity, joint, own or all_joints)

    for channel, stated in channels.items():
        quantity, joint = split_name(channel)
        if not stated.column or JOINT in stated.column or quantity == "time":
            continue
        holding = [k for k, table in enumerate(tables) if stated.column in table.columns]
        if not holding:
            every = [name for table in tables for name in table.columns]
            files = " and ".join(table.file for table in tables)
            problem = f"there is no such column{did_you_mean(stated.column, every)}"
            raise CampaignError(files, problem, column=stated.column, expected=f"a column of the channel {channel!r}")
        yield from (source(k, stated.column, quantity, joint) for k in holding)
    taken = {stated.column for stated in channels.values()}
    renamed = {channel for channel, stated in channels.items() if stated.column}
    for quantity in FIELDS:
        stated = channels.get(quantity, Stated())
        head, _, tail = (stated.column if JOINT in stated.column else f"{quantity}.{JOINT}").partition(JOINT)
        pattern = re.compile(f"{re.escape(head)}(.+){re.escape(tail)}")
        for k, table in enumerate(tables):
            for column in (name for name in table.columns if name not in taken):
                joint = m[1] if (m := pattern.fullmatch(column)) else ""
                alone = quantity in OF_ALL and column == quantity and not stated.column
                if (joint and f"{quantity}.{joint}" not in renamed) or alone:
                    yield source(k, column, quantity, joint)
