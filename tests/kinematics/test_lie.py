"""Laws of rotations and rigid motions; Pinocchio, and forty digits, as a second opinion."""

import mpmath
import numpy as np
import pinocchio
import pytest

from thermal_robot import kinematics as kin
from thermal_robot.kinematics.lie import sines_and_cosines

RNG = np.random.default_rng(7)
AXES = RNG.normal(size=(200, 3))
AXES /= np.linalg.norm(AXES, axis=1, keepdims=True)
NEAR_PI = [np.pi - 1e-4, np.pi - 1e-8, np.pi - 1e-12]
ANGLES = [0.0, 1e-300, 1e-12, 1e-8, 1e-4, 0.1, 0.4999, 0.5001, 1.0, 2.0, 3.0, *NEAR_PI]


@pytest.mark.parametrize("angle", ANGLES)
def test_exponentials_are_rigid_motions_and_the_logarithm_undoes_them(angle):
    rotations = kin.exp3(angle * AXES)
    np.testing.assert_allclose(rotations @ np.swapaxes(rotations, 1, 2), np.tile(np.eye(3), (200, 1, 1)), atol=2e-15)
    np.testing.assert_allclose(np.linalg.det(rotations), 1.0, atol=2e-15)
    atol = 2e-15 if angle > 3.0 else 1e-300 + 4e-16 * angle
    np.testing.assert_allclose(kin.log3(rotations), angle * AXES, rtol=4e-15, atol=atol)
    twists = np.concatenate([RNG.normal(size=(200, 3)), angle * AXES], axis=1)
    theirs = np.array([pinocchio.exp6(twist).homogeneous for twist in twists])
    np.testing.assert_allclose(kin.exp6(twists), theirs, rtol=0.0, atol=3e-15)
    np.testing.assert_allclose(kin.log6(theirs), twists, rtol=1e-13, atol=atol + 1e-14)


@pytest.mark.parametrize("angle", [0.0, 1e-6, 0.5, 2.0, 3.1])
def test_the_left_jacobian_is_the_derivative_of_the_exponential(angle):
    twist, step = np.concatenate([[0.3, -0.2, 0.5], angle * AXES[0]]), 1e-6 * np.eye(6)
    after = kin.log6(kin.exp6(twist + step) @ kin.exp6(-twist)) - kin.log6(kin.exp6(twist - step) @ kin.exp6(-twist))
    np.testing.assert_allclose(kin.left_jacobian(twist), after.T / 2e-6, atol=1e-9)


def test_half_turn_has_length_pi_about_either_sense_of_its_axis():
    back = kin.log3(kin.exp3(np.pi * AXES))
    np.testing.assert_allclose(np.linalg.norm(back, axis=1), np.pi, rtol=1e-15)
    np.testing.assert_allclose(np.abs(np.sum(back * AXES, axis=1)), np.pi, rtol=1e-14)


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
    # a quaternion of any length and sign is the same rotation
    for scale in (1.0, -3.0):
        np.testing.assert_allclose(kin.quaternion_to_rotation(scale * quaternions), rotations, atol=3e-15)
    theirs = np.array([pinocchio.Quaternion(r).coeffs()[[3, 0, 1, 2]] for r in rotations[:1000]])
    aligned = np.sign(np.sum(theirs * quaternions[:1000], axis=1, keepdims=True)) * theirs
    np.testing.assert_allclose(quaternions[:1000], aligned, atol=1e-8)
    # a quarter turn about z carries x to y
    rotation = kin.quaternion_to_rotation([np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)])
    np.testing.assert_allclose(rotation @ [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], atol=1e-15)


def test_roll_pitch_and_yaw_are_a_rotation_about_fixed_axes():
    for angles in RNG.uniform([-3, -1.5, -3], [3, 1.5, 3], (200, 3)):
        np.testing.assert_allclose(kin.rotation_to_rpy(pinocchio.rpy.rpyToMatrix(angles)), angles, atol=2e-14)


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
    whole = kin.align(points, moved[0], weights)
    for k in range(5):
        np.testing.assert_array_equal(whole[k], kin.align(points[k], moved[0], weights[k]))


def worst(angles, found):
    """Largest error of sines and cosines."""
    with mpmath.workdps(40):
        return max(
            abs(function(mpmath.mpf(float(x))) - mpmath.mpf(float(y)))
            for function, values in zip((mpmath.sin, mpmath.cos), found, strict=True)
            for x, y in zip(angles, values, strict=True)
        )


def beside(multiples, of):
    """Angles at and beside multiples of one."""
    exact = np.asarray(multiples) * of
    near = exact[:, None] + np.array([-1e-3, -1e-8, 0.0, 1e-12, 1e-8])
    return np.concatenate([near.ravel(), np.nextafter(exact, -9e9), np.nextafter(exact, 9e9)])


def by_numpy(angles):
    sines, cosines = np.empty_like(angles), np.empty_like(angles)
    sines_and_cosines(angles, sines, cosines)
    return sines, cosines


def by_numba(angles):
    """Rows of any length through the kernel."""
    pytest.importorskip("numba", reason="the compiled kernels are in the extra fast: numba is not installed")
    from thermal_robot.kinematics import kernels
    from thermal_robot.kinematics.settings import LANES, LARGEST_REDUCED

    found = []
    for begin in range(0, len(angles), LANES):
        part, room = angles[begin : begin + LANES], np.zeros((3, LANES))
        room[0, : len(part)] = part
        kernels.turn(room.reshape(-1), 0, bool(np.any(np.abs(part) > LARGEST_REDUCED)))
        found.append(room[1:, : len(part)])
    return np.concatenate(found, axis=1)


@pytest.mark.parametrize(("both", "within"), [(by_numpy, 4.5e-16), (by_numba, 3e-16)])
def test_sines_and_cosines_are_right_to_rounding(both, within):
    for largest in (1e-8, 0.8, 7.0, 1e3, 1e6, 1e12, 1e15):
        angles = np.random.default_rng(0).uniform(-largest, largest, 1000)
        assert worst(angles, both(angles)) < within
    for angles in (beside(np.arange(-9, 10), 0.5 * np.pi), beside([10_001, 400_000, 636_000, 640_000], 0.25 * np.pi)):
        assert worst(angles, both(angles)) < within
    small = np.array([1e-300, 1e-20, 1e-9, -1e-5])
    np.testing.assert_allclose(both(small)[0], np.sin(small), rtol=3e-16, atol=0.0)
    # zero is exact, and what is no number stays none, alone
    odd = np.array([0.0, np.nan, 1.0, np.inf, -np.inf])
    with np.errstate(invalid="ignore"):
        sines, cosines = both(odd)
    assert (sines[0], cosines[0]) == (0.0, 1.0)
    np.testing.assert_array_equal(np.isnan([sines, cosines]), [[False, True, False, True, True]] * 2)
