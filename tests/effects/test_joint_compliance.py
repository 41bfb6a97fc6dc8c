"""Joints that yield to their torque: energy, sensors, and weights that nobody wrote down."""

import re
from dataclasses import replace

import numpy as np
import pytest
from helpers import SAMPLES, commanded, tool_at, tool_with, without_masses

from thermal_robot.campaign import Campaign
from thermal_robot.effects import JointCompliance
from thermal_robot.observations import observe
from thermal_robot.robot import load_robot

on_arms = pytest.mark.parametrize("arm", ["rv_m2", "ur10", "panda"], indirect=True)


@pytest.mark.parametrize("name", ["rv_m2", "awkward"])
def test_a_loaded_elastic_arm_sinks(name, request):
    robot = request.getfixturevalue(name)
    bare = re.sub(r"<inertial>.*?</inertial>", "", robot.urdf, flags=re.DOTALL)
    down = np.array([0.3, -0.2, -9.0])
    robot = load_robot(bare, robot.tool_frame, root_frame=robot.root_frame, gravity=down)
    mass, place = 3.0, np.array([0.02, -0.01, 0.05])
    campaign = commanded(robot, {"payload": np.full(SAMPLES, mass)}, payload_com=place, target=place)
    compliance = 1e-8 * (1.0 + np.arange(robot.n))
    fallen = tool_with(campaign, JointCompliance(), compliance) - tool_with(campaign, JointCompliance(), 0 * compliance)
    # the load's potential energy pays for the work: m g·Δx = Σ c τ², τ what holds the load still
    arm = observe(campaign).joint_sensitivity[:, :3]
    torque = -np.einsum("nrj,r->nj", arm, mass * down)
    released = mass * fallen @ down
    assert (released > 0.0).all()
    np.testing.assert_allclose(released, torque**2 @ compliance, rtol=1e-5)


def test_an_outstretched_arm_sinks_under_its_own_weight(rv_m2):
    campaign = Campaign("stretched", rv_m2, np.zeros((1, 5)))
    level = tool_with(campaign, JointCompliance(), np.zeros(5))
    for j in (1, 2, 3):
        sunk = tool_with(campaign, JointCompliance(), 1e-5 * np.eye(5)[j]) - level
        assert sunk[0, 2] < -1e-6
        assert abs(sunk[0, 0]) < 1e-12


@on_arms
def test_a_torque_sensor_replaces_the_computed_torque_with_the_same_sign(arm):
    plain = commanded(arm)
    computed = observe(plain).torque
    values = 1e-5 * (1.0 + np.arange(arm.n))
    expected = tool_with(plain, JointCompliance(), values)
    columns = {f"torque.{n}": t for n, t in zip(arm.joint_names, computed.T, strict=True)}
    sensed = replace(plain, covariates=columns)
    np.testing.assert_allclose(tool_with(sensed, JointCompliance(), values), expected, atol=1e-14)
    doubled = replace(plain, covariates={k: 2.0 * v for k, v in columns.items()})
    np.testing.assert_allclose(
        tool_with(doubled, JointCompliance(), values),
        tool_at(arm, plain.q - 2.0 * values * computed),
        atol=1e-14,
    )


def test_torques_that_are_known_leave_no_weight_free(rv_m2):
    campaign = commanded(without_masses(rv_m2), {"torque.joint_2": np.linspace(1.0, 9.0, 10)})
    assert JointCompliance().variants(observe(campaign)) == (JointCompliance(),)
    assert JointCompliance().variants(observe(commanded(rv_m2))) == (JointCompliance(),)
    free = JointCompliance().variants(observe(commanded(without_masses(rv_m2))))[0]
    assert {p.unit for p in free.parameters(observe(commanded(without_masses(rv_m2))))} == {"rad"}
    assert "joint_1" not in {p.place for p in free.parameters(observe(commanded(without_masses(rv_m2))))}


@on_arms
def test_free_shapes_hold_the_true_torques(arm):
    """Whatever the masses are, the torque of each joint is a sum of its shapes: to within those that were left out."""
    bare, whole = commanded(without_masses(arm)), observe(commanded(arm))
    free = JointCompliance().variants(observe(bare))[0]
    shapes = [(r.index, r.values) for p in free.parameters(observe(bare)) for r in p.responses]
    largest = np.abs(whole.torque).max()
    for j in range(arm.n):
        own = [values for index, values in shapes if index == j]
        torque = whole.torque[:, j]
        if not own:
            assert np.ptp(torque) < 0.05 * largest
            continue
        basis = np.column_stack(own)
        left = torque - basis @ np.linalg.lstsq(basis, torque, rcond=None)[0]
        assert np.abs(left).max() < 0.05 * largest


def test_it_is_drawn_against_the_torque_that_it_yields_to(awkward):
    observations = observe(commanded(awkward))
    kinds = dict(zip(awkward.joint_names, awkward.joint_types, strict=True))
    for parameter in JointCompliance().parameters(observations):
        slides = kinds[parameter.place] == "prismatic"
        assert parameter.unit == ("m/N" if slides else "rad/(N·m)")
        response = parameter.responses[0].values
        name, unit, values = JointCompliance().driver(observations, [parameter], response)
        assert (name, unit) == (f"torque of {parameter.place}", "N" if slides else "N·m")
        np.testing.assert_array_equal(values, -response)


def test_without_masses_it_is_drawn_against_what_was_fitted(rv_m2):
    observations = observe(commanded(without_masses(rv_m2)))
    free = JointCompliance().variants(observations)[0]
    parameter = free.parameters(observations)[0]
    name, unit, values = free.driver(observations, [parameter], 3e-4 * parameter.responses[0].values)
    assert (name, unit) == (f"fitted torque of {parameter.place}", "relative")
    assert np.abs(values).max() == pytest.approx(1.0)


def test_a_model_of_old_says_the_shapes_joints_by_number(rv_m2):
    free = JointCompliance().variants(observe(commanded(without_masses(rv_m2))))[0]
    assert len(free.joints) > 1
    assert JointCompliance(joints=free.joints, weights=free.weights) == free
