"""What is simulated is what an exact robot does, computed by hand; it reads back, and a diagnosis finds it again."""

import ast
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from conftest import load_arm
from helpers import some
from pages import blocks
from several import FLAT, simulated

import thermal_robot
from thermal_robot import (
    CampaignError,
    CorrectedModel,
    EffectError,
    RobotError,
    demo_campaign,
    load_robot,
    read_campaign,
    simulate,
    write_campaign,
)
from thermal_robot.effects import Drift, Effect, JointRipple, Parameter, at_joint, library
from thermal_robot.kinematics import exp6, homogeneous, quaternion_to_rotation
from thermal_robot.observations import Frames, observe
from thermal_robot.planning import plan
from thermal_robot.simulation import schedule
from thermal_robot.simulation.schedule import balanced, conditions, in_turn, visits

ROOT = Path(__file__).parents[2]
TARGET = (0.05, 0.03, 0.1)
UPPER = 0.5  # m, of the planar arm


def poses_of(campaign):
    return homogeneous(quaternion_to_rotation(campaign.orientation), campaign.position)


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
    ("robot", "effects", "seed"),
    some(
        [
            (robot, effects, seed)
            for robot, effects in (
                ("rv_m2", {"backlash": {"joint_3": 4e-4}}),
                ("ur10", {"joint_offset": {"elbow_joint": 8e-4}}),
            )
            for seed in range(2)
        ],
        4,
    ),
)
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
    position, orientation = model.prediction(found)[:2]
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


@pytest.mark.slow
def test_the_page_prints_what_it_planted(capsys, diagnosed_once, monkeypatch):
    monkeypatch.setattr(thermal_robot, "diagnose", diagnosed_once)
    code = [text for language, text in blocks(ROOT / "docs" / "simulation.md") if language == "python"]
    assert len(code) == 1
    exec(compile(code[0], "simulation.md", "exec"), {})
    printed = ast.literal_eval(capsys.readouterr().out)
    assert set(printed) == {"backlash", "thermal_elongation", "excess_repeatability"}


# ---- what may be asked of a simulation


def test_a_campaign_lends_its_commands_and_conditions():
    demo = demo_campaign()
    found = simulate(demo.robot, {"joint_gain": 1e-3}, commands=demo)
    np.testing.assert_array_equal(found.q, demo.q)
    assert found.settings == replace(demo.settings, noise_position=None)
    for name, values in demo.covariates.items():
        np.testing.assert_array_equal(found.covariates[name], values)
    cold = simulate(demo.robot, commands=demo, conditions={"temperature": 15.0})
    assert set(cold.covariates["temperature"]) == {15.0}


def test_one_pose_is_one_row_and_repeats_as_often_as_asked(planar):
    q = np.array([0.3, 1.0])
    for given in (q, list(q), [q], [list(q)]):
        np.testing.assert_array_equal(simulate(planar, commands=given).q, [q])
    again = simulate(planar, commands=q, repeats=30)
    np.testing.assert_array_equal(again.q, np.tile(q, (30, 1)))
    assert set(again.labels["pose"]) == {"1"}


def test_another_order_or_another_session_brings_other_approaches(planar):
    q = [[0.0, 0.0], [1.0, 1.0], [0.5, 2.0]]
    side = [
        simulate(planar, commands=q, conditions=c).covariates["approach.shoulder"].tolist()
        for c in ({}, {"time": [2.0, 1.0, 0.0]}, {"session": ["a", "b", "b"]})
    ]
    assert side == [[0.0, 1.0, -1.0], [-1.0, 1.0, 0.0], [0.0, 0.0, -1.0]]
    assert "approach.shoulder" not in simulate(planar, commands=q, conditions={"time": None}).covariates


def test_a_plan_is_measured_as_it_was_planned(rv_m2):
    planned = plan(rv_m2, 12, ["joint_gain"], repeats=2, orientation=True, target=TARGET).commands
    found = simulate(rv_m2, commands=planned, noise=2e-5)
    assert found.measures == "pose"
    np.testing.assert_array_equal(found.labels["pose"], planned.labels["pose"])
    np.testing.assert_array_equal(found.target, TARGET)


def test_a_campaign_of_other_joints_is_refused(rv_m2, planar):
    with pytest.raises(CampaignError, match="commands other joints"):
        simulate(planar, commands=simulate(rv_m2, rows=5))
    with pytest.raises(CampaignError, match="neither rows nor repeats"):
        simulate(rv_m2, commands=demo_campaign(), rows=5)


def test_a_slide_without_limits_needs_commands():
    robot = load_robot(
        '<robot name="rail"><link name="a"/><link name="b"/><joint name="s" type="prismatic"><parent link="a"/>'
        '<child link="b"/><axis xyz="1 0 0"/></joint></robot>',
        "b",
    )
    with pytest.raises(CampaignError, match="a <limit> in the URDF"):
        simulate(robot)
    np.testing.assert_array_equal(simulate(robot, commands=[[2.0]]).position, [[2.0, 0.0, 0.0]])


def test_a_robot_is_loaded_where_there_is_none_yet(rv_m2):
    by_name = simulate("builtin:rv_m2", rows=5, tool_frame="tool0")
    np.testing.assert_array_equal(by_name.position, simulate(rv_m2, rows=5).position)
    with pytest.raises(RobotError, match="no tool frame is given; the links at the ends of this robot are tool0"):
        simulate("builtin:rv_m2")
    with pytest.raises(CampaignError, match=r"simulate\(campaign.robot, ..., commands=campaign\)"):
        simulate(by_name)


@dataclass(frozen=True)
class Sag(Effect):
    """An effect of a user's own."""

    name = "sag"

    def parameters(self, observations):
        joints = enumerate(observations.robot.joint_names)
        return tuple(Parameter("sag", "rad", 1e-3, "joint", name, (at_joint(j, 1.0),)) for j, name in joints)


def test_an_effect_of_ones_own_and_a_setting_of_ones_own(planar):
    found = simulate(planar, {Sag(): {"elbow": 2e-3}}, rows=9)
    named = simulate(planar, {"joint_offset": {"elbow": 2e-3}}, rows=9)
    np.testing.assert_array_equal(found.position, named.position)
    # by name over the campaign, as it is over its own span
    by_name = simulate(planar, {"drift": {"translation x": 1e-3}}, rows=9)
    as_it_is = simulate(planar, {Drift(span=60.0): {"translation x": 1e-3}}, rows=9)
    sound = simulate(planar, rows=9)
    assert (by_name.position - sound.position)[-1, 0] == pytest.approx(1e-3, abs=1e-12)
    assert (as_it_is.position - sound.position)[-1, 0] == pytest.approx(8e-3, abs=1e-12)


@pytest.mark.parametrize(
    ("effects", "message"),
    [
        ({"backlsh": 1e-3}, "no effect is named 'backlsh'; did you mean 'backlash'"),
        ({"backlash": {"joint3": 1e-3}}, "no parameter 'joint3' here; did you mean 'joint_3'"),
        ({"backlash": {"lost motion": 1e-3}}, "'lost motion' is 5 parameters; name one of 'lost motion, joint_1'"),
        ({"backlash": -1e-3}, "'lost motion, joint_1': -0.001, expected a number, not negative, in rad"),
        ({"backlash": {"joint_1": float("nan")}}, "NaN, expected"),
        ({"joint_offset": True}, "true, expected a number in rad"),
        ({"joint_offset": "much"}, "'much', expected a number in rad"),
        ({"joint_offset": [1e-3] * 4}, "has 5 parameters, 4 values given"),
        ({"drift": 1e-4}, "one number cannot stand for parameters in m, rad"),
        ({"tracking_lag": 1e-3}, "it needs velocity.joint_1.*as conditions={'velocity.joint_1'"),
        ({"joint_ripple": 1e-3}, "no parameters here.*JointRipple\\(joints=…"),
        ({5: 1.0}, "5 is neither the name of an effect nor an effect"),
        ([5], "no effects with values"),
        ({"excess_repeatability": {"joint_9": 1.0}}, "no parameter 'joint_9'"),
    ],
)
def test_effects_that_cannot_be_are_refused(rv_m2, effects, message):
    with pytest.raises(EffectError, match=message):
        simulate(rv_m2, effects)


def test_an_effect_without_anything_to_follow_says_what_it_needs(rv_m2):
    with pytest.raises(EffectError, match="it needs temperature; give"):
        simulate(rv_m2, {"thermal_elongation": 1e-5}, conditions={"temperature": None})


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"rows": 0}, "rows: is 0, expected a whole number from 1 on"),
        ({"rows": 7, "repeats": 2}, "does not divide into poses"),
        ({"rows": 7, "commands": [[0.0] * 5]}, "either rows or commands"),
        ({"commands": [[0.0] * 4]}, "expected a list of 5 values"),
        ({"commands": []}, "there is no row"),
        ({"commands": "x"}, "no positions; found str, expected rows of 5 joint positions, or a campaign"),
        ({"commands": [[float("nan")] * 5]}, r"commands\[0\]\[0\]: is NaN"),
        ({"conditions": {"temprature": 20.0}}, "did you mean 'temperature'"),
        ({"conditions": {"velocity.joint_9": 1.0}}, "no such joint"),
        ({"conditions": {"temperature.arm": 20.0}}, "no such link; did you mean 'forearm'"),
        ({"conditions": {"joint_1": 1.0}}, "is commanded, no condition"),
        ({"conditions": {"x": 1.0}}, "poses are what is simulated"),
        ({"conditions": {"time": [1.0, 2.0]}}, "one for each of 60"),
        ({"conditions": 5}, "values by name"),
        ({"conditions": {"temperature": -300.0}}, "impossible value"),
        ({"seed": -1}, "seed: is -1"),
        ({"seed": 0.5}, "seed: is 0.5"),
        ({"tool_frame": "flange"}, "'tool0', where its chain ends"),
        ({"base": np.eye(3)}, "'base': no pose"),
        ({"base": 2.0 * np.eye(4)}, "'base': no pose"),
        ({"tool": [0.0, 1.0]}, "or three numbers"),
        ({"base": np.diag([-1.0, -1.0, 1.0, 1.0]), "base_known": True}, "its error is an effect of its own"),
        ({"tool_known": 1}, "expected true or false"),
        ({"noise": -1e-6}, "a noise cannot be negative"),
        ({"noise_orientation": 1e-4}, "only positions are measured"),
        ({"measures": "poses"}, 'expected "position" or "pose"'),
    ],
)
def test_what_no_campaign_has_is_refused(rv_m2, given, message):
    with pytest.raises(CampaignError, match=message):
        simulate(rv_m2, **given)


@pytest.mark.parametrize(("rows", "repeats"), [(12, 1), (12, 2), (12, 3), (12, 6), (30, 5)])
def test_every_row_is_one_visit_and_none_follows_itself(rows, repeats):
    places = visits(rows, repeats)
    assert sorted(places.ravel().tolist()) == list(range(rows))
    q, labels = in_turn(np.arange(rows // repeats, dtype=float)[:, None], places)
    which = q[:, 0].astype(int)
    assert [*labels.get("pose", ())] == ([str(k + 1) for k in which] if repeats > 1 else [])
    assert np.all(np.diff(which) != 0)
    assert np.bincount(which).tolist() == [repeats] * (rows // repeats)


def test_a_sorted_order_is_mixed_until_both_sides_occur():
    poses = np.sort(np.random.default_rng(0).uniform(size=(40, 6)), axis=0)
    places = visits(40, 1)
    order = balanced(poses, places, np.random.default_rng(1))
    assert sorted(order.tolist()) == list(range(40))
    rising = (np.diff(poses[order], axis=0) > 0.0).mean(axis=0)
    assert np.all(np.abs(rising - 0.5) <= schedule.BALANCED + 1e-12)


def test_conditions_have_a_value_for_each_row():
    found = conditions(50, 6.0, (1.0, 3.0))
    assert {name: len(values) for name, values in found.items()} == {"time": 50, "temperature": 50, "payload": 50}
    assert found["payload"][0] == 0.0
    assert np.bincount(np.searchsorted([0.0, 1.0, 3.0], found["payload"])).min() >= 15
    assert np.all(np.diff(found["time"]) > 0.0)
    assert 0.9 * 6.0 < np.ptp(found["temperature"]) <= 6.0
    assert "payload" not in conditions(50, 6.0)
    # forty rows without warming take ten minutes
    assert 9.0 * 60.0 < conditions(40, 0.0)["time"][-1] < 10.0 * 60.0
