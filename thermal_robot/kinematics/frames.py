"""Batch forward kinematics and Jacobians of a chain, nominal or displaced, by the fastest engine."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from thermal_robot.arrays import Array
from thermal_robot.errors import RobotError
from thermal_robot.kinematics import compiled, lanes, settings, thin
from thermal_robot.kinematics.lanes import BASE, TOOL, Chained, ChainFrames, Moved, chunks, result, walk
from thermal_robot.kinematics.lie import exp6


@dataclass(frozen=True, eq=False)
class Displacement:
    """Small errors in the four channels of a chain; ``None`` means none there.

    The displaced tool pose is ``exp(base) · Π_k [P_k · exp(segment_k) · motion_k(q_k + joint_k)] ·
    exp(tool)``; every array may have a row for each configuration or be one row for all. Twists are ordered
    (linear m, angular rad). A joint that mimics another follows it where that one really is: ``q + joint``.

    Parameters
    ----------
    joint
        (N, n) or (n,) rad or m, added to the joint positions.
    segment
        (N, S, 6) or (S, 6): twist of each segment's placement, in its own frame (a right perturbation,
        ``LOCAL`` in Pinocchio).
    base
        (N, 6) or (6,) in the root frame.
    tool
        (N, 6) or (6,) in the tool frame.
    """

    joint: ArrayLike | None = None
    segment: ArrayLike | None = None
    base: ArrayLike | None = None
    tool: ArrayLike | None = None


def compute(
    what: str,
    robot: Chained,
    q: Array,
    out: Array,
    point: Array | None = None,
    mass: Array | None = None,
    frames: ChainFrames | None = None,
) -> Array:
    """Dispatch a batch of configurations ``q``, (N, n), to the fastest engine, which writes into ``out``.

    ``what`` is ``poses``, ``jacobians``, ``placements`` or ``gravity``. A point of the tool is (3,) or (N, 3) m in its
    frame, ``None`` for its origin; the mass of a payload there () or (N,) kg. With ``frames`` ``q`` is not read.
    """
    arguments = [] if what == "poses" else [point] if mass is None else [point, mass]
    if frames is not None:
        getattr(lanes, what)(robot, q, out, *arguments, frames)
    elif len(q) <= settings.FEW and len(robot.chain.placed) <= settings.MOST_PLACEMENTS:
        getattr(thin, what)(robot, q, out, *arguments)
    elif len(q) >= settings.MANY and _one_for_all(point, mass) and compiled.installed():
        compiled.run(what, robot, q, out, *arguments)
    else:
        getattr(lanes, what)(robot, q, out, *arguments)
    return out


def _one_for_all(point: Array | None, mass: Array | None) -> bool:
    return (point is None or point.ndim == 1) and (mass is None or mass.ndim == 0)


def _ready(robot: Chained, displacement: Displacement | None, rows: int) -> Moved:
    """Validate a displacement; convert it to joint offsets and, for twists not all zero, rigid motions by element."""
    if displacement is None:
        return lanes.NOWHERE
    shapes = {"joint": (robot.n,), "segment": (len(robot.segments), 6), "base": (6,), "tool": (6,)}
    found: dict[str, Array] = {}
    for name, shape in shapes.items():
        value = getattr(displacement, name)
        if value is None:
            continue
        array = np.asarray(value, dtype=float)
        if array.shape not in (shape, (rows, *shape)):
            raise RobotError(
                f"displacement {name!r} of shape {array.shape} does not fit: expected {shape} or {(rows, *shape)}",
                name=robot.name,
            )
        found[name] = array[None] if array.shape == shape else array
    twists = {end: found[name] for end, name in ((BASE, "base"), (TOOL, "tool")) if name in found}
    if "segment" in found:
        twists |= {int(k): found["segment"][:, s] for s, k in enumerate(robot.chain.placed)}
    return Moved(found.get("joint"), _motions({k: own for k, own in twists.items() if np.any(own)}))


def _motions(twists: dict[int, Array]) -> dict[int, Array]:
    """Rigid motions (4, 4, N) of (N, 6) twists; (4, 4, 1) where all rows are the same."""
    same = [k for k, own in twists.items() if (own == own[:1]).all()]
    alike = exp6(np.array([twists[k][0] for k in same]).reshape(-1, 6))
    motions = {k: motion[:, :, None] for k, motion in zip(same, alike, strict=True)}
    for k in twists.keys() - motions.keys():
        motions[k] = np.ascontiguousarray(np.moveaxis(exp6(twists[k]), 0, -1))
    return motions


def chain_frames(robot: Chained, q: ArrayLike, displacement: Displacement | None = None) -> ChainFrames:
    """Forward kinematics: frames of every chain element and of the tool.

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
    moved = _ready(robot, displacement, len(q))
    elements = len(robot.chain.names)
    frames = np.empty((elements + 1, 3, 4, len(q)))
    for part in chunks(len(q), elements):
        walk(robot.chain, q, moved, part, frames[:-1, ..., part], frames[-1, ..., part])
    rows = np.moveaxis(frames, -1, 0)
    return ChainFrames(rows[:, :-1, :, :3], rows[:, :-1, :, 3], rows[:, -1, :, :3], rows[:, -1, :, 3])


def tool_poses(
    robot: Chained, q: ArrayLike, displacement: Displacement | None = None, *, out: Array | None = None
) -> Array:
    """Forward kinematics: pose of the tool frame in the root frame.

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
        return compute("poses", robot, q, out)
    lanes.poses(robot, q, out, _ready(robot, displacement, len(q)))
    return out


def as_rows(robot: Chained, q: ArrayLike) -> Array:
    """Return the configurations as an (N, n) array of floats, one row for (n,); an error for another shape."""
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
        includes their motion.

    Raises
    ------
    RobotError
        If an array has not the shape that the robot asks for.
    """
    q = as_rows(robot, q) if frames is None else frames.tool_position
    out = result(out, len(q), 6, robot.n)
    return compute("jacobians", robot, q, out, _point(point, len(q)), frames=frames)


def placement_sensitivities(
    robot: Chained,
    q: ArrayLike,
    *,
    frames: ChainFrames | None = None,
    point: ArrayLike | None = None,
    out: Array | None = None,
) -> Array:
    """Kinematic regressor: twist of the tool, in root axes at the point, for a unit twist of each segment's placement.

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
    out = result(out, len(q), 6, len(robot.chain.placed), 6)
    return compute("placements", robot, q, out, _point(point, len(q)), frames=frames)


def _point(point: ArrayLike | None, rows: int) -> Array | None:
    """Validate a point of the tool, (3,) or (N, 3) m; ``None`` for its origin."""
    if point is None:
        return None
    offset = np.asarray(point, dtype=float)
    if offset.shape not in ((3,), (rows, 3)):
        raise RobotError(f"a point of shape {offset.shape} does not fit: expected (3,) or {(rows, 3)}")
    return offset
