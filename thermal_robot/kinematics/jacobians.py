"""What the tool does when a joint or a placement changes a little, for a batch of configurations."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from thermal_robot.arrays import Array
from thermal_robot.errors import RobotError
from thermal_robot.kinematics import lanes
from thermal_robot.kinematics.engines import engine_for
from thermal_robot.kinematics.frames import ChainFrames, as_rows
from thermal_robot.kinematics.scratch import result

if TYPE_CHECKING:
    from thermal_robot.kinematics.displaced import Chained


def frame_jacobians(
    robot: Chained,
    q: ArrayLike,
    *,
    frames: ChainFrames | None = None,
    point: ArrayLike | None = None,
    out: Array | None = None,
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
    out
        Array for the result, of its shape; fastest with N last in memory, as the results of earlier calls are.

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
    q = as_rows(robot, q) if frames is None else frames.tool_position
    at, out = _point(point, len(q)), result(out, len(q), 6, robot.n)
    if frames is None:
        engine_for(robot, len(q)).jacobians(robot, q, at, out)
    else:
        lanes.jacobians(robot, q, at, out, frames.rows_last())
    return out


def placement_sensitivities(
    robot: Chained,
    q: ArrayLike,
    *,
    frames: ChainFrames | None = None,
    point: ArrayLike | None = None,
    out: Array | None = None,
) -> Array:
    """Twist of the tool frame, in root axes at the point, for a unit twist of each segment's placement.

    The placement is perturbed on its right, in its own frame: P exp(ξ). With displaced ``frames`` it is the
    displaced placement that is perturbed further. The columns of translation hold the virtual prismatic
    joints of the paper (Eqs 6–8): along a segment's direction they give the displacement of the tool for a
    unit elongation.

    Parameters
    ----------
    robot, q, frames, point, out
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
    q = as_rows(robot, q) if frames is None else frames.tool_position
    at, out = _point(point, len(q)), result(out, len(q), 6, len(robot.chain.placed), 6)
    if frames is None:
        engine_for(robot, len(q)).placements(robot, q, at, out)
    else:
        lanes.placements(robot, q, at, out, frames.rows_last())
    return out


def _point(point: ArrayLike | None, rows: int) -> Array | None:
    """Return the point of the tool, (3,) or (N, 3) m; ``None`` for its origin."""
    if point is None:
        return None
    offset = np.asarray(point, dtype=float)
    if offset.shape not in ((3,), (rows, 3)):
        raise RobotError(f"a point of shape {offset.shape} does not fit: expected (3,) or {(rows, 3)}")
    return offset
