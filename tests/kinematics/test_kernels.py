"""Compiled sines and cosines against forty digits, and loops against NumPy."""

import mpmath
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

pytest.importorskip("numba", reason="the compiled kernels are in the extra fast: numba is not installed")

from thermal_robot.kinematics import kernels
from thermal_robot.kinematics.settings import LANES, LARGEST_REDUCED


def sines_and_cosines(angles):
    """Rows of any length through the kernel."""
    found = []
    for begin in range(0, len(angles), LANES):
        part = angles[begin : begin + LANES]
        room = np.zeros((3, LANES))
        room[0, : len(part)] = part
        kernels.turn(room.reshape(-1), 0, bool(np.any(np.abs(part) > LARGEST_REDUCED)))
        found.append(room[1:, : len(part)])
    return np.concatenate(found, axis=1)


def worst(angles):
    with mpmath.workdps(40):
        return max(
            abs(function(mpmath.mpf(float(x))) - mpmath.mpf(float(y)))
            for function, values in zip((mpmath.sin, mpmath.cos), sines_and_cosines(angles), strict=True)
            for x, y in zip(angles, values, strict=True)
        )


@pytest.mark.parametrize("largest", [1e-8, 0.8, 7.0, 1e3, LARGEST_REDUCED, 1e12])
def test_they_are_right_to_a_quadrillionth(largest):
    assert worst(np.random.default_rng(0).uniform(-largest, largest, 3000)) < 3e-16


def test_they_are_right_beside_multiples_of_an_eighth_turn():
    exact = np.concatenate([np.arange(-40, 41), [10_001, 400_000, 636_000, 640_000]]) * (0.25 * np.pi)
    beside = exact[:, None] + np.array([-1e-3, -1e-8, 0.0, 1e-12, 1e-8])
    assert worst(np.concatenate([beside.ravel(), np.nextafter(exact, -9e9), np.nextafter(exact, 9e9)])) < 3e-16


def test_small_sines_keep_their_digits():
    angles = np.array([1e-300, 1e-20, 1e-9, -1e-5])
    np.testing.assert_allclose(sines_and_cosines(angles)[0], np.sin(angles), rtol=3e-16, atol=0.0)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_no_number_stays_none(bad):
    room = np.zeros((3, LANES))
    room[0, 5] = bad
    kernels.sincos(room.reshape(-1), 0)
    assert np.all(np.isnan(room[1:, 5]))
    assert np.all(np.isfinite(np.delete(room, 5, axis=1)))


def homogeneous(room):
    """Frames (2, LANES, 4, 4) in the first 24 rows."""
    frames = np.zeros((2, LANES, 4, 4))
    frames[:, :, :3] = np.moveaxis(room[:24].reshape(2, 3, 4, LANES), -1, 1)
    frames[:, :, 3, 3] = 1.0
    return frames


def rigid(rotation, translation):
    found = np.eye(4)
    found[:3, :3], found[:3, 3] = rotation, translation
    return found


def test_a_placement_is_a_product_of_matrices():
    rng = np.random.default_rng(1)
    room, place = rng.normal(size=(24, LANES)), rng.normal(size=(3, 4))
    kernels.follow(room.reshape(-1), place, 0, 12)
    before, after = homogeneous(room)
    np.testing.assert_allclose(after, before @ np.vstack([place, [0.0, 0.0, 0.0, 1.0]]), rtol=0.0, atol=1e-14)


@pytest.mark.parametrize("a", [0, 1, 2])
@pytest.mark.parametrize("sign", [1, -1])
def test_a_turn_and_a_placement_are_a_product_of_matrices(a, sign):
    rng = np.random.default_rng(2)
    room, place = rng.normal(size=(27, LANES)), rng.normal(size=(3, 4))
    flat, b = room.reshape(-1), (a + sign) % 3
    kernels.turn(flat, 24, False)
    kernels.turn_and_follow(flat, a, b, 24, place, 0, 12)
    before, after = homogeneous(room)
    axis = np.cross(np.eye(3)[a], np.eye(3)[b])
    turns = [rigid(Rotation.from_rotvec(angle * axis).as_matrix(), np.zeros(3)) for angle in room[24]]
    np.testing.assert_allclose(after, before @ turns @ np.vstack([place, [0.0, 0.0, 0.0, 1.0]]), rtol=0.0, atol=1e-14)


def test_a_slide_moves_along_an_axis_of_the_frame():
    rng = np.random.default_rng(3)
    room, axis = rng.normal(size=(25, LANES)), rng.normal(size=3)
    kernels.slide(room.reshape(-1), axis, 24, 0, 12)
    before, after = homogeneous(room)
    np.testing.assert_allclose(after, before @ [rigid(np.eye(3), axis * s) for s in room[24]], rtol=0.0, atol=1e-14)
