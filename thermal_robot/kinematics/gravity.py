"""Gravity torques of the joints and gravity wrenches on the segments, in batches."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from thermal_robot.arrays import Array
from thermal_robot.errors import RobotError
from thermal_robot.kinematics.frames import as_rows, chain_frames, compute
from thermal_robot.kinematics.lanes import ChainFrames, result
from thermal_robot.kinematics.model import REVOLUTE

if TYPE_CHECKING:
    from thermal_robot.robot import Robot

_AT_TOOL = (0.0, 0.0, 0.0)


def gravity_torques(
    robot: Robot,
    q: ArrayLike,
    *,
    payload: ArrayLike | None = None,
    payload_com: ArrayLike = _AT_TOOL,
    frames: ChainFrames | None = None,
    out: Array | None = None,
) -> Array:
    """Generalized gravity: torque or force of each joint that holds the arm and its payload still.

    It is the gradient of the potential energy by the joint positions: ``pinocchio.computeGeneralizedGravity``
    with the payload as a point mass. A joint that others mimic holds them, too.

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
    out
        Array for the result, of its shape; fastest with N last in memory, as the results of earlier calls are.

    Returns
    -------
    ndarray
        (N, n) N·m, or N for a prismatic joint.

    Raises
    ------
    RobotError
        If an array has not the shape that the robot asks for.
    """
    q = as_rows(robot, q) if frames is None else frames.tool_position
    mass, com = _payload(payload, payload_com, len(q))
    return compute("gravity", robot, q, result(out, len(q), robot.n), com, mass, frames)


def segment_loads(
    robot: Robot,
    q: ArrayLike,
    *,
    payload: ArrayLike | None = None,
    payload_com: ArrayLike = _AT_TOOL,
) -> Array:
    """Gravity wrench on the far end of each segment: the weight of everything beyond it.

    Parameters
    ----------
    robot, q, payload, payload_com
        As for :func:`gravity_torques`.

    Returns
    -------
    ndarray
        (N, S, 6) force (N), then moment about the placement's origin (N·m), in the segment's own frame (behind the
        rotation of its placement). About the axis of a revolute joint the moment is minus what holds the joint.

    Raises
    ------
    RobotError
        If an array has not the shape that the robot asks for.
    """
    frames, chain = chain_frames(robot, q), robot.chain
    rows = len(frames.tool_position)
    rotations, positions = _with_tool(frames)
    mass, com = _payload(payload, payload_com, rows)
    moment = mass * (positions[-1] + com @ rotations[-1])
    segment_of = {int(k): s for s, k in enumerate(chain.placed)}
    joint_of = {int(k): j for j, k in enumerate(chain.movable)}
    gravity = robot.gravity[:, None]

    loads = np.empty((rows, len(segment_of), 6))
    for k in range(len(chain.names) - 1, -1, -1):
        if k in joint_of:
            j = joint_of[k]
            moment = moment + chain.masses[j] * (positions[k + 1] + chain.mass_centres[j] @ rotations[k + 1])
            mass = mass + chain.masses[j]
        if k not in segment_of:
            continue
        # a frame in the midst of a body carries what is fixed behind it, but not yet the whole body
        beyond = mass + chain.hanging[k]
        about = moment + chain.hanging[k] * (positions[k] + chain.hanging_centres[k] @ rotations[k])
        turned = np.cross(about - beyond * positions[k], gravity, axis=0)
        for part, wrench in ((slice(0, 3), np.broadcast_to(beyond * gravity, (3, rows))), (slice(3, 6), turned)):
            loads[:, segment_of[k], part] = np.einsum("imn,in->nm", rotations[k], wrench)
    return loads


def static_regressor(robot: Robot, q: ArrayLike) -> Array:
    """Regressor of statics: joint torques per unit mass and first moment of each body.

    Holding torques are linear in the masses and first moments of the bodies (Pinocchio's ``computeStaticRegressor``):
    τ_j = Σ_b Y_jb · (m_b, m_b c_b).

    Parameters
    ----------
    robot, q
        As for :func:`gravity_torques`.

    Returns
    -------
    ndarray
        (N, n, M, 4): joint, body (one behind each of the M movable joints, mimicking ones too), then its mass and
        first moment (x, y, z) in the frame of the element after that joint (the tool frame for the last).
    """
    frames = chain_frames(robot, q)
    chain, (rotations, positions) = robot.chain, ([np.moveaxis(e, -1, 0) for e in each] for each in _with_tool(frames))
    rows, bodies = len(frames.tool_position), len(chain.movable)
    regressor = np.zeros((rows, bodies, bodies, 4))
    for j, k in enumerate(chain.movable):
        axis = rotations[k] @ chain.axes[k]
        turn = -np.cross(robot.gravity, axis)  # −g · (axis × lever) = turn · lever
        for b in range(j, bodies):
            after = chain.movable[b] + 1
            if chain.kinds[k] == REVOLUTE:
                regressor[:, j, b, 0] = ((positions[after] - positions[k]) * turn).sum(axis=1)
                regressor[:, j, b, 1:] = np.einsum("nim,ni->nm", rotations[after], turn)
            else:
                regressor[:, j, b, 0] = -axis @ robot.gravity
    driven = chain.coupling.matrix.T @ regressor.reshape(rows, bodies, -1)
    return np.asarray(driven.reshape(rows, robot.n, bodies, 4))


def _with_tool(frames: ChainFrames) -> tuple[list[Array], list[Array]]:
    """List rotations (3, 3, N) and positions (3, N) of the K elements, followed by those of the tool."""
    places = frames.rows_last()
    return [*places.rotations, places.tool_rotation], [*places.positions, places.tool_position]


def _payload(payload: ArrayLike | None, com: ArrayLike, rows: int) -> tuple[Array, Array]:
    mass = np.asarray(0.0 if payload is None else payload, dtype=float)
    centre = np.asarray(com, dtype=float)
    if mass.shape not in ((), (rows,)):
        raise RobotError(f"a payload of shape {mass.shape} does not fit: expected one number or ({rows},)")
    if centre.shape != (3,):
        raise RobotError(f"payload_com of shape {centre.shape} does not fit: expected (3,)")
    return mass, centre
