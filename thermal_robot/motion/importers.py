"""Logs of other programs, as tables with the columns of a motion.toml.

Sources. LeRobot: ``meta/info.json`` of a dataset names the parts of ``action`` and ``observation.state``; rows of
``data/*/*.parquet`` have both as lists, ``timestamp`` (frame_index / fps, counted and not measured) and
``episode_index`` (huggingface/lerobot, ``datasets``). SAGE: a folder a motion with ``joint_list.txt``, ``control.csv``
and ``state_motor.csv``: timestamp in µs, in s of a simulation, and lists in quotes; ``event.csv`` tells MOTION_START
and DISABLE (isaac-sim2real/sage, README, "Data Format"). MuJoCo: arrays named as the fields of mjData, time, qpos,
qvel, ctrl and qfrc_actuator, one row a step, in an .npz or as columns ``qpos_0`` …; names come from the MJCF. ROS 2:
JointState, and JointTrajectoryControllerState (reference), JointTrajectory, Float64MultiArray (the joints in the order
of the chain) or JointState of another topic as the command. BAM: a JSON file a motion of a servo on a pendulum, with
``entries`` of position, speed, goal_position, torque_enable, input_volts, temp and timestamp (Rhoban/bam).
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.campaign.document import Document, fitted_sections
from thermal_robot.campaign.importers.run import IMPORTED, require_imported
from thermal_robot.campaign.names import listed
from thermal_robot.campaign.table import PARQUET, read_table, table_from_frame, without_library
from thermal_robot.campaign.write import ROBOT_NAME
from thermal_robot.errors import CampaignError
from thermal_robot.files import is_file, write_text
from thermal_robot.motion.columns import sources
from thermal_robot.motion.log import MotionLog
from thermal_robot.motion.read import FILE_NAME, KINDS, Declaration, build_motions, robot_of
from thermal_robot.robot import Robot
from thermal_robot.schema import text

if TYPE_CHECKING:
    import pandas as pd

_TOPIC = text("the name of a topic")
_MAPPED = {**KINDS, "recording": {"joints": _TOPIC, "command": _TOPIC}}


@dataclass(frozen=True)
class Asked:
    """What an import is given beside the files: the robot, its MJCF, and topics of a bag."""

    robot: Robot
    mjcf: Path | None = None
    topics: Mapping[str, str] = field(default_factory=dict)


class Taken(NamedTuple):
    """Parts of tables by their names, the unit of angles if the format states it, what was left out, in sentences."""

    parts: Mapping[str, Sequence[pd.DataFrame]]
    angle_unit: str = ""
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class MotionFormat:
    """A format that can be imported: what it is, its files, and how they are read."""

    does: str
    files: str
    read: Callable[[Sequence[Path], Asked], Taken]


def _frame(motion: str, time: Array, columns: Mapping[str, Array]) -> pd.DataFrame:
    import pandas as pd

    return pd.DataFrame({"motion": motion, "time": time, **columns})


def _named(quantity: str, joints: Sequence[str], values: Array, file: str) -> dict[str, Array]:
    """Return the columns of an array (N, joints) by name ``quantity.joint``; refuse another number of columns."""
    if values.ndim != 2 or values.shape[1] != len(joints):
        problem, expected = "has another number of values than joints", f"{len(joints)} values a row: {listed(joints)}"
        raise CampaignError(file, f"{quantity} {problem}", found=str(values.shape), expected=expected)
    return {f"{quantity}.{joint}": values[:, j] for j, joint in enumerate(joints)}


def _lists(file: Path, names: Sequence[str]) -> tuple[Array, dict[str, Array]]:
    """Read one of SAGE's tables: stamps without a change of unit, and its columns of lists as arrays (N, joints)."""
    table = read_table(file)
    for name in ("timestamp", *names[:1]):
        if name not in table.columns:
            raise table.error("is missing", name, expected=f"timestamp, {', '.join(names)}")
    stamps = table.numbers("timestamp")
    try:
        held = {
            name: np.array([json.loads(c) for c in table.text(name)], float) for name in names if name in table.columns
        }
    except ValueError as error:
        raise CampaignError(str(file), "a list cannot be read", found=str(error), expected="[0.1, 0.2, …]") from error
    return stamps, held


def _sage(files: Sequence[Path], asked: Asked) -> Taken:
    folders = sorted({found.parent for file in files for found in file.rglob("control.csv")})
    if not folders:
        raise CampaignError(", ".join(map(str, files)), "no folder with control.csv", expected="folders of motions")
    parts: dict[str, list[pd.DataFrame]] = {"state.csv": [], "command.csv": []}
    for folder in folders:
        names = folder / "joint_list.txt"
        joints = names.read_text(encoding="utf-8").split() if is_file(names) else asked.robot.joint_names
        begin, end = -np.inf, np.inf
        if is_file(folder / "event.csv"):
            events = read_table(folder / "event.csv")
            at = dict(zip(events.text("event"), events.numbers("timestamp"), strict=True))
            begin, end = at.get("MOTION_START", begin), at.get("DISABLE", end)
        for name, quantities, kept in (
            ("control.csv", {"positions": "cmd"}, parts["command.csv"]),
            ("state_motor.csv", {"positions": "q", "velocities": "qd", "torques": "torque"}, parts["state.csv"]),
        ):
            stamps, held = _lists(folder / name, list(quantities))
            time = stamps * (1e-6 if np.median(np.diff(stamps)) > 1.0 else 1.0)  # no log has a row a second
            inside = (stamps >= begin) & (stamps <= end)
            columns = [_named(quantities[k], joints, v[inside], str(folder / name)) for k, v in held.items()]
            kept.append(_frame(folder.name, time[inside], {k: v for each in columns for k, v in each.items()}))
    note = "torques are kept as torque.*, unread: robots differ in what they report; state it as tau under [channels]"
    return Taken(parts, "rad", (note,))


def _lerobot(files: Sequence[Path], asked: Asked) -> Taken:
    import pandas as pd

    if len(files) != 1 or not is_file(files[0] / "meta" / "info.json"):
        expected = "the folder of one dataset"
        raise CampaignError(", ".join(map(str, files)), "has no meta/info.json", expected=expected)
    info = json.loads((files[0] / "meta" / "info.json").read_text(encoding="utf-8"))
    try:
        tables = [pd.read_parquet(file) for file in sorted(files[0].glob("data/*/*.parquet"))]
    except ImportError as error:
        raise without_library(str(files[0]), PARQUET[0]) from error
    if not tables:
        raise CampaignError(str(files[0]), "has no data/*/*.parquet", expected="a dataset")
    rows, columns = pd.concat(tables, ignore_index=True), dict[str, Array]()
    for feature, quantity in (("action", "cmd"), ("observation.state", "q")):
        names = info.get("features", {}).get(feature, {}).get("names")
        names = next(iter(names.values()), None) if isinstance(names, dict) else names
        if not names or feature not in rows:
            raise CampaignError(str(files[0]), f"{feature} has no names or no values", expected="names of joints")
        joints = [name.removesuffix(".pos").removeprefix("main_") for name in names]
        columns |= _named(quantity, joints, np.stack(list(rows[feature])).astype(float), str(files[0]))
    known = {*asked.robot.urdf_joints, *asked.robot.joint_names}
    kept = {name: values for name, values in columns.items() if name.partition(".")[2] in known}
    frame = _frame("", rows["timestamp"].to_numpy(float), kept)
    frame["motion"] = [f"episode_{k}" for k in rows["episode_index"]]
    notes = ["stamps are counted frames, not measured: neither jitter nor a late reading shows"]
    beside = [name for name in columns if name not in kept]
    notes += [f"no joints of the robot: {listed(beside)}"] if beside else []
    return Taken({"log.csv": [frame]}, "", tuple(notes))


def _arrays(file: Path) -> dict[str, Array]:
    """Return the arrays of a log of MuJoCo, (rows, values) each, time (rows,)."""
    if file.suffix.lower() == ".npz":
        try:
            with np.load(file) as held:
                return {name: np.asarray(held[name], dtype=float) for name in held.files}
        except (OSError, ValueError) as error:
            raise CampaignError(str(file), f"cannot be read: {error}", expected="an .npz of numbers") from error
    table, parts = read_table(file), dict[str, dict[int, Array]]()
    for name in table.columns:
        if found := re.fullmatch(r"(qpos|qvel|ctrl|qfrc_actuator)[_.\[]?(\d+)\]?", name):
            parts.setdefault(found[1], {})[int(found[2])] = table.numbers(name)
    arrays = {name: np.column_stack([own[k] for k in sorted(own)]) for name, own in parts.items()}
    return arrays | ({"time": table.numbers("time")} if "time" in table.columns else {})


def _mujoco(files: Sequence[Path], asked: Asked) -> Taken:
    from thermal_robot.motion.mjcf import opened, places

    if asked.mjcf is None:
        raise CampaignError("import", "arrays have no names", expected="--robot MODEL.xml, the MJCF that was simulated")
    (where, step), frames, notes = places(opened(asked.mjcf)), [], []
    for file in files:
        arrays = _arrays(file)
        if "qpos" not in arrays or "ctrl" not in arrays:
            raise CampaignError(str(file), "has no qpos or no ctrl", found=listed(arrays), expected="both, and time")
        several = arrays["qpos"].ndim == 3
        for k in range(len(arrays["qpos"]) if several else 1):
            own = {name: values[k] if several and values.ndim > 1 else values for name, values in arrays.items()}
            time = own.get("time", step * np.arange(len(own["qpos"])))
            columns = {
                f"{quantity}.{joint}": own[name][:, at] * scale
                for name, quantity in (("ctrl", "cmd"), ("qpos", "q"), ("qvel", "qd"), ("qfrc_actuator", "tau"))
                for joint, (at, scale) in (where[name].items() if name in own else ())
            }
            frames.append(_frame(f"{file.stem}_{k}" if several else file.stem, np.ravel(time), columns))
        notes += [] if "time" in arrays else [f"{file.name} has no time: counted by the model's step"]
    return Taken({"log.csv": frames}, "rad", tuple(notes))


_BAM = {"goal_position": "cmd", "position": "q", "speed": "qd", "input_volts": "volts", "temp": "temperature"}


def _bam(files: Sequence[Path], asked: Asked) -> Taken:
    frames, joint = [], asked.robot.joint_names[0]
    for file in files:
        try:
            held = json.loads(file.read_text(encoding="utf-8"))
            entries = {name: np.array([one[name] for one in held["entries"]], float) for name in held["entries"][0]}
            entries["goal_position"][entries.get("torque_enable", np.ones(1)) < 0.5] = np.nan
            columns = {f"{kind}.{joint}": entries[name] for name, kind in _BAM.items() if name in entries}
            frames.append(_frame(file.stem, entries["timestamp"], columns))
            frames[-1]["kind"] = held.get("trajectory", "")
        except (OSError, ValueError, LookupError, TypeError, AttributeError) as error:
            expected = "entries with position, goal_position and timestamp"
            raise CampaignError(str(file), "cannot be read", found=str(error), expected=expected) from error
    note = "kp is a register of the firmware, and no stiffness: state it in N·m/rad under [servo.<joint>]"
    return Taken({"log.csv": frames}, "rad", (note,))


_COMMANDS = {
    "control_msgs/msg/JointTrajectoryControllerState": "a controller's state",
    "trajectory_msgs/msg/JointTrajectory": "trajectories",
    "std_msgs/msg/Float64MultiArray": "arrays",
    "sensor_msgs/msg/JointState": "joint states",
}
"""Types of messages that hold commands, the surest first."""


def _rosbag(files: Sequence[Path], asked: Asked) -> Taken:
    from thermal_robot.campaign.importers.rosbag import JOINT_STATES, instant, messages, opened

    states, commands = [], []
    for file in files:
        with opened(file) as reader:
            topics = {c.topic: c.msgtype for c in reader.connections}
            spoken = [t for t, kind in topics.items() if kind in JOINT_STATES]
            own = asked.topics.get("joints") or next((t for t in spoken if t.endswith("joint_states")), None)
            found = messages(str(file), reader, JOINT_STATES, own, "joints")
            own = own or next(iter(spoken), "")
            others = [(kind, t) for kind in _COMMANDS for t in topics if topics[t] == kind and t != own]
            kinds = [kind for kind, topic in others if asked.topics.get("command", topic) == topic][:1]
            if not kinds or not found:
                expected = f"JointState, and one of {', '.join(_COMMANDS)}"
                problem = "has no command or no joint states"
                raise CampaignError(str(file), problem, found=listed(topics), expected=expected)
            topic = asked.topics.get("command") or (others[0][1] if kinds[0] in JOINT_STATES else None)
            asked_for = messages(str(file), reader, kinds, topic, "command")
        rows = [(instant(s, m), m.name, m.position) for s, m, _ in found]
        states.append(_by_name(file.stem, "q", rows))
        speeds = [(instant(s, m), m.name, m.velocity) for s, m, _ in found if len(m.velocity) == len(m.name)]
        if len(speeds) == len(rows):
            states[-1] = states[-1].join(_by_name("", "qd", speeds).drop(columns=["motion", "time"]))
        commands.append(_by_name(file.stem, "cmd", list(_commanded(asked_for, asked.robot.joint_names))))
    note = "efforts are left out: ROS means N·m, and drivers publish a current"
    return Taken({"state.csv": states, "command.csv": commands}, "rad", (note,))


def _commanded(found: Sequence[Any], joints: Sequence[str]) -> Iterator[tuple[float, Sequence[str], Any]]:
    """Yield instant, s, joints and positions of each command; a trajectory's points end where the next one begins."""
    from thermal_robot.campaign.importers.rosbag import instant

    begins = [instant(s, m) if hasattr(m, "header") else 1e-9 * s for s, m, _ in found]
    for begin, end, (_, message, kind) in zip(begins, [*begins[1:], np.inf], found, strict=True):
        if kind.endswith("JointTrajectory"):
            for point in message.points:
                at = begin + point.time_from_start.sec + 1e-9 * point.time_from_start.nanosec
                if at < end or len(message.points) == 1:
                    yield at, message.joint_names, point.positions
        elif kind.endswith("ControllerState"):
            wanted = message.reference if hasattr(message, "reference") else message.desired
            yield begin, message.joint_names, wanted.positions
        elif kind.endswith("MultiArray"):
            yield begin, joints, message.data
        else:
            yield begin, message.name, message.position


def _by_name(motion: str, quantity: str, rows: Sequence[tuple[float, Sequence[str], Any]]) -> pd.DataFrame:
    """Return a table with a row a message and a column a joint, NaN where a message does not name the joint."""
    import pandas as pd

    cells = [{f"{quantity}.{n}": float(v) for n, v in zip(names, values, strict=False)} for _, names, values in rows]
    frame = pd.DataFrame({"motion": motion, "time": [at for at, _, _ in rows]})
    return frame.join(pd.DataFrame(cells))


MOTION_FORMATS = {
    "lerobot": MotionFormat("a dataset of LeRobot: action and observation.state of each episode", "FOLDER", _lerobot),
    "sage": MotionFormat("SAGE's control.csv and state_motor.csv", "FOLDERS of motions", _sage),
    "mujoco": MotionFormat("what MuJoCo simulated: time, qpos, qvel, ctrl", "F.npz or F.csv, one a motion", _mujoco),
    "bam": MotionFormat("BAM's records of a servo on a pendulum", "F.json, one a motion", _bam),
    "motionbag": MotionFormat("joint states and their commands in ROS 2 bags", "BAGS, one a motion", _rosbag),
}
"""Formats of logs of motion by name, in the order of the help."""


def import_motion(
    format: str,
    files: Sequence[Path],
    directory: Path,
    *,
    robot: Mapping[str, str],
    angle_unit: str = "",
    mapping: Path | None = None,
) -> tuple[MotionLog, Path, tuple[str, ...]]:
    """Read a log of a format and write it as a folder with motion.toml; return it, the file, and notes.

    ``robot`` is what ``[robot]`` says; a ``mapping`` is a motion.toml without ``log``, and for bags has ``[recording]``
    joints and command, the topics.

    Raises
    ------
    CampaignError
        As :func:`~thermal_robot.motion.read_motion`, and files that cannot be used or would be overwritten.
    """
    import pandas as pd
    import tomli_w

    raw = dict(Document(mapping, _MAPPED, FILE_NAME).data) if mapping else {}
    topics, said = raw.pop("recording", {}), {**raw.pop("robot", {}), **robot}
    folder = mapping.parent if mapping and "urdf" not in robot and "mjcf" not in robot else Path()
    loaded, servos = robot_of(said, mapping or Path("import"), folder)
    taken = MOTION_FORMATS[format].read(files, Asked(loaded, folder / said["mjcf"] if "mjcf" in said else None, topics))
    frames = {name: pd.concat(parts, ignore_index=True) for name, parts in taken.parts.items()}
    require_imported(files, directory, (FILE_NAME, ROBOT_NAME, *frames))
    unit = raw.get("motion", {}).get("angle_unit") or angle_unit or taken.angle_unit
    if not unit:
        problem = f"{format} states no unit of angles, and may hold shares of a range, which are none"
        raise CampaignError("import", problem, expected="--angle-unit, or a mapping with [channels]")
    tables = [table_from_frame(frame, str(directory / name), first_row=2) for name, frame in frames.items()]
    if "tool_frame" not in said:
        loaded, _ = robot_of(said, mapping or Path("import"), folder, sources(tables, {}))
    own = {joint: {k: v for k, v in vars(servo).items() if v is not None} for joint, servo in servos.items()}
    own |= {joint: own.get(joint, {}) | stated for joint, stated in raw.get("servo", {}).items()}
    ends = {"tool_frame": loaded.tool_frame, "root_frame": loaded.root_frame, "gravity": loaded.gravity.tolist()}
    sections = {
        **raw,
        "robot": {"urdf": ROBOT_NAME, **ends},
        "motion": {"log": list(frames), **raw.get("motion", {}), "angle_unit": unit},
        "servo": own,
    }
    fitted = fitted_sections(KINDS, sections)
    log = build_motions(tables, Declaration.stated(directory.resolve().name, fitted, {}), loaded)
    origin = f"{IMPORTED} {format}` from {listed(map(str, files))}."
    texts = {ROBOT_NAME: loaded.urdf, FILE_NAME: f"# {' '.join(origin.split())}\n{tomli_w.dumps(sections)}"}
    try:
        directory.mkdir(parents=True, exist_ok=True)
        for name, content in ({name: frame.to_csv(index=False) for name, frame in frames.items()} | texts).items():
            write_text(directory / name, content)
    except OSError as error:
        raise CampaignError(str(directory), f"cannot be written: {error.strerror}") from error
    return log, directory / FILE_NAME, (*taken.notes, *log.notes)
