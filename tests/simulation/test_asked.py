"""What may be asked of a simulation: rows, conditions, effects, frames, an instrument; and what is refused."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from thermal_robot import CampaignError, EffectError, RobotError, demo_campaign, load_robot, simulate
from thermal_robot.effects import Drift, Effect, Parameter, at_joint
from thermal_robot.planning import plan
from thermal_robot.simulation import schedule
from thermal_robot.simulation.schedule import balanced, conditions, in_turn, visits

TARGET = (0.05, 0.03, 0.1)


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
