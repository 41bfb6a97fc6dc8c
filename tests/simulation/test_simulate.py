"""What is simulated is what an exact robot does, computed by hand; it reads back, and a diagnosis finds it again."""

import ast
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from conftest import load_arm
from pages import blocks
from several import FLAT, simulated

import thermal_robot
from thermal_robot import CorrectedModel, read_campaign, simulate, write_campaign
from thermal_robot.effects import JointRipple, library
from thermal_robot.kinematics import exp6, quaternion_to_rotation
from thermal_robot.observations import Frames, observe

ROOT = Path(__file__).parents[2]
TARGET = (0.05, 0.03, 0.1)
UPPER = 0.5  # m, of the planar arm


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


def test_a_robot_is_where_its_kinematics_say_at_its_offsets_behind_its_base_before_its_tool(arm):
    found = simulate(arm, rows=20, measures="pose", seed=3)
    np.testing.assert_allclose(poses_of(found), arm.forward(found.q), atol=1e-12)
    assert np.all((found.q >= arm.lower) & (found.q <= arm.upper))
    assert (found.noise_position, found.base_known, found.tool_known) == (None, True, True)
    rng = np.random.default_rng(5)
    base, tool = (exp6(rng.normal(size=6)) for _ in range(2))
    away = rng.normal(0.0, 0.01, arm.n)
    found = simulate(arm, {"joint_offset": away}, rows=10, measures="pose", base=base, tool=tool)
    np.testing.assert_allclose(poses_of(found), base @ arm.forward(found.q + away) @ tool, atol=1e-12)
    assert (found.base_known, found.tool_known) == (False, False)
    np.testing.assert_array_equal(found.target, tool[:3, 3])


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
@pytest.mark.parametrize("seed", range(2))
def test_a_diagnosis_finds_what_was_simulated(diagnosed_once, robot, effects, seed):
    arm = load_arm(robot)
    base = exp6(np.array([1.0, -2.0, 0.5, 0.1, 0.2, 2.0]))
    found = diagnosed_once(simulate(arm, effects, rows=80, base=base, tool=TARGET, noise=2e-5, seed=seed))
    ((name, values),) = effects.items()
    assert found.verdict == (name,)
    ((place, value),) = values.items()
    told = next(p for p in found.finding(name).parameters if p.name.endswith(place))
    assert told.value == pytest.approx(value, abs=5.0 * told.std)


def test_a_point_is_known_and_turns_nothing(planar):
    found = simulate(planar, rows=10, tool=TARGET)
    there = planar.forward(found.q) @ np.array([*TARGET, 1.0])
    np.testing.assert_allclose(found.position, there[:, :3], atol=1e-12)
    assert found.tool_known


def test_the_noise_has_the_size_that_is_stated(planar):
    given = dict(rows=4000, measures="pose", seed=8)
    exact = simulate(planar, **given)
    found = simulate(planar, noise=3e-5, noise_orientation=2e-4, **given)
    np.testing.assert_array_equal(found.q, exact.q)
    assert (found.noise_position, found.noise_orientation) == (3e-5, 2e-4)
    # 4000 rows tell each axis' sigma to 1.1 %
    np.testing.assert_allclose((found.position - exact.position).std(axis=0), 3e-5, rtol=0.05)
    turn = poses_of(found)[:, :3, :3] @ poses_of(exact)[:, :3, :3].transpose(0, 2, 1)
    about = 0.5 * np.column_stack(
        [turn[:, 2, 1] - turn[:, 1, 2], turn[:, 0, 2] - turn[:, 2, 0], turn[:, 1, 0] - turn[:, 0, 1]]
    )
    np.testing.assert_allclose(about.std(axis=0), 2e-4, rtol=0.05)


def test_a_warm_link_is_longer_along_itself(planar):
    q = np.array([[0.3, 1.0], [0.3, 1.0], [-2.0, 0.5]])
    warm = {"temperature": [20.0, 30.0, 25.0]}
    grown = simulate(planar, {"thermal_elongation": {"upper": 2e-5}}, commands=q, conditions=warm)
    shift = grown.position - simulate(planar, commands=q, conditions=warm).position
    longer = UPPER * 2e-5 * np.array([0.0, 10.0, 5.0])
    expected = longer[:, None] * np.column_stack([np.cos(q[:, 0]), np.sin(q[:, 0]), np.zeros(3)])
    np.testing.assert_allclose(shift, expected, atol=1e-14)


def test_lost_motion_is_the_gap_between_the_two_sides(planar):
    q = [[0.0, 0.5], [1.0, 0.5], [2.0, 0.5], [1.0, 0.5], [0.0, 0.5]]
    found = simulate(planar, {"backlash": {"shoulder": 1e-3}}, commands=q)
    below, above = found.position[1], found.position[3]
    turn = np.arctan2(above[1], above[0]) - np.arctan2(below[1], below[0])
    assert turn == pytest.approx(1e-3, rel=1e-9)


def angle(campaign):
    """Where the shoulder stands, told from a straight arm."""
    return np.arctan2(campaign.position[:, 1], campaign.position[:, 0])


def straight(rows):
    return np.column_stack([np.random.default_rng(2).uniform(-2.0, 2.0, rows), np.zeros(rows)])


def test_a_joint_that_scatters_comes_to_another_place_at_each_visit(planar):
    found = simulate(planar, {"excess_repeatability": {"shoulder": 2e-3}}, commands=straight(1000), repeats=3)
    away = angle(found) - found.q[:, 0]
    assert away.std() == pytest.approx(2e-3, rel=0.06)
    pose = np.unique(found.labels["pose"], return_inverse=True)[1]
    within = away - (np.bincount(pose, away) / 3.0)[pose]
    assert within.std() * np.sqrt(3.0 / 2.0) == pytest.approx(2e-3, rel=0.06)


def test_a_coarse_encoder_stands_on_its_steps_and_repeats(planar):
    step = 0.02
    found = simulate(planar, {"encoder_resolution": {"shoulder": step}}, commands=straight(200), repeats=2)
    stands = angle(found)
    assert np.abs(stands - found.q[:, 0]).max() == pytest.approx(step / 2.0, rel=0.1)
    steps = (stands - stands[0]) / step
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-9)
    for pose in set(found.labels["pose"]):
        assert np.ptp(stands[found.labels["pose"] == pose]) < 1e-12


def test_effects_together_are_the_model_that_has_them(rv_m2):
    base, tool = exp6(np.array([0.4, -1.0, 0.2, 0.1, 0.3, 1.0])), exp6(np.array([0.05, 0.0, 0.1, 0.2, 0.0, 0.1]))
    values = {"thermal_elongation": np.arange(1.0, 6.0) * 1e-5, "backlash": {"joint_3": 3e-4}, "instrument_scale": 2e-5}
    found = simulate(rv_m2, values, base=base, tool=tool, measures="pose")
    known = library()
    effects = (
        (known["thermal_elongation"], values["thermal_elongation"]),
        (known["backlash"], np.array([0.0, 0.0, 3e-4, 0.0, 0.0])),
        (known["instrument_scale"], np.array([2e-5])),
    )
    model = CorrectedModel(rv_m2, found.settings, Frames(base, tool), effects, "pose", tuple(found.covariates))
    position, orientation = model.predict(found)
    np.testing.assert_array_equal(found.position, position)
    np.testing.assert_array_equal(found.orientation, orientation)
    again = simulate(rv_m2, model.effects, base=base, tool=tool, measures="pose")
    np.testing.assert_array_equal(again.position, found.position)


def test_targets_and_noises_of_the_campaign_that_lent_its_commands_are_gone(rv_m2):
    lent = simulate(rv_m2, rows=40, noise=1e-5, measures="pose", seed=2)
    lent = replace(lent, noise_of_rows=np.full(40, 2e-5))
    found = simulate(rv_m2, commands=lent, noise=1e-5, seed=3)
    assert found.noise_of_rows is None
    assert found.noise_position == 1e-5
    several, _ = simulated(rv_m2, ["joint_offset"], FLAT, 1)
    assert several.targets is not None
    found = simulate(rv_m2, commands=several, seed=3)
    assert found.targets is None
    assert {"x", "y", "z", "qw"} <= set(found.to_frame())


def test_a_robot_that_is_warm_all_the_time_is_larger_by_the_same_share(rv_m2):
    cold = simulate(rv_m2, conditions={"temperature": 20.0})
    warm = simulate(rv_m2, {"thermal_elongation": 1e-5}, conditions={"temperature": 32.0})
    np.testing.assert_allclose(warm.position, (1.0 + 12e-5) * cold.position, rtol=0.0, atol=1e-12)


def test_the_page_prints_what_it_planted(capsys, diagnosed_once, monkeypatch):
    monkeypatch.setattr(thermal_robot, "diagnose", diagnosed_once)
    code = [text for language, text in blocks(ROOT / "docs" / "simulation.md") if language == "python"]
    assert len(code) == 1
    exec(compile(code[0], "simulation.md", "exec"), {})
    printed = ast.literal_eval(capsys.readouterr().out)
    assert set(printed) == {"backlash", "thermal_elongation", "excess_repeatability"}
