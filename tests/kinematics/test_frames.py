"""The four channels: the exactly displaced robot against its linear response, by central differences."""

import numpy as np
import pytest

from thermal_robot import kinematics as kin

STEP = 1e-5
TOLERANCE = 2e-9  # STEP² times lengths of a metre or two, and rounding over STEP


def twist_between(before, after):
    """Twist (N, 6) in root axes, at the tool, that carries one pose to the other in a unit of time."""
    turn = kin.log3(after[:, :3, :3] @ np.swapaxes(before[:, :3, :3], 1, 2))
    return np.concatenate([after[:, :3, 3] - before[:, :3, 3], turn], axis=1)


def central_difference(robot, q, displace):
    """Twist of the tool for a unit of what ``displace`` scales."""
    below, above = (kin.tool_poses(robot, q, displace(step)) for step in (-STEP, STEP))
    return twist_between(below, above) / (2 * STEP)


@pytest.fixture
def displaced(arm):
    """Large errors everywhere but in the segments, to differentiate about."""
    rng = np.random.default_rng(5)
    return kin.Displacement(joint=rng.normal(0, 0.3, arm.n), base=rng.normal(0, 0.3, 6), tool=rng.normal(0, 0.3, 6))


def test_joint_channel_is_the_jacobian(arm, configurations, displaced):
    q = configurations(arm, 20)
    jacobians = kin.frame_jacobians(arm, q, frames=kin.chain_frames(arm, q, displaced))
    for j, unit in enumerate(np.eye(arm.n)):
        response = central_difference(
            arm,
            q,
            lambda h, u=unit: kin.Displacement(joint=displaced.joint + h * u, base=displaced.base, tool=displaced.tool),
        )
        np.testing.assert_allclose(jacobians[:, :, j], response, rtol=0.0, atol=TOLERANCE)


def test_segment_channel_is_the_placement_sensitivity(arm, configurations, displaced):
    q = configurations(arm, 20)
    sensitivities = kin.placement_sensitivities(arm, q, frames=kin.chain_frames(arm, q, displaced))
    units = np.eye(len(arm.segments) * 6).reshape(-1, len(arm.segments), 6)
    for column, unit in enumerate(units):
        response = central_difference(
            arm, q, lambda h, u=unit: kin.Displacement(displaced.joint, h * u, displaced.base, displaced.tool)
        )
        expected = sensitivities.reshape(len(q), 6, -1)[:, :, column]
        np.testing.assert_allclose(expected, response, rtol=0.0, atol=TOLERANCE)


def test_base_channel_moves_the_whole_robot(arm, configurations):
    q = configurations(arm, 20)
    position = kin.tool_poses(arm, q)[:, :3, 3]
    for unit in np.eye(6):
        response = central_difference(arm, q, lambda h, u=unit: kin.Displacement(base=h * u))
        expected = np.concatenate([unit[:3] + np.cross(unit[3:], position), np.tile(unit[3:], (20, 1))], axis=1)
        np.testing.assert_allclose(expected, response, rtol=0.0, atol=TOLERANCE)


def test_tool_channel_turns_with_the_tool(arm, configurations):
    q = configurations(arm, 20)
    rotation = kin.tool_poses(arm, q)[:, :3, :3]
    for unit in np.eye(6):
        response = central_difference(arm, q, lambda h, u=unit: kin.Displacement(tool=h * u))
        expected = np.concatenate([rotation @ unit[:3], rotation @ unit[3:]], axis=1)
        np.testing.assert_allclose(expected, response, rtol=0.0, atol=TOLERANCE)


def test_what_the_sum_of_the_channels_leaves_out_is_of_second_order(arm, configurations):
    q = configurations(arm, 20)
    rng = np.random.default_rng(6)
    joint, base, tool = rng.normal(size=arm.n), rng.normal(size=6), rng.normal(size=6)
    segment = rng.normal(size=(len(arm.segments), 6))
    nominal = kin.tool_poses(arm, q)
    rotation, position = nominal[:, :3, :3], nominal[:, :3, 3]
    linear = kin.frame_jacobians(arm, q) @ joint
    linear += np.einsum("nask,sk->na", kin.placement_sensitivities(arm, q), segment)
    linear += np.concatenate([base[:3] + np.cross(base[3:], position), np.tile(base[3:], (20, 1))], axis=1)
    linear += np.concatenate([rotation @ tool[:3], rotation @ tool[3:]], axis=1)

    def left_out(size):
        errors = kin.Displacement(size * joint, size * segment, size * base, size * tool)
        return np.linalg.norm(twist_between(nominal, kin.tool_poses(arm, q, errors)) - size * linear)

    assert left_out(1e-3) / left_out(1e-4) == pytest.approx(100.0, rel=0.1)


def test_elongation_lengthens_the_placement_and_turns_nothing(arm):
    growing = [s for s, segment in enumerate(arm.segments) if segment.length > 0.0]
    assert growing
    for s in growing:
        segment = arm.segments[s]
        twists = np.zeros((len(arm.segments), 6))
        twists[s, :3] = 1e-3 * segment.direction
        q = np.zeros((1, arm.n))
        before, after = kin.chain_frames(arm, q), kin.chain_frames(arm, q, kin.Displacement(segment=twists))
        np.testing.assert_array_equal(after.rotations, before.rotations)
        moved = after.positions[0, segment.index] - before.positions[0, segment.index]
        k = segment.index
        parent = before.rotations[0, k] @ arm.chain.rotations[k].T
        np.testing.assert_allclose(moved, 1e-3 * parent @ arm.chain.translations[k] / segment.length, atol=1e-15)
