"""Frames of the chain, nominal or displaced, and their Jacobians, for a batch of configurations; by which engine."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from thermal_robot.arrays import Array
from thermal_robot.errors import RobotError
from thermal_robot.kinematics import compiled, lanes, settings, thin
from thermal_robot.kinematics.lanes import Places
from thermal_robot.kinematics.walk import Chained, Displaced, Displacement, Weighted, chunks, result, rows_last, walk


class Engine(Protocol):
    """What every engine can do: write the results of N configurations ``q``, (N, n), into ``out``.

    A point of the tool is (3,) or (N, 3) m in its frame, ``None`` for its origin; the mass of a payload () or (N,) kg.
    """

    def poses(self, robot: Chained, q: Array, out: Array) -> None:
        """Write the poses of the tool, (N, 4, 4)."""

    def jacobians(self, robot: Chained, q: Array, point: Array | None, out: Array) -> None:
        """Write the Jacobians at the point, (N, 6, n)."""

    def placements(self, robot: Chained, q: Array, point: Array | None, out: Array) -> None:
        """Write the sensitivities of the point to every placement, (N, 6, S, 6)."""

    def gravity(self, robot: Weighted, q: Array, mass: Array, com: Array, out: Array) -> None:
        """Write the torques that hold the arm and the payload, (N, n)."""


def engine_for(robot: Chained, rows: int) -> Engine:
    """Return the engine that is fastest for that many configurations."""
    if rows <= settings.FEW and thin.covers(robot):
        return thin
    return compiled if rows >= settings.MANY and compiled.installed() else lanes


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
