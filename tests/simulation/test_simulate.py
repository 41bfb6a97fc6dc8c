"""What is simulated is what an exact robot does, reads back as written, and is found again by a diagnosis."""

import ast
from pathlib import Path

import numpy as np
import pytest
from conftest import load_arm
from pages import blocks

from thermal_robot import (
    CampaignError,
    RobotError,
    diagnose,
    read_campaign,
    simulate,
    write_campaign,
)
from thermal_robot.effects import JointRipple, library
from thermal_robot.kinematics import exp6, quaternion_to_rotation
from thermal_robot.observations import observe

ROOT = Path(__file__).parents[2]
TARGET = (0.05, 0.03, 0.1)


def poses_of(campaign):
    pose = np.tile(np.eye(4), (campaign.samples, 1, 1))
    pose[:, :3, :3] = quaternion_to_rotation(campaign.orientation)
    pose[:, :3, 3] = campaign.position
    return pose


def recorded(robot, rows=30):
    """Conditions that any effect may follow; a sensor on each link."""
    rng = np.random.default_rng(4)
    found = {"payload": rng.choice([0.0, 2.0], rows)}
    for joint in robot.joint_names:
        found[f"velocity.{joint}"] = rng.uniform(-1.0, 1.0, rows)
    for link in dict.fromkeys(segment.parent_link for segment in robot.segments):
        found[f"temperature.{link}"] = rng.uniform(18.0, 30.0, rows)
    return found


def as_key(name, robot):
    """An effect of the library; ripple has no waves of its own."""
    return JointRipple().having(robot.joint_names[0], 7.0, 1.0) if name == JointRipple.name else name


def test_a_sound_robot_is_where_its_kinematics_say(arm):
    found = simulate(arm, rows=20, measures="pose", seed=3)
    np.testing.assert_allclose(poses_of(found), arm.forward(found.q), atol=1e-12)
    assert np.all((found.q >= arm.lower) & (found.q <= arm.upper))
    assert found.noise_position is None
    assert found.base_known
    assert found.tool_known


def test_an_offset_is_the_same_robot_at_other_positions(arm):
    away = np.random.default_rng(1).normal(0.0, 0.01, arm.n)
    found = simulate(arm, {"joint_offset": away}, rows=20, measures="pose")
    np.testing.assert_allclose(poses_of(found), arm.forward(found.q + away), atol=1e-12)


def test_the_same_seed_is_the_same_campaign(planar):
    given = ({"backlash": 1e-4},)
    one, same, other = (simulate(planar, *given, noise=1e-5, seed=seed) for seed in (5, 5, 6))
    np.testing.assert_array_equal(one.position, same.position)
    assert np.abs(one.q - other.q).max() > 0.1
    sound = simulate(planar, noise=1e-5, seed=5)
    np.testing.assert_array_equal(one.q, sound.q)
    scattered = simulate(planar, {"excess_repeatability": 0.0}, noise=1e-5, seed=5)
    np.testing.assert_array_equal(scattered.position, sound.position)


@pytest.mark.parametrize("name", sorted(library()))
@pytest.mark.parametrize("robot", ["rv_m2", "ur10", "awkward-from-base"])
def test_every_effect_of_the_library_moves_what_is_measured(robot, name):
    arm = load_arm(robot)
    given = dict(rows=30, conditions=recorded(arm), measures="pose")
    key = as_key(name, arm)
    sound, still = simulate(arm, **given), simulate(arm, {key: {}}, **given)
    np.testing.assert_array_equal(still.position, sound.position)
    effect = library()[name].variants(observe(sound))[0] if isinstance(key, str) else key
    sizes = [parameter.size for parameter in effect.parameters(observe(sound))]
    moved = simulate(arm, {key: sizes}, **given)
    assert 1e-7 < np.abs(moved.position - sound.position).max() < 0.5


def test_it_reads_back_as_it_was_written(rv_m2, tmp_path):
    found = simulate(
        rv_m2, {"joint_gain": 1e-3}, rows=24, repeats=3, measures="pose", noise=1e-5, conditions={"humidity": 40}
    )
    read = read_campaign(write_campaign(found, tmp_path).parent)
    np.testing.assert_array_equal(read.position, found.position)
    np.testing.assert_allclose(read.orientation, found.orientation, atol=1e-15)
    np.testing.assert_array_equal(read.labels["pose"], found.labels["pose"])
    assert set(read.covariates) == set(found.covariates)
    for name, values in read.covariates.items():
        np.testing.assert_array_equal(values, found.covariates[name])
    assert (read.extra, read.warnings) == (("humidity",), found.warnings)
    assert len(found.to_frame()) == 24


@pytest.mark.parametrize(
    ("robot", "effects"),
    [("rv_m2", {"backlash": {"joint_3": 4e-4}}), ("ur10", {"joint_offset": {"elbow_joint": 8e-4}})],
)
@pytest.mark.parametrize("seed", range(3))
def test_a_diagnosis_finds_what_was_simulated(robot, effects, seed):
    arm = load_arm(robot)
    base = exp6(np.array([1.0, -2.0, 0.5, 0.1, 0.2, 2.0]))
    found = diagnose(simulate(arm, effects, rows=80, base=base, tool=TARGET, noise=2e-5, seed=seed))
    ((name, values),) = effects.items()
    assert found.verdict == (name,)
    ((place, value),) = values.items()
    told = next(p for p in found.finding(name).parameters if p.name.endswith(place))
    assert told.value == pytest.approx(value, abs=5.0 * told.std)


def test_a_robot_is_loaded_where_there_is_none_yet(rv_m2):
    by_name = simulate("builtin:rv_m2", rows=5, tool_frame="tool0")
    np.testing.assert_array_equal(by_name.position, simulate(rv_m2, rows=5).position)
    with pytest.raises(RobotError, match="no tool frame is given; the links at the ends of this robot are tool0"):
        simulate("builtin:rv_m2")
    with pytest.raises(CampaignError, match=r"simulate\(campaign.robot, ..., commands=campaign\)"):
        simulate(by_name)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"seed": -1}, "seed: is -1"),
        ({"seed": 0.5}, "seed: is 0.5"),
        ({"tool_frame": "flange"}, "'tool0', where its chain ends"),
    ],
)
def test_a_seed_or_a_frame_that_is_none_is_refused(rv_m2, given, message):
    with pytest.raises(CampaignError, match=message):
        simulate(rv_m2, **given)


def test_the_page_prints_what_it_planted(capsys):
    code = [text for language, text in blocks(ROOT / "docs" / "simulation.md") if language == "python"]
    assert len(code) == 1
    exec(compile(code[0], "simulation.md", "exec"), {})
    printed = ast.literal_eval(capsys.readouterr().out)
    assert set(printed) == {"backlash", "thermal_elongation", "excess_repeatability"}
