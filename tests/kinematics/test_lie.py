"""Laws of rotations and rigid motions, and Pinocchio as a second opinion."""

import numpy as np
import pinocchio
import pytest

from thermal_robot import kinematics as kin

RNG = np.random.default_rng(7)
AXES = RNG.normal(size=(200, 3))
AXES /= np.linalg.norm(AXES, axis=1, keepdims=True)
ANGLES = [
    0.0,
    1e-300,
    1e-12,
    1e-8,
    1e-4,
    0.1,
    0.4999,
    0.5001,
    1.0,
    2.0,
    3.0,
    np.pi - 1e-4,
    np.pi - 1e-8,
    np.pi - 1e-12,
]


@pytest.mark.parametrize("angle", ANGLES)
def test_log_undoes_exp_to_rounding(angle):
    vectors = angle * AXES
    back = kin.log3(kin.exp3(vectors))
    np.testing.assert_allclose(back, vectors, rtol=4e-15, atol=2e-15 if angle > 3.0 else 1e-300 + 4e-16 * angle)


def test_half_turn_has_length_pi_about_either_sense_of_its_axis():
    back = kin.log3(kin.exp3(np.pi * AXES))
    np.testing.assert_allclose(np.linalg.norm(back, axis=1), np.pi, rtol=1e-15)
    np.testing.assert_allclose(np.abs(np.sum(back * AXES, axis=1)), np.pi, rtol=1e-14)


@pytest.mark.parametrize("angle", ANGLES)
def test_exp_gives_rotations(angle):
    rotations = kin.exp3(angle * AXES)
    np.testing.assert_allclose(rotations @ np.swapaxes(rotations, 1, 2), np.tile(np.eye(3), (200, 1, 1)), atol=2e-15)
    np.testing.assert_allclose(np.linalg.det(rotations), 1.0, atol=2e-15)


@pytest.mark.parametrize("angle", ANGLES)
def test_exp6_is_pinocchios(angle):
    twists = np.concatenate([RNG.normal(size=(200, 3)), angle * AXES], axis=1)
    theirs = np.array([pinocchio.exp6(twist).homogeneous for twist in twists])
    np.testing.assert_allclose(kin.exp6(twists), theirs, rtol=0.0, atol=3e-15)


def test_opposite_twists_undo_each_other():
    twists = RNG.normal(size=(4, 50, 6))
    product = kin.exp6(twists) @ kin.exp6(-twists)
    np.testing.assert_allclose(product, np.broadcast_to(np.eye(4), product.shape), atol=2e-14)


def test_quaternions_and_rotations_are_one():
    vectors = np.concatenate([angle * AXES for angle in ANGLES] + [np.pi * np.eye(3)])
    rotations = kin.exp3(vectors)
    quaternions = kin.rotation_to_quaternion(rotations)
    np.testing.assert_allclose(np.linalg.norm(quaternions, axis=1), 1.0, rtol=1e-15)
    assert np.all(quaternions[:, 0] >= 0.0)
    np.testing.assert_allclose(kin.quaternion_to_rotation(quaternions), rotations, atol=3e-15)
    theirs = np.array([pinocchio.Quaternion(r).coeffs()[[3, 0, 1, 2]] for r in rotations[:1000]])
    aligned = np.sign(np.sum(theirs * quaternions[:1000], axis=1, keepdims=True)) * theirs
    np.testing.assert_allclose(quaternions[:1000], aligned, atol=1e-8)


def test_a_quaternion_of_any_length_and_sign_is_the_same_rotation():
    quaternions = RNG.normal(size=(50, 4))
    np.testing.assert_allclose(
        kin.quaternion_to_rotation(-3.0 * quaternions), kin.quaternion_to_rotation(quaternions), atol=1e-15
    )


def test_known_quaternion():
    # a quarter turn about z carries x to y
    rotation = kin.quaternion_to_rotation([np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)])
    np.testing.assert_allclose(rotation @ [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], atol=1e-15)


def test_roll_pitch_and_yaw_are_a_rotation_about_fixed_axes():
    angles = RNG.uniform([-3, -1.5, -3], [3, 1.5, 3], (200, 3))
    for roll, pitch, yaw in angles:
        rotation = pinocchio.rpy.rpyToMatrix(roll, pitch, yaw)
        np.testing.assert_allclose(kin.rotation_to_rpy(rotation), [roll, pitch, yaw], atol=2e-14)


@pytest.mark.parametrize("away", [0.0, 1e-16, 1e-9, 1e-5])
def test_roll_pitch_and_yaw_together_give_the_rotation_at_a_quarter_turn(away):
    for roll, yaw in RNG.uniform(-3, 3, (50, 2)):
        for side in (1.0, -1.0):
            rotation = pinocchio.rpy.rpyToMatrix(roll, side * (np.pi / 2 - away), yaw)
            again = pinocchio.rpy.rpyToMatrix(kin.rotation_to_rpy(rotation))
            np.testing.assert_allclose(again, rotation, atol=1e-15)


def test_points_are_aligned_in_batches_as_one_by_one():
    rng = np.random.default_rng(3)
    points, weights = rng.normal(size=(5, 30, 3)), rng.uniform(0.1, 1.0, (5, 30))
    motions = kin.exp6(rng.normal(size=(5, 6)))
    moved = points @ motions[:, :3, :3].transpose(0, 2, 1) + motions[:, None, :3, 3]
    np.testing.assert_allclose(kin.align(points, moved, weights), motions, rtol=0.0, atol=1e-13)
    for k in range(5):
        one = kin.align(points[k], moved[0], weights[k])
        np.testing.assert_array_equal(kin.align(points, moved[0], weights)[k], one)
