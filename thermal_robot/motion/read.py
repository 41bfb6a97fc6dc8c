"""From motion.toml and its tables, or from data frames, to a log of motions: checked, in SI, each with its stamps."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign import settings as kinds
from thermal_robot.campaign.checked import check_joints, first_true
from thermal_robot.campaign.document import FILE_NAME as CAMPAIGN
from thermal_robot.campaign.document import Document, declared_file, robot_reference
from thermal_robot.campaign.names import did_you_mean, listed
from thermal_robot.campaign.read import name_of, stated_path, stated_robot
from thermal_robot.campaign.settings import given
from thermal_robot.campaign.table import Table, listed_rows, read_table, table_from_frame
from thermal_robot.campaign.units import Units
from thermal_robot.errors import CampaignError, RobotError, require
from thermal_robot.files import is_file, is_folder
from thermal_robot.motion.columns import FIELDS, Source, Stated, channels_kind, sources
from thermal_robot.motion.log import Channel, Motion, MotionLog, Servo, joint_kinds
from thermal_robot.motion.refuse import refused
from thermal_robot.motion.settings import FEWEST_SAMPLES, LONGEST_GAP
from thermal_robot.robot import Robot
from thermal_robot.schema import NOT_NEGATIVE, POSITIVE, Kind, either, mapping, number, record, text
from thermal_robot.schema import listed as list_of

if TYPE_CHECKING:
    import pandas as pd

FILE_NAME = "motion.toml"
_COLUMN = text("the name of a column")
_PATH = text("the path of a table")
_OF_A_SERVO = {"kp": POSITIVE, "kd": NOT_NEGATIVE, "limit": POSITIVE, "dead_band": number()}
_OF_A_SERVO |= {"gain": number(above=-1.0), "zero": number()}
_OF_A_SERVO |= dict.fromkeys(("friction", "damping", "armature", "delay"), NOT_NEGATIVE)
TOLERANCE = mapping(NOT_NEGATIVE)
KINDS: dict[str, Mapping[str, Kind] | Kind] = {
    "robot": {
        "urdf": text("the path of the robot's URDF file"),
        "mjcf": text("the path of the robot's MJCF file"),
        "tool_frame": text("the link at the end of the chain"),
        "root_frame": text("the link where the chain starts"),
        "gravity": kinds.GRAVITY,
    },
    "motion": {
        "log": either(_PATH, list_of(_PATH)),
        "time": _COLUMN,
        "motion": _COLUMN,
        "kind": _COLUMN,
        "angle_unit": kinds.ANGLE_UNIT,
        "length_unit": kinds.LENGTH_UNIT,
    },
    "servo": mapping(record(_OF_A_SERVO, may_lack=_OF_A_SERVO)),
    "payload": {"mass": NOT_NEGATIVE, "com": kinds.VECTOR},
    "channels": channels_kind,
    "tolerance": TOLERANCE,
    "about": kinds.ABOUT,
}
"""What each key of each section of motion.toml may be."""


@dataclass(frozen=True)
class Declaration:
    """Settings of a motion.toml, or of a call, by which tables are read; payload's centre in m, servos in SI."""

    name: str
    units: Units
    labels: Mapping[str, str]  # columns of time, motion and kind, where stated
    channels: Mapping[str, Stated]
    servos: Mapping[str, Servo]
    payload: tuple[float, Array] | None
    tolerance: Mapping[str, float]
    about: Mapping[str, str]

    @classmethod
    def stated(cls, name: str, sections: Mapping[str, Mapping[str, Any]], servos: Mapping[str, Servo]) -> Declaration:
        """Build the settings from sections of motion.toml; what these state of servos overrides ``servos``."""
        motion, payload = sections["motion"], sections.get("payload", {})
        units = Units(motion["angle_unit"], motion.get("length_unit", "m"))
        com = np.array(payload.get("com", (0.0, 0.0, 0.0))) * units.length_scale
        labels = {key: motion[key] for key in ("time", "motion", "kind") if motion.get(key)}
        said = sections.get("servo", {})
        servos = {**servos, **{joint: replace(servos.get(joint, Servo()), **own) for joint, own in said.items()}}
        held = (payload["mass"], com) if "mass" in payload else None
        channels, tolerance, about = (sections.get(key, {}) for key in ("channels", "tolerance", "about"))
        return cls(name, units, labels, channels, servos, held, tolerance, about)


def declares_motion(path: Path) -> bool:
    """Tell whether a file, or the motion.toml of a folder without campaign.toml, has a section ``[motion]``."""
    file = path / FILE_NAME if is_folder(path) and not is_file(path / CAMPAIGN) else path
    return is_file(file) and re.search(rb"^\s*\[motion\]", file.read_bytes(), re.MULTILINE) is not None


def read_motion(path: str | Path, *, folder: str | Path | None = None) -> MotionLog:
    """Command and encoder series of a robot's joints, as for system identification, from a motion.toml.

    Parameters
    ----------
    path
        motion.toml, or the directory that holds it.
    folder
        Against which the paths in it are resolved; its own where absent.

    Returns
    -------
    MotionLog
        SI, each channel with its own stamps; what was odd stands in its ``notes``.

    Raises
    ------
    CampaignError
        A file that cannot be used: names file, row and column, what was found and what was expected; or a log that
        tells nothing of the joints' servos, with the reason.
    RobotError
        A robot that cannot be loaded, or has no such frame.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> try:
    ...     tr.read_motion("no_such_folder")
    ... except tr.CampaignError as error:
    ...     print(error)
    no_such_folder: there is no such file...
    """
    file, base, document, logs = _declared(path, folder)
    document.required("motion", "angle_unit")
    tables = [read_table(each) for each in logs]
    held = sources(tables, document.sections.get("channels", {}))
    robot, servos = robot_of(document.sections.get("robot", {}), file, base, held)
    declaration = Declaration.stated(name_of(file, FILE_NAME), document.sections, servos)
    for section in ("servo", "tolerance"):
        lines = {joint: document.row(section, joint) for joint in document.sections.get(section, {})}
        check_joints(str(file), section, lines, robot.joint_names, lines)
    return build_motions(tables, declaration, robot)


def _declared(path: str | Path, folder: str | Path | None) -> tuple[Path, Path, Document, list[Path]]:
    """Return a motion.toml, the folder of the paths in it, its document, and the files of its tables."""
    file = declared_file(stated_path("read_motion()", path, FILE_NAME), FILE_NAME, "motion")
    document, base = Document(file, KINDS, FILE_NAME), file.parent if folder is None else Path(folder)
    log = document.required("motion", "log")
    return file, base, document, [base / each for each in ((log,) if isinstance(log, str) else log)]


def robot_of(
    said: Mapping[str, Any], file: Path, folder: Path, held: Sequence[Source] = ()
) -> tuple[Robot, dict[str, Servo]]:
    """Load the robot of the section ``[robot]``; return it and, from an MJCF, the servos by joint."""
    if ("urdf" in said) == ("mjcf" in said):
        found = "both" if "urdf" in said else "neither"
        raise CampaignError(str(file), "which robot it is", column="robot", found=found, expected="urdf or mjcf")
    servos: dict[str, Servo] = {}
    reference: str | Path
    if "mjcf" in said:
        from thermal_robot.motion.mjcf import opened, servos_of_mjcf, urdf_of_mjcf

        model = opened(folder / said["mjcf"])
        reference, servos = urdf_of_mjcf(model, folder / said["mjcf"]), servos_of_mjcf(model)
        said = {"gravity": tuple(model.opt.gravity.tolist()), **said}
    else:
        reference = robot_reference(said["urdf"], folder)
    ends = {"root_frame": said.get("root_frame"), "gravity": said.get("gravity")}
    if "tool_frame" in said:
        return stated_robot(file, reference, said["tool_frame"], **ends), servos
    return _fullest(file, reference, ends, {source.joint for source in held}), servos


def _fullest(file: Path, reference: str | Path, ends: Mapping[str, Any], joints: set[str]) -> Robot:
    """Load the chain to a leaf link that holds most of the joints; raise the error if no chain loads."""
    from thermal_robot.kinematics.model import leaf_links
    from thermal_robot.urdf_text import urdf_text

    described, source, _ = urdf_text(reference)
    chains = []
    for leaf in leaf_links(described, source):
        with suppress(RobotError):  # a hand beside the arm may have joints of another kind, or none
            chains.append(stated_robot(file, reference, leaf, **ends))
    if not chains:  # say why
        return stated_robot(file, reference, "", **ends)
    return max(chains, key=lambda robot: len(joints & set(robot.joint_names)))


def files_of(path: str | Path, folder: Path | None = None) -> list[Path]:
    """Return the files that a log is read from: motion.toml, its tables, and the robot where it is a file."""
    file, base, document, logs = _declared(path, folder)
    said = document.sections.get("robot", {})
    robot = base / said["mjcf"] if "mjcf" in said else robot_reference(said.get("urdf", ""), base)
    return [file, *logs, *([robot] if isinstance(robot, Path) else [])]


def motion_from_table(
    robot: Robot,
    table: pd.DataFrame | Sequence[pd.DataFrame],
    *,
    angle_unit: str = "rad",
    length_unit: str = "m",
    time: str = "",
    motion: str = "",
    kind: str = "",
    channels: Mapping[str, Any] | None = None,
    servos: Mapping[str, Servo] | None = None,
    payload: tuple[float, Sequence[float]] | None = None,
    tolerance: Mapping[str, float] | None = None,
    name: str = "table",
) -> MotionLog:
    """Command and encoder series of a robot's joints, from pandas data frames; columns are those of a motion.toml.

    Parameters
    ----------
    robot
        From :func:`thermal_robot.load_robot`; its chain must hold the joints.
    table
        One frame, or several with stamps of their own (command in one, encoder in another).
    angle_unit, length_unit
        Units of ``cmd``, ``q`` and ``qd``; ``length_unit`` where a joint slides, and of the payload's centre.
    time, motion, kind
        Names of the columns of the stamps, and of the labels of motions and of their type; where left out, those of
        these names where they are there.
    channels, servos, tolerance
        As the sections of a motion.toml.
    payload
        Mass, kg, and centre of mass in the frame of the chain's last link.
    name
        Of the log.

    Raises
    ------
    CampaignError
        As for a file.

    Examples
    --------
    >>> import numpy as np, pandas as pd
    >>> import thermal_robot as tr
    >>> from thermal_robot.motion import motion_from_table
    >>> t = np.arange(0.0, 10.0, 0.02)
    >>> moved = {"time": t, "cmd.joint_1": np.sin(t), "q.joint_1": 0.98 * np.sin(t - 0.06)}
    >>> motion_from_table(tr.load_robot("builtin:rv_m2", "tool0"), pd.DataFrame(moved))
    <MotionLog 'table': 1 motions of 1 joints, 10 s>
    """
    import pandas as pd

    call = "motion_from_table()"
    require(f"{call}, robot", robot, (Robot,), "a robot, as load_robot gives it")
    frames = [table] if isinstance(table, pd.DataFrame) else list(table)
    for frame in frames:
        require(f"{call}, table", frame, (pd.DataFrame,), "pandas DataFrames")
    tables = [table_from_frame(f, "<table>" if len(frames) == 1 else f"<table {k}>") for k, f in enumerate(frames)]
    sections = {
        "motion": {"angle_unit": angle_unit, "length_unit": length_unit, "time": time, "motion": motion, "kind": kind},
        "channels": given(call, "channels", channels or {}, channels_kind),
        "payload": {} if payload is None else {"mass": float(payload[0]), "com": payload[1]},
        "tolerance": given(call, "tolerance", tolerance or {}, TOLERANCE),
    }
    declaration = Declaration.stated(given(call, "name", name, text(empty=True)), sections, servos or {})
    for key, named in (("servos", declaration.servos), ("tolerance", declaration.tolerance)):
        check_joints(call, key, named, robot.joint_names)
    return build_motions(tables, declaration, robot)


def build_motions(tables: Sequence[Table], declaration: Declaration, robot: Robot) -> MotionLog:
    """Validate tables and return the log; what cannot be used is refused with row and column."""
    held = sources(tables, declaration.channels)
    joints, notes = _joints(tables, held, robot)
    clocks = [_Clock.of(table, declaration) for table in tables]
    _require_labels(clocks)
    notes += [note for clock in clocks for note in clock.notes]
    read = {source.column for source in held} | {clock.column for clock in clocks} | set(declaration.labels.values())
    unread = [c for table in tables for c in table.columns if c not in read and c not in ("motion", "kind")]
    notes += [f"columns that were not read: {listed(unread, 6)}"] if unread else []
    channels = {
        name: _channel(clocks, [s for s in held if s.quantity == q], declaration, robot, joints)
        for q, name in FIELDS.items()
    }
    motions: list[Motion] = []
    for label in dict.fromkeys(label for clock in clocks for label in clock.kinds):
        parts = {name: channel.get(label) for name, channel in channels.items()}
        if not channels["command"] and parts["torque"] is not None:
            parts["command"] = parts["position"]
        if parts["command"] is None or parts["position"] is None:
            lacking = "command" if parts["command"] is None else "position"
            notes.append(f"motion {label!r} has no {lacking} and is left out")
            continue
        kind = next((clock.kinds[label] for clock in clocks if clock.kinds.get(label)), "")
        motions += _motions(label or declaration.name, kind, parts, notes)
    files = " and ".join(table.file for table in tables)
    if not motions:
        expected = "motions with both, of the same label and clock"
        raise CampaignError(files, "no motion has command and position", expected=expected)
    own = {key: getattr(declaration, key) for key in ("servos", "payload", "tolerance", "about")}
    warnings = (warning for table in tables for warning in table.warnings)
    log = MotionLog(declaration.name, robot, joints, tuple(motions), notes=(*warnings, *notes), **own)
    return refused(log, files)


def _joints(tables: Sequence[Table], held: Sequence[Source], robot: Robot) -> tuple[tuple[str, ...], list[str]]:
    """Return joints with position and command (torque if none has one), and notes; refuse unknown joints and none."""
    notes = []
    named: dict[str, set[str]] = {}
    for source in held:
        named.setdefault(source.joint, set()).add(source.quantity)
        if source.joint and source.joint not in (*robot.joint_names, *robot.urdf_joints):
            table = tables[source.table]
            problem = f"the robot has no joint {source.joint!r}{did_you_mean(source.joint, robot.joint_names)}"
            raise table.error(problem, source.column, expected=f"one of {listed(robot.joint_names)}")
    named.pop("", None)
    files = " and ".join(table.file for table in tables)
    # a gripper's joint lies beside the chain
    order = [*robot.joint_names, *(name for name in robot.urdf_joints if name not in robot.joint_names)]
    torques = not any("cmd" in quantities for quantities in named.values())
    both = [joint for joint in order if {"tau" if torques else "cmd", "q"} <= named.get(joint, set())]
    if not any("q" in quantities for quantities in named.values()):
        raise CampaignError(files, "no joint's position is recorded", expected="columns q.<joint>, or [channels]")
    if torques and not both:
        problem = "no command is recorded, and no torque: nothing says what the joints should have done"
        expected = "columns cmd.<joint>, or tau.<joint>: a current times its constant"
        raise CampaignError(files, problem, expected=expected)
    if not both:
        found = f"{listed(named)}; the robot has {listed(robot.joint_names)}"
        raise CampaignError(files, "no joint has command and position", found=found, expected="both")
    beside = [joint for joint in named if joint not in both]
    if beside:
        notes.append(f"left out, without command or position: {listed(beside)}")
    if torques:
        notes.append("no command is recorded: the torques along the measured motion are explained, and no servo")
    return tuple(both), notes


@dataclass(frozen=True)
class _Clock:
    """Motion and stamp, s, of each row of a table, as the index (N,) of a data frame; and types of motions by label."""

    table: Table
    column: str
    index: pd.MultiIndex
    kinds: Mapping[str, str]
    kept: NDArray[np.bool_]  # (N,) rows whose stamp is not that of the row before in the motion
    notes: tuple[str, ...]

    @classmethod
    def of(cls, table: Table, declaration: Declaration) -> _Clock:
        """Read a table's stamps and labels; refuse stamps that decrease in a motion, and a motion of two types."""
        import pandas as pd

        stated = declaration.channels.get("time", Stated())
        column = stated.column or declaration.labels.get("time", "time")
        if column not in table.columns:
            problem = f"has no column of time{did_you_mean(column, table.columns)}"
            raise table.error(problem, column, expected="stamps of the rows; its name is [motion] time")
        time = pd.Series(table.numbers(column) * (stated.scale or 1.0))
        names = [declaration.labels.get(key, key) for key in ("motion", "kind")]
        motion, kind = (
            pd.Series(table.text(name) if name in table.columns else "", index=time.index, dtype=object)
            for name in names
        )
        before = time.groupby(motion, sort=False).shift()
        back = first_true((time < before).to_numpy())
        if back is not None:
            told = {
                "found": f"{time[back]:.9g} s after {before[back]:.9g} s",
                "expected": "stamps that increase in a motion",
            }
            raise table.error("rows are out of order, or two motions have one label", column, back, **told)
        usual = kind.groupby(motion, sort=False).transform("first")
        other = first_true((kind != usual).to_numpy())
        if other is not None:
            told = {"found": repr(kind[other]), "expected": repr(usual[other])}
            raise table.error("a motion has two types", names[1], other, **told)
        kept = (time != before).to_numpy()
        said = f"{table.file}: {listed_rows(table.rows[~kept])} left out: the stamp of the row before"
        index = pd.MultiIndex.from_arrays([motion, time])
        return cls(table, column, index, dict(zip(motion, kind, strict=True)), kept, () if kept.all() else (said,))


def _require_labels(clocks: Sequence[_Clock]) -> None:
    """Refuse a table without labels of motions where any table has several motions."""
    several = any(len(clock.kinds) > 1 for clock in clocks)
    for clock in clocks:
        if several and list(clock.kinds) == [""]:
            expected = "a column that says which motion each row belongs to, as in the other table"
            raise CampaignError(clock.table.file, "has no labels of motions", expected=expected)


def _channel(
    clocks: Sequence[_Clock], held: Sequence[Source], declaration: Declaration, robot: Robot, joints: Sequence[str]
) -> dict[str, Channel]:
    """Return a quantity's samples by label of the motion, stamps unshifted; rows without any value are left out.

    Samples of several tables are merged by stamp; of equal stamps the last value that is not NaN counts.
    """
    import pandas as pd

    kinds_of, parts = joint_kinds(robot), []
    for k, clock in enumerate(clocks):
        values = np.full((len(clock.index), len(joints)), np.nan)
        own = [source for source in held if source.table == k and source.joint in ("", *joints)]
        for source in sorted(own, key=lambda each: bool(each.joint)):  # a joint's own column counts for more
            usual = declaration.units.joint_scale(kinds_of.get(source.joint, "revolute"))
            scale = source.scale or (usual if source.quantity in ("cmd", "q", "qd") else 1.0)
            chosen = joints.index(source.joint) if source.joint else slice(None)
            values.T[chosen] = clock.table.numbers(source.column, gaps=True) * scale
        parts.append(pd.DataFrame(values, clock.index)[clock.kept].dropna(how="all"))
    merged = pd.concat(parts).groupby(level=[0, 1]).last()
    return {
        str(label): _frozen(rows.index.get_level_values(1).to_numpy(copy=True), rows.to_numpy(copy=True))
        for label, rows in merged.groupby(level=0)
    }


def _frozen(time: Array, values: Array) -> Channel:
    time.setflags(write=False)
    values.setflags(write=False)
    return Channel(time, values)


def _motions(label: str, kind: str, parts: Mapping[str, Channel | None], notes: list[str]) -> Iterator[Motion]:
    """Split a motion where readings pause for over LONGEST_GAP; yield parts with enough samples, stamps from zero."""
    position = parts["position"]
    assert position is not None
    breaks = np.flatnonzero(np.diff(position.time) > LONGEST_GAP)
    edges = [-np.inf, *((position.time[k] + position.time[k + 1]) / 2.0 for k in breaks), np.inf]
    if len(breaks):
        notes.append(f"motion {label!r} is interrupted {len(breaks)} times and counts as {len(breaks) + 1}")
    for k, (begin, end) in enumerate(itertools.pairwise(edges)):
        name = label if k == 0 else f"{label} ({k + 1})"
        cut = {key: _cut(channel, begin, end) for key, channel in parts.items() if channel is not None}
        own = {key: channel for key, channel in cut.items() if len(channel.time)}
        if any(key not in own or len(own[key].time) < FEWEST_SAMPLES for key in ("command", "position")):
            notes.append(f"motion {name!r} has fewer than {FEWEST_SAMPLES} samples and is left out")
            continue
        zero = min(float(channel.time[0]) for channel in own.values())
        began = {key: _frozen(channel.time - zero, channel.values) for key, channel in own.items()}
        if parts["command"] is position:
            began["command"] = began["position"]
        yield Motion(name, kind, **{key: began.get(key) for key in FIELDS.values()})  # type: ignore[arg-type]


def _cut(channel: Channel, begin: float, end: float) -> Channel:
    inside = slice(*np.searchsorted(channel.time, [begin, end]))
    return Channel(channel.time[inside], channel.values[inside])
