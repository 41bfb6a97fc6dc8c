"""Barycentres, mean rotations and small angles."""

import numpy as np
import pytest

from thermal_robot.iso9283 import Attained
from thermal_robot.iso9283.criteria import angles, mean_rotation, three
from thermal_robot.kinematics import exp3


def test_the_barycentre_and_some_of_the_cycles():
    attained = Attained(np.array([[1.0, 2, 3], [3, 2, 1], [5, 5, 5]]), np.tile(np.eye(3), (3, 1, 1)))
    np.testing.assert_allclose(attained.barycentre, [3, 3, 3])
    first = attained.take(np.array([0, 1]))
    assert first.cycles == 2
    np.testing.assert_allclose(first.barycentre, [2, 2, 2])
    assert first.rotation.shape == (2, 3, 3)
    assert Attained(attained.position).take(np.array([0])).mean_rotation is None


def test_the_mean_of_turns_about_one_axis_is_the_turn_by_their_mean():
    axis = np.array([2.0, -1.0, 2.0]) / 3
    mean = mean_rotation(exp3(np.outer([0.1, 0.2, 0.3], axis)))
    np.testing.assert_allclose(mean, exp3(0.2 * axis), atol=1e-12)
    np.testing.assert_allclose(mean @ mean.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(mean) == pytest.approx(1.0)


def test_angles_are_about_the_axes_of_the_common_frame():
    """The target may point anywhere: a turn about the frame's z is angle c, whatever it does to the target."""
    target = exp3(np.array([0.7, -1.1, 2.0]))
    turned = exp3(np.array([0.0, 0.0, 2e-3])) @ target
    np.testing.assert_allclose(angles(turned, target), [0, 0, 2e-3], atol=1e-12)


def test_angles_are_those_of_turns_one_after_the_other_but_for_products():
    a, b, c = 1e-3, -2e-3, 1.5e-3
    one_by_one = exp3([0, 0, c]) @ exp3([0, b, 0]) @ exp3([a, 0, 0])
    np.testing.assert_allclose(angles(one_by_one, np.eye(3)), [a, b, c], atol=2e-6)


def test_three_are_plain_numbers():
    assert three(np.array([1, 2, 3], dtype=np.float32)) == (1.0, 2.0, 3.0)
    assert all(type(value) is float for value in three(np.ones(3)))
