"""How well readings fit: frames anywhere, gross errors let go, turns counted at a lever's length."""

from dataclasses import replace

import numpy as np
import pytest
from simulate import simulate

from thermal_robot.diagnosis.data_faults.faults import Readings, stacked
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import rms
from thermal_robot.kinematics import exp3, quaternion_to_rotation, rotation_to_quaternion

NOISE = 20e-6


def test_what_fits_is_left_with_its_noise(rv_m2):
    readings = Readings.of(simulate(rv_m2, samples=60, seed=1, noise=NOISE, outliers=0.1)[0])
    distance = readings.distance(readings.align())
    # the median distance of three normal components
    assert np.median(distance) == pytest.approx(1.54 * NOISE, rel=0.25)


def test_a_turn_counts_by_what_it_moves_at_a_lever(rv_m2):
    poses = simulate(rv_m2, samples=30, seed=1, noise=NOISE, turning=1e-6)[0]
    readings = Readings.of(poses)
    frames, turn = readings.align(), 0.1
    turned = quaternion_to_rotation(poses.orientation) @ exp3(np.array([[turn, 0.0, 0.0]]))
    away = replace(readings, orientation=rotation_to_quaternion(turned)).distance(frames)
    np.testing.assert_allclose(away, settings.LEVER * turn, rtol=0.05)


def test_rows_are_taken_from_every_column(rv_m2):
    readings = Readings.of(simulate(rv_m2, samples=30, seed=1, turning=3e-5)[0])
    some = readings.take(np.array([4, 2]))
    for name in ("q", "position", "orientation", "clock"):
        np.testing.assert_array_equal(getattr(some, name), getattr(readings, name)[[4, 2]])


def test_the_root_mean_square_of_a_right_triangle():
    assert rms(np.array([[3.0], [4.0]])) == pytest.approx(np.sqrt(12.5))


def test_readings_side_by_side_are_what_they_are_one_by_one(rv_m2):
    several = [Readings.of(simulate(rv_m2, samples=30, seed=k, noise=NOISE, turning=3e-5)[0]) for k in range(3)]
    side = stacked(several)
    begun = np.zeros((3, 1, 3))
    frames = side.align(begun=begun)
    distance = side.distance(frames)
    left, place = side.relaxed()
    for k, own in enumerate(several):
        alone = own.align(begun=begun[k])
        np.testing.assert_allclose(distance[k], own.distance(alone), atol=1e-9)
        np.testing.assert_allclose(left[k], own.relaxed()[0], atol=1e-9)
        np.testing.assert_allclose(side.still()[k], own.still())
        # the map tells where the target sits as well as rigid frames do
        np.testing.assert_allclose(place[k], alone.tool[:3, 3], atol=5e-3)


def test_a_map_leaves_nothing_whatever_unit_and_axes_the_instrument_has(rv_m2):
    readings = Readings.of(simulate(rv_m2, samples=60, seed=1, noise=NOISE, outliers=0.1)[0])
    plain = np.median(readings.relaxed()[0])
    other = replace(readings, position=25.4 * readings.position[:, [1, 0, 2]] * [1.0, 1.0, -1.0])
    assert np.median(other.relaxed()[0]) == pytest.approx(plain, rel=0.1)
    turned = replace(readings, q=readings.q * np.where(np.arange(rv_m2.n) == 2, -1.0, 1.0))
    assert np.median(turned.relaxed()[0]) > 100.0 * plain


def test_a_robot_at_rest_leaves_the_extent_of_the_points(rv_m2):
    readings = Readings.of(simulate(rv_m2, samples=60, seed=1)[0])
    rest = replace(readings, q=np.repeat(readings.q[:1], 60, axis=0))
    assert np.median(rest.distance(rest.align())) == pytest.approx(readings.still(), rel=0.2)
