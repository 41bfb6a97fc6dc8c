"""Sines and cosines against forty digits."""

import mpmath
import numpy as np
import pytest

from thermal_robot.kinematics.lie import sines_and_cosines


def both(angles):
    sines, cosines = np.empty_like(angles), np.empty_like(angles)
    sines_and_cosines(angles, sines, cosines)
    return sines, cosines


@pytest.mark.parametrize("largest", [1e-8, 1.0, 7.0, 1e3, 1e6, 1e15])
def test_they_are_right_to_four_ten_quadrillionths(largest):
    angles = np.random.default_rng(0).uniform(-largest, largest, 3000)
    against_many_digits(angles)


def test_they_are_right_beside_multiples_of_a_quarter_turn():
    exact = np.outer(np.arange(-9, 10), [0.5 * np.pi]).ravel()
    beside = exact[:, None] + np.array([-1e-3, -1e-8, 0.0, 1e-12, 1e-8])
    against_many_digits(np.concatenate([beside.ravel(), np.nextafter(exact, -99), np.nextafter(exact, 99)]))


def against_many_digits(angles):
    found = both(angles)
    with mpmath.workdps(40):
        for function, values in zip((mpmath.sin, mpmath.cos), found, strict=True):
            worst = max(
                abs(function(mpmath.mpf(float(x))) - mpmath.mpf(float(y))) for x, y in zip(angles, values, strict=True)
            )
            assert worst < 4.5e-16


def test_zero_is_exact_and_no_number_stays_none():
    sines, cosines = both(np.array([0.0, np.nan, 1.0]))
    assert (sines[0], cosines[0]) == (0.0, 1.0)
    np.testing.assert_array_equal(np.isnan([sines, cosines]), [[False, True, False]] * 2)
