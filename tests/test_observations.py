"""Where robot meets campaign: the gap as it is defined, and every sensitivity against differences of the gap."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import commanded, without_masses
from several import FLAT, table_of

from thermal_robot import observations
from thermal_robot.campaign import Campaign, campaign_from_table
from thermal_robot.kinematics import (
    Displacement,
    exp3,
    exp6,
    gravity_torques,
    log3,
    quaternion_to_rotation,
    rotation_to_quaternion,
    tool_poses,
)
from thermal_robot.observations import Frames, observe

STEP = 1e-5
TOLERANCE = 2e-8  # STEP² times lengths of some metres, and rounding over STEP


@pytest.fixture
def frames():
    """A tracker metres away and turned at random, a target that is turned and off the flange."""
    return Frames(exp6([2.0, -1.5, 0.7, 0.9, -2.0, 0.4]), exp6([0.05, -0.02, 0.11, 0.3, 0.8, -0.5]))


@pytest.fixture(params=["rv_m2", "awkward"])
def robot(request):
    return request.getfixturevalue(request.param)


def measured_exactly(robot, frames, rows=12, seed=3):
    """A campaign of poses in which the robot is where its model says."""
    rng = np.random.default_rng(seed)
    q = rng.uniform(np.maximum(robot.lower, -2.0), np.minimum(robot.upper, 2.0), (rows, robot.n))
    poses = frames.base @ tool_poses(robot, q) @ frames.tool
    return Campaign("exact", robot, q, poses[:, :3, 3], rotation_to_quaternion(poses[:, :3, :3]))


def shifted(campaign, shift, turn):
    """The same campaign, each target moved by ``shift`` and turned by ``turn``, measurement frame axes."""
    rotation = exp3(turn) @ quaternion_to_rotation(campaign.orientation)
    return replace(campaign, position=campaign.position + shift, orientation=rotation_to_quaternion(rotation))


def test_the_gap_is_measured_minus_predicted_in_the_axes_of_the_root(robot, frames):
    campaign, rng = measured_exactly(robot, frames), np.random.default_rng(4)
    shift, turn = 1e-3 * rng.normal(size=(12, 3)), 0.2 * rng.normal(size=(12, 3))
    turned = frames.base[:3, :3]
    np.testing.assert_allclose(observe(campaign, frames).gap, 0.0, atol=2e-14)
    moved = shifted(campaign, shift @ turned.T, turn @ turned.T)
    np.testing.assert_allclose(observe(moved, frames).gap, np.hstack([shift, turn]), atol=1e-13)
    np.testing.assert_allclose(observe(replace(moved, orientation=None), frames).gap, shift, atol=1e-13)
    # either sign of a quaternion is the same gap, and what the instrument adds is taken off
    flipped = replace(campaign, orientation=-campaign.orientation)
    np.testing.assert_allclose(observe(flipped, frames).gap, observe(campaign, frames).gap, atol=1e-14)
    added = replace(campaign, position=campaign.position + shift)
    np.testing.assert_allclose(observe(added, frames, instrument=shift).gap, 0.0, atol=2e-14)


def test_without_measurements_there_is_no_gap_to_ask_for(rv_m2):
    seen = observe(commanded(rv_m2))
    np.testing.assert_allclose(seen.predicted_position, tool_poses(rv_m2, seen.q)[:, :3, 3], atol=1e-15)
    with pytest.raises(ValueError, match="no measurements"):
        _ = seen.gap


def response(campaign, frames, displace):
    """Change (N, 6) of the gap for a unit of a displacement: what the target does, with its sign turned."""
    below, above = (observe(campaign, frames, displacement=displace(h)).gap for h in (-STEP, STEP))
    return (below - above) / (2 * STEP)


def answers(robot, frames, campaign):
    """Assert that every sensitivity is the difference of the gap."""
    seen = observe(campaign, frames)
    for j, unit in enumerate(np.eye(robot.n)):
        moved = response(campaign, frames, lambda h, u=unit: Displacement(joint=h * u))
        np.testing.assert_allclose(seen.joint_sensitivity[:, :, j], moved, atol=TOLERANCE)
    for axis, unit in enumerate(np.eye(6)):
        moved = response(campaign, frames, lambda h, u=unit: Displacement(base=h * u))
        np.testing.assert_allclose(seen.base_sensitivity[:, :, axis], moved, atol=TOLERANCE)
        moved = response(campaign, frames, lambda h, u=unit: Displacement(tool=h * u))
        np.testing.assert_allclose(seen.tool_sensitivity[:, :, axis], moved, atol=TOLERANCE)
        for s in range(len(robot.segments)):
            twists = np.zeros((len(robot.segments), 6))
            twists[s] = unit
            moved = response(campaign, frames, lambda h, t=twists: Displacement(segment=h * t))
            np.testing.assert_allclose(seen.segment_sensitivity[:, :, s, axis], moved, atol=TOLERANCE)


def test_sensitivities_are_how_the_target_answers(robot, frames):
    answers(robot, frames, measured_exactly(robot, frames))


def test_a_base_that_stands_elsewhere_is_a_twist_of_the_base(rv_m2, frames):
    campaign, twist = measured_exactly(rv_m2, frames), 1e-6 * np.array([1.0, -2.0, 3.0, 0.5, -0.4, 0.3])
    elsewhere = Frames(frames.base @ exp6(twist), frames.tool)
    expected = observe(campaign, frames).base_sensitivity @ twist
    np.testing.assert_allclose(observe(campaign, elsewhere).gap, -expected, atol=1e-11)


def test_declared_frames_are_the_root_and_the_target(rv_m2):
    declared, tool = Frames.declared(commanded(rv_m2, target=np.array([0.01, 0.02, 0.03]))), np.eye(4)
    tool[:3, 3] = 0.01, 0.02, 0.03
    np.testing.assert_array_equal([declared.base, declared.tool], [np.eye(4), tool])


def test_the_command_is_what_effects_follow(rv_m2):
    campaign = commanded(rv_m2)
    plain = observe(campaign)
    moved = observe(campaign, displacement=Displacement(joint=np.full(5, 0.1)))
    assert plain.commanded is plain.chain
    assert np.abs(moved.chain.tool_position - plain.chain.tool_position).max() > 0.01
    np.testing.assert_array_equal(moved.commanded.tool_position, plain.chain.tool_position)


def test_what_was_forgotten_is_computed_again(rv_m2):
    seen = observe(commanded(rv_m2))
    before = seen.segment_sensitivity
    held = set(vars(seen))
    seen.forget()
    assert held - set(vars(seen)) == {"chain", "segment_sensitivity", "sight"}
    assert seen.segment_sensitivity is not before
    np.testing.assert_array_equal(seen.segment_sensitivity, before)


def test_few_observations_hold_their_kinematics_at_once(rv_m2, monkeypatch):
    campaign = commanded(rv_m2)
    monkeypatch.setattr(observations, "HELD_ROWS", 3 * campaign.samples)
    several = [observe(campaign) for _ in range(4)]
    alike = [seen.segment_sensitivity for seen in several]
    assert ["chain" in vars(seen) for seen in several] == [False, True, True, True]
    np.testing.assert_array_equal(several[0].segment_sensitivity, alike[0])
    assert ["chain" in vars(seen) for seen in several] == [True, False, True, True]


def test_a_simulators_word_stands_for_the_urdf(rv_m2, frames):
    """The prediction is the simulator's; what is displaced moves it as it moves the model."""
    plain = measured_exactly(rv_m2, frames)
    turned = np.random.default_rng(7).normal(size=(12, 4))
    said = replace(
        plain,
        simulated_position=np.random.default_rng(6).normal(size=(12, 3)),
        simulated_orientation=turned / np.linalg.norm(turned, axis=1, keepdims=True),
    )
    seen = observe(said, frames)
    np.testing.assert_allclose(seen.position, said.simulated_position, atol=1e-15)
    np.testing.assert_allclose(seen.rotation, quaternion_to_rotation(said.simulated_orientation), atol=1e-14)
    moved = Displacement(joint=np.array([0.0, 0.01, 0.0, -0.02, 0.0]))
    ours, theirs = observe(said, frames, displacement=moved), observe(plain, frames, displacement=moved)
    model = observe(plain, frames)
    np.testing.assert_allclose(ours.position - seen.position, theirs.position - model.position, atol=1e-14)
    turns = (o.rotation @ p.rotation.transpose(0, 2, 1) for o, p in ((ours, seen), (theirs, model)))
    np.testing.assert_allclose(*(log3(turn) for turn in turns), atol=1e-14)


def test_a_covariate_is_read_for_a_row_a_link_or_the_clock(rv_m2):
    time, order = np.linspace(0, 90, 10), np.arange(10.0)
    hall, arm = np.linspace(20, 25, 10), np.linspace(30, 40, 10)
    bare, ordered = observe(commanded(rv_m2)), observe(commanded(rv_m2, {"order": order}))
    recorded = {"order": order, "time": time, "temperature": hall, "temperature.upper_arm": arm, "payload": np.ones(10)}
    seen = observe(commanded(rv_m2, recorded))
    assert bare.clock is bare.temperature("forearm") is None
    np.testing.assert_array_equal(ordered.clock, order)
    np.testing.assert_array_equal(seen.clock, time)
    np.testing.assert_array_equal(seen.temperature("upper_arm"), arm)
    np.testing.assert_array_equal(seen.temperature("forearm"), hall)
    assert [seen.varies(column) for column in ("time", "payload", "speed")] == [True, False, False]


def test_torque_is_reported_or_else_what_holds_the_arm(rv_m2):
    reported, payload, com = np.linspace(-1, 1, 10), np.linspace(0.5, 2, 10), np.array([0.0, 0.01, 0.05])
    seen = observe(commanded(rv_m2, {"payload": payload, "torque.joint_3": reported}, payload_com=com))
    expected = gravity_torques(rv_m2, seen.q, payload=payload, payload_com=com)
    expected[:, 2] = reported
    np.testing.assert_array_equal(seen.torque, expected)
    # the last segment carries the payload, and so do all before it
    weight = np.linalg.norm((seen.segment_load - observe(commanded(rv_m2)).segment_load)[:, :, :3], axis=2)
    np.testing.assert_allclose(weight, np.tile(9.81 * payload[:, None], (1, len(rv_m2.segments))), rtol=1e-12)
    # nothing weighs where nothing is known to
    bare = without_masses(rv_m2)
    assert observe(commanded(bare)).torque is None
    assert observe(commanded(bare, {"payload": payload})).torque is not None
    only = observe(commanded(bare, {"torque.joint_2": np.ones(10)})).torque
    np.testing.assert_array_equal(only, np.tile([0.0, 1.0, 0.0, 0.0, 0.0], (10, 1)))


def several(robot, frames):
    """Exact poses that several targets tell."""
    poses = measured_exactly(robot, frames, rows=6)
    table = table_of(poses, FLAT, np.random.default_rng(0), noise=0.0)
    return replace(poses, targets=campaign_from_table(robot, table).targets)


def test_what_several_targets_tell_turns_about_the_axes_of_their_frame(rv_m2, frames):
    rng = np.random.default_rng(5)
    campaign = shifted(several(rv_m2, frames), 1e-3 * rng.normal(size=(6, 3)), 0.1 * rng.normal(size=(6, 3)))
    plain, seen = observe(replace(campaign, targets=None), frames), observe(campaign, frames)
    np.testing.assert_array_equal(seen.gap[:, :3], plain.gap[:, :3])
    measured = quaternion_to_rotation(campaign.orientation)
    again = frames.base[:3, :3] @ seen.rotation @ exp3(seen.gap[:, 3:])
    np.testing.assert_allclose(again, measured, atol=1e-12)


def test_sensitivities_are_how_the_frame_of_several_targets_answers(rv_m2, frames):
    answers(rv_m2, frames, several(rv_m2, frames))
