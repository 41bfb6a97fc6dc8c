"""Compiled loops against products of matrices."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

pytest.importorskip("numba", reason="the compiled kernels are in the extra fast: numba is not installed")

from thermal_robot.kinematics import kernels
from thermal_robot.kinematics.settings import LANES


def homogeneous(room):
    """Frames (2, LANES, 4, 4) in the first 24 rows."""
    frames = np.zeros((2, LANES, 4, 4))
    frames[:, :, :3] = np.moveaxis(room[:24].reshape(2, 3, 4, LANES), -1, 1)
    frames[:, :, 3, 3] = 1.0
    return frames


def turned(axis, angles):
    found = np.tile(np.eye(4), (len(angles), 1, 1))
    found[:, :3, :3] = Rotation.from_rotvec(np.outer(angles, axis)).as_matrix()
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
    turns = turned(axis, room[24])
    np.testing.assert_allclose(after, before @ turns @ np.vstack([place, [0.0, 0.0, 0.0, 1.0]]), rtol=0.0, atol=1e-14)


def test_a_slide_moves_along_an_axis_of_the_frame():
    rng = np.random.default_rng(3)
    room, axis = rng.normal(size=(25, LANES)), rng.normal(size=3)
    kernels.slide(room.reshape(-1), axis, 24, 0, 12)
    before, after = homogeneous(room)
    slides = np.tile(np.eye(4), (LANES, 1, 1))
    slides[:, :3, 3] = np.outer(room[24], axis)
    np.testing.assert_allclose(after, before @ slides, rtol=0.0, atol=1e-14)
