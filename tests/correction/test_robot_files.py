"""The calibrated robot and its files: every reader sees the corrected model in them, and says what is in them."""

import io
import json
from dataclasses import replace

import mujoco
import numpy as np
import pandas as pd
import pytest
import ur_arm
from arms import arms
from conftest import load_arm
from floor import NOISE, real_robot
from helpers import some
from hypothesis import given
from lxml import etree
from readers import READERS, displaced, held, model_of
from scipy.spatial.transform import Rotation
from simulate import simulate

from thermal_robot import CampaignError, diagnose
from thermal_robot.campaign import Units
from thermal_robot.campaign.ur_kinematics import with_kinematics
from thermal_robot.correction import (
    calibrated,
    calibrated_urdf,
    dh_table,
    joint_parameters,
    mjcf_of_urdf,
    ur_kinematics,
)
from thermal_robot.effects import BaseFrame, JointGain, JointOffset, ThermalElongation, ToolFrame
from thermal_robot.kinematics import Displacement, exp6, tool_poses
from thermal_robot.observations import Frames
from thermal_robot.robot import load_robot

ROWS = 12
CONVENTIONS = ("standard", "modified")


def sound(robot):
    """The same robot with nothing displaced."""
    nominal = robot.robot
    return replace(robot, displacement=Displacement(np.zeros(nominal.n), np.zeros((len(nominal.segments), 6))))


def test_placements_are_the_chain_at_zero(arm):
    robot = displaced(arm, seed=7)
    pose = np.eye(4)
    for placement in robot.placements:
        pose = pose @ placement
    # a joint that mimics another stands at its offset while that one is at zero
    if not arm.chain.coupling.offset.any():
        np.testing.assert_allclose(pose, tool_poses(arm, np.zeros(arm.n), robot.displacement)[0], atol=1e-14)
    assert set(robot.origins) == {segment.name for segment in arm.segments}


def test_base_and_tool_are_where_the_model_puts_them(rv_m2):
    base, tool = exp6([1.0, 2.0, 3.0, 0.3, -0.2, 0.1]), exp6([0.0, 0.1, 0.05, 0.2, 0.0, 0.4])
    effects = [(BaseFrame(), np.arange(1, 7) * 1e-3), (ToolFrame(turns=True), np.arange(6, 0, -1) * 1e-3)]
    robot = calibrated(model_of(rv_m2, *effects, frames=Frames(base, tool), base_known=True, tool_known=True))
    np.testing.assert_allclose(robot.base, base @ exp6(np.arange(1, 7) * 1e-3), atol=1e-15)
    np.testing.assert_allclose(robot.target, exp6(np.arange(6, 0, -1) * 1e-3) @ tool, atol=1e-15)
    assert robot.origins == {}
    assert list(robot.links) == ["tool0_target"]
    assert calibrated(model_of(rv_m2)).links == {}


def test_notes_list_what_is_in_it_and_what_is_not(rv_m2):
    model = model_of(rv_m2, (JointOffset(), [1e-3, 0, 0, 0, 0]), (JointGain(), [0, 2e-3, 0, 0, 0]))
    notes = calibrated(model).notes("urdf")
    at = [notes.index(line) for line in notes if line.endswith(":")]
    assert [notes[k].split(",")[0] for k in at] == ["Written here:", "Not written"]
    assert notes[at[0] + 1] == "  joint_offset: zero offset, joint_1 = 0.001 rad"
    assert "  joint_gain: gain error, joint_2 = 0.002" in notes[at[1] :]
    assert "°C" not in notes[0]
    growing = model_of(rv_m2, (ThermalElongation(common=True), [2e-5]), needs=("temperature",))
    assert "its lengths at 24 °C" in calibrated(growing, temperature=24.0).notes("urdf")[0]
    assert calibrated(growing).temperature == 20.0
    with pytest.raises(CampaignError, match="how the robot grows"):
        calibrated(model, temperature=24.0)


@pytest.mark.parametrize("reader", READERS)
def test_every_reader_of_the_urdf_sees_the_displaced_robot(arm, reader, configurations):
    robot, q = displaced(arm, seed=1), configurations(arm, ROWS, seed=2)
    expected = tool_poses(arm, q, robot.displacement) @ robot.target
    text = calibrated_urdf(robot)
    seen = READERS[reader](text, arm.root_frame, f"{arm.tool_frame}_target", held(arm, q))
    np.testing.assert_allclose(list(seen), expected, rtol=0, atol=1e-9)


def without_origins(text):
    """Its XML, and that of each joint by name, without the joints' origins."""
    root = etree.fromstring(text.encode(), etree.XMLParser(recover=True))
    joints = {joint.get("name"): etree.tostring(joint) for joint in root.findall("joint")}
    for origin in root.findall("joint/origin"):
        origin.getparent().remove(origin)
    return etree.tostring(root, method="c14n", with_comments=True), joints


def test_a_mimicking_joint_follows_and_all_else_stands_as_it_stood(arm, configurations):
    robot, q = displaced(arm, seed=3, target=False), configurations(arm, ROWS, seed=4)
    text = calibrated_urdf(robot)
    again = load_robot(text, arm.tool_frame, root_frame=arm.root_frame)
    assert again.joint_names == arm.joint_names
    np.testing.assert_array_equal(again.lower, arm.lower)
    np.testing.assert_allclose(tool_poses(again, q), tool_poses(arm, q, robot.displacement), rtol=0, atol=1e-12)
    (after, joints), (before, were) = without_origins(text), without_origins(arm.urdf)
    assert after == before
    assert {name for name, own in joints.items() if own != were[name]} == {segment.name for segment in arm.segments}
    as_it_is = calibrated_urdf(sound(robot))
    assert without_origins(as_it_is) == (before, were)
    assert "Written here: nothing" in as_it_is


@pytest.mark.parametrize("frame", ["base", None])
def test_a_turn_of_a_quarter_in_pitch_and_a_zero_of_any_size(awkward_urdf, frame, configurations):
    text = awkward_urdf.replace('rpy="0.5 0.6 0.7"', f'rpy="0.5 {np.pi / 2!r} 0.7"')
    robot = load_robot(text, "tip", root_frame=frame)
    model = model_of(robot, (JointOffset(), np.linspace(-2.0, 2.0, robot.n)))
    q = configurations(robot, ROWS)
    again = load_robot(calibrated_urdf(calibrated(model)), "tip", root_frame=frame)
    np.testing.assert_allclose(tool_poses(again, q), tool_poses(robot, q + np.linspace(-2, 2, robot.n)), atol=1e-12)


@pytest.mark.parametrize("kind", some(["geometric", "joint_offset", "thermal_elongation"], 3))
def test_the_written_robot_predicts_what_its_model_does(rv_m2, kind):
    """Of a campaign of one such effect the URDF alone, at one temperature, is the corrected model."""
    campaign, _, (fresh, _) = simulate(rv_m2, [kind], seed=1, fresh=60)
    model = diagnose(campaign, only=[kind]).model
    warm = replace(fresh, covariates={**fresh.covariates, "temperature": np.full(60, 31.0)})
    robot = calibrated(model, temperature=31.0 if model.needs else None)
    assert robot.kept == ()
    poses = robot.base @ tool_poses(load_robot(calibrated_urdf(robot), "tool0_target"), warm.q)
    predicted = model.prediction(warm)[0]
    np.testing.assert_allclose(poses[:, :3, 3], predicted, rtol=0, atol=1e-9)
    plain = model.frames.base @ tool_poses(rv_m2, warm.q) @ model.frames.tool
    assert np.abs(plain[:, :3, 3] - predicted).max() > 1e-5


WARM = np.where(np.arange(200) < 120, np.random.default_rng(0).uniform(16.0, 34.0, 200), 29.0)
FLOOR = {
    "joint_offset": {"zeros": [0.0, 1.5e-3, -1e-3, 8e-4, 0.0]},
    "geometric": {"misplaced": 3e-4},
    "thermal_elongation": {"temperature": WARM},
}


@pytest.mark.parametrize("kind", some(FLOOR, 3))
def test_the_written_robot_is_the_one_on_the_floor(rv_m2, kind):
    """In poses that nothing was fitted to, at one temperature: as near to the robot as its model is."""
    whole = real_robot(rv_m2, 3, samples=200, **FLOOR[kind])
    model = diagnose(whole.take(np.arange(120)), only=FLOOR).model
    assert [effect.name for effect, _ in model.effects] == [kind]
    fresh = whole.take(np.arange(120, 200))
    robot = calibrated(model, temperature=29.0 if model.needs else None)
    poses = robot.base @ tool_poses(load_robot(calibrated_urdf(robot), "tool0_target"), fresh.q)
    plain = model.frames.base @ tool_poses(rv_m2, fresh.q) @ model.frames.tool
    left, before = (np.sqrt(((p[:, :3, 3] - fresh.position) ** 2).mean()) for p in (poses, plain))
    np.testing.assert_allclose(poses[:, :3, 3], model.prediction(fresh)[0], rtol=0, atol=1e-9)
    assert before > 1.8 * NOISE
    assert left < 1.25 * NOISE


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("prefix", ["", "r_"])
def test_a_kinematics_yaml_leads_where_the_model_does(tmp_path, seed, prefix):
    rng = np.random.default_rng(seed)
    robot = load_robot(ur_arm.urdf(prefix=prefix), f"{prefix}tool0")
    moved, q = displaced(robot, rng, 1e-3), rng.uniform(-3, 3, (10, 6))
    (tmp_path / "k.yaml").write_text(ur_kinematics(moved))
    expected = tool_poses(robot, q, moved.displacement)
    assert np.abs(expected - tool_poses(robot, q)).max() > 1e-4
    read = with_kinematics(robot, tmp_path / "k.yaml")
    np.testing.assert_allclose(tool_poses(read, q), expected, rtol=0, atol=1e-12)
    (tmp_path / "again.yaml").write_text(ur_kinematics(sound(replace(moved, robot=read))))
    again = with_kinematics(robot, tmp_path / "again.yaml")
    np.testing.assert_allclose(tool_poses(again, q), expected, rtol=0, atol=1e-12)


def test_a_simulator_whose_joints_are_set_stands_where_the_model_does(rv_m2, configurations):
    """MuJoCo's own bodies: set to the frames, and moved by the changes."""
    robot, q = displaced(rv_m2, seed=5, target=False), configurations(rv_m2, 5)
    told = json.loads(joint_parameters(robot))["joints"]
    expected = tool_poses(rv_m2, q, robot.displacement)
    for by_change in (False, True):
        model = mujoco.MjModel.from_xml_string(mjcf_of_urdf(rv_m2.urdf))
        for joint in told.values():
            body = model.body(joint["child"])
            new = placed(joint["pos"], joint["quat"])
            if by_change:
                new = placed(joint["change_pos"], joint["change_quat"]) @ placed(body.pos, body.quat)
            turn = Rotation.from_matrix(new[:3, :3]).as_quat()
            body.pos[:], body.quat[:] = new[:3, 3], np.roll(turn, 1)
        data = mujoco.MjData(model)
        for row, pose in zip(held(rv_m2, q), expected, strict=True):
            for name, position in row.items():
                data.qpos[model.joint(name).qposadr[0]] = position
            mujoco.mj_kinematics(model, data)
            np.testing.assert_allclose(data.body("tool0").xpos - data.body("base_link").xpos, pose[:3, 3], atol=1e-9)


def placed(pos, quat):
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = Rotation.from_quat(np.roll(quat, -1)).as_matrix(), pos
    return pose


def test_robots_of_others_have_no_kinematics_yaml(rv_m2):
    with pytest.raises(CampaignError, match="'rv_m2' has no shoulder_pan_joint"):
        ur_kinematics(displaced(rv_m2, 0, 1e-3))


def moved(turns="", angles=(), shift=(0.0, 0.0, 0.0)):
    """(4, 4) of a shift, then turns about axes, each about those that the ones before have turned."""
    pose = np.eye(4)
    pose[:3, 3] = shift
    pose[:3, :3] = Rotation.from_euler(turns, angles).as_matrix() if turns else np.eye(3)
    return pose


def led(table, commands):
    """Where a table leads: its own kinematics, of rad and m, by the commands of joints."""
    pose = np.eye(4)
    for row in table.to_dict("records"):
        a = {name.split(" ")[0]: value for name, value in row.items()}
        if a["type"] in ("base", "tool"):
            pose = pose @ moved("ZYX", [a["yaw"], a["pitch"], a["roll"]], [a["x"], a["y"], a["z"]])
            continue
        by = a["multiplier"] * commands[a["follows"]] if a["multiplier"] else 0.0
        turned, slid = (0.0, by) if a["type"] == "prismatic" else (by, 0.0)
        joint = moved("Z", a["theta"] + turned, [0.0, 0.0, a["d"] + slid])
        link = moved("XY", [a["alpha"], a["beta"]], [a["a"], 0.0, 0.0])
        pose = pose @ (joint @ link if a["convention"] == "standard" else link @ joint)
    return pose


def leads_as_the_model(robot, q):
    expected = tool_poses(robot.robot, q, robot.displacement) @ robot.target
    for convention in CONVENTIONS:
        table = pd.read_csv(io.StringIO(dh_table(robot, convention).to_csv(index=False)))
        seen = [led(table, dict(zip(robot.robot.joint_names, row, strict=True))) for row in q]
        np.testing.assert_allclose(seen, expected, rtol=0, atol=1e-9)


def test_a_table_that_is_written_leads_to_the_models_poses(arm, configurations):
    for size in (0.0, 1e-3, 3e-2):
        leads_as_the_model(displaced(arm, seed=2, size=size), configurations(arm, 5, seed=3))


@pytest.mark.slow
@given(arms())
def test_any_arm_has_a_table_and_is_written_and_read(arm):
    robot = displaced(arm, seed=8)
    q = np.random.default_rng(9).uniform(np.maximum(arm.lower, -3.0), np.minimum(arm.upper, 3.0), (3, arm.n))
    leads_as_the_model(robot, q)
    again = load_robot(calibrated_urdf(robot), f"{arm.tool_frame}_target")
    expected = tool_poses(arm, q, robot.displacement) @ robot.target
    np.testing.assert_allclose(tool_poses(again, q), expected, rtol=0, atol=1e-12)


def test_the_table_of_a_sound_ur10_is_its_makers():
    """Universal Robots' own table: d 0.1273 0 0 0.163941 0.1157 0.0922, a 0 −0.612 −0.5723, α ±90° where axes cross."""
    table = dh_table(displaced(load_arm("ur10"), 0, size=0.0, target=False))[1:-1]
    np.testing.assert_allclose(np.abs(table["a [m]"]), [0, 0.612, 0.5723, 0, 0, 0], atol=1e-9)
    crossing = np.isclose(np.abs(table["alpha [rad]"]), np.pi / 2)
    assert crossing.tolist() == [True, False, False, True, True, False]
    np.testing.assert_allclose(table["beta [rad]"], 0.0, atol=1e-9)
    np.testing.assert_allclose(np.abs(table["d [m]"]), [0.1273, 0, 0, 0.163941, 0.1157, 0.0922], atol=1e-4)


def test_a_calibrated_table_differs_little_from_the_nominal_one(rv_m2):
    """So that a controller's table can be corrected by the difference; axes that coincide are the exception."""
    robot = displaced(rv_m2, 4, size=1e-4, target=False)
    after, before = (dh_table(r, "modified")[1:-2] for r in (robot, sound(robot)))
    for name in ("theta [rad]", "a [m]", "alpha [rad]", "beta [rad]", "d [m]"):
        assert 1e-6 < np.abs(after[name] - before[name]).max() < 2e-3, name


def test_units_are_those_that_are_asked_for_and_said(rv_m2):
    robot = displaced(rv_m2, 1)
    plain, other = dh_table(robot), dh_table(robot, "standard", Units("deg", "mm"))
    np.testing.assert_allclose(np.radians(other["alpha [deg]"]), plain["alpha [rad]"])
    np.testing.assert_allclose(other["a [mm]"], 1e3 * plain["a [m]"])
    np.testing.assert_allclose(other["x [mm]"], 1e3 * plain["x [m]"])
    with pytest.raises(CampaignError, match="standard or modified"):
        dh_table(robot, "paul")
