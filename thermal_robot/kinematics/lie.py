"""Rotations and rigid motions in batches (Lie groups SO(3), SE(3)): exponentials, logarithms, quaternions.

Every function takes any number of leading dimensions and is accurate to rounding at both ends, near the
identity and near a half turn. Twists are ordered (linear, angular), quaternions (w, x, y, z).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import expm

from thermal_robot.arrays import Array

# (θ − sin θ)/θ³ cancels below half a radian; there its series, whose eighth term is below 1e-17, takes over.
_CUBIC_SERIES = (1 / 6, -1 / 120, 1 / 5040, -1 / 362880, 1 / 39916800, -1 / 6227020800, 1 / 1307674368000)
_CUBIC_SERIES_BELOW = 0.5


def skew(vectors: ArrayLike) -> Array:
    """(..., 3, 3) matrix of the cross product, ``skew(a) @ b = a × b``, of vectors (..., 3)."""
    v = np.asarray(vectors, dtype=float)
    out = np.zeros((*v.shape, 3))
    out[..., 0, 1], out[..., 0, 2] = -v[..., 2], v[..., 1]
    out[..., 1, 0], out[..., 1, 2] = v[..., 2], -v[..., 0]
    out[..., 2, 0], out[..., 2, 1] = -v[..., 1], v[..., 0]
    return out


def homogeneous(rotations: ArrayLike, translations: ArrayLike) -> Array:
    """Homogeneous matrices (..., 4, 4) of rotations (..., 3, 3) and translations (..., 3), m."""
    motions = np.zeros((*np.shape(translations)[:-1], 4, 4))
    motions[..., :3, :3], motions[..., :3, 3], motions[..., 3, 3] = rotations, translations, 1.0
    return motions


def point_jacobian(points: ArrayLike) -> Array:
    """Jacobian (..., 3, 6) of points (..., 3) by a twist of what carries them, at its origin, linear first."""
    p = np.asarray(points, dtype=float)
    moved = np.zeros((*p.shape, 6))
    moved[..., :3] = np.eye(3)
    moved[..., 3:] = np.cross(np.eye(3), p[..., None, :]).swapaxes(-1, -2)
    return moved


def exp3(vectors: ArrayLike) -> Array:
    """Exponential map of SO(3): rotation matrix of each rotation vector (Rodrigues' formula).

    Parameters
    ----------
    vectors
        (..., 3) rad.

    Returns
    -------
    ndarray
        (..., 3, 3) rotation matrices.
    """
    w = np.asarray(vectors, dtype=float)
    first, second, _ = _rodrigues_coefficients(w)
    turn = skew(w)
    rotation: Array = np.eye(3) + first * turn + second * (turn @ turn)
    return rotation


def exp6(twists: ArrayLike) -> Array:
    """Exponential map of SE(3): rigid motion of each twist.

    Parameters
    ----------
    twists
        (..., 6), linear part in m, angular part in rad.

    Returns
    -------
    ndarray
        (..., 4, 4) homogeneous matrices; equal to ``pinocchio.exp6``.
    """
    xi = np.asarray(twists, dtype=float)
    linear, angular = xi[..., :3], xi[..., 3:]
    first, second, third = _rodrigues_coefficients(angular)
    turn = skew(angular)
    turn_twice = turn @ turn
    left_jacobian = np.eye(3) + second * turn + third * turn_twice
    return homogeneous(np.eye(3) + first * turn + second * turn_twice, (left_jacobian @ linear[..., None])[..., 0])


def log3(rotations: ArrayLike) -> Array:
    """Logarithm of SO(3): rotation vector of each rotation, of length at most π.

    Parameters
    ----------
    rotations
        (..., 3, 3) rotation matrices.

    Returns
    -------
    ndarray
        (..., 3) rad.
    """
    quaternion = rotation_to_quaternion(rotations)
    imaginary = quaternion[..., 1:]
    sine = np.linalg.norm(imaginary, axis=-1, keepdims=True)
    # atan2 keeps full accuracy at both ends, where arccos of the trace loses half of the digits.
    half_angle = np.arctan2(sine, quaternion[..., :1])
    factor = np.divide(2.0 * half_angle, sine, out=np.full_like(sine, 2.0), where=sine > 0.0)
    vector: Array = factor * imaginary
    return vector


def log6(motions: ArrayLike) -> Array:
    """Logarithm of SE(3): twist of each rigid motion, its rotation vector of length at most π.

    Parameters
    ----------
    motions
        (..., 4, 4) homogeneous matrices.

    Returns
    -------
    ndarray
        (..., 6), linear part in m, angular part in rad; equal to ``pinocchio.log6``.
    """
    found = np.asarray(motions, dtype=float)
    angular = log3(found[..., :3, :3])
    units = np.concatenate(np.broadcast_arrays(np.eye(3), angular[..., None, :]), axis=-1)
    carried = exp6(units)[..., :3, 3].swapaxes(-1, -2)
    linear: Array = np.linalg.solve(carried, found[..., :3, 3:])[..., 0]
    return np.concatenate([linear, angular], axis=-1)


def left_jacobian(twist: Array) -> Array:
    """Left Jacobian (6, 6) of SE(3) at a twist (6,): exp(ξ + δ) = exp(J δ) exp(ξ) to first order.

    J = ∫ exp(s ad ξ) ds over 0…1, from one exponential of a block matrix (Van Loan, *IEEE TAC* 23, 1978). The right
    Jacobian at a twist is the left one at its opposite.
    """
    blocks = np.zeros((12, 12))
    blocks[:3, :3] = blocks[3:6, 3:6] = skew(twist[3:])
    blocks[:3, 3:6] = skew(twist[:3])
    blocks[:6, 6:] = np.eye(6)
    found: Array = expm(blocks)[:6, 6:]
    return found


def quaternion_to_rotation(quaternions: ArrayLike) -> Array:
    """Rotation matrix of each quaternion, normalised first.

    Parameters
    ----------
    quaternions
        (..., 4), ordered w, x, y, z, not zero.

    Returns
    -------
    ndarray
        (..., 3, 3).
    """
    q = np.asarray(quaternions, dtype=float)
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    scalar, imaginary = q[..., :1, None], q[..., 1:]
    turn = skew(imaginary)
    rotation: Array = np.eye(3) + 2.0 * scalar * turn + 2.0 * (turn @ turn)
    return rotation


def rotation_to_quaternion(rotations: ArrayLike) -> Array:
    """Return the unit quaternion of each rotation, with w ≥ 0 (Shepperd's method).

    Parameters
    ----------
    rotations
        (..., 3, 3) rotation matrices.

    Returns
    -------
    ndarray
        (..., 4), ordered w, x, y, z.
    """
    r = np.asarray(rotations, dtype=float)
    trace = np.trace(r, axis1=-2, axis2=-1)
    # Row a of this table is 4·q_a·q; the row with the largest q_a has no cancellation.
    table = np.empty((*r.shape[:-2], 4, 4))
    table[..., 0, 0] = 1.0 + trace
    for i, (j, k) in enumerate(((1, 2), (2, 0), (0, 1))):
        table[..., 0, i + 1] = table[..., i + 1, 0] = r[..., k, j] - r[..., j, k]
        table[..., i + 1, i + 1] = 1.0 + 2.0 * r[..., i, i] - trace
        table[..., j + 1, k + 1] = table[..., k + 1, j + 1] = r[..., j, k] + r[..., k, j]
    largest = np.argmax(np.diagonal(table, axis1=-2, axis2=-1), axis=-1)
    row = np.take_along_axis(table, largest[..., None, None], axis=-2)[..., 0, :]
    row = row / np.linalg.norm(row, axis=-1, keepdims=True)
    quaternion: Array = np.where(row[..., :1] < 0.0, -row, row)
    return quaternion


def rotation_to_rpy(rotation: ArrayLike) -> Array:
    """Roll, pitch and yaw of a rotation, R = Rz(yaw) Ry(pitch) Rx(roll), the URDF convention.

    At a pitch of ±90° roll and yaw are not unique, and near it neither is well determined; roll is then found of what
    the yaw leaves, so that the three together give the rotation to rounding.

    Parameters
    ----------
    rotation
        (3, 3).

    Returns
    -------
    ndarray
        (3,) rad.
    """
    r = np.asarray(rotation, dtype=float)
    yaw = np.arctan2(r[1, 0], r[0, 0])
    cosine, sine = np.cos(yaw), np.sin(yaw)
    pitch = np.arctan2(-r[2, 0], cosine * r[0, 0] + sine * r[1, 0])
    # the second row of Rz(−yaw) R = Ry(pitch) Rx(roll) is (0, cos roll, −sin roll)
    across = cosine * r[1] - sine * r[0]
    return np.array([np.arctan2(-across[2], across[1]), pitch, yaw])


def _rodrigues_coefficients(vectors: Array) -> tuple[Array, Array, Array]:
    """Coefficients sin θ/θ, (1 − cos θ)/θ², (θ − sin θ)/θ³, each (..., 1, 1), of rotation vectors of length θ."""
    angle = np.linalg.norm(vectors, axis=-1)[..., None, None]
    first = np.sinc(angle / np.pi)
    second = 0.5 * np.sinc(angle / (2.0 * np.pi)) ** 2
    near = angle < _CUBIC_SERIES_BELOW
    square = np.where(near, angle, 0.0) ** 2
    series = np.polynomial.polynomial.polyval(square, _CUBIC_SERIES)
    safe = np.where(near, 1.0, angle)
    third = np.where(near, series, (1.0 - first) / safe**2)
    return first, second, third


def align(source: Array, target: Array, weights: Array) -> Array:
    """Weighted rigid alignment (Kabsch): motion (..., 4, 4) from points (..., N, 3) to others, weights (..., N).

    Umeyama, *IEEE PAMI* 13 (1991), without scale; reflections excluded.
    """
    share = weights / weights.sum(axis=-1, keepdims=True)
    from_mean, to_mean = share[..., None, :] @ source, share[..., None, :] @ target
    u, _, vt = np.linalg.svd((target - to_mean).swapaxes(-1, -2) @ ((source - from_mean) * share[..., None]))
    upright = np.ones(u.shape[:-1])
    upright[..., 2] = np.linalg.det(u) * np.linalg.det(vt)
    turn = (u * upright[..., None, :]) @ vt
    return homogeneous(turn, (to_mean.swapaxes(-1, -2) - turn @ from_mean.swapaxes(-1, -2))[..., 0])


def sines_and_cosines(angles: Array, sines: Array, cosines: Array) -> None:
    """Write sines and cosines of angles (rad) into arrays, from the tangent of the half angle.

    NumPy has a vectorised tangent for doubles where the processor has AVX-512, and no such sine: with it both cost a
    sixth. They are right to 4e-16, at any angle: where the tangent h is large, near π, sin = 2h / (1 + h²) and cos = 2
    / (1 + h²) − 1 depend on it only weakly.
    """
    half, ratio = sines, cosines
    np.multiply(angles, 0.5, out=half)
    np.tan(half, out=half)
    np.multiply(half, half, out=ratio)
    ratio += 1.0
    np.divide(2.0, ratio, out=ratio)
    np.multiply(half, ratio, out=sines)
    np.subtract(ratio, 1.0, out=cosines)
