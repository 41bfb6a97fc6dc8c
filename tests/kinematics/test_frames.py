"""The four channels: the displaced robot against its linear response, by central differences."""

import numpy as np
import pytest

from thermal_robot import kinematics as kin

STEP = 1e-5
TOLERANCE = 2e-9  # STEP² times lengths of a metre or two, and rounding over STEP
ROWS = 20


def twist_between(before, after):
    """Twist (N, 6) in root axes, at the tool, that carries one pose to the other in a unit of time."""
    turn = kin.log3(after[:, :3, :3] @ np.swapaxes(before[:, :3, :3], 1, 2))
    return np.concatenate([after[:, :3, 3] - before[:, :3, 3], turn], axis=1)


def response(robot, q, **channel):
    """Twist of the tool by a channel, each row of which has an error of one unit, about errors everywhere."""
    ((name, units),) = channel.items()
    rng = np.random.default_rng(5)
    # large errors but in the segments, which are differentiated about zero
    about = {"joint": rng.normal(0, 0.3, robot.n), "segment": np.zeros((len(robot.segments), 6))}
    about |= {"base": rng.normal(0, 0.3, 6), "tool": rng.normal(0, 0.3, 6)}
    about = about if name in ("joint", "segment") else {name: np.zeros(6)}
    for unit in units:
        ends = (kin.Displacement(**{**about, name: about[name] + h * unit}) for h in (-STEP, STEP))
        yield twist_between(*(kin.tool_poses(robot, q, moved) for moved in ends)) / (2 * STEP)
    yield kin.chain_frames(robot, q, kin.Displacement(**about))


def test_joint_and_segment_channels_are_jacobian_and_placement_sensitivity(arm, configurations):
    q, s = configurations(arm, ROWS), len(arm.segments)
    *found, frames = response(arm, q, joint=np.eye(arm.n))
    jacobians = kin.frame_jacobians(arm, q, frames=frames)
    np.testing.assert_allclose(jacobians, np.stack(found, axis=-1), rtol=0.0, atol=TOLERANCE)
    *found, frames = response(arm, q, segment=np.eye(s * 6).reshape(-1, s, 6))
    sensitivities = kin.placement_sensitivities(arm, q, frames=frames).reshape(ROWS, 6, -1)
    np.testing.assert_allclose(sensitivities, np.stack(found, axis=-1), rtol=0.0, atol=TOLERANCE)


def test_base_channel_moves_the_whole_robot_and_tool_channel_turns_with_the_tool(arm, configurations):
    q = configurations(arm, ROWS)
    poses = kin.tool_poses(arm, q)
    rotation, position = poses[:, :3, :3], poses[:, :3, 3]
    *base, _ = response(arm, q, base=np.eye(6))
    *tool, _ = response(arm, q, tool=np.eye(6))
    for unit, of_base, of_tool in zip(np.eye(6), base, tool, strict=True):
        whole = np.concatenate([unit[:3] + np.cross(unit[3:], position), np.tile(unit[3:], (ROWS, 1))], axis=1)
        np.testing.assert_allclose(of_base, whole, rtol=0.0, atol=TOLERANCE)
        turned = np.concatenate([rotation @ unit[:3], rotation @ unit[3:]], axis=1)
        np.testing.assert_allclose(of_tool, turned, rtol=0.0, atol=TOLERANCE)


def test_what_the_sum_of_the_channels_leaves_out_is_of_second_order(arm, configurations):
    q, rng = configurations(arm, ROWS), np.random.default_rng(6)
    joint, base, tool = rng.normal(size=arm.n), rng.normal(size=6), rng.normal(size=6)
    segment = rng.normal(size=(len(arm.segments), 6))
    nominal = kin.tool_poses(arm, q)
    rotation, position = nominal[:, :3, :3], nominal[:, :3, 3]
    linear = kin.frame_jacobians(arm, q) @ joint
    linear += np.einsum("nask,sk->na", kin.placement_sensitivities(arm, q), segment)
    linear += np.concatenate([base[:3] + np.cross(base[3:], position), np.tile(base[3:], (ROWS, 1))], axis=1)
    linear += np.concatenate([rotation @ tool[:3], rotation @ tool[3:]], axis=1)

    def left_out(size):
        errors = kin.Displacement(size * joint, size * segment, size * base, size * tool)
        return np.linalg.norm(twist_between(nominal, kin.tool_poses(arm, q, errors)) - size * linear)

    assert left_out(1e-3) / left_out(1e-4) == pytest.approx(100.0, rel=0.1)


def test_elongation_lengthens_the_placement_and_turns_nothing(arm):
    growing, q = [s for s, segment in enumerate(arm.segments) if segment.length > 0.0], np.zeros((1, arm.n))
    assert growing
    before = kin.chain_frames(arm, q)
    for s in growing:
        segment, twists = arm.segments[s], np.zeros((len(arm.segments), 6))
        twists[s, :3] = 1e-3 * segment.direction
        after, k = kin.chain_frames(arm, q, kin.Displacement(segment=twists)), segment.index
        np.testing.assert_array_equal(after.rotations, before.rotations)
        moved = after.positions[0, k] - before.positions[0, k]
        parent = before.rotations[0, k] @ arm.chain.rotations[k].T
        np.testing.assert_allclose(moved, 1e-3 * parent @ arm.chain.translations[k] / segment.length, atol=1e-15)


def test_the_stretched_arm(rv_m2):
    pose = kin.tool_poses(rv_m2, np.zeros(5))[0]
    np.testing.assert_allclose(pose[:3, 3], [0.0, 0.12 + 0.25 + 0.20 + 0.15, 0.40], atol=1e-15)
    np.testing.assert_allclose(pose[:3, :3], np.eye(3), atol=1e-15)
