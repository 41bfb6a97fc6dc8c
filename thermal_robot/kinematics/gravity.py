"""The torques that hold an arm against gravity, for a batch of configurations."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal_robot.errors import RobotError
from thermal_robot.kinematics.frames import ChainFrames, chain_frames
from thermal_robot.kinematics.model import REVOLUTE

if TYPE_CHECKING:
    from thermal_robot.robot import Robot

Array = NDArray[np.float64]


def gravity_torques(
    robot: Robot,
    q: ArrayLike,
    *,
    payload: ArrayLike | None = None,
    payload_com: ArrayLike = (0.0, 0.0, 0.0),
    frames: ChainFrames | None = None,
) -> Array:
    """Torque or force of each joint that holds the arm and its payload still.

    It is the gradient of the potential energy by the joint positions: ``pinocchio.computeGeneralizedGravity``
    with the payload as a point mass.

    Parameters
    ----------
    robot
        The robot; one without masses carries the payload only.
    q
        (N, n) rad or m; not read if ``frames`` is given.
    payload
        (N,) or one number, kg.
    payload_com
        (3,) m: centre of the payload in the tool frame.
    frames
        From :func:`~thermal_robot.kinematics.chain_frames`, to save computing them again.

    Returns
    -------
    ndarray
        (N, n) N·m, or N for a prismatic joint.

    Raises
    ------
    RobotError
        If an array has not the shape that the robot asks for.
    """
    frames = chain_frames(robot, q) if frames is None else frames
    chain, rows = robot.chain, len(frames.tool_position)
    rotations, positions = np.moveaxis(frames.rotations, 0, -1), np.moveaxis(frames.positions, 0, -1)
    tool_rotation, tool_position = np.moveaxis(frames.tool_rotation, 0, -1), frames.tool_position.T
    mass, com = _payload(payload, payload_com, rows)

    torques = np.empty((rows, robot.n))
    # From the tool inwards: what a joint carries is what the next one carries plus its own bodies.
    moment = mass * (tool_position + np.einsum("ijn,j->in", tool_rotation, com))
    for j in range(robot.n - 1, -1, -1):
        k = chain.movable[j]
        last = k + 1 == len(chain.names)
        body_rotation, body_position = (tool_rotation, tool_position) if last else (rotations[k + 1], positions[k + 1])
        moment = moment + chain.masses[j] * (body_position + chain.mass_centres[j] @ body_rotation)
        mass = mass + chain.masses[j]
        axis = chain.axes[k] @ rotations[k]
        if chain.kinds[k] == REVOLUTE:
            # −m g · (axis × lever), the triple product turned so that the constant vector is crossed once
            lever = moment - mass * positions[k]
            torques[:, j] = -np.einsum("in,in->n", axis, np.cross(lever, robot.gravity[:, None], axis=0))
        else:
            torques[:, j] = -mass * (robot.gravity @ axis)
    return torques


def _payload(payload: ArrayLike | None, com: ArrayLike, rows: int) -> tuple[Array, Array]:
    mass = np.asarray(0.0 if payload is None else payload, dtype=float)
    centre = np.asarray(com, dtype=float)
    if mass.shape not in ((), (rows,)):
        raise RobotError(f"a payload of shape {mass.shape} does not fit: expected one number or ({rows},)")
    if centre.shape != (3,):
        raise RobotError(f"payload_com of shape {centre.shape} does not fit: expected (3,)")
    return mass, centre
