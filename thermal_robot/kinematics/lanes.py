"""NumPy engine: batch kinematics of a chunk of configurations at once, nominal or displaced.

A frame of C configurations is an array (3, 4, C): rotation and position side by side, as in the first three rows of a
homogeneous matrix, and the configurations last, so that every NumPy call works on long contiguous rows. Chunks stay in
the cache; results are written where they belong.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple, Protocol
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.errors import RobotError
from thermal_robot.kinematics import settings
from thermal_robot.kinematics.lie import sines_and_cosines
from thermal_robot.kinematics.model import FIXED, PRISMATIC, REVOLUTE, Chain

_FRAME = 12 * 8
"""Bytes of one frame of one configuration."""

_kept = threading.local()


def scratch(name: str, *shape: int) -> Array:
    """Reusable uninitialised array of a shape; valid until the next call.

    Two arrays that are in use together have two names.
    """
    size = math.prod(shape)
    kept: Array | None = getattr(_kept, name, None)
    if kept is None or kept.size < size:
        kept = np.empty(size)
        setattr(_kept, name, kept)
    return kept[:size].reshape(shape)


def chunks(rows: int, frames: int) -> Iterator[slice]:
    """Consecutive slices of rows, short enough for that many frames a row to stay in the cache."""
    fits = settings.CACHE // (_FRAME * max(frames, 1))
    step = max(min(settings.CHUNK, fits), min(settings.SHORTEST_CHUNK, settings.CHUNK))
    return (slice(start, min(start + step, rows)) for start in range(0, rows, step))


def rows_last(array: Array) -> Array:
    """View of an array (N, ...) as (..., N)."""
    return array.transpose(*range(1, array.ndim), 0)


def result(out: Array | None, rows: int, *shape: int) -> Array:
    """Output array for N configurations: a new one with N last in memory, or the caller's.

    The caller's ``out`` is of shape (N, ...), in any layout; refused unless it is such an array of floats that may be
    written to.
    """
    if out is None:
        last = len(shape)
        return np.empty((*shape, rows)).transpose(last, *range(last))
    wanted = (rows, *shape)
    if not isinstance(out, np.ndarray) or out.shape != wanted or out.dtype != np.float64:
        raise RobotError(
            f"out of shape {np.shape(out)} and type {getattr(out, 'dtype', type(out).__name__)} does not fit: "
            f"expected an array of float64 of shape {wanted}"
        )
    if not out.flags.writeable:
        raise RobotError("out must not be written to: give an array that may be, or none")
    return out


class Chained(Protocol):
    """Protocol of a robot for the engines, a subset of :class:`~thermal_robot.Robot`."""

    @property
    def name(self) -> str: ...  # noqa: D102
    @property
    def n(self) -> int: ...  # noqa: D102
    @property
    def segments(self) -> Sequence[Any]: ...  # noqa: D102
    @property
    def chain(self) -> Chain: ...  # noqa: D102
    @property
    def gravity(self) -> Array: ...  # noqa: D102


class ChainFrames(NamedTuple):
    """Frames of N configurations in the axes of the root frame, for K chain elements (fixed URDF joints too).

    Parameters
    ----------
    rotations, positions
        (N, K, 3, 3) and (N, K, 3) m: after the placement of each element, displaced or not, and before its
        motion. The memory is laid out with N last, for speed; within the engine N is the last axis, too.
    tool_rotation, tool_position
        (N, 3, 3) and (N, 3) m of the tool frame.
    """

    rotations: Array
    positions: Array
    tool_rotation: Array
    tool_position: Array

    def rows_last(self) -> ChainFrames:
        """Copy with the N last, as the engines need them."""
        return ChainFrames(*map(rows_last, self))


class Moved(NamedTuple):
    """Displacement as arrays: joint offsets (1 or N, n), and rigid motions (4, 4, 1 or N) by element."""

    joint: Array | None = None
    motions: dict[int, Array] = {}  # noqa: RUF012 - nobody writes to it


BASE, TOOL = -2, -1
"""Numbers of the chain's two ends, in addition to those of its elements 0..K−1."""
NOWHERE = Moved()
"""Displacement of a nominal chain: none."""
TURNS, TURNS_ALIGNED, SLIDES = 1, 2, 3
"""Kinds of joint motion: a turn about an axis of the frame, a turn about any other axis, a slide."""


class Arm(NamedTuple):
    """Constant arrays of a chain of K elements, M movable joints, n driving ones and S segments, for the engines.

    The walk along it goes from element to element by the constant ``place`` (K, 4, 4), then turns or slides. Where a
    joint turns about no axis of its frame, ``aligned`` (K, 4, 4) puts the third axis there first, and the next
    placement, or ``back`` behind the last joint, takes that off again. ``turns`` (K, 2): of the rotation the first
    column turns towards the second. ``lead``, ``factor``, ``offset``, ``first``, ``last`` (M,): column of the driving
    joint (−1: none), how a joint follows it, and whether it is the first or last to. ``plain``: whether every movable
    joint is a driving one. ``point`` (3,) of the tool, m.
    """

    kinds: NDArray[np.int64]
    joint: NDArray[np.int64]
    turns: NDArray[np.int64]
    place: Array
    aligned: Array
    back: Array
    axes: Array
    movable: NDArray[np.int64]
    placed: NDArray[np.int64]
    lead: NDArray[np.int64]
    factor: Array
    offset: Array
    first: NDArray[np.bool_]
    last: NDArray[np.bool_]
    plain: bool
    masses: Array
    centres: Array
    point: Array


_arms: WeakKeyDictionary[Chain, Arm] = WeakKeyDictionary()


def arm_of(chain: Chain) -> Arm:
    """Return the constant arrays of a chain for the engines, cached by chain; ``point`` is the tool's origin."""
    found = _arms.get(chain)
    if found is None:
        found = _arms[chain] = _made(chain)
    return found


def _made(chain: Chain) -> Arm:
    elements, matrix, offset = len(chain.names), chain.coupling.matrix, chain.coupling.offset
    kinds, joint = np.full(elements, FIXED), np.full(elements, -1)
    joint[chain.movable] = np.arange(len(chain.movable))
    turns, back = np.tile([0, 1], (elements, 1)), np.eye(4)
    place, aligned = chain.placements, np.tile(np.eye(4), (elements, 1, 1))
    for k in range(elements):
        place[k], back = back @ place[k], np.eye(4)
        if chain.kinds[k] == PRISMATIC:
            kinds[k] = SLIDES
        elif chain.kinds[k] == REVOLUTE:
            kinds[k], turns[k], aligned[k, :3, :3] = _about(chain.axes[k])
            back = aligned[k].T
    lead = [chain.coupling.leader(j) for j in range(len(matrix))]
    return Arm(
        kinds=kinds,
        joint=joint,
        turns=turns,
        place=place,
        aligned=aligned,
        back=back,
        axes=np.array(chain.axes),
        movable=np.array(chain.movable),
        placed=np.array(chain.placed),
        lead=np.array([-1 if j is None else j for j in lead]),
        factor=np.array([0.0 if j is None else matrix[row, j] for row, j in enumerate(lead)]),
        offset=np.array(offset),
        first=np.array([j not in lead[:row] for row, j in enumerate(lead)]),
        last=np.array([j not in lead[row + 1 :] for row, j in enumerate(lead)]),
        plain=np.array_equal(matrix, np.eye(len(matrix))) and not np.any(offset),
        masses=np.array(chain.masses),
        centres=np.array(chain.mass_centres),
        point=np.zeros(3),
    )


def _about(axis: Array) -> tuple[int, tuple[int, int], Array]:
    """Kind of a turn, the two columns of the frame that it rotates, and a constant rotation (3, 3) before it."""
    w = int(np.argmax(np.abs(axis)))
    a, b = (w + 1) % 3, (w + 2) % 3
    if np.abs(axis[w]) == 1.0 and np.count_nonzero(axis) == 1:
        return TURNS, (a, b) if axis[w] > 0.0 else (b, a), np.eye(3)
    first = np.eye(3)[a] - axis[a] * axis
    first /= np.linalg.norm(first)
    return TURNS_ALIGNED, (0, 1), np.column_stack([first, np.cross(axis, first), axis])


def walk(chain: Chain, q: Array, moved: Moved, part: slice, frames: Array | Sequence[Array], tool: Array) -> None:
    """Forward kinematics of a chunk of configurations: frames of all elements and of the tool.

    Of the N rows of ``q`` the chunk ``part`` has C. ``frames`` are K arrays (3, 4, C) to write to: the frame after the
    placement of each element, before its motion; consecutive ones must not be the same. ``tool`` is (3, 4, C).
    """
    arm, size = arm_of(chain), part.stop - part.start
    joints = _joints(arm, chain, q, moved.joint, part)
    sines, cosines = scratch("sines", *joints.shape), scratch("cosines", *joints.shape)
    sines_and_cosines(joints, sines, cosines)
    free, base = scratch("walk", 3, 4, size), moved.motions.get(BASE)
    here: Array | None = None if base is None else np.broadcast_to(_rows_of(base, part)[:3], (3, 4, size))
    for k, (kind, j, place) in enumerate(zip(arm.kinds.tolist(), arm.joint.tolist(), arm.place, strict=True)):
        frame = frames[k]
        if here is None:
            frame[...] = place[:3, :, None]
        else:
            np.matmul(place.T, here, out=frame)
        if k in moved.motions:
            frame[...] = _followed(frame, _rows_of(moved.motions[k], part))
        here = frame if kind == FIXED else free
        if kind == SLIDES:
            _slide(frame, arm.axes[k], joints[j], free)
        elif kind != FIXED:
            if kind == TURNS_ALIGNED:
                frame = np.matmul(arm.aligned[k].T, frame, out=scratch("aligned", *frame.shape))
            a, b = arm.turns[k].tolist()
            _turn(frame, a, b, sines[j], cosines[j], free)
    if here is not None and arm.kinds[-1] == TURNS_ALIGNED:
        np.matmul(arm.back.T, here, out=tool)
    elif tool is not here:
        tool[...] = here
    if TOOL in moved.motions:
        tool[...] = _followed(tool, _rows_of(moved.motions[TOOL], part))


def _joints(arm: Arm, chain: Chain, q: Array, more: Array | None, part: slice) -> Array:
    """Positions (M, C) of the movable joints in a chunk: offsets ``more`` added, then mimicking joints coupled."""
    driving = scratch("driving", q.shape[1], part.stop - part.start)
    driving[...] = q[part].T
    if more is not None:
        driving += more[part if len(more) > 1 else slice(None)].T
    if arm.plain:
        return driving
    joints = scratch("joints", len(chain.movable), driving.shape[1])
    np.matmul(chain.coupling.matrix, driving, out=joints)
    joints += arm.offset[:, None]
    return joints


def _turn(frame: Array, a: int, b: int, sine: Array, cosine: Array, out: Array) -> None:
    """Rotate column a of every frame towards column b."""
    one, other, term, rest = frame[:, a], frame[:, b], scratch("term", 3, len(sine)), 3 - a - b
    first, second = np.multiply(one, cosine, out=out[:, a]), np.multiply(other, cosine, out=out[:, b])
    first += np.multiply(other, sine, out=term)
    second -= np.multiply(one, sine, out=term)
    out[:, rest], out[:, 3] = frame[:, rest], frame[:, 3]


def _slide(frame: Array, axis: Array, distance: Array, out: Array) -> None:
    """Translate every frame along a constant axis of its own by its ``distance``, m."""
    out[...] = frame
    term = np.matmul(axis, frame[:, :3], out=scratch("term", 3, len(distance)))
    term *= distance
    out[:, 3] += term


def _rows_of(motions: Array, part: slice) -> Array:
    return motions if motions.shape[-1] == 1 else motions[..., part]


def _followed(frame: Array, motions: Array) -> Array:
    """Multiply every frame (3, 4, C) on its right by its own rigid motion, (4, 4, C), or a common one, (4, 4, 1)."""
    product = frame[:, 0, None] * motions[0]
    for m in (1, 2):
        product += frame[:, m, None] * motions[m]
    product[:, 3] += frame[:, 3]
    return np.asarray(product)


@contextmanager
def written(out: Array, part: slice) -> Iterator[Array]:
    """Yield a buffer for the results (..., C) of a chunk: the output itself where N is last in memory."""
    rows = rows_last(out)[..., part]
    if rows.strides[-1] == rows.itemsize:
        yield rows
        return
    block = scratch("written", *rows.shape)
    yield block
    rows[...] = block


def visit(
    robot: Chained, q: Array, out: Array, given: ChainFrames | None, do: Callable[[ChainFrames, slice, Array], None]
) -> None:
    """Call a function with the frames of one chunk of configurations after another, and its output buffer.

    The frames are overwritten when ``do`` returns; ``q`` is not read where those of all N are ``given``.
    """
    chain, elements = robot.chain, len(robot.chain.names)
    for part in chunks(len(out), elements):
        if given is not None:
            found = ChainFrames(*(array[..., part] for array in given.rows_last()))
        else:
            frames = scratch("frames", elements + 1, 3, 4, part.stop - part.start)
            walk(chain, q, NOWHERE, part, frames[:-1], frames[-1])
            found = ChainFrames(frames[:-1, :, :3], frames[:-1, :, 3], frames[-1, :, :3], frames[-1, :, 3])
        with written(out, part) as block:
            do(found, part, block)


def target(frames: ChainFrames, point: Array | None, part: slice) -> Array:
    """Position (3, C) in root axes of a point of the tool, (3,) or (N, 3) m in its frame."""
    if point is None:
        return frames.tool_position
    if point.ndim == 2:
        return np.asarray(np.einsum("imc,cm->ic", frames.tool_rotation, point[part]) + frames.tool_position)
    found = np.matmul(point, frames.tool_rotation, out=scratch("target", *frames.tool_position.shape))
    found += frames.tool_position
    return found


def cross(a: Array, b: Array, out: Array, term: Array) -> None:
    """Write the cross product of vectors, or of one with many, components first; faster here than ``np.cross``."""
    for i, (j, k) in enumerate(((1, 2), (2, 0), (0, 1))):
        np.multiply(a[j], b[k], out=out[i])
        np.multiply(a[k], b[j], out=term)
        out[i] -= term


def poses(robot: Chained, q: Array, out: Array, moved: Moved = NOWHERE) -> None:
    """Write the forward kinematics of the tool, homogeneous matrices (N, 4, 4), displaced or not."""
    elements = len(robot.chain.names)
    for part in chunks(len(q), 4):
        pair = scratch("frames", 2, 3, 4, part.stop - part.start)
        with written(out, part) as block:
            block[3] = np.array([0.0, 0.0, 0.0, 1.0])[:, None]
            frames = [pair[k % 2] for k in range(elements - 1)] + [block[:3]]
            walk(robot.chain, q, moved, part, frames, frames[-1])


def jacobians(robot: Chained, q: Array, out: Array, point: Array | None, given: ChainFrames | None = None) -> None:
    """Write the geometric Jacobian (N, 6, n) at a point of the tool, linear rows first, root axes."""
    chain, plain = robot.chain, arm_of(robot.chain).plain

    def write(frames: ChainFrames, part: slice, out: Array) -> None:
        end, size = target(frames, point, part), out.shape[-1]
        block = out if plain else scratch("block", 6, len(chain.movable), size)
        axis, lever, term = (scratch(name, 3, size) for name in ("axis", "lever", "term"))
        for j, k in enumerate(chain.movable.tolist()):
            np.matmul(chain.axes[k], frames.rotations[k], out=axis)
            if chain.kinds[k] == REVOLUTE:
                np.subtract(end, frames.positions[k], out=lever)
                cross(axis, lever, block[:3, j], term[0])
                block[3:, j] = axis
            else:
                block[:3, j], block[3:, j] = axis, 0.0
        if not plain:
            np.matmul(chain.coupling.matrix.T, block, out=out)

    visit(robot, q, out, given, write)


def placements(robot: Chained, q: Array, out: Array, point: Array | None, given: ChainFrames | None = None) -> None:
    """Write the kinematic regressor (N, 6, S, 6): twist of a point of the tool per unit twist of each placement."""

    def write(frames: ChainFrames, part: slice, out: Array) -> None:
        end, size = target(frames, point, part), out.shape[-1]
        lever, term = scratch("lever", 3, size), scratch("term", 3, size)
        for s, k in enumerate(robot.chain.placed.tolist()):
            rotation = frames.rotations[k]
            np.subtract(end, frames.positions[k], out=lever)
            out[:3, s, :3] = rotation
            out[3:, s, 3:] = rotation
            out[3:, s, :3] = 0.0
            cross(rotation, lever[:, None], out[:3, s, 3:], term)

    visit(robot, q, out, given, write)


def gravity(robot: Chained, q: Array, out: Array, com: Array, mass: Array, given: ChainFrames | None = None) -> None:
    """Write generalized gravity (N, n), N·m or N, of arm and payload of mass () or (N,) kg at ``com`` on the tool."""
    chain, plain, pull = robot.chain, arm_of(robot.chain).plain, robot.gravity

    def write(frames: ChainFrames, part: slice, out: Array) -> None:
        size, held = out.shape[-1], mass[part] if mass.ndim else mass
        moment = target(frames, com, part)
        moment *= held
        block = out if plain else scratch("block", len(chain.movable), size)
        axis, lever, term, turn = (scratch(name, 3, size) for name in ("axis", "lever", "term", "turn"))
        for j, k in reversed(list(enumerate(chain.movable.tolist()))):
            last = k + 1 == len(chain.names)
            np.matmul(chain.mass_centres[j], frames.tool_rotation if last else frames.rotations[k + 1], out=term)
            term += frames.tool_position if last else frames.positions[k + 1]
            term *= chain.masses[j]
            moment += term
            held = held + chain.masses[j]
            np.matmul(chain.axes[k], frames.rotations[k], out=axis)
            if chain.kinds[k] == REVOLUTE:
                # −m g · (axis × lever), the triple product turned so that the constant vector is crossed once
                np.subtract(moment, np.multiply(held, frames.positions[k], out=term), out=lever)
                cross(pull, lever, turn, term[0])
                turn *= axis
                np.add(turn[0], turn[1], out=block[j])
                block[j] += turn[2]
            else:
                np.matmul(-pull, axis, out=block[j])
                block[j] *= held
        if not plain:
            np.matmul(chain.coupling.matrix.T, block, out=out)

    visit(robot, q, out, given, write)
