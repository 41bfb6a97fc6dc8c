"""The blind trial's reality agrees with Pinocchio where nothing is wrong, and is physics of its own elsewhere."""

import ast
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("mujoco", reason='the blind trial needs "thermal-robot[blind]"')

import thermal_robot
from thermal_robot.blind.cases import Case, RobotChoice
from thermal_robot.blind.plan import ROBOTS, robots
from thermal_robot.blind.reality import FAULTS, UNLISTED, World, make
from thermal_robot.blind.reality.fault import Fault
from thermal_robot.blind.reality.rigid import from_vector, rpy_matrix
from thermal_robot.blind.reality.setting import draw_setting
from thermal_robot.blind.reality.sizes import Gauge, place, sized
from thermal_robot.campaign import read_campaign
from thermal_robot.effects import library
from thermal_robot.kinematics import gravity_torques, tool_poses
from thermal_robot.robot import load_robot

REALITY = Path(thermal_robot.__file__).parent / "blind" / "reality"
NAMED = {name: (urdf, tool) for name, urdf, tool in ROBOTS}


def drawn(world, samples, seed):
    rng = np.random.default_rng(seed)
    lower, upper = np.maximum(world.lower, -2.8), np.minimum(world.upper, 2.8)
    return rng.uniform(lower, upper, (samples, world.n))


@pytest.fixture(scope="module")
def ur10():
    return World(load_robot(*NAMED["ur10"]).urdf, "tool0")


@pytest.fixture(scope="module")
def setting(ur10):
    return draw_setting(ur10, 90, np.random.default_rng(3), sensor="links", sessions=True)


@pytest.fixture(scope="module")
def gauge(setting):
    return Gauge(setting, np.arange(setting.samples), np.array([0.02, -0.01, 0.1]), True, True)


@pytest.mark.parametrize("path", sorted(REALITY.glob("*.py")), ids=lambda path: path.name)
def test_reality_imports_neither_pinocchio_nor_what_it_judges(path):
    allowed = ("thermal_robot.blind.reality", "thermal_robot.blind.cases", "thermal_robot.errors")
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
        names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
        for name in names:
            assert not name.startswith(("pinocchio", "yourdfpy")), name
            assert not name.startswith("thermal_robot") or name.startswith(allowed), name


@pytest.mark.parametrize("name", NAMED)
def test_a_sound_robot_stands_where_pinocchio_has_it(name):
    urdf, tool = NAMED[name]
    robot = load_robot(urdf, tool)
    world = World(robot.urdf, tool)
    q = drawn(world, 60, 1)
    assert world.names == robot.joint_names
    poses, torque = world.poses(q, np.zeros(60), world.sound(60))
    np.testing.assert_allclose(poses, tool_poses(robot, q), atol=1e-9)
    np.testing.assert_allclose(torque, gravity_torques(robot, q), atol=1e-8)


def test_hinges_of_the_beams_move_nothing_while_they_are_stiff(ur10):
    q = drawn(ur10, 30, 2)
    body = ur10.sound(30)
    body.bow[:] = 1e-300  # enough to build the beams, too little to bend them
    np.testing.assert_allclose(
        ur10.poses(q, np.zeros(30), body)[0], ur10.poses(q, np.zeros(30), ur10.sound(30))[0], atol=1e-12
    )


def test_stretching_a_sound_robot_leaves_no_trace_in_the_next_run(ur10):
    q = drawn(ur10, 10, 4)
    before = ur10.poses(q, np.zeros(10), ur10.sound(10))[0]
    body = ur10.sound(10)
    body.growth[:] = 1e-3
    body.placements = np.full((10, len(ur10.chain), 6), 1e-3)
    ur10.poses(q, np.full(10, 3.0), body)
    np.testing.assert_array_equal(ur10.poses(q, np.zeros(10), ur10.sound(10))[0], before)


def test_a_spring_yields_by_its_torque(ur10):
    """A joint on a spring stands where spring and gravity balance: q = q_command − c τ(q)."""
    q, load = drawn(ur10, 20, 5), np.full(20, 4.0)
    body = ur10.sound(20)
    body.springs[1] = 2e-5
    soft, torque = ur10.poses(q, load, body)
    yielded = q.copy()
    yielded[:, 1] -= 2e-5 * torque[:, 1]
    stiff, same = ur10.poses(yielded, load, ur10.sound(20))
    np.testing.assert_allclose(soft, stiff, atol=1e-12)
    np.testing.assert_allclose(torque, same, atol=1e-9)
    assert np.abs(torque[:, 1]).max() > 50.0


def test_a_cantilever_bends_as_the_textbook_says():
    """F L³/3EI, but for what lumping into three hinges leaves out: the midpoint rule, 1/4 of (1/3)²."""
    length, weight, stiffness = 0.8, 5.0, 4e3
    urdf = f"""<robot name="beam"><link name="wall"/><link name="arm"/><link name="end"/>
      <joint name="turn" type="revolute"><parent link="wall"/><child link="arm"/><axis xyz="0 0 1"/>
        <limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
      <joint name="tip" type="fixed"><parent link="arm"/><child link="end"/><origin xyz="{length} 0 0"/></joint>
      </robot>"""
    world = World(urdf, "end", payload_com=(0.0, 0.0, 0.0))
    body = world.sound(1)
    body.beams[:] = 1.0 / stiffness
    pose, _ = world.poses(np.zeros((1, 1)), np.array([weight]), body)
    lumped = 1.0 - 1.0 / (4 * 3**2)  # Σ (L/3) x_k² over three midpoints against ∫ x² dx
    expected = weight * 9.81 * length**3 / (3 * stiffness) * lumped
    assert -pose[0, 2, 3] == pytest.approx(expected, rel=1e-4)


def test_links_grow_along_themselves(ur10, setting, gauge):
    """Tool displacement of growth equals the sum of segment vectors times their strain."""
    values = np.full((len(ur10.segments), 1), 12e-6)
    moved = gauge.place([(FAULTS["thermal_elongation"], values)]) - gauge.sound
    expected = np.zeros_like(moved)
    for s, k in enumerate(ur10.segments):
        chain = ur10.chain[: k + 1]
        start = np.tile(np.eye(4), (setting.samples, 1, 1))
        movable = 0
        for joint in chain[:-1]:
            step = from_vector(np.zeros((setting.samples, 6)))
            step[:, :3, :3], step[:, :3, 3] = rpy_matrix(joint.rpy), joint.xyz
            start = start @ step
            if joint.movable:
                turn = np.zeros((setting.samples, 6))
                turn[:, 3:] = joint.axis * setting.q[:, movable, None]
                start = start @ from_vector(turn)
                movable += 1
        strain = 12e-6 * (setting.links[:, s] - 20.0)
        expected += (start[:, :3, :3] @ chain[-1].xyz) * strain[:, None]
    np.testing.assert_allclose(moved, expected, atol=1e-10)
    assert np.abs(moved).max() > 50e-6


@pytest.mark.parametrize("name", [*FAULTS, *UNLISTED])
def test_every_fault_moves_the_target_as_far_as_it_is_told(name, ur10):
    fault: Fault = {**FAULTS, **UNLISTED}[name]
    rng = np.random.default_rng(7)
    day = draw_setting(
        ur10,
        80,
        rng,
        moving="moving" in fault.wants,
        repeats=4 if "repeats" in fault.wants else 1,
        sensor="links",
        sessions="sessions" in fault.wants,
    )
    day.extra.update(humidity=45.0 + np.arange(80) / 8, motor_temperature=25.0 + np.arange(80) / 3.0)
    unknown = not {"base_known", "tool_known"} & set(fault.wants)
    gauge = Gauge(day, np.arange(80), np.array([0.02, 0.0, 0.1]), unknown, unknown)
    values = sized(gauge, fault, fault.draw(day, rng), 1e-4, lambda moved: gauge.rms(gauge.left(moved)))
    assert gauge.rms(gauge.left(gauge.moved(fault, values))) == pytest.approx(1e-4, rel=0.05)
    # twice the size, twice the displacement: faults are small (an encoder's steps are not: they are chance)
    if name != "encoder_resolution":
        one, two = gauge.moved(fault, values), gauge.moved(fault, fault.scaled(values, 2.0))
        np.testing.assert_allclose(two, 2.0 * one, atol=0.02 * np.abs(two).max())
    np.testing.assert_allclose(gauge.moved(fault, fault.scaled(values, 0.0)), 0.0, atol=1e-14)


def test_lost_motion_hangs_where_gravity_holds_the_joint(setting, gauge):
    values = np.zeros((6, 3))
    load = setting.torque[:, 1]
    friction = 0.4 * np.abs(load).max()
    values[1] = 1e-3, friction, 0.05
    body = setting.world.sound(setting.samples)
    FAULTS["backlash"].act(body, setting, values)
    heavy, light = np.abs(load) > 1.3 * friction, np.abs(load) < 0.7 * friction
    assert heavy.mean() > 0.2
    assert light.mean() > 0.2
    np.testing.assert_allclose(body.joints[heavy, 1], -1e-3 * np.sign(load[heavy]), rtol=1e-4)
    np.testing.assert_allclose(body.joints[light, 1], -1e-3 * setting.approach[light, 1], rtol=1e-4)


def test_no_single_other_effect_does_what_is_measured_beyond_it(gauge, setting):
    """A joint's offset is geometry: nothing of it is beyond; a gain leaves little beyond harmonics, drift a lot."""
    offset, drift = np.zeros((6, 1)), np.zeros((1, 7))
    offset[2], drift[0] = 1e-3, (1e-4, 0, 0, 1e-4, 0, 0, 2400.0)
    moved = gauge.moved(FAULTS["joint_offset"], offset)
    assert gauge.beyond(FAULTS["joint_offset"], moved, ["geometric"])["geometric"] < 2e-3 * gauge.rms(moved)
    moved = gauge.moved(FAULTS["drift"], drift)
    beyond = gauge.beyond(FAULTS["drift"], moved, ["geometric", "backlash"])
    assert min(beyond.values()) > 0.5 * gauge.rms(gauge.left(moved))


@pytest.fixture(scope="module")
def choice():
    return robots([("ur10", *NAMED["ur10"])])[0]


def case(choice: RobotChoice, **asked):
    return Case("c0001", 42, asked.pop("kind", "single"), choice, **asked)


def test_a_campaign_can_be_read_and_holds_what_was_asked(choice, tmp_path):
    answers = make(case(choice, effects=("drift", "backlash"), kind="pair"), tmp_path)
    campaign = read_campaign(tmp_path)
    assert campaign.samples == answers["samples"]
    assert set(answers["truth"]["effects"]) == {"drift", "backlash"}
    for part in answers["truth"]["parts"].values():
        assert 2.0 <= part["ratio"] <= 6.0
    assert np.shape(answers["fresh_position"]) == (100, 3)
    text = "".join(path.read_text() for path in sorted(tmp_path.iterdir()))
    assert "drift" not in text
    assert "backlash" not in text


def test_the_same_seed_makes_the_same_files(choice, tmp_path):
    first, second = (make(case(choice, effects=("joint_gain",)), tmp_path / name) for name in "ab")
    assert json.dumps(first) == json.dumps(second)
    for path in sorted((tmp_path / "a").iterdir()):
        assert path.read_bytes() == (tmp_path / "b" / path.name).read_bytes()
    other = make(replace(case(choice, effects=("joint_gain",)), seed=43), tmp_path / "c")
    assert json.dumps(other) != json.dumps(first)


def test_without_a_fault_only_noise_is_left(choice, tmp_path):
    answers = make(case(choice, kind="null"), tmp_path)
    left = np.array(answers["fresh_position"]) - np.array(answers["fresh_before"])
    per_axis = np.sqrt((left**2).mean())
    # nine parameters of the frames from some hundred rows: sqrt(9 / 3N)
    assert per_axis < 3.0 * np.sqrt(9.0 / (3 * answers["samples"])) * answers["noise"]
    measured = np.asarray(read_campaign(tmp_path).position)
    assert np.isfinite(measured).all()


def test_a_hidden_column_is_in_neither_table(choice, tmp_path):
    answers = make(case(choice, kind="hidden", effects=("thermal_elongation",), hidden=("temperature",)), tmp_path)
    for name in ("measurements.csv", "fresh.csv"):
        head = (tmp_path / name).read_text().splitlines()[0]
        assert "temperature" not in [column.split(".")[0] for column in head.split(",")]
        assert "time" in head
    assert answers["truth"]["needs"] == ["temperature"]


def test_the_background_is_there_and_far_below_the_noise(choice, tmp_path):
    asked = {"ratio": (0.7, 1.5), "samples": (30, 60), "background": 0.15, "heavy": True}
    truth = make(case(choice, kind="hard", effects=("geometric",), **asked), tmp_path)["truth"]
    quiet = {name: part["ratio"] for name, part in truth["parts"].items() if not part["main"]}
    assert {"joint_offset", "drift", "backlash", "transmission_error"} <= set(quiet)
    assert all(0.1 < ratio < 0.2 for ratio in quiet.values())
    assert 0.7 <= truth["parts"]["geometric"]["ratio"] <= 1.5


def test_placed_in_the_instruments_frame_the_scale_is_about_its_origin(setting, ur10):
    pose = from_vector(np.array([[1.0, 2.0, 0.5, 0.2, -0.3, 1.0]]))[0]
    scaled = place(setting, [(FAULTS["instrument_scale"], np.array([[1e-3]]))], np.zeros(3), pose)[0]
    np.testing.assert_allclose(scaled, 1.001 * place(setting, [], np.zeros(3), pose)[0], rtol=1e-12)


def test_what_the_library_knows_the_reality_can_make():
    assert set(library()) <= set(FAULTS)
    assert not set(library()) & set(UNLISTED)
    assert len(UNLISTED) >= 6
