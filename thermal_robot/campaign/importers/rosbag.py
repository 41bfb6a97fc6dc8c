"""Importer of recordings of joints and of an instrument, ROS bags or CSV: one row for each standstill.

The joints are those that the robot reports, and stand for the commands. Figures are in rad and m, as everywhere in ROS,
unless the mapping says otherwise.

Bags are read by the library rosbags (ternaris.gitlab.io/rosbags, ``rosbags.highlevel.AnyReader``), CSV by its headers.
Sources: ``rostopic echo -p`` writes %time in ns and a column for each field, as field.header.stamp, field.name0,
field.position0, field.pose.position.x (wiki.ros.org/rostopic). PlotJuggler writes __time in s and a column for each
series, which its parsers call <topic>/<joint>/position and <topic>/pose/position/x (``ros2_parsers/jointstates_msg.h``
and ``pose_msg.h`` of PlotJuggler/plotjuggler-ros-plugins). ``ros2 topic echo --csv`` writes no header and all fields
one after another: sec, nanosec, frame, the names, the positions, then velocities and efforts (ros2/rosidl_runtime_py,
``convert.py``, ``message_to_csv``). A table of one's own has time in s, and columns named as in a campaign.

By how much the clocks of robot and instrument differ is told by one motion that both recorded: roughly from the speeds
of the target, which need no frames: the lag at which they are most alike. Then the lag, the place of the instrument and
the place of the target are fitted together to what was measured in motion.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from operator import attrgetter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign import names
from thermal_robot.campaign.importers.plan import IN_SI, Format, Plan, Source, planned
from thermal_robot.campaign.names import listed
from thermal_robot.campaign.recognise import joint_columns
from thermal_robot.campaign.table import Cells, Layout, Table, read_table
from thermal_robot.errors import CampaignError
from thermal_robot.files import is_file, is_folder
from thermal_robot.kinematics import align, exp3, tool_poses
from thermal_robot.robot import Robot

WINDOW = 0.2  # s over which a joint's velocity is taken: steps of an encoder, 1e-5 rad, are then 1e-4 rad/s at most
VELOCITY = 1e-3  # rad/s or m/s below which a joint stands: a target 1 m away moves 50 µm in a pair's tolerance
STANDSTILL = 0.5  # s that a robot stands at least: shorter is a turning point, or still swings
SETTLING = 0.25  # s after stopping that are not used: arms swing out at some 10 Hz, and controllers settle
TOLERANCE = 0.05  # s between a row's instant and its sample: instruments measure twenty times a second or more


@dataclass(frozen=True)
class Stream:
    """Time series of N samples of k quantities."""

    file: str  # where they come from, for messages
    time: Array  # (N,) s, increasing
    values: Array  # (N, k) in the unit of the recording
    names: tuple[str, ...]  # of the k columns: joints, or x y z and perhaps qw qx qy qz

    def between(self, times: Array) -> Array:
        """Interpolate the values linearly at (M,) times: (M, k); the end values are held beyond the ends."""
        return np.column_stack([np.interp(times, self.time, column) for column in self.values.T])

    def scaled(self, scale: Array) -> Stream:
        """Return the time series with its k columns multiplied by unit factors (k,)."""
        return replace(self, values=self.values * scale)

    def nearest(self, times: Array) -> NDArray[np.int64]:
        """Return the indices (M,) of the samples nearest in time to each of (M,) times, s."""
        after = np.clip(np.searchsorted(self.time, times), 1, len(self.time) - 1)
        return np.where(times - self.time[after - 1] < self.time[after] - times, after - 1, after)


def stream(file: str, time: Array, values: Array, names: Sequence[str]) -> Stream:
    """Build a time series sorted by time, without NaN rows and duplicate times; fewer than two samples are refused."""
    kept = ~(np.isnan(time) | np.isnan(values).any(axis=1))
    _, first = np.unique(time[kept], return_index=True)
    if len(first) < 2:
        found = f"{len(first)} of {', '.join(names)}"
        raise CampaignError(file, "has fewer than two samples", found=found, expected="a recording")
    return Stream(file, time[kept][first], values[kept][first], tuple(names))


class Pairs(NamedTuple):
    """Samples of robot and instrument, one pair for each standstill."""

    times: Array  # (M,) s, of the robot's clock
    joints: Array  # (M, n) of the samples nearest in time, and target: (M, k)
    target: Array
    short: int  # how many standstills were too short
    lonely: int  # how many had no sample of the target within the tolerance


def paired(
    joints: Stream,
    target: Stream,
    lag: float,
    *,
    tolerance: float = TOLERANCE,
    standstill: float = STANDSTILL,
    velocity: float = VELOCITY,
    settling: float = SETTLING,
) -> Pairs:
    """Pair the samples of two recordings nearest to the middle of each standstill of the joints, after settling.

    ``lag``, s, is robot clock minus instrument clock. A standstill has joint velocities below ``velocity`` for at least
    ``standstill`` s; a target sample counts within ``tolerance`` s.
    """
    times = joints.time
    moved = joints.between(times + WINDOW / 2) - joints.between(times - WINDOW / 2)
    still = np.abs(moved).max(axis=1) <= velocity * WINDOW
    edges = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(int)))
    begins, ends = times[edges[::2]], times[edges[1::2] - 1]
    long = ends - begins >= standstill
    middles = (begins + np.minimum(settling, (ends - begins) / 2) + ends)[long] / 2
    own, seen = joints.nearest(middles), target.nearest(middles - lag)
    near = np.abs(target.time[seen] + lag - middles) <= tolerance
    held = middles[near], joints.values[own[near]], target.values[seen[near]]
    return Pairs(*held, int((~long).sum()), int((~near).sum()))


FINEST = 0.005  # s between instants at which speeds are compared: joint states are published no faster as a rule
LONGEST = 2_000_000  # instants that are compared: three hours at the finest step; longer ones take a coarser step
UNEXPLAINED = 0.1  # share of the places' spread left by the fit: a bent robot leaves 0.01, foreign recordings 0.5
MOVING = 0.1  # share of the fastest speed from which a sample tells the time: at rest it does not
MOST = 2000  # samples in motion that are fitted; more take time and add little
BLOCKS = 10  # parts of the recording for Tukey's jackknife: honest whatever errors the fit knows nothing of
LEAST = 60  # samples in motion that a fit of ten figures and its scatter want


class Lag(NamedTuple):
    """Estimated clock offset of two recordings, with its standard deviation and the residual of the fit."""

    value: float  # s: the robot's clock shows that much more than the instrument's at the same instant
    std: float  # one standard deviation, s
    left: float  # m rms: distance in motion that lag and frames leave


def lag(joints: Stream, target: Stream, robot: Robot, place: Array) -> Lag:
    """Estimate the clock offset by cross-correlation of speeds, then least squares; its deviation by the jackknife.

    Recordings that show no motion in common, or hardly any, are refused.

    The target's positions are in any frame that stands still; ``place`` (3,), m, is where it roughly is on the tool.
    """
    # clocks that count from 1970 leave too few digits for a derivative by time: from here on both begin at 0
    begun = float(joints.time[0] - target.time[0])
    joints, target = (replace(each, time=each.time - each.time[0]) for each in (joints, target))
    rough = _by_speed(joints, target, robot, place)
    speed = _speeds(target, target.time)
    inside = (target.time + rough > joints.time[0]) & (target.time + rough < joints.time[-1])
    moving = np.flatnonzero(inside & (speed > MOVING * np.max(speed[inside], initial=0.0)))
    if len(moving) < LEAST:
        problem = "too few samples are in motion to estimate the offset of the clocks"
        expected = f"at least {LEAST}; or [recording] offset in the mapping"
        raise CampaignError(target.file, problem, found=str(len(moving)), expected=expected)
    chosen = moving[np.linspace(0, len(moving) - 1, min(MOST, len(moving))).astype(int)]
    whole, left = _fitted(joints, target, robot, chosen, np.concatenate([[rough], np.zeros(6), place]))
    spread = float(np.linalg.norm(target.values[chosen, :3].std(axis=0)))
    if not left <= UNEXPLAINED * spread:
        problem = "the joints do not move the target as it was measured, however the clocks differ"
        found = f"{1e3 * left:.0f} mm rms of {1e3 * spread:.0f} mm that no offset explains"
        named, expected = f"{joints.file} and {target.file}", "recordings of one motion of this robot"
        raise CampaignError(named, problem, found=found, expected=expected)
    parts = np.array_split(np.arange(len(chosen)), BLOCKS)
    without = [_fitted(joints, target, robot, np.delete(chosen, part), whole)[0][0] for part in parts]
    deviation = np.sqrt((BLOCKS - 1) / BLOCKS * np.sum((np.array(without) - np.mean(without)) ** 2))
    return Lag(begun + float(whole[0]), float(deviation), left)


def _by_speed(joints: Stream, target: Stream, robot: Robot, place: Array) -> float:
    """Lag, s, at which the target's speeds in two recordings that begin at 0 have the largest cross-correlation."""
    from scipy.signal import correlate, correlation_lags

    spans = [stream.time[-1] for stream in (joints, target)]
    usual = [float(np.median(np.diff(stream.time))) for stream in (joints, target)]
    step = max(FINEST, *usual, max(spans) / LONGEST)
    poses = tool_poses(robot, joints.values)
    reached = replace(joints, values=poses[:, :3, 3] + poses[:, :3, :3] @ place)
    both = [_speeds(each, np.arange(0.0, span, step)) for each, span in zip((reached, target), spans, strict=True)]
    one, other = (speeds - speeds.mean() for speeds in both)
    best = int(np.argmax(correlate(one, other, method="fft")))
    return float(correlation_lags(len(one), len(other))[best] * step)


def _speeds(stream: Stream, times: Array) -> Array:
    """Speed (M,), m/s, of the interpolated target position at given times, by central differences."""
    return np.asarray(np.linalg.norm(np.gradient(stream.between(times)[:, :3], times, axis=0), axis=1))


def _fitted(joints: Stream, target: Stream, robot: Robot, chosen: Any, start: Array) -> tuple[Array, float]:
    """Fit lag, pose of the instrument's frame and place of the target on the tool by nonlinear least squares.

    Returns the ten parameters and the residual, m rms. The rotation is relative to the aligned start, hence small.
    """
    from scipy.optimize import least_squares

    times, measured = target.time[chosen], target.values[chosen, :3]

    def reached(figures: Array) -> Array:
        poses = tool_poses(robot, joints.between(times + figures[0]))
        places: Array = poses[:, :3, 3] + poses[:, :3, :3] @ figures[7:]
        return places

    frame = align(reached(start), measured, np.ones(len(times)))
    middle = measured.mean(axis=0)

    def gap(figures: Array) -> Array:
        seen: Array = reached(figures) @ frame[:3, :3].T + frame[:3, 3] - middle
        away: Array = seen @ exp3(figures[1:4]).T + middle + figures[4:7] - measured
        return np.ravel(away)

    begin = np.concatenate([start[:1], np.zeros(6), start[7:]])
    # the sizes of what is sought: a step of the clock, angles, metres
    found = least_squares(gap, begin, x_scale=np.array([0.01, *[0.01] * 3, *[0.01] * 6]))
    return found.x, float(np.sqrt(2 * found.cost / len(times)))


_NANOSECOND = 1e-9
_CLOCKS = {"field.header.stamp": _NANOSECOND, "%time": _NANOSECOND, "__time": 1.0, "time": 1.0, "timestamp": 1.0}
"""Columns that tell the time, the best first, and their units in s: a stamp is of the measurement, %time of its
coming."""
_PART = re.compile(r"(?:^|[./])(?:position|point|translation|(?P<turn>orientation|rotation))[./](?P<axis>[xyzw])$")
_STAMP = re.compile(rb"\d+,\d+,")  # sec and nanosec, with which lines without a header begin


def read_streams(file: Path, joints: Sequence[str]) -> tuple[Stream | None, Stream | None]:
    """Time series of the chain's joints and of the target in a CSV of topics; ``None`` where one is missing.

    A file that is no table, has no clock, or has some of the joints only is refused.
    """
    bare = False
    if is_file(file):
        with file.open("rb") as content:
            bare = _STAMP.match(content.read(64)) is not None
    table = _named(read_table(file, Layout(",", 0, False))) if bare else read_table(file)
    clock = next((name for name in _CLOCKS if name in table.columns), None)
    if clock is None:
        expected = f"one of {', '.join(_CLOCKS)}"
        raise CampaignError(str(file), "has no column of time", row=table.header, expected=expected)
    time, found = table.numbers(clock, gaps=True) * _CLOCKS[clock], list[Stream | None]()
    for columns in (_joints(table, joints), _target(table)):
        values = [table.numbers(name, gaps=True) for name in columns.values()]
        found.append(stream(table.file, time, np.column_stack(values), tuple(columns)) if columns else None)
    return found[0], found[1]


def _named(table: Table) -> Table:
    """Name the columns of headerless CSV from ``ros2 topic echo``: time, and joints by name or x y z (qx qy qz qw)."""
    stamps, fields = list(table.columns)[:2], list(table.columns)[2:]
    time = table.numbers(stamps[0]) + table.numbers(stamps[1]) * _NANOSECOND
    # texts, or nothing where a frame has no name; figures that are nan throughout, as efforts, are no texts
    text = (table.first_text(name) is None and any(table.columns[name]) for name in fields)
    first = next((k for k, figures in enumerate(text) if figures), len(fields))
    recorded = [table.text(name)[0] for name in fields[1:first]]  # the first text is the frame
    rest = [name for name in fields[first:] if any(table.columns[name])]  # a comma at the end is no field
    if not recorded and len(rest) in (len(names.POSITION), len(names.MEASURED)):
        recorded = ["x", "y", "z", "qx", "qy", "qz", "qw"][: len(rest)]
    if len(recorded) < 2 or first + len(recorded) > len(fields):
        problem = "neither joint states nor poses are recognised in lines without a header"
        expected = "sec, nanosec, frame, and names and positions of the joints, or x y z (qx qy qz qw)"
        raise CampaignError(table.file, problem, found=f"{len(fields) + 2} fields", expected=expected)
    columns = {name: table.columns[field] for name, field in zip(recorded, fields[first:], strict=False)}
    return replace(table, columns={"time": time, **columns})


def _joints(table: Table, joints: Sequence[str]) -> dict[str, str]:
    """Column of each joint's position, by joint name; empty without any, an error where only some are recorded."""
    named = {
        table.text(name)[0]: name.replace("name", "position", 1)
        for name in table.columns
        if re.fullmatch(r"field\.name\d+", name)
    }
    columns = joint_columns(table.columns, joints)
    columns |= {j: named[name] for j, name in joint_columns(named, joints).items() if named[name] in table.columns}
    if columns and len(columns) < len(joints):
        lacking = next(joint for joint in joints if joint not in columns)
        raise table.error("a joint of the chain is not recorded", lacking, expected=f"all of {listed(joints)}")
    return {joint: columns[joint] for joint in joints if columns}


def _target(table: Table) -> dict[str, str]:
    """Columns of the target's position, and its quaternion if complete, by campaign name; empty without a position."""
    parts: dict[str, str] = {}
    for name in table.columns:
        if found := _PART.search(name):
            parts.setdefault(f"{'q' if found['turn'] else ''}{found['axis']}", name)
    for group in (names.POSITION, names.ORIENTATION):
        if not any(name in parts for name in group):
            parts |= {name: name for name in group if name in table.columns}
    wanted = next((each for each in (names.MEASURED, names.POSITION) if {*each} <= {*parts}), ())
    return {name: parts[name] for name in wanted}


ENDINGS = (".bag", ".mcap", ".db3")
JOINT_STATES = ("sensor_msgs/msg/JointState",)
_TARGETS = {
    "geometry_msgs/msg/PoseStamped": ("pose.position", "pose.orientation"),
    "geometry_msgs/msg/TransformStamped": ("transform.translation", "transform.rotation"),
    "geometry_msgs/msg/PointStamped": ("point",),
}
"""Types of messages with a place, and the fields that hold it and a turn."""


def read_bag(
    path: Path, joints: Sequence[str], joint_topic: str | None, target_topic: str | None
) -> tuple[Stream | None, Stream | None]:
    """Time series of the chain's joints and of the target in a bag; ``None`` where no topic has such messages.

    A topic may be ``None`` where only one has such messages. An unreadable bag, several topics to choose from, and a
    joint that is not recorded are refused.
    """
    file = str(path)
    with opened(path) as reader:
        states = messages(file, reader, JOINT_STATES, joint_topic, "joints")
        targets = messages(file, reader, tuple(_TARGETS), target_topic, "pose")
    return _joint_stream(file, states, joints), _target_stream(file, targets)


@contextmanager
def opened(path: Path) -> Iterator[Any]:
    """Open a bag of ROS 1 or 2 and yield its ``AnyReader``; a bag that cannot be read raises a CampaignError."""
    file = str(path)
    try:
        from rosbags.highlevel import AnyReader, AnyReaderError
        from rosbags.typesys import Stores, get_typestore
    except ImportError as error:
        expected = 'pip install "thermal-robot[ros]"'
        raise CampaignError(file, "bags need rosbags, which is not installed", expected=expected) from error
    try:
        with AnyReader([path], default_typestore=get_typestore(Stores.LATEST)) as reader:
            yield reader
    except AnyReaderError as error:
        raise CampaignError(file, f"cannot be read as a bag ({error})", expected="a bag of ROS 1 or ROS 2") from error


def messages(file: str, reader: Any, types: Sequence[str], topic: str | None, key: str) -> list[Any]:
    """Return all messages of given types in the one topic that has them, or that stated: time in ns, message, type."""
    fitting = [c for c in reader.connections if c.msgtype in types]
    topics, kinds = sorted({c.topic for c in fitting}), " or ".join(types)
    if topic is None and len(topics) > 1:
        problem, expected = f"several topics have messages of {kinds}", f"[recording] {key} in the mapping"
        raise CampaignError(file, problem, found=listed(topics), expected=expected)
    if topic is not None and topic not in topics:
        problem = f"no messages of {kinds} in topic {topic!r}"
        raise CampaignError(file, problem, found=listed(topics), expected="its topics")
    chosen = [c for c in fitting if topic in (None, c.topic)]
    return [
        (stamp, reader.deserialize(raw, connection.msgtype), connection.msgtype)
        for connection, stamp, raw in (reader.messages(connections=chosen) if chosen else ())
    ]


def instant(stamp: int, message: Any) -> float:
    """Return a message's time, s: of its header's stamp, or of its recording where the stamp is zero."""
    header = message.header.stamp
    return header.sec + header.nanosec * _NANOSECOND if header.sec or header.nanosec else stamp * _NANOSECOND


def _joint_stream(file: str, messages: Sequence[Any], joints: Sequence[str]) -> Stream | None:
    times, rows = [], []
    for stamp, message, _ in messages:
        where = joint_columns(message.name, joints)
        if len(where) == len(joints):  # a hand may speak in messages of its own
            times.append(instant(stamp, message))
            rows.append([message.position[message.name.index(where[joint])] for joint in joints])
    if messages and not rows:
        recorded = sorted({name for _, message, _ in messages for name in message.name})
        problem = "no message has all joints of the chain"
        raise CampaignError(file, problem, found=listed(recorded), expected=listed(joints))
    return stream(file, np.array(times), np.array(rows, dtype=float), joints) if rows else None


def _target_stream(file: str, messages: Sequence[Any]) -> Stream | None:
    times, rows = [], []
    for stamp, message, kind in messages:
        place, *turns = (attrgetter(path)(message) for path in _TARGETS[kind])
        times.append(instant(stamp, message))
        rows.append([place.x, place.y, place.z, *(getattr(turn, axis) for turn in turns for axis in "wxyz")])
    whole = names.MEASURED[: len(rows[0])] if rows else ()
    return stream(file, np.array(times), np.array(rows, dtype=float), whole) if rows else None


_LIMITS = ("tolerance", "standstill", "velocity", "settling")


def _read_recordings(files: Sequence[Path], plan: Plan) -> Source:
    """Read both recordings, estimate their clock offset unless stated, and pair them at standstill."""
    own, robot = planned(IN_SI), plan.robot()
    settings = plan.over(own).settings(robot)
    joints, target = _streams(files, plan, robot)
    scale = np.array([settings.units.joint_scale(kind) for kind in robot.joint_types])  # SI values of one unit
    moved, known = joints.scaled(scale), plan.get("recording", "offset")
    how = "as stated"
    if known is None:
        lengths = np.where(np.isin(target.names, names.POSITION), settings.units.length_scale, 1.0)
        known, std, left = lag(moved, target.scaled(lengths), robot, np.array(settings.target))
        how = f"estimated from the motion, of which {1e3 * left:.2g} mm rms are left"
        clocks = f"{known:.6f} ± {std:.6f}"
    else:
        clocks = f"{known:g}"
    clocks = f"the robot's clock shows {clocks} s more than the instrument's, {how}"
    limits = {key: value for key in _LIMITS if (value := plan.get("recording", key)) is not None}
    pairs = paired(moved, target, known, **limits)
    if not len(pairs.times):
        found = f"{pairs.short} standstills too short, {pairs.lonely} without a sample"
        expected = "standstills; [recording] standstill, velocity and tolerance in the mapping"
        problem = "the robot never stands still long enough beside a sample of the target"
        raise CampaignError(joints.file, problem, found=found, expected=expected)
    notes = [f"{len(joints.time)} joint states and {len(target.time)} samples of the target read", clocks]
    notes.append(f"{len(pairs.times)} standstills taken")
    notes += [f"{pairs.short} standstills left out, too short"] if pairs.short else []
    notes += [f"{pairs.lonely} standstills left out, no sample of the target near"] if pairs.lonely else []
    columns: dict[str, Cells] = dict(zip(joints.names, (pairs.joints / scale).T, strict=True))
    columns |= {**dict(zip(target.names, pairs.target.T, strict=True)), "time": pairs.times - pairs.times[0]}
    table = Table(f"{joints.file} with {target.file}", columns, np.arange(1, len(pairs.times) + 1))
    return Source(table, own, tuple(notes), (f"Clocks: {clocks}.",))


def _streams(files: Sequence[Path], plan: Plan, robot: Robot) -> tuple[Stream, Stream]:
    """Read the time series of joints and of the target, each from the one file that has it; else refuse the files."""
    topics, read = [plan.get("recording", key) for key in ("joints", "pose")], []
    for file in files:
        bag = file.suffix.lower() in ENDINGS or is_folder(file)
        read.append(read_bag(file, robot.joint_names, *topics) if bag else read_streams(file, robot.joint_names))
    found = [[each for each in streams if each is not None] for streams in zip(*read, strict=True)]
    for streams, what in zip(found, ("joint states of the chain", "poses or points of the target"), strict=True):
        if len(streams) != 1:
            problem = f"{'more than one file has' if streams else 'no file has'} {what}"
            raise CampaignError(" and ".join(map(str, files)), problem, expected=f"one recording of {what}")
    return found[0][0], found[1][0]


ROSBAG = Format(
    "joint_states and poses of the target: ROS bags, or CSV of rostopic, ros2 topic echo, PlotJuggler",
    "BAG, or BAG POSES.csv, or JOINT_STATES.csv POSES.csv",
    _read_recordings,
)
