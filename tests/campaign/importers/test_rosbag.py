"""Recordings of robot and instrument: a row for each rest, by the right clock; as bags and as every kind of CSV."""

import sys
from dataclasses import dataclass

import numpy as np
import pytest
from campaign.importers.written import complaint, imported
from helpers import some

from thermal_robot.campaign.importers.rosbag import Stream, lag, paired, read_bag, read_streams, stream
from thermal_robot.errors import CampaignError
from thermal_robot.kinematics import exp3, tool_poses

TARGET = np.array([0.02, -0.03, 0.11])
REST = 1.2


@dataclass(frozen=True)
class Motion:
    """Joint positions at rest (P, n), when each rest begins and ends, and the moves between."""

    poses: np.ndarray
    begins: np.ndarray
    ends: np.ndarray

    def at(self, times):
        """Joint positions: smooth moves (Flash and Hogan's, without a jerk at their ends) between rests."""
        k = np.clip(np.searchsorted(self.ends, times), 0, len(self.poses) - 1)
        before = np.maximum(k - 1, 0)
        length = np.where(k > 0, self.begins[k] - self.ends[before], 1.0)
        s = np.clip(np.where(k > 0, times - self.ends[before], 1.0) / length, 0, 1)[:, None]
        share = 10 * s**3 - 15 * s**4 + 6 * s**5
        return self.poses[before] + share * (self.poses[k] - self.poses[before])


def motion(robot, rng, poses=25):
    lower, upper = np.maximum(robot.lower, -1.5), np.minimum(robot.upper, 1.5)
    q = rng.uniform(lower, upper, (poses, robot.n)) * 0.6
    moves = rng.uniform(1.0, 3.0, poses)
    begins = np.cumsum(moves + REST) - moves[0] - REST
    return Motion(q, begins, begins + REST)


def recorded(robot, rng, *, offset, poses=25, joint_rate=100.0, rate=60.0, noise=5e-5, bent=0.0, start=1.6e9):
    """Joint states and positions of the target, where the robot's clock shows ``offset`` more; and the motion.

    ``bent`` turns the robot's second joint by that much more than its model, rad, times the joint's position.
    """
    path = motion(robot, rng, poses)
    span = path.ends[-1]
    joint_times = np.arange(0.0, span, 1 / joint_rate) + rng.uniform(0, 1 / joint_rate)
    joints = np.round(path.at(joint_times) / 1e-5) * 1e-5
    times = np.arange(0.3, span - 0.2, 1 / rate)
    times = times + 0.1 / rate * rng.uniform(-1, 1, len(times))
    q = path.at(times)
    q[:, 1] += bent * np.sin(2 * q[:, 1])
    tool = tool_poses(robot, q)
    frame, shift = exp3(rng.normal(size=3)), rng.uniform(-3, 3, 3)
    places = (tool[:, :3, 3] + tool[:, :3, :3] @ TARGET) @ frame.T + shift + noise * rng.normal(size=(len(times), 3))
    own = Stream("joints", joint_times + start, joints, robot.joint_names)
    return own, Stream("target", times + start - offset, places, ("x", "y", "z")), path


NOWHERE = np.zeros(3)


@pytest.mark.parametrize("offset", some([-12.3, 0.347, 1.5e9], 2))
def test_a_known_offset_is_recovered_to_a_tenth_of_a_millisecond(rv_m2, offset):
    joints, target, _ = recorded(rv_m2, np.random.default_rng(1), offset=offset)
    found = lag(joints, target, rv_m2, NOWHERE)
    assert found.value == pytest.approx(offset, abs=1e-4)
    assert 0 < found.std < 1e-4
    assert found.left < 2 * np.sqrt(3) * 5e-5


@pytest.mark.slow
def test_the_deviation_is_honest_where_the_robot_is_bent(rv_m2):
    """Errors of the robot that the fit does not know, of a millimetre, spoil the offset by no more than is told."""
    errors, told = [], []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        offset = rng.uniform(-20, 20)
        joints, target, _ = recorded(rv_m2, rng, offset=offset, bent=3e-3)
        found = lag(joints, target, rv_m2, NOWHERE)
        errors.append(found.value - offset)
        told.append(found.std)
    scores = np.array(errors) / told
    assert np.abs(errors).max() < 1e-3
    assert np.abs(scores).max() < 4.0
    assert 0.2 < np.sqrt((scores**2).mean()) < 2.0


def test_where_the_target_is_need_not_be_known(rv_m2):
    joints, target, _ = recorded(rv_m2, np.random.default_rng(3), offset=2.0)
    near, far = (lag(joints, target, rv_m2, place) for place in (TARGET, TARGET + 0.2))
    assert near.value == pytest.approx(far.value, abs=1e-5)


def test_two_motions_that_have_nothing_to_do_with_each_other_are_refused(rv_m2):
    joints = recorded(rv_m2, np.random.default_rng(1), offset=0.0)[0]
    target = recorded(rv_m2, np.random.default_rng(2), offset=0.0)[1]
    with pytest.raises(CampaignError, match=r"however the clocks differ; found \d+ mm rms of \d+ mm"):
        lag(joints, target, rv_m2, NOWHERE)


def test_a_robot_that_hardly_moves_tells_no_time(rv_m2):
    joints, target, _ = recorded(rv_m2, np.random.default_rng(1), offset=0.0, rate=2.0, poses=8)
    with pytest.raises(CampaignError, match="too few samples are in motion"):
        lag(joints, target, rv_m2, NOWHERE)


def test_a_pair_for_each_rest_by_the_offset_of_the_clocks(rv_m2):
    """A second off, targets are centimetres away: what the estimate is good for."""
    joints, target, path = recorded(rv_m2, np.random.default_rng(0), offset=7.0, start=0.0)
    right, near, off = (paired(joints, target, lag) for lag in (7.0, 6.5, 6.0))
    assert len(right.times) == len(path.poses)
    np.testing.assert_allclose(right.joints, path.poses, atol=1.1e-5)
    assert ((path.begins < right.times) & (right.times < path.ends)).all()
    common = set.intersection(*(set(p.times.tolist()) for p in (right, near, off)))
    places = [p.target[[t in common for t in p.times]] for p in (right, near, off)]
    assert np.abs(places[0] - places[1]).max() < 1e-3  # still at rest
    assert np.abs(places[0] - places[2]).max() > 0.01


def test_rests_that_are_too_short_or_unmeasured_are_counted(rv_m2):
    joints, target, path = recorded(rv_m2, np.random.default_rng(0), offset=0.0, start=0.0, poses=10)
    assert paired(joints, target, 0.0, standstill=5.0).short == 10
    gap = (target.time < path.begins[4]) | (target.time > path.ends[4])
    holed = type(target)("t", target.time[gap], target.values[gap], target.names)
    pairs = paired(joints, holed, 0.0)
    assert (len(pairs.times), pairs.lonely) == (9, 1)
    far = paired(joints, holed, 0.0, tolerance=2.0)
    assert (len(far.times), far.lonely) == (10, 0)


@pytest.mark.parametrize("velocity", [1e-3, 5e-3])
def test_a_robot_that_creeps_does_not_stand(rv_m2, velocity):
    time = np.arange(0.0, 10.0, 0.01)
    creeping = 2e-3 * time[:, None] * np.ones(rv_m2.n)
    joints = recorded(rv_m2, np.random.default_rng(0), offset=0.0, poses=2)[0]
    joints = type(joints)("j", time, creeping, joints.names)
    target = type(joints)("t", time, np.zeros((len(time), 3)), ("x", "y", "z"))
    pairs = paired(joints, target, 0.0, velocity=velocity)
    assert len(pairs.times) == int(velocity > 2e-3)


def test_samples_are_put_in_order_and_gaps_left_out():
    time = np.array([3.0, 1.0, np.nan, 2.0, 1.0])
    found = stream("f", time, np.array([[30.0], [10.0], [0.0], [np.nan], [11.0]]), ["x"])
    np.testing.assert_array_equal(found.time, [1.0, 3.0])
    np.testing.assert_array_equal(found.values, [[10.0], [30.0]])
    with pytest.raises(CampaignError, match="f: has fewer than two samples; found 1 of x"):
        stream("f", np.array([1.0, 1.0]), np.zeros((2, 1)), ["x"])


OFFSET = 3.21
POSES = 12


@pytest.fixture(scope="module")
def recording(rv_m2):
    return recorded(rv_m2, np.random.default_rng(5), offset=OFFSET, poses=POSES, joint_rate=50.0, rate=30.0)


def stamp(seconds):
    whole = np.floor(seconds)
    return int(whole), round(1e9 * (seconds - whole))


def put(folder, name, rows, header=()):
    """Write rows, figures with nine digits, as CSV."""
    told = [header] * bool(header) + [[v if isinstance(v, str) else f"{v:.9g}" for v in row] for row in rows]
    (folder / name).write_text("\n".join(map(",".join, told)))


def nanoseconds(t):
    return str(round(1e9 * t))


def rostopic(folder, joints, target):
    joint_header = ["%time", "field.header.seq", "field.header.stamp", "field.header.frame_id"]
    joint_header += [f"field.{what}{k}" for what in ("name", "position") for k in range(6)]
    order = ("gripper", *reversed(joints.names))
    rows = zip(map(nanoseconds, joints.time), joints.values, strict=True)
    put(folder, "joints.csv", ([t, "0", t, "", *order, 0.0, *q[::-1]] for t, q in rows), joint_header)
    header = ["%time", "field.header.stamp", *(f"field.pose.position.{axis}" for axis in "xyz")]
    rows = zip(target.time, target.values, strict=True)
    put(folder, "poses.csv", ([nanoseconds(t + 0.03), nanoseconds(t), *p] for t, p in rows), header)
    return ["joints.csv", "poses.csv"]


def ros2(folder, joints, target):
    rows = zip(joints.time, joints.values, strict=True)
    put(folder, "joints.csv", ([*map(str, stamp(t)), "", *joints.names, *q] for t, q in rows))
    rows = zip(target.time, target.values, strict=True)
    put(folder, "poses.csv", ([*map(str, stamp(t)), "tracker", *p, 0.0, 0.0, 0.0, 1.0] for t, p in rows))
    return ["joints.csv", "poses.csv"]


def plotjuggler(folder, joints, target):
    """One table of all series, with empty cells where a series has no sample."""
    header = ["__time", *(f"/joint_states/{name}/position" for name in joints.names)]
    header += [f"/tracker/point/{axis}" for axis in "xyz"]
    rows = [(t, [*q, *[""] * 3]) for t, q in zip(joints.time, joints.values, strict=True)]
    rows += [(t, [*[""] * len(joints.names), *p]) for t, p in zip(target.time, target.values, strict=True)]
    put(folder, "all.csv", ([f"{t:.7f}", *cells] for t, cells in sorted(rows, key=lambda row: row[0])), header)
    return ["all.csv"]


def own(folder, joints, target):
    for name, each in (("joints.csv", joints), ("poses.csv", target)):
        table = np.column_stack([each.time, each.values])
        np.savetxt(folder / name, table, "%.9f", ",", header=",".join(["time", *each.names]), comments="")
    return ["joints.csv", "poses.csv"]


def bag(folder, joints, target, first=False):
    """A bag of ROS 2 with poses, or of ROS 1 with points; the former says when they came by the robot's clock."""
    rosbags = pytest.importorskip("rosbags.rosbag1" if first else "rosbags.rosbag2")
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC if first else Stores.ROS2_HUMBLE)
    state, posed, pose, point, turn, header, time = (store.types[name] for name in (
        "sensor_msgs/msg/JointState", f"geometry_msgs/msg/{'Point' if first else 'Pose'}Stamped",
        "geometry_msgs/msg/Pose", "geometry_msgs/msg/Point", "geometry_msgs/msg/Quaternion",
        "std_msgs/msg/Header", "builtin_interfaces/msg/Time",
    ))  # fmt: skip
    write = store.serialize_ros1 if first else store.serialize_cdr
    seq, name = ([0], "all.bag") if first else ([], "bag")
    with rosbags.Writer(folder / name, **({} if first else {"version": 9})) as writer:
        a, b = (
            writer.add_connection(topic, kind.__msgtype__, typestore=store)
            for topic, kind in (("/joint_states", state), ("/tracker", posed))
        )
        for t, q in zip(joints.time, joints.values, strict=True):
            message = state(header(*seq, time(*stamp(t)), ""), list(joints.names), q.copy(), np.zeros(0), np.zeros(0))
            writer.write(a, round(1e9 * t), write(message, state.__msgtype__))
        for t, p in zip(target.time, target.values, strict=True):
            place = point(*p) if first else pose(point(*p), turn(0.0, 0.0, 0.0, 1.0))
            message = posed(header(*seq, time(*stamp(t)), "tracker"), place)
            writer.write(b, round(1e9 * (t + (0.0 if first else OFFSET))), write(message, posed.__msgtype__))
    return [name]


def bag1(folder, joints, target):
    return bag(folder, joints, target, first=True)


ROBOT = ("--robot", "builtin:rv_m2", "--tool", "tool0")


@pytest.mark.parametrize("write", [rostopic, ros2, plotjuggler, own, bag, bag1])
def test_every_recording_gives_the_rests_of_the_robot(recording, tmp_path, capsys, write):
    joints, target, path = recording
    campaign, out = imported(capsys, tmp_path, "rosbag", *write(tmp_path, joints, target), *ROBOT, robot=False)
    assert f"{POSES} standstills taken" in out
    np.testing.assert_allclose(campaign.q, path.poses, atol=1.2e-5)
    shown = float(out.split("clock shows ")[1].split(" ")[0])
    assert shown == pytest.approx(OFFSET, abs=1e-3)
    text = (tmp_path / "made" / "campaign.toml").read_text()
    assert f"# Clocks: the robot's clock shows {shown:.6f} ± " in text
    middles = target.between((path.begins + path.ends) / 2 + 1.6e9 - OFFSET)
    np.testing.assert_allclose(campaign.position[1:-1], middles[1:-1], atol=4e-4)
    assert campaign.covariates["time"][0] == 0.0


def test_a_stated_offset_and_other_units_are_taken(recording, tmp_path, capsys):
    joints, target, path = recording
    scaled = joints.scaled(np.full(5, 180 / np.pi)), target.scaled(np.full(3, 1e3))
    (tmp_path / "m.toml").write_text(f"[recording]\noffset = {OFFSET}\n")
    said = (*own(tmp_path, *scaled), *ROBOT, "--mapping", "m.toml", "--angle-unit", "deg", "--length-unit", "mm")
    campaign, out = imported(capsys, tmp_path, "rosbag", *said, robot=False)
    assert "clock shows 3.21 s more than the instrument's, as stated; 12 standstills taken" in out
    np.testing.assert_allclose(campaign.q, path.poses, atol=1.2e-5)
    assert np.linalg.norm(campaign.position - target.between(path.begins + 1.6e9 + 0.7 - OFFSET), axis=1).max() < 5e-4
    assert campaign.units.length == "mm"


def test_what_is_lacking_is_told(recording, tmp_path, capsys):
    joints, target, _ = recording
    own(tmp_path, joints, target)
    text = (tmp_path / "joints.csv").read_text()
    (tmp_path / "less.csv").write_text(text.replace("joint_3", "joint_x", 1))
    (tmp_path / "clockless.csv").write_text(text.replace("time", "t", 1))
    (tmp_path / "odd.bag").write_bytes(b"no bag")
    told = {
        ("joints.csv",): "joints.csv: no file has poses or points of the target",
        ("joints.csv", "joints.csv", "poses.csv"): "found 3, expected BAG",
        ("joints.csv", "joints.csv"): "more than one file has joint states of the chain",
        ("less.csv", "poses.csv"): "less.csv, row 1, column 'joint_3': a joint of the chain is not recorded",
        ("clockless.csv", "poses.csv"): "clockless.csv, row 1: has no column of time",
        ("odd.bag",): "odd.bag: cannot be read as a bag",
    }
    for files, said in told.items():
        assert said in complaint(capsys, tmp_path, "rosbag", *files, *ROBOT, robot=False)
    (tmp_path / "m.toml").write_text("[recording]\noffset = 0\nstandstill = 60\n")
    files = ("joints.csv", "poses.csv", "--mapping", "m.toml")
    said = complaint(capsys, tmp_path, "rosbag", *files, *ROBOT, robot=False)
    assert "never stands still long enough" in said
    assert "found 12 standstills too short, 0 without a sample" in said


def test_topics_are_not_guessed(tmp_path, capsys, monkeypatch):
    rosbag2 = pytest.importorskip("rosbags.rosbag2")
    from rosbags.typesys import Stores, get_typestore

    for name, topics in (("two", ("/left/joint_states", "/right/joint_states")), ("one", ("/joint_states",))):
        with rosbag2.Writer(tmp_path / name, version=9) as writer:
            for topic in topics:
                store = get_typestore(Stores.ROS2_HUMBLE)
                writer.add_connection(topic, "sensor_msgs/msg/JointState", typestore=store)
    said = complaint(capsys, tmp_path, "rosbag", "two", *ROBOT, robot=False)
    assert "found '/left/joint_states', '/right/joint_states', expected [recording] joints in the mapping" in said
    with pytest.raises(CampaignError, match="in topic '/arm'; found '/joint_states', expected its topics"):
        read_bag(tmp_path / "one", ("a",), "/arm", None)
    assert read_bag(tmp_path / "one", ("a",), None, None) == (None, None)
    monkeypatch.setitem(sys.modules, "rosbags.highlevel", None)
    with pytest.raises(CampaignError, match=r'bags need rosbags, .* expected pip install "thermal-robot\[ros\]"'):
        read_bag(tmp_path / "a.bag", ("a",), None, None)


JOINTS = ("a", "b")


def read(tmp_path, text):
    (tmp_path / "f.csv").write_text(text)
    return read_streams(tmp_path / "f.csv", JOINTS)


def test_stamps_count_for_more_than_the_time_of_coming(tmp_path):
    text = "%time,field.header.stamp,field.name0,field.name1,field.position0,field.position1\n"
    text += "9000000000,1000000000,b,a,0.5,0.25\n9900000000,2000000000,b,a,0.6,0.35\n"
    joints, target = read(tmp_path, text)
    assert target is None
    np.testing.assert_allclose(joints.time, [1.0, 2.0])
    np.testing.assert_allclose(joints.values, [[0.25, 0.5], [0.35, 0.6]])


def test_joints_named_in_two_ways_keep_the_order_of_the_chain(tmp_path):
    joints, _ = read(tmp_path, "time,b,field.name0,field.position0\n1,0.5,a,0.25\n2,0.6,a,0.35\n")
    assert joints.names == JOINTS
    np.testing.assert_allclose(joints.values, [[0.25, 0.5], [0.35, 0.6]])


def test_orientations_are_put_scalar_first(tmp_path):
    parts = [f"field.transform.rotation.{axis}" for axis in "xyzw"]
    places = [f"field.transform.translation.{axis}" for axis in "xyz"]
    text = ",".join(["%time", *parts, *places]) + "\n1000000000,.1,.2,.3,.9,1,2,3\n2000000000,.1,.2,.3,.9,4,5,6\n"
    _, target = read(tmp_path, text)
    assert target.names == ("x", "y", "z", "qw", "qx", "qy", "qz")
    np.testing.assert_allclose(target.values[0], [1, 2, 3, 0.9, 0.1, 0.2, 0.3])


def test_lines_without_a_header(tmp_path):
    _, target = read(tmp_path, "1,500000000,map,1,2,3,.1,.2,.3,.9\n2,0,map,4,5,6,.1,.2,.3,.9\n")
    np.testing.assert_allclose(target.time, [1.5, 2.0])
    np.testing.assert_allclose(target.values[1], [4, 5, 6, 0.9, 0.1, 0.2, 0.3])
    joints, _ = read(tmp_path, "1,0,,a,hand,b,.1,.9,.2,0,0,0\n2,0,,a,hand,b,.3,.9,.4,0,0,0\n")
    np.testing.assert_allclose(joints.values, [[0.1, 0.2], [0.3, 0.4]])
    _, target = read(tmp_path, "1,0,map,1,2,3,\n2,0,map,4,5,6,\n")  # a comma at the end is no field
    np.testing.assert_allclose(target.values, [[1, 2, 3], [4, 5, 6]])
    with pytest.raises(CampaignError, match="'a': a joint of the chain is not recorded, expected all of 'a', 'b'"):
        read(tmp_path, "1,0,,c,b,.1,.2\n2,0,,c,b,.3,.4\n")
    with pytest.raises(CampaignError, match="neither joint states nor poses are recognised"):
        read(tmp_path, "1,0,map,1,2\n2,0,map,1,2\n")


@pytest.mark.parametrize("suffix", ["", "/position"])
@pytest.mark.parametrize("behind", ["", ",0,0,nan,nan", ",nan,nan,nan,nan", ",0,0,,", ",0,0,inf,inf"])
@pytest.mark.parametrize("frame", ["", "base"])
def test_what_stands_behind_the_positions_does_not_shift_them(tmp_path, frame, behind, suffix):
    lines = [f"{k},0,{frame},b{suffix},a{suffix},{k / 10},{k / 5}{behind}" for k in (1, 2, 3)]
    joints, target = read(tmp_path, "\n".join(lines) + "\n")
    assert target is None
    np.testing.assert_allclose(joints.values, [[0.2, 0.1], [0.4, 0.2], [0.6, 0.3]])
