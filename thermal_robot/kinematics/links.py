"""Forward kinematics of all links, and elongation of segments (Kluz et al. 2018, Eqs 6–11)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from thermal_robot.arrays import Array
from thermal_robot.kinematics.frames import chain_frames

if TYPE_CHECKING:
    from thermal_robot.robot import Robot


def growing(robot: Robot) -> tuple[int, ...]:
    """Return the indices of the S segments that have a length along which they can grow, from the root on."""
    return tuple(s for s, segment in enumerate(robot.segments) if np.any(segment.direction))


def elongation_jacobian(robot: Robot, q: ArrayLike) -> Array:
    """Jacobian of the tool's position, in root axes, by the elongation of each segment with a length (Eqs 6–11).

    The columns are unit vectors: the directions of the segments. They are the same for every point of the tool, and
    an elongation turns nothing, so that the displacement is linear in the elongations, not only to first order.

    Parameters
    ----------
    robot
        The robot.
    q
        (N, n) rad or m; (n,) counts as one configuration.

    Returns
    -------
    ndarray
        (N, 3, S) m/m; S segments as by :func:`growing`.

    Raises
    ------
    RobotError
        If ``q`` does not have the shape that the robot asks for.
    """
    frames = chain_frames(robot, q)
    chosen = [robot.segments[s] for s in growing(robot)]
    out = np.empty((len(frames.tool_position), 3, len(chosen)))
    for column, segment in enumerate(chosen):
        out[..., column] = frames.rotations[:, segment.index] @ segment.direction
    return out


def link_poses(robot: Robot, q: ArrayLike) -> Array:
    """Forward kinematics of every link of the URDF in the root frame, by Pinocchio, row after row.

    Parameters
    ----------
    robot
        The robot; joints beside its chain stand where they are held.
    q
        (N, n) rad or m; (n,) counts as one configuration.

    Returns
    -------
    ndarray
        (N, L, 4, 4) homogeneous matrices, lengths in m, in the order of ``robot.urdf_links``.
    """
    model, data = robot.model, robot.model.createData()
    frames = [model.getFrameId(link, pin.FrameType.BODY) for link in robot.urdf_links]
    root = frames[robot.urdf_links.index(robot.root_frame)]
    configurations = to_pinocchio(robot, q)
    poses = np.empty((len(configurations), len(frames), 4, 4))
    for i, configuration in enumerate(configurations):
        pin.framesForwardKinematics(model, data, configuration)
        poses[i] = [data.oMf[root].actInv(data.oMf[frame]).homogeneous for frame in frames]
    return poses


def to_pinocchio(robot: Robot, q: ArrayLike) -> Array:
    """Pinocchio configurations (N, nq) from (N, n): mimicking joints added, continuous ones as cosine and sine."""
    rows = robot.chain.coupling.positions(np.atleast_2d(np.asarray(q, dtype=float)))
    columns = []
    for joint, position in zip(list(robot.model.joints)[1:], rows.T, strict=True):
        columns += [np.cos(position), np.sin(position)] if joint.nq == 2 else [position]
    return np.column_stack(columns)
