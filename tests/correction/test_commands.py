"""Corrected commands: the real target reaches the nominal pose, by the model and on robots that know nothing of it."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from simulate import commands as drawn
from simulate import conditions, draw_effect, further_conditions

from thermal_robot import CorrectedModel, diagnose, read_campaign
from thermal_robot.blind.cases import Case, RobotChoice
from thermal_robot.campaign import Campaign
from thermal_robot.correction.model import FARTHEST
from thermal_robot.effects.apply import displacement
from thermal_robot.errors import CampaignError
from thermal_robot.kinematics import frame_jacobians, tool_poses
from thermal_robot.observations import Frames, observe
from thermal_robot.robot import load_robot

ROWS = 40
CHAIN = ("joint_offset", "joint_gain", "backlash", "joint_compliance", "geometric", "thermal_elongation", "drift")
"""Effects that displace the chain or its base; of each the expected size, which is a fraction of a millimetre."""


def rows_of(robot, seed=0, rows=ROWS):
    """Nominal poses and conditions; of arms with six joints and more those far from singular poses."""
    rng = np.random.default_rng(seed)
    q = drawn(robot, 20 * rows, rng)
    if robot.n >= 6:
        q = q[np.linalg.svd(frame_jacobians(robot, q), compute_uv=False)[:, 5] > 0.05]
    q = q[:rows]
    covariates = {**conditions(robot, q, rng, 2.0), **further_conditions(robot, q, rng, True, False)}
    return Campaign("poses", robot, q, covariates=covariates, payload_com=np.array([0.0, 0.0, 0.05]))


def model_of(samples, names, seed=0, scale=1.0):
    """A corrected model that holds effects with drawn values."""
    rng, tool = np.random.default_rng(seed), np.eye(4)
    tool[:3, 3] = 0.02, -0.03, 0.1
    base = np.eye(4)
    base[:3, 3] = 1.0, 2.0, 0.5
    frames = Frames(base, tool)
    nominal = observe(samples, frames)
    effects = []
    for name in names:
        effect, values = draw_effect(name, nominal, rng)
        effects.append((effect, scale * values))
    return CorrectedModel(
        samples.robot, samples.settings, frames, tuple(effects), "position", tuple(samples.covariates)
    )


def really(model, samples, q):
    """Where the model's chain brings the target at joint positions, root frame."""
    there = replace(samples, q=q)
    moved = displacement(observe(there, model.frames), model.effects)[0]
    return tool_poses(samples.robot, q, moved) @ model.frames.tool


@pytest.mark.parametrize("name", CHAIN)
def test_the_real_target_reaches_the_nominal_pose(name):
    robot = load_robot("example-robot-data:ur10", "tool0")
    samples = rows_of(robot)
    model = model_of(samples, [name], seed=3)
    wanted = tool_poses(robot, samples.q) @ model.frames.tool
    before = np.linalg.norm((really(model, samples, samples.q) - wanted)[:, :3, 3], axis=1)
    found = model.corrected_commands(samples)
    reached = really(model, samples, found.q)
    assert before.max() > 1e-5
    np.testing.assert_allclose(reached, wanted, rtol=0, atol=1e-9)
    assert found.direction.max() < 1e-8


def test_all_at_once_with_five_six_and_seven_joints(rv_m2):
    panda = load_robot("example-robot-data:panda", "panda_hand")
    for robot in (rv_m2, load_robot("example-robot-data:ur10", "tool0"), panda):
        samples = rows_of(robot, seed=4)
        model = model_of(samples, CHAIN, seed=4)
        found = model.corrected_commands(samples)
        wanted = tool_poses(robot, samples.q) @ model.frames.tool
        reached = really(model, samples, found.q)
        np.testing.assert_allclose(reached[:, :3, 3], wanted[:, :3, 3], rtol=0, atol=1e-9)
        farthest = [FARTHEST[kind] for kind in robot.joint_types]
        assert (np.abs(found.q - samples.q) <= farthest).all()
        assert (found.direction.max() < 1e-8) == (robot.n >= 6)


def test_commands_stay_where_nothing_moves_the_chain_and_a_zero_is_taken_off(rv_m2):
    samples = rows_of(rv_m2)
    np.testing.assert_array_equal(model_of(samples, CHAIN, scale=0.0).corrected_commands(samples).q, samples.q)
    # what the instrument adds moves no robot
    scale, zeros = model_of(samples, ["instrument_scale"]), model_of(samples, ["joint_offset"], seed=5)
    assert scale.effects[0][1].any()
    np.testing.assert_array_equal(scale.corrected_commands(samples).q, samples.q)
    found = zeros.corrected_commands(samples)
    np.testing.assert_allclose(found.q, samples.q - zeros.effects[0][1], rtol=0, atol=1e-9)


def test_conditions_and_directions_count(rv_m2):
    samples = rows_of(rv_m2, rows=10)
    model = model_of(samples, ["joint_compliance", "backlash", "thermal_elongation"], seed=6)
    told = {name: values[0] for name, values in samples.covariates.items()}
    one = model.corrected_commands(samples.q, told)
    for change in (
        {"payload": 5.0},
        {"temperature": 35.0},
        {f"approach.{j}": -told[f"approach.{j}"] for j in rv_m2.joint_names},
    ):
        assert np.abs(model.corrected_commands(samples.q, {**told, **change}).q - one.q).max() > 1e-6
    with pytest.raises(CampaignError, match="temperature"):
        model.corrected_commands(samples.q, {name: value for name, value in told.items() if name != "temperature"})
    with pytest.raises(CampaignError, match="no rows of numbers"):
        model.corrected_commands(samples.q, {**told, "payload": [1.0, 2.0]})


def test_what_is_out_of_reach_is_an_error_with_its_row(rv_m2):
    samples = rows_of(rv_m2, rows=12)
    model = model_of(samples, ["joint_offset"])
    effect, _ = model.effects[0]
    far = replace(model, effects=((effect, np.array([0.0, 0.5, 0.0, 0.0, 0.0])),))  # half a radian: another posture
    with pytest.raises(CampaignError, match=r"row 2: .*out of reach.*11 more rows.*mm are left"):
        far.corrected_commands(samples)
    at_limit = samples.q.copy()
    at_limit[7] = rv_m2.upper
    back = replace(model, effects=((effect, np.full(5, -0.05)),))  # the real joints would have to go beyond their ends
    with pytest.raises(CampaignError, match=r"row 9: .*out of reach"):
        back.corrected_commands(replace(samples, q=at_limit))


def test_no_command_lies_beyond_a_limit(rv_m2):
    samples = rows_of(rv_m2, rows=6)
    model = model_of(samples, ["joint_offset"])
    model = replace(model, effects=((model.effects[0][0], np.array([0.0, 1e-3, 0.0, 0.0, 0.0])),))

    def at(position):
        q = samples.q.copy()
        q[4, 1] = position
        return replace(samples, q=q)

    upper = rv_m2.upper[1]
    # the real joint is ahead of its command: at its limit, and beyond it by what the zero is off, a command lies within
    for position in (upper, upper + 0.9e-3):
        found = model.corrected_commands(at(position)).q
        assert (found <= rv_m2.upper).all()
        np.testing.assert_allclose(found[4, 1], position - 1e-3, atol=1e-9)
    degrees = replace(at(4.0), units=type(samples.units)("deg", "mm"))
    for poses, told in (
        (at(upper + 2e-3), r"row 6, column 'joint_2': .*beyond its limit"),
        (at(4.0), r"row 6, column 'joint_2': .*found 4 rad, expected.*1\.745"),
        (degrees, r"found 229.183 deg \(4 rad\), expected a position from"),
    ):
        with pytest.raises(CampaignError, match=told):
            model.corrected_commands(poses)
    with pytest.raises(CampaignError, match=r"nor in 5 more rows.*arrays are in rad"):
        model.corrected_commands(np.degrees(samples.q), {name: 0.0 for name in samples.covariates})


def test_a_data_frame_comes_back_with_commands_in_its_own_units(rv_m2):
    samples = rows_of(rv_m2, rows=6)
    samples = replace(samples, units=type(samples.units)("deg", "um"))
    model = model_of(samples, ["joint_offset"], seed=7)
    table = pd.DataFrame(np.degrees(samples.q), columns=list(rv_m2.joint_names))
    table = table.assign(part="a bolt", x=1.0, **samples.covariates)
    commands = model.corrected_commands(table)
    answer = model.commanded(table, commands)
    np.testing.assert_allclose(answer[list(rv_m2.joint_names)], np.degrees(commands.q))
    assert "x" not in answer
    assert list(answer.columns)[:5] == list(rv_m2.joint_names)
    assert list(answer.columns)[-5:] == ["std.x", "std.y", "std.z", "outside", "miss.direction"]
    assert (answer["part"] == "a bolt").all()


@pytest.mark.slow
@pytest.mark.parametrize("source", ["builtin:rv_m2", "example-robot-data:ur10"])
def test_poses_in_space_are_reached_by_the_real_target(source):
    robot = load_robot(source, "tool0")
    samples = rows_of(robot, rows=10)
    model = model_of(samples, ["joint_offset", "joint_compliance"], seed=8)
    wanted = tool_poses(robot, samples.q) @ model.frames.tool
    found = model.corrected_commands(wanted, {name: 0.0 for name in samples.covariates})
    there = replace(samples, covariates={name: np.zeros(10) for name in samples.covariates})
    reached = really(model, there, found.q)
    np.testing.assert_allclose(reached[:, :3, 3], wanted[:, :3, 3], rtol=0, atol=1e-9)
    away = wanted.copy()
    away[3, :3, 3] += 10.0
    for poses, told in (
        (away, "row 4: out of reach"),
        (2.0 * wanted, "no poses"),
        ([[["a"]]], "no poses"),
        ([[0.1], [0.1, 0.2]], "no rows of numbers"),
    ):
        with pytest.raises(CampaignError, match=told):
            model.corrected_commands(poses, there.covariates)


ROBOTS = {"rv_m2": ("builtin:rv_m2", "tool0"), "ur10": ("example-robot-data:ur10", "tool0")}
"""Robots of the proof, with their tool frames."""


def on_the_floor(robot, effect, seed, folder, monkeypatch):
    """A campaign of the trial's reality, and a function that runs its further rows again at other commands.

    The reality is MuJoCo's, with physics of its own: it shares no formula with the program.
    """
    from thermal_robot.blind.reality import instrument, make

    kept, place = [], instrument.place

    def noted(setting, faults, target, pose):
        kept.append((setting, faults, target, pose))
        return place(setting, faults, target, pose)

    monkeypatch.setattr(instrument, "place", noted)
    source, tool = ROBOTS[robot]
    case = Case(
        "proof", seed, "single", RobotChoice(robot, load_robot(source, tool).urdf, tool), (effect,), samples=(120, 120)
    )
    folder.mkdir(exist_ok=True)
    answers = make(case, folder)
    assert "withdrawn" not in answers
    setting, faults, target, pose = kept[-1]
    others = np.flatnonzero(~setting.given)

    def again(q):
        whole = setting.q.copy()
        whole[others] = q
        poses, torque = setting.world.poses(whole, setting.payload, setting.world.sound(setting.samples))
        return place(replace(setting, q=whole, poses=poses, torque=torque), faults, target, pose)[0][others]

    return answers, again


def rms(values):
    """Per axis."""
    return np.sqrt((values**2).mean())


@pytest.mark.slow
@pytest.mark.parametrize("robot", list(ROBOTS))
def test_a_robot_on_the_floor_goes_where_its_model_says(robot, tmp_path, monkeypatch):
    effects, named = [name for name in CHAIN if name != "drift"], []
    for effect in effects:
        folder = tmp_path / effect
        answers, again = on_the_floor(robot, effect, 11, folder, monkeypatch)
        found = diagnose(read_campaign(folder))
        poses = found.model.samples(folder / "fresh.csv")
        nominal = observe(poses, found.model.frames).predicted_position
        predicted = found.model.prediction(poses)[0] - np.array(answers["fresh_position"])
        left = again(found.model.corrected_commands(poses).q) - nominal
        # what is wrong with the robot then is what was wrong with the prediction, and nothing else
        assert abs(rms(left) - rms(predicted)) < 0.05 * answers["noise"]
        if found.verdict == (effect,):
            noise = answers["noise"] * np.random.default_rng(12).normal(size=nominal.shape)
            before, after = (rms(gap + noise) / answers["noise"] for gap in (again(poses.q) - nominal, left))
            print(f"{robot} {effect}: {before:.2f} -> {after:.3f} times the noise")
            assert before > 1.5
            assert after <= 1.3
            named.append(effect)
    # of rv_m2's lost motion, which the load decides, four rows tell, and they are taken for outliers
    assert len(named) >= len(effects) - 1
