"""Compiled sines and cosines against forty digits, and loops against NumPy."""

import mpmath
import numpy as np
import pytest

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
        kernels.turn(room, 0, bool(np.any(np.abs(part) > LARGEST_REDUCED)))
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
    kernels.sincos(room, 0)
    assert np.all(np.isnan(room[1:, 5]))
    assert np.all(np.isfinite(np.delete(room, 5, axis=1)))


def test_a_placement_is_a_product_of_matrices():
    rng = np.random.default_rng(1)
    room, place = rng.normal(size=(24, LANES)), rng.normal(size=(3, 4))
    kernels.follow(room, place, 0, 12)
    frames = np.zeros((2, LANES, 4, 4))
    frames[:, :, :3] = np.moveaxis(room.reshape(2, 3, 4, LANES), -1, 1)
    frames[:, :, 3, 3] = 1.0
    expected = frames[0] @ np.vstack([place, [0.0, 0.0, 0.0, 1.0]])
    np.testing.assert_allclose(frames[1], expected, rtol=0.0, atol=1e-14)
