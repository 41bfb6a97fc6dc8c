"""Rigid motions, on scipy: nothing is taken from the program that is put to the test."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]


def from_vector(twists: Array) -> Array:
    """(N, 4, 4) motions from (N, 6) translations (m) and rotation vectors (rad)."""
    motion = np.tile(np.eye(4), (len(twists), 1, 1))
    motion[:, :3, :3] = Rotation.from_rotvec(twists[:, 3:]).as_matrix()
    motion[:, :3, 3] = twists[:, :3]
    return motion


def rpy_matrix(rpy: Array) -> Array:
    """Rotation of a URDF origin: about the fixed axes x, y, z."""
    return np.asarray(Rotation.from_euler("xyz", rpy).as_matrix())


def quaternion(rotation: Array) -> Array:
    """Scalar first, (..., 4)."""
    return np.roll(Rotation.from_matrix(rotation).as_quat(), 1, axis=-1)


def anywhere(rng: np.random.Generator, reach: float) -> Array:
    """(4, 4) a random direction, and a place up to ``reach`` along each axis."""
    motion = np.eye(4)
    motion[:3, :3] = Rotation.random(rng=rng).as_matrix()
    motion[:3, 3] = rng.uniform(-reach, reach, 3)
    return motion


def free_columns(reference: Array, rotation: Array, base: bool, tool: bool) -> Array:
    """(3N, 0..9) displacement per unit of each freedom of the frames."""
    n, centred = len(reference), reference - reference.mean(axis=0)
    parts = []
    if base:
        turn = np.zeros((n, 3, 3))
        for axis in range(3):
            turn[:, :, axis] = np.cross(np.eye(3)[axis], centred)
        parts += [np.tile(np.eye(3), (n, 1, 1)), turn]
    if tool:
        parts.append(rotation)
    return np.concatenate(parts, axis=2).reshape(3 * n, -1) if parts else np.zeros((3 * n, 0))
