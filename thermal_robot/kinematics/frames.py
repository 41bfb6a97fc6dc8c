"""Where the frames of the chain are, for a batch of configurations, nominal or displaced.

Inside, a quantity of N configurations is kept as a structure of arrays, the N last, so that each NumPy call
works on long contiguous rows, and in chunks that stay in the processor's cache. Outside, N comes first.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal_robot.errors import RobotError
from thermal_robot.kinematics.lie import exp6, skew
from thermal_robot.kinematics.model import FIXED, REVOLUTE

if TYPE_CHECKING:
    from thermal_robot.kinematics.chained import Chained

Array = NDArray[np.float64]

CHUNK = 4096
"""Configurations worked on at a time: few enough for their arrays to stay in the cache, many enough for NumPy's calls
to cost nothing beside them."""


@dataclass(frozen=True, eq=False)
class Displacement:
    """Small errors in the four places where error enters a chain; ``None`` means none there.

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
    rows, chain = len(q), robot.chain
    moved = _Displaced.of(robot, displacement, rows)
    rotations = np.empty((len(chain.names), 3, 3, rows))
    positions = np.empty((len(chain.names), 3, rows))
    tool_rotation, tool_position = np.empty((3, 3, rows)), np.empty((3, rows))
    joint_of = {int(k): j for j, k in enumerate(chain.movable)}
    turns = skew(chain.axes)
    for part in chunks(rows):
        driving = q[part] + moved.joint[part if len(moved.joint) > 1 else slice(None)]
        joints = np.ascontiguousarray(chain.coupling.positions(driving).T)
        rotation, position = moved.start(part)
        for k in range(len(chain.names)):
            rotation, position = _compose(rotation, position, chain.rotations[k], chain.translations[k])
            if k in moved.segment:
                rotation, position = _compose_rows(rotation, position, *_rows_of(moved.segment[k], part))
            rotations[k, ..., part], positions[k, ..., part] = rotation, position
            if chain.kinds[k] == FIXED:
                continue
            angle = joints[joint_of[k]]
            if chain.kinds[k] == REVOLUTE:
                rotation = _turn(rotation, turns[k], angle)
            else:
                position = position + (chain.axes[k] @ rotation) * angle
        if moved.tool is not None:
            rotation, position = _compose_rows(rotation, position, *_rows_of(moved.tool, part))
        tool_rotation[..., part], tool_position[..., part] = rotation, position
    return ChainFrames(
        np.moveaxis(rotations, -1, 0),
        np.moveaxis(positions, -1, 0),
        np.moveaxis(tool_rotation, -1, 0),
        tool_position.T,
    )


def tool_poses(robot: Chained, q: ArrayLike, displacement: Displacement | None = None) -> Array:
    """Pose of the tool frame in the root frame.

    Parameters
    ----------
    robot, q, displacement
        As for :func:`chain_frames`.

    Returns
    -------
    ndarray
        (N, 4, 4) homogeneous matrices, lengths in m.
    """
    frames = chain_frames(robot, q, displacement)
    poses = np.zeros((len(frames.tool_position), 4, 4))
    poses[:, :3, :3], poses[:, :3, 3], poses[:, 3, 3] = frames.tool_rotation, frames.tool_position, 1.0
    return poses


def as_rows(robot: Chained, q: ArrayLike) -> Array:
    """Return the configurations as an (N, n) array of floats."""
    rows = np.atleast_2d(np.asarray(q, dtype=float))
    if rows.ndim != 2 or rows.shape[1] != robot.n:
        raise RobotError(
            f"joint positions of shape {np.shape(q)} do not fit robot {robot.name!r} of {robot.n} joints: "
            f"expected (N, {robot.n})",
            name=robot.name,
        )
    return rows


def chunks(rows: int) -> Iterator[slice]:
    """Consecutive slices that cover all rows."""
    return (slice(start, min(start + CHUNK, rows)) for start in range(0, rows, CHUNK))


@dataclass(frozen=True, eq=False)
class _Displaced:
    """A displacement made ready: joint offsets (1 or N, n), twists as rigid motions (4, 4, 1 or N)."""

    joint: Array
    segment: dict[int, Array]
    base: Array | None
    tool: Array | None

    @staticmethod
    def of(robot: Chained, displacement: Displacement | None, rows: int) -> _Displaced:
        if displacement is None:
            displacement = Displacement()
        joint = _channel(robot, "joint", displacement.joint, (robot.n,), rows)
        segment = _channel(robot, "segment", displacement.segment, (len(robot.segments), 6), rows)
        base = _channel(robot, "base", displacement.base, (6,), rows)
        tool = _channel(robot, "tool", displacement.tool, (6,), rows)
        motions: dict[int, Array] = {}
        for s, k in enumerate(robot.chain.placed if segment is not None else ()):
            if segment is not None and np.any(segment[:, s]):
                motions[int(k)] = _motions(segment[:, s])
        return _Displaced(
            np.zeros((1, robot.n)) if joint is None else joint,
            motions,
            None if base is None else _motions(base),
            None if tool is None else _motions(tool),
        )

    def start(self, part: slice) -> tuple[Array, Array]:
        size = part.stop - part.start
        if self.base is None:
            return np.repeat(np.eye(3)[..., None], size, axis=2), np.zeros((3, size))
        rotation, position = _rows_of(self.base, part)
        return np.broadcast_to(rotation, (3, 3, size)).copy(), np.broadcast_to(position, (3, size)).copy()


def _channel(robot: Chained, name: str, value: ArrayLike | None, shape: tuple[int, ...], rows: int) -> Array | None:
    if value is None:
        return None
    array = np.asarray(value, dtype=float)
    if array.shape == shape:
        return array[None]
    if array.shape == (rows, *shape):
        return array
    raise RobotError(
        f"displacement {name!r} of shape {array.shape} does not fit: expected {shape} or {(rows, *shape)}",
        name=robot.name,
    )


def _motions(twists: Array) -> Array:
    return np.ascontiguousarray(np.moveaxis(exp6(twists), 0, -1))


def _rows_of(motions: Array, part: slice) -> tuple[Array, Array]:
    chosen = motions if motions.shape[-1] == 1 else motions[..., part]
    return chosen[:3, :3], chosen[:3, 3]


def _compose(rotation: Array, position: Array, by_rotation: Array, by_translation: Array) -> tuple[Array, Array]:
    """Follow every frame, (3, 3, C) and (3, C), by one constant placement."""
    # rotation[i] is (3, C) over the columns of the matrix: a constant on the right is a matrix on its left.
    return by_rotation.T @ rotation, position + by_translation @ rotation


def _compose_rows(rotation: Array, position: Array, by_rotation: Array, by_translation: Array) -> tuple[Array, Array]:
    """Follow every frame by a motion of its own."""
    product = rotation[:, 0, None] * by_rotation[0]
    for m in (1, 2):
        product += rotation[:, m, None] * by_rotation[m]
    return product, position + np.einsum("imc,mc->ic", rotation, np.broadcast_to(by_translation, position.shape))


def _turn(rotation: Array, turn: Array, angle: Array) -> Array:
    """Rotate every frame about its own constant axis: R (1 + sin q [a]× + (1 − cos q) [a]×²), Rodrigues."""
    once = turn.T @ rotation
    twice = turn.T @ once
    once *= np.sin(angle)
    twice *= 2.0 * np.sin(0.5 * angle) ** 2
    once += twice
    once += rotation
    return once
