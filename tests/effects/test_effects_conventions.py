"""The conventions of the formats: sign, unit and zero of every effect, from physics and not from its columns."""

import re
from dataclasses import replace

import numpy as np
import pytest
from helpers import SAMPLES, commanded, tool_at, tool_with

from thermal_robot.campaign import Campaign
from thermal_robot.effects import (
    Backlash,
    BaseFrame,
    Drift,
    Geometric,
    InstrumentScale,
    JointCompliance,
    JointGain,
    JointOffset,
    ThermalElongation,
    ToolFrame,
    TransmissionError,
)
from thermal_robot.kinematics import exp6, tool_poses
from thermal_robot.observations import Frames, observe
from thermal_robot.robot import load_robot

on_arms = pytest.mark.parametrize("arm", ["rv_m2", "ur10", "panda"], indirect=True)


@on_arms
def test_an_offset_adds_to_the_command(arm):
    campaign = commanded(arm)
    offset = 1e-2 * (1.0 + np.arange(arm.n))
    expected = tool_at(arm, campaign.q + offset)
    np.testing.assert_allclose(tool_with(campaign, JointOffset(), offset), expected, atol=1e-14)


@on_arms
def test_a_gain_multiplies_the_command(arm):
    campaign = commanded(arm)
    gain = 1e-2 * (1.0 + np.arange(arm.n))
    expected = tool_at(arm, (1.0 + gain) * campaign.q)
    np.testing.assert_allclose(tool_with(campaign, JointGain(), gain), expected, atol=1e-14)


@on_arms
def test_a_transmission_error_is_periodic_in_the_joint_and_in_the_motor(arm):
    campaign = commanded(arm, gears={arm.joint_names[1]: 101.0})
    parameters = TransmissionError().parameters(observe(campaign))
    values = 1e-3 * (1.0 + np.arange(len(parameters)))
    q = campaign.q.copy()
    for parameter, value in zip(parameters, values, strict=True):
        shape, order = re.match(r"(sine|cosine), order (\d+)", parameter.label).groups()
        j = arm.joint_names.index(parameter.place)
        q[:, j] += value * (np.sin if shape == "sine" else np.cos)(int(order) * campaign.q[:, j])
    assert len(parameters) == 4 * arm.n + 4
    np.testing.assert_allclose(tool_with(campaign, TransmissionError(), values), tool_at(arm, q), atol=1e-14)


@on_arms
def test_lost_motion_stops_half_of_it_short_of_where_the_joint_was_going(arm):
    approach = np.random.default_rng(6).choice([-1.0, 0.0, 1.0], (SAMPLES, arm.n))
    campaign = commanded(arm, {f"approach.{n}": a for n, a in zip(arm.joint_names, approach.T, strict=True)})
    lost = 2e-3 * (1.0 + np.arange(arm.n))
    expected = tool_at(arm, campaign.q - 0.5 * lost * approach)
    np.testing.assert_allclose(tool_with(campaign, Backlash(), lost), expected, atol=1e-14)


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


@on_arms
@pytest.mark.parametrize("reference", [20.0, 25.0])
def test_an_arm_that_expands_evenly_keeps_its_shape(arm, reference):
    temperature = np.linspace(15.0, 60.0, SAMPLES)
    campaign = commanded(arm, {"temperature": temperature}, reference_temperature=reference)
    effect = ThermalElongation()
    alpha = 2e-5
    grown = tool_with(campaign, effect, np.full(len(effect.parameters(observe(campaign))), alpha))
    expected = (1.0 + alpha * (temperature - reference))[:, None] * tool_at(arm, campaign.q)
    np.testing.assert_allclose(grown, expected, atol=1e-14)


@on_arms
def test_each_segment_follows_its_parent_links_own_temperature(arm):
    general = np.linspace(21.0, 30.0, SAMPLES)
    link = arm.segments[2].parent_link
    own = general + 7.0
    effect = ThermalElongation()
    uniform = commanded(arm, {"temperature": general})
    one = commanded(arm, {"temperature": general, f"temperature.{link}": own})
    for parameter, plain in zip(effect.parameters(observe(one)), effect.parameters(observe(uniform)), strict=True):
        ratio = parameter.responses[0].values[:, :3] @ plain.responses[0].values[0, :3]
        ratio /= plain.responses[0].values[:, :3] @ plain.responses[0].values[0, :3]
        expected = (own - 20.0) / (general - 20.0) if parameter.place == link else np.ones(SAMPLES)
        np.testing.assert_allclose(ratio, expected, rtol=1e-12)


@pytest.mark.parametrize("clock", ["time", "order"])
@pytest.mark.parametrize("share", [0.0, 0.1, 0.6])
def test_drift_begins_at_zero_and_reaches_its_parameters_at_the_end(rv_m2, clock, share):
    values = np.sort(np.random.default_rng(7).uniform(100.0, 900.0, SAMPLES))
    campaign = commanded(rv_m2, {clock: values})
    settings = {s.time_constant: s for s in Drift().variants(observe(campaign))}
    effect = replace(settings[0.1], time_constant=share)
    base = exp6([1.0, -2.0, 0.5, 0.4, 1.0, -0.3])
    frames = Frames(base, np.eye(4))
    still = tool_with(campaign, effect, np.zeros(6), frames)
    gone = tool_with(campaign, effect, [2e-4, -1e-4, 3e-4, 0, 0, 0], frames) - still
    np.testing.assert_allclose(gone[0], 0.0, atol=1e-14)
    np.testing.assert_allclose(gone[-1], base[:3, :3] @ [2e-4, -1e-4, 3e-4], atol=1e-14)
    elapsed = (values - values[0]) / (values[-1] - values[0])
    growth = elapsed if share == 0 else (1 - np.exp(-elapsed / share)) / (1 - np.exp(-1 / share))
    np.testing.assert_allclose(gone, growth[:, None] * gone[-1], atol=1e-14)


def test_drift_turns_the_whole_robot_about_its_base(rv_m2):
    campaign = commanded(rv_m2, {"time": np.arange(SAMPLES, dtype=float)})
    effect = Drift().variants(observe(campaign))[0]
    turned = tool_with(campaign, effect, [0, 0, 0, 0, 0, 0.1])
    angle = 0.1 * np.linspace(0, 1, SAMPLES)
    x, y, z = tool_at(rv_m2, campaign.q).T
    expected = np.stack([x * np.cos(angle) - y * np.sin(angle), x * np.sin(angle) + y * np.cos(angle), z], axis=1)
    np.testing.assert_allclose(turned, expected, atol=1e-14)


@on_arms
def test_a_scale_error_stretches_what_is_measured_about_the_instruments_origin(arm):
    campaign = commanded(arm)
    frames = Frames(exp6([1.0, -2.0, 0.5, 0.4, 1.0, -0.3]), exp6([0.1, 0, 0.05, 0, 0, 0]))
    true = tool_with(campaign, InstrumentScale(), [0.0], frames)
    np.testing.assert_allclose(tool_with(campaign, InstrumentScale(), [2e-4], frames), 1.0002 * true, atol=1e-14)


def test_declared_frames_are_off_by_a_twist_in_root_and_tool(rv_m2):
    campaign = commanded(rv_m2, base_known=True, tool_known=True, target=[0.01, 0.02, 0.1])
    poses = tool_poses(rv_m2, campaign.q)
    nominal = tool_with(campaign, BaseFrame(), np.zeros(6))
    shift = np.array([1e-3, 2e-3, -3e-3])
    moved = tool_with(campaign, BaseFrame(), [*shift, 0, 0, 0]) - nominal
    np.testing.assert_allclose(moved, np.broadcast_to(shift, moved.shape), atol=1e-14)
    np.testing.assert_allclose(tool_with(campaign, ToolFrame(), shift) - nominal, poses[:, :3, :3] @ shift, atol=1e-14)


@on_arms
def test_a_geometric_error_is_an_edited_urdf(arm):
    """A twist of a placement is the URDF's origin moved and turned: write that into the URDF and compare."""
    import xml.etree.ElementTree as ElementTree

    from scipy.spatial.transform import Rotation

    campaign = commanded(arm)
    effect = Geometric()
    parameters = effect.parameters(observe(campaign))
    values = np.where([p.unit == "m" for p in parameters], 2e-3, 3e-3) * np.cos(np.arange(len(parameters)))
    tree = ElementTree.fromstring(arm.urdf)
    origins = {j.get("name"): j for j in tree.findall("joint")}
    for k in range(0, len(parameters), 6):
        joint = origins[parameters[k].label.split(" of ")[1]]
        origin = joint.find("origin")
        if origin is None:
            origin = ElementTree.SubElement(joint, "origin")
        place = np.eye(4)
        place[:3, 3] = [float(v) for v in origin.get("xyz", "0 0 0").split()]
        rpy = [float(v) for v in origin.get("rpy", "0 0 0").split()]
        place[:3, :3] = Rotation.from_euler("xyz", rpy).as_matrix()
        place = place @ exp6(values[k : k + 6])
        origin.set("xyz", " ".join(repr(float(v)) for v in place[:3, 3]))
        turned = Rotation.from_matrix(place[:3, :3]).as_euler("xyz")
        origin.set("rpy", " ".join(repr(float(v)) for v in turned))
    edited = load_robot(ElementTree.tostring(tree, encoding="unicode"), arm.tool_frame, root_frame=arm.root_frame)
    expected = tool_at(edited, campaign.q)
    assert np.abs(expected - tool_at(arm, campaign.q)).max() > 1e-3
    np.testing.assert_allclose(tool_with(campaign, effect, values), expected, atol=1e-12)
