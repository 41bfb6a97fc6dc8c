"""Recordings as bags and as every kind of CSV give the same campaign: a row for each rest, by the right clock."""

import numpy as np
import pytest
from campaign.importers.recordings import recorded
from campaign.importers.written import complaint

from thermal_robot import cli
from thermal_robot.campaign import read_campaign

OFFSET = 3.21
POSES = 12


@pytest.fixture(scope="module")
def recording(rv_m2):
    return recorded(rv_m2, np.random.default_rng(5), offset=OFFSET, poses=POSES, joint_rate=50.0, rate=30.0)


def stamp(seconds):
    whole = np.floor(seconds)
    return int(whole), round(1e9 * (seconds - whole))


def rostopic(folder, joints, target):
    names = ",".join(f"field.name{k}" for k in range(6))
    header = f"%time,field.header.seq,field.header.stamp,field.header.frame_id,{names}"
    header += "," + ",".join(f"field.position{k}" for k in range(6))
    lines = [header]
    order = ("gripper", *reversed(joints.names))
    for t, q in zip(joints.time, joints.values, strict=True):
        nanoseconds = str(round(1e9 * t))
        figures = [0.0, *q[::-1]]
        lines.append(",".join([nanoseconds, "0", nanoseconds, "", *order, *(f"{v:.9g}" for v in figures)]))
    (folder / "joints.csv").write_text("\n".join(lines))
    parts = [f"field.pose.{p}" for p in ("position.x", "position.y", "position.z")]
    lines = [f"%time,field.header.stamp,{','.join(parts)}"]
    for t, p in zip(target.time, target.values, strict=True):
        lines.append(",".join([str(round(1e9 * t + 3e7)), str(round(1e9 * t)), *(f"{v:.9g}" for v in p)]))
    (folder / "poses.csv").write_text("\n".join(lines))
    return ["joints.csv", "poses.csv"]


def ros2(folder, joints, target):
    lines = [",".join([*map(str, stamp(t)), "", *joints.names, *(f"{v:.9g}" for v in q)])
             for t, q in zip(joints.time, joints.values, strict=True)]  # fmt: skip
    (folder / "joints.csv").write_text("\n".join(lines))
    lines = [",".join([*map(str, stamp(t)), "tracker", *(f"{v:.9g}" for v in p), "0", "0", "0", "1"])
             for t, p in zip(target.time, target.values, strict=True)]  # fmt: skip
    (folder / "poses.csv").write_text("\n".join(lines))
    return ["joints.csv", "poses.csv"]


def plotjuggler(folder, joints, target):
    """One table of all series, with empty cells where a series has no sample."""
    header = ["__time", *(f"/joint_states/{name}/position" for name in joints.names)]
    header += [f"/tracker/point/{axis}" for axis in "xyz"]
    rows = [(t, [f"{v:.9g}" for v in q] + [""] * 3) for t, q in zip(joints.time, joints.values, strict=True)]
    empty = [""] * len(joints.names)
    rows += [(t, empty + [f"{v:.9g}" for v in p]) for t, p in zip(target.time, target.values, strict=True)]
    lines = [",".join([f"{t:.7f}", *cells]) for t, cells in sorted(rows)]
    (folder / "all.csv").write_text("\n".join([",".join(header), *lines]))
    return ["all.csv"]


def own(folder, joints, target):
    for name, stream in (("joints.csv", joints), ("poses.csv", target)):
        table = np.column_stack([stream.time, stream.values])
        np.savetxt(folder / name, table, "%.9f", ",", header=",".join(["time", *stream.names]), comments="")
    return ["joints.csv", "poses.csv"]


def bag(folder, joints, target, kind=None):
    rosbag2 = pytest.importorskip("rosbags.rosbag2")
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    types = store.types
    header, time = types["std_msgs/msg/Header"], types["builtin_interfaces/msg/Time"]
    state, posed = types["sensor_msgs/msg/JointState"], types["geometry_msgs/msg/PoseStamped"]
    pose, point, turn = (types[f"geometry_msgs/msg/{name}"] for name in ("Pose", "Point", "Quaternion"))
    with rosbag2.Writer(folder / "bag", version=9) as writer:
        a = writer.add_connection("/joint_states", state.__msgtype__, typestore=store)
        b = writer.add_connection("/tracker", posed.__msgtype__, typestore=store)
        none = np.zeros(0)
        for t, q in zip(joints.time, joints.values, strict=True):
            message = state(header(time(*stamp(t)), ""), list(joints.names), q.copy(), none, none)
            writer.write(a, round(1e9 * t), store.serialize_cdr(message, state.__msgtype__))
        for t, p in zip(target.time, target.values, strict=True):
            message = posed(header(time(*stamp(t)), "tracker"), pose(point(*p), turn(0.0, 0.0, 0.0, 1.0)))
            writer.write(b, round(1e9 * (t + OFFSET)), store.serialize_cdr(message, posed.__msgtype__))
    return ["bag"]


def bag1(folder, joints, target):
    rosbag1 = pytest.importorskip("rosbags.rosbag1")
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    types = store.types
    header, time = types["std_msgs/msg/Header"], types["builtin_interfaces/msg/Time"]
    state, pointed = types["sensor_msgs/msg/JointState"], types["geometry_msgs/msg/PointStamped"]
    point = types["geometry_msgs/msg/Point"]
    with rosbag1.Writer(folder / "all.bag") as writer:
        a = writer.add_connection("/joint_states", state.__msgtype__, typestore=store)
        b = writer.add_connection("/tracker", pointed.__msgtype__, typestore=store)
        none = np.zeros(0)
        for t, q in zip(joints.time, joints.values, strict=True):
            message = state(header(0, time(*stamp(t)), ""), list(joints.names), q.copy(), none, none)
            writer.write(a, round(1e9 * t), store.serialize_ros1(message, state.__msgtype__))
        for t, p in zip(target.time, target.values, strict=True):
            message = pointed(header(0, time(*stamp(t)), "tracker"), point(*p))
            writer.write(b, round(1e9 * t), store.serialize_ros1(message, pointed.__msgtype__))
    return ["all.bag"]


ROBOT = ("--robot", "builtin:rv_m2", "--tool", "tool0")


@pytest.mark.parametrize("write", [rostopic, ros2, plotjuggler, own, bag, bag1])
def test_every_recording_gives_the_rests_of_the_robot(recording, tmp_path, capsys, write):
    joints, target, path = recording
    files = [str(tmp_path / name) for name in write(tmp_path, joints, target)]
    assert cli.main(["import", "rosbag", *files, *ROBOT, "-o", str(tmp_path / "made")]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert f"{POSES} standstills taken" in out
    campaign = read_campaign(tmp_path / "made")
    np.testing.assert_allclose(campaign.q, path.poses, atol=1.2e-5)
    shown = float(out.split("clock shows ")[1].split(" ")[0])
    assert shown == pytest.approx(OFFSET, abs=1e-3)
    text = (tmp_path / "made" / "campaign.toml").read_text()
    assert f"# Clocks: the robot's clock shows {shown:.6f} ± " in text
    middles = target.between((path.begins + path.ends) / 2 + 1.6e9 - OFFSET)
    np.testing.assert_allclose(campaign.position[1:-1], middles[1:-1], atol=4e-4)
    assert campaign.covariates["time"][0] == 0.0


def test_a_stated_offset_is_taken(recording, tmp_path, capsys):
    joints, target, _ = recording
    files = [str(tmp_path / name) for name in own(tmp_path, joints, target)]
    (tmp_path / "m.toml").write_text(f"[recording]\noffset = {OFFSET}\n")
    mapping = ("--mapping", str(tmp_path / "m.toml"))
    assert cli.main(["import", "rosbag", *files, *ROBOT, *mapping, "-o", str(tmp_path / "made")]) == 0
    assert "clock shows 3.21 s more than the instrument's, as stated; 12 standstills taken" in capsys.readouterr().out


def test_other_units_are_declared(recording, tmp_path, capsys):
    joints, target, path = recording
    scaled = joints.scaled(np.full(5, 180 / np.pi)), target.scaled(np.full(3, 1e3))
    files = [str(tmp_path / name) for name in own(tmp_path, *scaled)]
    units = ("--angle-unit", "deg", "--length-unit", "mm")
    assert cli.main(["import", "rosbag", *files, *ROBOT, *units, "-o", str(tmp_path / "made")]) == 0
    campaign = read_campaign(tmp_path / "made")
    np.testing.assert_allclose(campaign.q, path.poses, atol=1.2e-5)
    assert np.linalg.norm(campaign.position - target.between(path.begins + 1.6e9 + 0.7 - OFFSET), axis=1).max() < 5e-4
    assert campaign.units.length == "mm"


def test_what_is_lacking_is_told(recording, tmp_path, capsys):
    joints, target, _ = recording
    own(tmp_path, joints, target)
    (tmp_path / "robot.urdf").write_text("")

    def said(*files):
        return complaint(capsys, tmp_path, "rosbag", *files, *ROBOT, robot=False)

    assert "joints.csv: no file has poses or points of the target" in said("joints.csv")
    text = (tmp_path / "joints.csv").read_text()
    (tmp_path / "less.csv").write_text(text.replace("joint_3", "joint_x", 1))
    assert "less.csv, row 1, column 'joint_3': a joint of the chain is not recorded" in said("less.csv", "poses.csv")
    (tmp_path / "clockless.csv").write_text(text.replace("time", "t", 1))
    assert "clockless.csv, row 1: has no column of time" in said("clockless.csv", "poses.csv")
    (tmp_path / "odd.bag").write_bytes(b"no bag")
    assert "odd.bag: cannot be read as a bag" in said("odd.bag")


def test_several_topics_are_not_guessed(recording, tmp_path, capsys):
    rosbag2 = pytest.importorskip("rosbags.rosbag2")
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    with rosbag2.Writer(tmp_path / "bag", version=9) as writer:
        for topic in ("/left/joint_states", "/right/joint_states"):
            writer.add_connection(topic, "sensor_msgs/msg/JointState", typestore=store)
    said = complaint(capsys, tmp_path, "rosbag", "bag", *ROBOT, robot=False)
    assert "found '/left/joint_states', '/right/joint_states', expected [recording] joints in the mapping" in said
