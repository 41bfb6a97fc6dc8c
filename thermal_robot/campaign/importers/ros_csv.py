"""Recordings of ROS topics as CSV: joint states, and poses or points of the target, recognised by their headers.

Sources: ``rostopic echo -p`` writes %time in ns and a column for each field, as field.header.stamp, field.name0,
field.position0, field.pose.position.x (wiki.ros.org/rostopic). PlotJuggler writes __time in s and a column for each
series, which its parsers call <topic>/<joint>/position and <topic>/pose/position/x (``ros2_parsers/jointstates_msg.h``
and ``pose_msg.h`` of PlotJuggler/plotjuggler-ros-plugins). ``ros2 topic echo --csv`` writes no header and all fields
one after another: sec, nanosec, frame, the names, the positions, then velocities and efforts (ros2/rosidl_runtime_py,
``convert.py``, ``message_to_csv``). A table of one's own has time in s, and columns named as in a campaign.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.campaign import names
from thermal_robot.campaign.headings import joint_columns
from thermal_robot.campaign.importers.standstill import Stream, stream
from thermal_robot.campaign.names import listed
from thermal_robot.campaign.table import Table
from thermal_robot.campaign.tabular import Layout, read_table
from thermal_robot.errors import CampaignError
from thermal_robot.files import is_file

_NANOSECOND = 1e-9
_CLOCKS = {"field.header.stamp": _NANOSECOND, "%time": _NANOSECOND, "__time": 1.0, "time": 1.0, "timestamp": 1.0}
"""Columns that tell the time, the best first, and their units in s: a stamp is of the measurement, %time of its
coming."""
_PLACE = re.compile(r"(?:^|[./])(?:position|point|translation)[./](?P<axis>[xyz])$")
_TURN = re.compile(r"(?:^|[./])(?:orientation|rotation)[./](?P<axis>[xyzw])$")
_WITHOUT_HEADER = Layout(",", 0, False)
_BEFORE_NAMES = 2
"""Fields of a stamp, sec and nanosec, at the beginning of each line without a header."""


def read_streams(file: Path, joints: Sequence[str]) -> tuple[Stream | None, Stream | None]:
    """Return what a file has of the joints and of the target; ``None`` for what it has not.

    Parameters
    ----------
    file
        CSV of one topic, or of several.
    joints
        Of the chain.

    Raises
    ------
    CampaignError
        A file that is no table, has no clock, or has some of the joints only.
    """
    if _begins_with_figures(file):
        return _without_header(read_table(file, _WITHOUT_HEADER), joints)
    table = read_table(file)
    clock = next((name for name in _CLOCKS if name in table.columns), None)
    if clock is None:
        raise CampaignError(
            str(file), "has no column of time", row=table.header, expected=f"one of {', '.join(_CLOCKS)}"
        )
    time = table.numbers(clock, gaps=True) * _CLOCKS[clock]
    places = [columns and stream(str(file), time, _figures(table, list(columns.values())), list(columns))
              for columns in (_joints(table, joints), _target(table))]  # fmt: skip
    return places[0] or None, places[1] or None


def _begins_with_figures(file: Path) -> bool:
    """Return whether the first line begins with two whole numbers, a stamp, and is no header."""
    if not is_file(file):
        return False
    with file.open("rb") as content:
        return re.match(rb"\d+,\d+,", content.read(64)) is not None


def _figures(table: Table, columns: Sequence[str]) -> Array:
    return np.column_stack([table.numbers(name, gaps=True) for name in columns])


def _joints(table: Table, joints: Sequence[str]) -> dict[str, str]:
    """Return the column of each joint; nothing where there is none of any."""
    named = {table.text(name)[0]: f"field.position{name[len('field.name'):]}"
             for name in table.columns if re.fullmatch(r"field\.name\d+", name)}  # fmt: skip
    columns = joint_columns(table.columns, joints)
    series = joint_columns(named, joints)
    columns |= {joint: named[name] for joint, name in series.items() if named[name] in table.columns}
    if columns and len(columns) < len(joints):
        lacking = next(joint for joint in joints if joint not in columns)
        raise CampaignError(
            table.file, "a joint of the chain is not recorded", row=table.header, column=lacking, expected="all of them"
        )
    return columns


def _target(table: Table) -> dict[str, str]:
    """Return the columns of the target's place, and of its orientation where all four are there."""
    place: dict[str, str] = {}
    turn: dict[str, str] = {}
    for name in table.columns:
        if found := _PLACE.search(name):
            place.setdefault(found["axis"], name)
        elif found := _TURN.search(name):
            turn.setdefault(f"q{found['axis']}", name)
    own = {name: name for name in names.MEASURED if name in table.columns}
    place = place or {axis: own[axis] for axis in names.POSITION if axis in own}
    turn = turn or {part: own[part] for part in names.ORIENTATION if part in own}
    if set(place) != set(names.POSITION):
        return {}
    whole = names.MEASURED if set(turn) == set(names.ORIENTATION) else names.POSITION
    return {name: {**place, **turn}[name] for name in whole}


def _without_header(table: Table, joints: Sequence[str]) -> tuple[Stream | None, Stream | None]:
    """Return the stream of a file whose fields have an order and no names."""
    fields = list(table.columns)
    time = table.numbers(fields[0]) + table.numbers(fields[1]) * _NANOSECOND
    # texts, or nothing where a frame has no name; figures that are nan throughout, as efforts, are no texts
    texts = list(itertools.takewhile(lambda name: table.first_text(name) is not None or not any(table.columns[name]),
                                     fields[_BEFORE_NAMES:]))  # fmt: skip
    first = _BEFORE_NAMES + len(texts)
    recorded = [table.text(name)[0] for name in texts[1:]]  # the first text is the frame
    columns = joint_columns(recorded, joints)
    if columns and len(columns) == len(joints):
        wanted = [fields[first + recorded.index(columns[joint])] for joint in joints]
        return stream(table.file, time, _figures(table, wanted), joints), None
    if len(recorded) > 1:
        lacking = next(joint for joint in joints if joint not in columns)
        raise CampaignError(table.file, "a joint of the chain is not among the names", column=lacking,
                            found=listed(recorded), expected=f"all of {listed(joints)}")  # fmt: skip
    rest = [name for name in fields[first:] if any(table.columns[name])]  # a comma at the end is no field
    if len(rest) in (len(names.POSITION), len(names.MEASURED)):
        order = ("x", "y", "z", "qx", "qy", "qz", "qw")[: len(rest)]
        by_name = dict(zip(order, rest, strict=True))
        wanted = [name for name in names.MEASURED if name in by_name]
        return None, stream(table.file, time, _figures(table, [by_name[name] for name in wanted]), wanted)
    raise CampaignError(
        table.file,
        "neither joint states nor poses are recognised in lines without a header",
        found=f"{len(fields)} fields",
        expected="sec, nanosec, frame, and names and positions of the joints, or x y z (qx qy qz qw)",
    )
