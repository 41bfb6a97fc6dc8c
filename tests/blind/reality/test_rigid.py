"""Rigid motions against their laws."""

import numpy as np
import pytest

pytest.importorskip("mujoco", reason='the blind trial needs "thermal-robot[blind]"')

from thermal_robot.blind.reality.world import anywhere, free_columns, from_vector, quaternion, rpy_matrix

RNG = np.random.default_rng(8)
TWISTS = RNG.normal(size=(20, 6))


def test_motions_are_rigid():
    turns = from_vector(TWISTS)[:, :3, :3]
    np.testing.assert_allclose(turns @ turns.transpose(0, 2, 1), np.tile(np.eye(3), (20, 1, 1)), atol=1e-14)
    np.testing.assert_allclose(np.linalg.det(turns), 1.0)


def test_a_rotation_leaves_its_axis_and_turns_by_its_length():
    turns = from_vector(TWISTS)[:, :3, :3]
    np.testing.assert_allclose((turns @ TWISTS[:, 3:, None])[:, :, 0], TWISTS[:, 3:], atol=1e-12)
    angle = np.linalg.norm(TWISTS[:, 3:], axis=1)
    np.testing.assert_allclose(np.trace(turns, axis1=1, axis2=2), 1.0 + 2.0 * np.cos(angle))


def test_a_quarter_turn_takes_x_to_y():
    motion = from_vector(np.array([[1.0, 2.0, 3.0, 0.0, 0.0, np.pi / 2]]))[0]
    np.testing.assert_allclose(motion @ [1.0, 0.0, 0.0, 1.0], [1.0, 3.0, 3.0, 1.0], atol=1e-15)


def test_rpy_turns_about_the_fixed_axes_x_then_y_then_z():
    about = [from_vector(np.eye(6)[3 + k][None] * angle)[0, :3, :3] for k, angle in enumerate((0.3, -0.7, 1.1))]
    np.testing.assert_allclose(rpy_matrix(np.array([0.3, -0.7, 1.1])), about[2] @ about[1] @ about[0], atol=1e-15)


def test_a_quaternion_has_its_scalar_first():
    assert quaternion(np.eye(3)) == pytest.approx([1.0, 0.0, 0.0, 0.0])
    half = np.cos(0.2), np.sin(0.2)
    assert quaternion(rpy_matrix(np.array([0.0, 0.0, 0.4]))) == pytest.approx([half[0], 0.0, 0.0, half[1]])


def test_anywhere_is_in_reach_and_in_no_favoured_direction():
    poses = np.array([anywhere(np.random.default_rng(seed), 2.0) for seed in range(400)])
    assert np.abs(poses[:, :3, 3]).max() <= 2.0
    np.testing.assert_allclose(np.linalg.det(poses[:, :3, :3]), 1.0)
    # the mean of 400 unit vectors in no direction: 1/sqrt(400 · 3) a component
    assert np.abs(poses[:, :3, :3].mean(axis=0)).max() < 4.5 / np.sqrt(1200.0)


def test_columns_of_the_frames_are_what_a_small_motion_does():
    points, turns, step = RNG.normal(size=(15, 3)), from_vector(RNG.normal(size=(15, 6)))[:, :3, :3], 1e-6
    columns = free_columns(points, turns, True, True)
    assert columns.shape == (45, 9)
    centre = points.mean(axis=0)
    for k, twist in enumerate(step * np.eye(6)):
        motion = from_vector(twist[None])[0]
        moved = (points - centre) @ motion[:3, :3].T + motion[:3, 3] + centre
        np.testing.assert_allclose(columns[:, k], (moved - points).ravel() / step, atol=1e-5)
    for k, offset in enumerate(np.eye(3)):
        np.testing.assert_allclose(columns[:, 6 + k], (turns @ offset).ravel())


@pytest.mark.parametrize(("base", "tool", "freedoms"), [(True, False, 6), (False, True, 3), (False, False, 0)])
def test_a_frame_that_is_known_has_no_freedom(base, tool, freedoms):
    assert free_columns(RNG.normal(size=(5, 3)), np.tile(np.eye(3), (5, 1, 1)), base, tool).shape == (15, freedoms)
