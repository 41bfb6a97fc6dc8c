"""What the tool does when a joint or a placement changes a little, for a batch of configurations."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal_robot.errors import RobotError
from thermal_robot.kinematics.frames import ChainFrames, chain_frames, chunks
from thermal_robot.kinematics.model import REVOLUTE

if TYPE_CHECKING:
    from thermal_robot.kinematics.chained import Chained

Array = NDArray[np.float64]


def frame_jacobians(
    robot: Chained, q: ArrayLike, *, frames: ChainFrames | None = None, point: ArrayLike | None = None
) -> Array:
    """Geometric Jacobian: twist of the tool frame, in root axes at the point, for a unit speed of each joint.

    Parameters
    ----------
    robot
        The robot.
    q
        (N, n) rad or m; not read if ``frames`` is given.
    frames
        From :func:`~thermal_robot.kinematics.chain_frames`, to save computing them again or to differentiate
        a displaced chain.
    point
        (3,) or (N, 3) m: the point whose velocity is meant, fixed to the tool frame and expressed in it; the
        tool's origin by default.

    Returns
    -------
    ndarray
        (N, 6, n), linear rows first: ``LOCAL_WORLD_ALIGNED`` in Pinocchio. The column of a joint that others mimic
        holds what they do with it.

    Raises
    ------
    RobotError
        If an array has not the shape that the robot asks for.
    """
    frames = chain_frames(robot, q) if frames is None else frames
    chain = robot.chain
    rotations, positions, target = _structure_of_arrays(frames, point)
    rows = positions.shape[-1]
    jacobians = np.empty((rows, 6, robot.n))
    for part in chunks(rows):
        block = np.zeros((6, len(chain.movable), part.stop - part.start))
        for j, k in enumerate(chain.movable):
            axis = chain.axes[k] @ rotations[k, ..., part]
            if chain.kinds[k] == REVOLUTE:
                _cross(axis, target[:, part] - positions[k, :, part], out=block[:3, j])
                block[3:, j] = axis
            else:
                block[:3, j] = axis
        jacobians[part] = np.moveaxis(chain.coupling.matrix.T @ block, -1, 0)
    return jacobians


def placement_sensitivities(
    robot: Chained, q: ArrayLike, *, frames: ChainFrames | None = None, point: ArrayLike | None = None
) -> Array:
    """Twist of the tool frame, in root axes at the point, for a unit twist of each segment's placement.

    The placement is perturbed on its right, in its own frame: P exp(ξ). With displaced ``frames`` it is the
    displaced placement that is perturbed further. The columns of translation hold the virtual prismatic
    joints of the paper (Eqs 6–8): along a segment's direction they give the displacement of the tool for a
    unit elongation.

    Parameters
    ----------
    robot, q, frames, point
        As for :func:`frame_jacobians`.

    Returns
    -------
    ndarray
        (N, 6, S, 6): twist of the tool, segment, twist of the placement (linear first in both).

    Raises
    ------
    RobotError
        If an array has not the shape that the robot asks for.
    """
    frames = chain_frames(robot, q) if frames is None else frames
    rotations, positions, target = _structure_of_arrays(frames, point)
    rows, elements = positions.shape[-1], robot.chain.placed
    sensitivities = np.empty((rows, 6, len(elements), 6))
    for part in chunks(rows):
        block = np.zeros((6, len(elements), 6, part.stop - part.start))
        for s, k in enumerate(elements):
            rotation = rotations[k, ..., part]
            lever = target[:, part] - positions[k, :, part]
            block[:3, s, :3] = rotation
            block[3:, s, 3:] = rotation
            for axis in range(3):
                _cross(rotation[:, axis], lever, out=block[:3, s, 3 + axis])
        sensitivities[part] = np.moveaxis(block, -1, 0)
    return sensitivities


def _structure_of_arrays(frames: ChainFrames, point: ArrayLike | None) -> tuple[Array, Array, Array]:
    """Rotations (K, 3, 3, N), positions (K, 3, N) and the target point (3, N), all in root axes."""
    target = frames.tool_position.T
    if point is not None:
        offset = np.asarray(point, dtype=float)
        if offset.shape not in ((3,), frames.tool_position.shape):
            raise RobotError(
                f"a point of shape {offset.shape} does not fit: expected (3,) or {frames.tool_position.shape}"
            )
        target = target + np.einsum(
            "nij,nj->in", frames.tool_rotation, np.broadcast_to(offset, frames.tool_position.shape)
        )
    return np.moveaxis(frames.rotations, 0, -1), np.moveaxis(frames.positions, 0, -1), target


def _cross(a: Array, b: Array, out: Array) -> None:
    """Cross product of vectors with their components first; here several times faster than ``np.cross``."""
    for i, (j, k) in enumerate(((1, 2), (2, 0), (0, 1))):
        np.multiply(a[j], b[k], out=out[i])
        out[i] -= a[k] * b[j]
