"""Logs of other programs: written as they write them, imported by the command, and read back as they were."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from motion.arms import JOINTS, log, tables

from thermal_robot import cli
from thermal_robot.motion import find_faults, read_motion

ROBOT = ("--robot", "builtin:rv_m2", "--tool", "tool0")


def imported(capsys, folder: Path, format: str, *said):
    status = cli.main(["import", format, *map(str, said), "-o", str(folder / "made")])
    out, err = capsys.readouterr()
    assert status == 0, err
    return read_motion(folder / "made"), out


def refusal(capsys, folder: Path, format: str, *said):
    assert cli.main(["import", format, *map(str, said), "-o", str(folder / "made")]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    assert not (folder / "made").exists()
    return err


def sampled():
    """State and command of two motions, both at the stamps of the command."""
    state, command = tables(2)
    columns = [f"q.{joint}" for joint in JOINTS]
    for label in command.motion.unique():
        rows, own = command.motion == label, state[state.motion == label]
        for name in columns:
            command.loc[rows, name] = np.interp(command.time[rows], own.time, own[name])
    return command


def same(found, frame, quantity, channel, atol=1e-6):
    for motion, (_, rows) in zip(found.motions, frame.groupby("motion"), strict=True):
        held = getattr(motion, channel)
        np.testing.assert_allclose(held.values, rows[[f"{quantity}.{joint}" for joint in found.joints]], atol=atol)
        np.testing.assert_allclose(held.time, rows.time - rows.time.iloc[0], atol=1e-5)


def lerobot(folder, frame, names):
    pytest.importorskip("pyarrow", reason="Parquet files need pyarrow")
    data = folder / "set" / "data" / "chunk-000"
    data.mkdir(parents=True)
    (folder / "set" / "meta").mkdir()
    features = {"action": {"names": names}, "observation.state": {"names": names}}
    (folder / "set" / "meta" / "info.json").write_text(json.dumps({"fps": 50, "features": features}))
    for k, (_, rows) in enumerate(frame.groupby("motion")):
        lists = {
            feature: list(np.rad2deg(rows[[f"{q}.{joint}" for joint in JOINTS]].to_numpy()).astype(np.float32))
            for feature, q in (("action", "cmd"), ("observation.state", "q"))
        }
        told = {**lists, "timestamp": rows.time.to_numpy().astype(np.float32), "episode_index": k}
        pd.DataFrame(told).to_parquet(data / f"episode_{k:06d}.parquet")
    return folder / "set"


def test_records_of_bam(tmp_path, capsys):
    frame, files = sampled(), []
    for label, rows in frame.groupby("motion"):
        entries = [
            {"timestamp": t, "position": q, "goal_position": u, "torque_enable": k != 5, "input_volts": 12.0}
            for k, (t, q, u) in enumerate(zip(rows.time, rows["q.joint_1"], rows["cmd.joint_1"], strict=True))
        ]
        files.append(tmp_path / f"{label}.json")
        files[-1].write_text(json.dumps({"trajectory": "sine", "kp": 8, "entries": entries}))
    found, out = imported(capsys, tmp_path, "bam", *files, *ROBOT)
    assert "kp is a register" in out
    assert [(motion.name, motion.kind) for motion in found.motions] == [("m0", "sine"), ("m1", "sine")]
    for motion, (_, rows) in zip(found.motions, frame.groupby("motion"), strict=True):
        j = found.joints.index("joint_1")
        np.testing.assert_allclose(motion.position.of(j)[1], rows["q.joint_1"], atol=1e-6)
        assert len(motion.command.of(j)[0]) == len(rows) - 1
        assert motion.volts.of(j)[1].max() == 12.0
    files[0].write_text("{}")
    assert "m0.json: cannot be read" in refusal(capsys, tmp_path / "again", "bam", *files, *ROBOT)


@pytest.mark.parametrize(
    "names", [[f"{joint}.pos" for joint in JOINTS], {"motors": [f"main_{joint}" for joint in JOINTS]}]
)
def test_a_dataset_of_lerobot(tmp_path, capsys, names):
    frame = sampled()
    folder = lerobot(tmp_path, frame, names)
    assert "lerobot states no unit of angles" in refusal(capsys, tmp_path, "lerobot", folder, *ROBOT)
    found, out = imported(capsys, tmp_path, "lerobot", folder, *ROBOT, "--angle-unit", "deg")
    assert [motion.name for motion in found.motions] == ["episode_0", "episode_1"]
    same(found, frame, "cmd", "command")
    same(found, frame, "q", "position")
    assert "stamps are counted frames, not measured" in out


def sage(folder, scale):
    state, command = tables(2)
    for label in state.motion.unique():
        own = folder / "logs" / label
        own.mkdir(parents=True)
        (own / "joint_list.txt").write_text("\n".join(JOINTS))
        (own / "event.csv").write_text(f"type,timestamp,event\nEVENT,0,MOTION_START\nEVENT,{15.0 * scale},DISABLE\n")
        for name, frame, kinds in (
            ("control", command, {"positions": "cmd"}),
            ("state_motor", state, {"positions": "q", "velocities": "qd"}),
        ):
            rows = frame[frame.motion == label]
            lists = {
                k: [json.dumps(r) for r in rows[[f"{q}.{j}" for j in JOINTS]].to_numpy().tolist()]
                for k, q in kinds.items()
            }
            table = pd.DataFrame({"type": name.upper(), "timestamp": rows.time * scale, **lists})
            table.to_csv(own / f"{name}.csv", index=False)
    return folder / "logs"


@pytest.mark.parametrize("scale", [1.0, 1e6])
def test_pairs_of_sage_in_seconds_and_microseconds(tmp_path, capsys, scale):
    found, out = imported(capsys, tmp_path, "sage", sage(tmp_path, scale), *ROBOT)
    state, command = (frame[frame.time <= 15.0] for frame in tables(2))
    same(found, command, "cmd", "command")
    same(found, state, "qd", "velocity")
    assert "2 motions of 5 joints" in out


MJCF = """<mujoco model="two"><option timestep="0.002" gravity="0 0 -9.81"/><worldbody>
<body name="upper" pos="0.1 0 0.3" euler="10 0 20">
 <joint name="lift" axis="0 1 0" range="-120 120" pos="0 0 0.02" ref="20" damping="0.3"/>
 <geom type="capsule" size="0.02" fromto="0 0 0 0.3 0 0.05" mass="0.4"/>
 <body name="lower" pos="0.3 0 0.05"><joint name="bend" axis="0 1 0.2" range="-150 150" damping="0.2"/>
  <joint name="slide" type="slide" axis="1 0 0" range="-0.1 0.2" ref="0.02" damping="5"/>
  <geom type="capsule" size="0.02" fromto="0 0 0 0.25 0 0" mass="0.2"/>
  <site name="tip" pos="0.25 0 0" euler="0 30 0"/></body></body></worldbody><actuator>
<position name="a" joint="bend" kp="20" kv="0.8" gear="1"/>
<position name="b" joint="lift" kp="30" kv="1" gear="2" forcerange="-8 8"/>
<position name="c" joint="slide" kp="400" kv="20"/></actuator></mujoco>"""


@pytest.fixture
def simulated(tmp_path):
    """MuJoCo's own run of an arm, its model and its arrays."""
    mujoco = pytest.importorskip("mujoco", reason="the arm is simulated by MuJoCo")
    (tmp_path / "two.xml").write_text(MJCF)
    model = mujoco.MjModel.from_xml_string(MJCF)
    data = mujoco.MjData(model)
    kept = {name: [] for name in ("time", "qpos", "qvel", "ctrl", "qfrc_actuator")}
    for k in range(5000):
        t = k * model.opt.timestep
        data.ctrl[:] = 0.5 * np.sin(2.1 * t), 2.0 * (0.3 + 0.4 * np.sin(1.3 * t)), 0.03 * np.sin(3.0 * t)
        if k % 5 == 0:
            for name, held in kept.items():
                held.append(np.copy(getattr(data, name)))
        mujoco.mj_step(model, data)
    return model, {name: np.array(held) for name, held in kept.items()}


def test_what_mujoco_simulated(tmp_path, capsys, simulated):
    _, arrays = simulated
    np.savez(tmp_path / "run.npz", **arrays)
    found, _ = imported(capsys, tmp_path, "mujoco", tmp_path / "run.npz", "--robot", tmp_path / "two.xml")
    assert found.joints == ("lift", "bend", "slide")
    motion = found.motions[0]
    np.testing.assert_allclose(motion.position.values, arrays["qpos"], atol=1e-12)
    np.testing.assert_allclose(motion.command.values, arrays["ctrl"][:, [1, 0, 2]] / [2.0, 1.0, 1.0], atol=1e-12)
    np.testing.assert_allclose(motion.torque.values, arrays["qfrc_actuator"], atol=1e-12)
    servo = found.servos["lift"]
    assert (servo.kp, servo.kd, servo.limit) == (120.0, 4.0, 16.0)
    assert find_faults(found).faults == ()
    table = {f"{name}_{k}": arrays[name][:, k] for name in ("qpos", "ctrl") for k in range(3)}
    pd.DataFrame({"time": arrays["time"], **table}).to_csv(tmp_path / "run.csv", index=False)
    again, _ = imported(capsys, tmp_path, "mujoco", tmp_path / "run.csv", "--robot", tmp_path / "two.xml")
    np.testing.assert_allclose(again.motions[0].position.values, motion.position.values, atol=1e-12)


def test_the_robot_of_an_mjcf_is_mujocos_own(tmp_path, simulated):
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo says where its bodies are")
    import pinocchio

    from thermal_robot.motion.mjcf import opened, urdf_of_mjcf
    from thermal_robot.robot import load_robot

    model, _ = simulated
    data = mujoco.MjData(model)
    robot = load_robot(urdf_of_mjcf(opened(tmp_path / "two.xml"), tmp_path / "two.xml"), "tip")
    assert robot.joint_names == ("lift", "bend", "slide")
    np.testing.assert_allclose(robot.lower, model.jnt_range[:, 0])
    draw = np.random.default_rng(0)
    for q in draw.uniform(-1.0, 1.0, (5, 3)) * [1.0, 1.0, 0.05]:
        data.qpos[:], data.qvel[:] = q, 0.0
        mujoco.mj_forward(model, data)
        pose = robot.forward(q)
        np.testing.assert_allclose(pose[:3, 3], data.site("tip").xpos, atol=1e-9)
        np.testing.assert_allclose(pose[:3, :3], data.site("tip").xmat.reshape(3, 3), atol=1e-9)
        data.qacc[:] = acceleration = draw.normal(size=3)
        mujoco.mj_inverse(model, data)
        own = pinocchio.rnea(robot.model, robot.model.createData(), q, np.zeros(3), acceleration)
        np.testing.assert_allclose(own, data.qfrc_inverse, atol=1e-9)


def bag(folder, how):
    rosbag2 = pytest.importorskip("rosbags.rosbag2")
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    kinds = ("sensor_msgs/msg/JointState", "std_msgs/msg/Header", "builtin_interfaces/msg/Time",
             "std_msgs/msg/Float64MultiArray", "std_msgs/msg/MultiArrayLayout", "trajectory_msgs/msg/JointTrajectory",
             "trajectory_msgs/msg/JointTrajectoryPoint", "builtin_interfaces/msg/Duration")  # fmt: skip
    state, header, time, array, layout, trajectory, point, duration = (store.types[name] for name in kinds)
    readings, commands = tables(1)
    none = np.zeros(0)

    def stamp(t):
        return header(time(int(t), round(1e9 * (t % 1.0))), "")

    with rosbag2.Writer(folder / "bag", version=9) as writer:
        own = writer.add_connection("/joint_states", state.__msgtype__, typestore=store)
        kind = {"array": array, "trajectory": trajectory, "state": state}[how]
        asked = writer.add_connection("/command", kind.__msgtype__, typestore=store)
        for t, q, qd in zip(readings.time, readings[[f"q.{j}" for j in JOINTS]].to_numpy(),
                            readings[[f"qd.{j}" for j in JOINTS]].to_numpy(), strict=True):  # fmt: skip
            message = state(stamp(10.0 + t), list(JOINTS[::-1]), q[::-1].copy(), qd[::-1].copy(), none)
            writer.write(own, round(1e9 * (10.0 + t)), store.serialize_cdr(message, state.__msgtype__))
        for t, u in zip(commands.time, commands[[f"cmd.{j}" for j in JOINTS]].to_numpy().copy("C"), strict=True):
            points = [point(u, none, none, none, duration(0, 0)), point(u + 1.0, none, none, none, duration(1, 0))]
            message = {
                "array": lambda u=u: array(layout([], 0), u),
                "state": lambda t=t, u=u: state(stamp(10.0 + t), list(JOINTS), u, none, none),
                "trajectory": lambda t=t, points=points: trajectory(stamp(10.0 + t), list(JOINTS), points),
            }[how]()
            writer.write(asked, round(1e9 * (10.0 + t)), store.serialize_cdr(message, kind.__msgtype__))
    return folder / "bag"


@pytest.mark.parametrize("how", ["array", "trajectory", "state"])
def test_joint_states_and_their_commands_in_a_bag(tmp_path, capsys, how):
    found, out = imported(capsys, tmp_path, "motionbag", bag(tmp_path, how), *ROBOT)
    plain = log(*tables(1)).motions[0]
    np.testing.assert_allclose(found.motions[0].position.values, plain.position.values, atol=1e-12)
    np.testing.assert_allclose(found.motions[0].velocity.time, plain.velocity.time, atol=1e-6)
    count = len(plain.command.time)
    np.testing.assert_allclose(found.motions[0].command.values[:count], plain.command.values, atol=1e-12)
    assert "efforts are left out" in out


def test_a_mapping_says_what_the_files_do_not(tmp_path, capsys):
    folder = sage(tmp_path, 1.0)
    (tmp_path / "m.toml").write_text(
        "[servo.joint_2]\nkp = 40.0\n[payload]\nmass = 1.0\n[motion]\nangle_unit = 'rad'\n"
    )
    found, _ = imported(capsys, tmp_path, "sage", folder, *ROBOT, "--mapping", tmp_path / "m.toml")
    assert found.servos["joint_2"].kp == 40.0
    assert found.payload[0] == 1.0
    (tmp_path / "made" / "motion.toml").write_text("[motion]\n")
    assert cli.main(["import", "sage", str(folder), *ROBOT, "-o", str(tmp_path / "made")]) == 2
    assert "was not imported" in capsys.readouterr().err


REFUSED = [
    ("sage", "no folder with control.csv"),
    ("lerobot", "has no meta/info.json"),
    ("mujoco", "--robot MODEL.xml"),
]


@pytest.mark.parametrize(("format", "said"), REFUSED)
def test_files_of_another_kind_are_refused(tmp_path, capsys, format, said):
    assert said in refusal(capsys, tmp_path, format, tmp_path, *ROBOT)


def test_check_describes_a_log_and_names_its_faults(tmp_path, capsys):
    from motion.arms import put

    state, command = tables(3)
    put(tmp_path, state.assign(**{"q.joint_3": -state["q.joint_3"], "qd.joint_3": -state["qd.joint_3"]}), command)
    for named in (tmp_path, tmp_path / "motion.toml"):
        assert cli.main(["check", str(named)]) == 0
        said = capsys.readouterr().out
        assert "3 of 20 to 20 s, 60 s in all" in said
        assert "q.joint_3 moves against cmd.joint_3" in said
        assert "not recorded   torque, current, volts, temperature" in said
