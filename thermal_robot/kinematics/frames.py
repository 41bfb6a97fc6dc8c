"""Where the frames of the chain are, for a batch of configurations, nominal or displaced."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from thermal_robot.arrays import Array
from thermal_robot.errors import RobotError
from thermal_robot.kinematics import lanes
from thermal_robot.kinematics.blocks import Places
from thermal_robot.kinematics.displaced import Displaced, Displacement
from thermal_robot.kinematics.engines import engine_for
from thermal_robot.kinematics.scratch import chunks, result, rows_last
from thermal_robot.kinematics.walk import walk

if TYPE_CHECKING:
    from thermal_robot.kinematics.displaced import Chained


__all__ = ["ChainFrames", "Displacement", "as_rows", "chain_frames", "tool_poses"]


@dataclass(frozen=True, eq=False)
class ChainFrames:
    """Frames of N configurations in the axes of the root frame, for K chain elements (fixed URDF joints too).

    Parameters
    ----------
    rotations, positions
        (N, K, 3, 3) and (N, K, 3) m: after the placement of each element, displaced or not, and before its
        motion. The memory is laid out with N last, for speed.
    tool_rotation, tool_position
        (N, 3, 3) and (N, 3) m of the tool frame.
    """

    rotations: Array
    positions: Array
    tool_rotation: Array
    tool_position: Array

    def rows_last(self) -> Places:
        """Return the same with the N last, as the engines want them."""
        arrays = (self.rotations, self.positions, self.tool_rotation, self.tool_position)
        return Places(*map(rows_last, arrays))


def chain_frames(robot: Chained, q: ArrayLike, displacement: Displacement | None = None) -> ChainFrames:
    """Frames of every chain element and of the tool.

    Parameters
    ----------
    robot
        The robot.
    q
        (N, n) rad or m; (n,) counts as one configuration.
    displacement
        Errors to apply exactly, not to first order.

    Raises
    ------
    RobotError
        If ``q`` or a displacement does not have the shape that the robot asks for.
    """
    q = as_rows(robot, q)
    moved = Displaced.of(robot, displacement, len(q))
    elements = len(robot.chain.names)
    frames = np.empty((elements + 1, 3, 4, len(q)))
    for part in chunks(len(q), elements):
        walk(robot.chain, q, moved, part, frames[:-1, ..., part], frames[-1, ..., part])
    rows = np.moveaxis(frames, -1, 0)
    return ChainFrames(rows[:, :-1, :, :3], rows[:, :-1, :, 3], rows[:, -1, :, :3], rows[:, -1, :, 3])


def tool_poses(
    robot: Chained, q: ArrayLike, displacement: Displacement | None = None, *, out: Array | None = None
) -> Array:
    """Pose of the tool frame in the root frame.

    Parameters
    ----------
    robot, q, displacement
        As for :func:`chain_frames`.
    out
        Array for the result, of its shape; fastest with N last in memory, as the results of earlier calls are.

    Returns
    -------
    ndarray
        (N, 4, 4) homogeneous matrices, lengths in m; ``out``, if it was given.

    Raises
    ------
    RobotError
        If an array has not the shape that the robot asks for.
    """
    q = as_rows(robot, q)
    out = result(out, len(q), 4, 4)
    if displacement is None:
        engine_for(robot, len(q)).poses(robot, q, out)
    else:
        lanes.poses(robot, q, out, Displaced.of(robot, displacement, len(q)))
    return out


def as_rows(robot: Chained, q: ArrayLike) -> Array:
    """Return the configurations as an (N, n) array of floats."""
    rows = np.asarray(q, dtype=float)
    if rows.ndim < 2:
        rows = rows.reshape(1, -1)
    if rows.ndim != 2 or rows.shape[1] != robot.n:
        raise RobotError(
            f"joint positions of shape {np.shape(q)} do not fit robot {robot.name!r} of {robot.n} joints: "
            f"expected (N, {robot.n})",
            name=robot.name,
        )
    return rows
