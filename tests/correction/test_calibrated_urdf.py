"""The calibrated URDF: every reader sees the corrected model in it, and its text is the user's own."""

from dataclasses import replace

import numpy as np
import pytest
from arms import arms
from floor import NOISE, real_robot
from hypothesis import given
from lxml import etree
from readers import READERS, displaced, held, model_of
from simulate import simulate

from thermal_robot import diagnose
from thermal_robot.correction import calibrated, calibrated_urdf
from thermal_robot.effects import JointOffset
from thermal_robot.kinematics import Displacement, tool_poses
from thermal_robot.robot import load_robot

ROWS = 12


@pytest.mark.parametrize("reader", READERS)
def test_every_reader_sees_the_displaced_robot(arm, reader, configurations):
    robot = displaced(arm, seed=1)
    q = configurations(arm, ROWS, seed=2)
    expected = tool_poses(arm, q, robot.displacement) @ robot.target
    text = calibrated_urdf(robot)
    seen = READERS[reader](text, arm.root_frame, f"{arm.tool_frame}_target", held(arm, q))
    np.testing.assert_allclose(list(seen), expected, rtol=0, atol=1e-9)


def test_a_mimicking_joint_follows_where_the_other_really_is(arm, configurations):
    robot = displaced(arm, seed=3)
    q = configurations(arm, ROWS, seed=4)
    again = load_robot(calibrated_urdf(robot), arm.tool_frame, root_frame=arm.root_frame)
    assert again.joint_names == arm.joint_names
    np.testing.assert_array_equal(again.lower, arm.lower)
    np.testing.assert_allclose(tool_poses(again, q), tool_poses(arm, q, robot.displacement), rtol=0, atol=1e-12)


def without_origins(text):
    """Its XML, and that of each joint by name, without the joints' origins."""
    root = etree.fromstring(text.encode(), etree.XMLParser(recover=True))
    joints = {joint.get("name"): etree.tostring(joint) for joint in root.findall("joint")}
    for origin in root.findall("joint/origin"):
        origin.getparent().remove(origin)
    return etree.tostring(root, method="c14n", with_comments=True), joints


def test_all_else_stands_as_it_stood(arm):
    after, before = (without_origins(text) for text in (calibrated_urdf(displaced(arm, 5, target=False)), arm.urdf))
    assert after[0] == before[0]
    moved = {name for name, text in after[1].items() if text != before[1][name]}
    assert moved == {segment.name for segment in arm.segments}


def test_a_sound_robot_is_written_as_it_is(rv_m2):
    robot = replace(displaced(rv_m2, 0, target=False), displacement=Displacement(np.zeros(5), np.zeros((7, 6))))
    text = calibrated_urdf(robot)
    assert without_origins(text) == without_origins(rv_m2.urdf)
    assert "Written here: nothing" in text


@pytest.mark.parametrize("frame", ["base", None])
def test_a_turn_of_a_quarter_in_pitch_and_a_zero_of_any_size(awkward_urdf, frame, configurations):
    text = awkward_urdf.replace('rpy="0.5 0.6 0.7"', f'rpy="0.5 {np.pi / 2!r} 0.7"')
    robot = load_robot(text, "tip", root_frame=frame)
    model = model_of(robot, (JointOffset(), np.linspace(-2.0, 2.0, robot.n)))
    q = configurations(robot, ROWS)
    again = load_robot(calibrated_urdf(calibrated(model)), "tip", root_frame=frame)
    np.testing.assert_allclose(tool_poses(again, q), tool_poses(robot, q + np.linspace(-2, 2, robot.n)), atol=1e-12)


@pytest.mark.parametrize("kind", ["joint_offset", "geometric", "thermal_elongation"])
def test_the_written_robot_predicts_what_its_model_does(rv_m2, kind):
    """Of a campaign of one such effect the URDF alone, at one temperature, is the corrected model."""
    campaign, _, (fresh, _) = simulate(rv_m2, [kind], seed=1, fresh=60)
    model = diagnose(campaign, only=[kind]).model
    warm = replace(fresh, covariates={**fresh.covariates, "temperature": np.full(60, 31.0)})
    robot = calibrated(model, temperature=31.0 if model.needs else None)
    assert robot.kept == ()
    again = load_robot(calibrated_urdf(robot), "tool0_target")
    poses = robot.base @ tool_poses(again, warm.q)
    predicted = model.predict(warm)[0]
    np.testing.assert_allclose(poses[:, :3, 3], predicted, rtol=0, atol=1e-9)
    plain = tool_poses(rv_m2, warm.q) @ model.frames.tool
    assert np.abs((model.frames.base @ plain)[:, :3, 3] - predicted).max() > 1e-5


WARM = np.where(np.arange(200) < 120, np.random.default_rng(0).uniform(16.0, 34.0, 200), 29.0)
FLOOR = {
    "joint_offset": {"zeros": [0.0, 1.5e-3, -1e-3, 8e-4, 0.0]},
    "geometric": {"misplaced": 3e-4},
    "thermal_elongation": {"temperature": WARM},
}


@pytest.mark.parametrize("kind", FLOOR)
def test_the_written_robot_is_the_one_on_the_floor(rv_m2, kind):
    """In poses that nothing was fitted to, at one temperature: as near to the robot as its model is."""
    whole = real_robot(rv_m2, 3, samples=200, **FLOOR[kind])
    model = diagnose(whole.take(np.arange(120))).model
    assert [effect.name for effect, _ in model.effects] == [kind]
    fresh = whole.take(np.arange(120, 200))
    robot = calibrated(model, temperature=29.0 if model.needs else None)
    poses = robot.base @ tool_poses(load_robot(calibrated_urdf(robot), "tool0_target"), fresh.q)
    plain = model.frames.base @ tool_poses(rv_m2, fresh.q) @ model.frames.tool
    left, before = (np.sqrt(((p[:, :3, 3] - fresh.position) ** 2).mean()) for p in (poses, plain))
    np.testing.assert_allclose(poses[:, :3, 3], model.predict(fresh)[0], rtol=0, atol=1e-9)
    assert before > 1.8 * NOISE
    assert left < 1.25 * NOISE


@given(arms())
def test_any_arm_is_written_and_read(arm):
    robot = displaced(arm, seed=8)
    q = np.random.default_rng(9).uniform(np.maximum(arm.lower, -3.0), np.minimum(arm.upper, 3.0), (3, arm.n))
    expected = tool_poses(arm, q, robot.displacement) @ robot.target
    again = load_robot(calibrated_urdf(robot), f"{arm.tool_frame}_target")
    np.testing.assert_allclose(tool_poses(again, q), expected, rtol=0, atol=1e-12)
