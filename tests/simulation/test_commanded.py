"""Rows of a simulation: drawn, given, or those of a campaign, under the conditions that are asked for."""

from dataclasses import replace

import numpy as np
import pytest

from thermal_robot import (
    CampaignError,
    demo_campaign,
    load_robot,
    simulate,
)
from thermal_robot.planning import plan

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
    ],
)
def test_rows_that_no_campaign_has_are_refused(rv_m2, given, message):
    with pytest.raises(CampaignError, match=message):
        simulate(rv_m2, **given)
