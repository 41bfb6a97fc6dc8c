"""One walk along a chain, from the root to the tool, for a chunk of configurations at once.

A frame of C configurations is an array (3, 4, C): rotation and position side by side, as in the first three rows of a
homogeneous matrix, and the configurations last, so that every NumPy call works on long contiguous rows.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal_robot.arrays import Array
from thermal_robot.errors import RobotError
from thermal_robot.kinematics import settings
from thermal_robot.kinematics.lie import exp6, sines_and_cosines
from thermal_robot.kinematics.model import FIXED, PRISMATIC, Chain

_FRAME = 12 * 8
"""Bytes of one frame of one configuration."""

_kept = threading.local()


def scratch(name: str, *shape: int) -> Array:
    """Return an array of that shape with anything in it, the same memory each time; until the next call it is yours.

    Two arrays that are in use together have two names.
    """
    size = math.prod(shape)
    kept: Array | None = getattr(_kept, name, None)
    if kept is None or kept.size < size:
        kept = np.empty(size)
        setattr(_kept, name, kept)
    return kept[:size].reshape(shape)


def chunks(rows: int, frames: int) -> Iterator[slice]:
    """Consecutive slices that cover all rows, each short enough for that many frames a row to stay in the cache."""
    fits = settings.CACHE // (_FRAME * max(frames, 1))
    step = max(min(settings.CHUNK, fits), min(settings.SHORTEST_CHUNK, settings.CHUNK))
    return (slice(start, min(start + step, rows)) for start in range(0, rows, step))


def rows_last(array: Array) -> Array:
    """Return an array (N, ...) as (..., N), the same memory."""
    return array.transpose(*range(1, array.ndim), 0)


def result(out: Array | None, rows: int, *shape: int) -> Array:
    """Return the array for the results of N configurations: a new one with N last in memory, or the caller's.

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
    """A chain with a name; a :class:`~thermal_robot.Robot` is one."""

    @property
    def name(self) -> str:
        """Name of the robot, for messages."""

    @property
    def n(self) -> int:
        """Number of joints that can be driven."""

    @property
    def segments(self) -> Sequence[Any]:
        """The placements that may be displaced, from the root on."""

    @property
    def chain(self) -> Chain:
        """Constant arrays of its elements."""


class Weighted(Chained, Protocol):
    """A chain on which gravity pulls; a :class:`~thermal_robot.Robot` is one."""

    @property
    def gravity(self) -> NDArray[np.float64]:
        """(3,) m/s² in the root frame."""


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
class Displaced:
    """A displacement made ready: joint offsets (1 or N, n), twists as rigid motions (4, 4, 1 or N)."""

    joint: Array | None
    segment: dict[int, Array]
    base: Array | None
    tool: Array | None

    @staticmethod
    def of(robot: Chained, displacement: Displacement | None, rows: int) -> Displaced:
        """Make a displacement ready for that many rows."""
        if displacement is None:
            displacement = Displacement()
        joint = _channel(robot, "joint", displacement.joint, (robot.n,), rows)
        segment = _channel(robot, "segment", displacement.segment, (len(robot.segments), 6), rows)
        base = _channel(robot, "base", displacement.base, (6,), rows)
        tool = _channel(robot, "tool", displacement.tool, (6,), rows)
        twists = {} if segment is None else {int(k): segment[:, s] for s, k in enumerate(robot.chain.placed)}
        twists = {k: own for k, own in twists.items() if np.any(own)}
        ends = {k: own for k, own in ((_BASE, base), (_TOOL, tool)) if own is not None}
        motions = _motions({**twists, **ends})
        return Displaced(joint, {k: motions[k] for k in twists}, motions.get(_BASE), motions.get(_TOOL))


_BASE, _TOOL = -2, -1
"""Numbers of the ends of the chain beside those of its elements."""
NOWHERE = Displaced(None, {}, None, None)
"""Nothing displaced."""


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


def _motions(twists: dict[int, Array]) -> dict[int, Array]:
    """(4, 4, N) of each of (N, 6) twists, (4, 4, 1) where all rows are the same, as most errors of an arm are."""
    same = [k for k, own in twists.items() if (own == own[:1]).all()]
    alike = exp6(np.array([twists[k][0] for k in same]).reshape(-1, 6))
    motions = {k: motion[:, :, None] for k, motion in zip(same, alike, strict=True)}
    for k in twists.keys() - motions.keys():
        motions[k] = np.ascontiguousarray(np.moveaxis(exp6(twists[k]), 0, -1))
    return motions


@dataclass(frozen=True, eq=False)
class Step:
    """What the walk does at one element: it goes on by a constant placement, then turns or slides.

    ``place`` and ``aligned`` are (4, 4), transposed: from where the walk stands to the element's frame, and the
    rotation that puts the third axis on that of the joint, ``None`` where it is there. ``turns``: columns (a, b) of the
    rotation, where a revolute joint turns a towards b; (b, a); and the others of a frame. ``slides``: (3,) axis of a
    prismatic joint.
    """

    place: Array
    joint: int | None
    slides: Array | None
    turns: tuple[slice, slice, slice]
    aligned: Array | None


@dataclass(frozen=True, eq=False)
class Steps:
    """All steps of a chain, and the one behind its last joint, transposed; ``None`` where the walk is there."""

    each: tuple[Step, ...]
    last: Array | None
    plain: bool
    """Whether every movable joint is a driving one, so that their positions are the configuration."""


_steps: WeakKeyDictionary[Chain, Steps] = WeakKeyDictionary()


def steps(chain: Chain) -> Steps:
    """Return the steps of a chain, made once."""
    found = _steps.get(chain)
    if found is None:
        found = _steps[chain] = _made(chain)
    return found


def _made(chain: Chain) -> Steps:
    joint_of = {int(k): j for j, k in enumerate(chain.movable)}
    each: list[Step] = []
    back: Array | None = None
    for k in range(len(chain.names)):
        place = np.eye(4)
        place[:3, :3], place[:3, 3] = chain.rotations[k], chain.translations[k]
        place, axis = place if back is None else back @ place, chain.axes[k]
        turns, aligned, back = _columns(0, 1), None, None
        if chain.kinds[k] not in (FIXED, PRISMATIC):
            turns, aligned = _about(axis)
            back = None if aligned is None else aligned.T
        slides = axis if chain.kinds[k] == PRISMATIC else None
        each.append(
            Step(
                _transposed(place),
                joint_of.get(k),
                slides,
                turns,
                None if aligned is None else _transposed(aligned),
            )
        )
    matrix = chain.coupling.matrix
    plain = matrix.shape[0] == matrix.shape[1] and bool(np.all(matrix == np.eye(len(matrix))))
    last = None if back is None else _transposed(back)
    return Steps(tuple(each), last, plain and not np.any(chain.coupling.offset))


def _transposed(matrix: Array) -> Array:
    return np.ascontiguousarray(matrix.T)


def _about(axis: Array) -> tuple[tuple[slice, slice, slice], Array | None]:
    """Which columns a rotation about the axis turns, and after which constant rotation."""
    w = int(np.argmax(np.abs(axis)))
    a, b = (w + 1) % 3, (w + 2) % 3
    if np.abs(axis[w]) == 1.0 and np.count_nonzero(axis) == 1:
        return _columns(*((a, b) if axis[w] > 0.0 else (b, a))), None
    first = np.zeros(3)
    first[a] = 1.0
    first -= (first @ axis) * axis
    first /= np.linalg.norm(first)
    aligned = np.eye(4)
    aligned[:3, 0], aligned[:3, 1], aligned[:3, 2] = first, np.cross(axis, first), axis
    return _columns(0, 1), aligned


def _columns(a: int, b: int) -> tuple[slice, slice, slice]:
    pair, swapped = (slice(i, j + 1 if j > i else j - 1 if j else None, j - i) for i, j in ((a, b), (b, a)))
    return pair, swapped, slice(3 - a - b, 4, a + b)


def walk(
    chain: Chain,
    q: Array,
    moved: Displaced,
    part: slice,
    frames: Array | Sequence[Array],
    tool: Array,
    *,
    keep: bool = True,
) -> None:
    """Write the frames of a chunk of configurations.

    Of the N rows of ``q`` the chunk ``part`` has C. ``frames`` are K arrays (3, 4, C) to write to: the frame after the
    placement of each element, before its motion; consecutive ones must not be the same. Without ``keep`` they are only
    worked in. ``tool`` is (3, 4, C).
    """
    taken, size = steps(chain), part.stop - part.start
    joints = _joints(chain, taken, q, moved, part)
    sines, cosines = scratch("sines", len(joints), 2, size), scratch("cosines", *joints.shape)
    sines_and_cosines(joints, sines[:, 0], cosines)
    np.negative(sines[:, 0], out=sines[:, 1])
    free, term = scratch("walk", 3, 4, size) if keep else None, scratch("term", 3, size)
    here: Array | None = None if moved.base is None else np.broadcast_to(_rows_of(moved.base, part)[:3], (3, 4, size))
    for k, step in enumerate(taken.each):
        frame = frames[k]
        if here is None:
            frame[...] = step.place.T[:3, :, None]
        else:
            np.matmul(step.place, here, out=frame)
        if k in moved.segment:
            frame[...] = _followed(frame, _rows_of(moved.segment[k], part))
        here = frame
        if step.joint is not None:
            here = frame if free is None else free
            if step.slides is not None:
                _slide(frame, step.slides, joints[step.joint], here, term)
            else:
                _turn(frame, step, sines[step.joint], cosines[step.joint], here)
    if taken.last is not None and here is not None:
        np.matmul(taken.last, here, out=tool)
    elif tool is not here:
        tool[...] = here
    if moved.tool is not None:
        tool[...] = _followed(tool, _rows_of(moved.tool, part))


def _joints(chain: Chain, taken: Steps, q: Array, moved: Displaced, part: slice) -> Array:
    """Return the (M, C) positions of the movable joints."""
    driving = scratch("driving", q.shape[1], part.stop - part.start)
    driving[...] = q[part].T
    if moved.joint is not None:
        driving += moved.joint[part if len(moved.joint) > 1 else slice(None)].T
    if taken.plain:
        return driving
    joints = scratch("joints", len(chain.movable), driving.shape[1])
    np.matmul(chain.coupling.matrix, driving, out=joints)
    joints += chain.coupling.offset[:, None]
    return joints


def _turn(frame: Array, step: Step, sines: Array, cosine: Array, out: Array) -> None:
    """Turn every frame about its own constant axis; ``sines`` are (2, C), the sine and its negative."""
    if step.aligned is not None:
        frame = np.matmul(step.aligned, frame, out=scratch("aligned", *frame.shape))
    pair, swapped, rest = step.turns
    cosine_part, sine_part = scratch("cosine part", 3, 2, len(cosine)), scratch("sine part", 3, 2, len(cosine))
    np.multiply(frame[:, pair], cosine, out=cosine_part)
    np.multiply(frame[:, swapped], sines, out=sine_part)
    np.add(cosine_part, sine_part, out=out[:, pair])
    if out is not frame:
        out[:, rest] = frame[:, rest]


def _slide(frame: Array, axis: Array, distance: Array, out: Array, term: Array) -> None:
    """Move every frame along its own constant axis."""
    if out is not frame:
        out[...] = frame
    np.matmul(axis, frame[:, :3], out=term)
    term *= distance
    out[:, 3] += term


def _rows_of(motions: Array, part: slice) -> Array:
    return motions if motions.shape[-1] == 1 else motions[..., part]


def _followed(frame: Array, motions: Array) -> Array:
    """Follow every frame by a motion of its own, (4, 4, C) or one for all, (4, 4, 1)."""
    product = frame[:, 0, None] * motions[0]
    for m in (1, 2):
        product += frame[:, m, None] * motions[m]
    product[:, 3] += frame[:, 3]
    return np.asarray(product)


TURNS, TURNS_ALIGNED, SLIDES = 1, 2, 3
"""What happens behind a placement that is not ``FIXED``: a turn about an axis of the frame, or any other, a slide."""


class Arm(NamedTuple):
    """Constant arrays of a chain of K elements, M movable joints, n driving ones and S segments.

    ``turns`` (K, 2): of the rotation the first column turns towards the second. ``place``, ``aligned``, ``back``: the
    first three rows of what :class:`Steps` has. ``lead``, ``factor``, ``offset``, ``first``, ``last`` (M,): column of
    the driving joint (−1: none), how a joint follows it, and whether it is the first or last to.
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
    masses: Array
    centres: Array
    point: Array


def arm_of(chain: Chain, point: Array | None) -> Arm:
    """Write a chain, and a point of its tool, as the kernels want it."""
    taken, matrix = steps(chain), chain.coupling.matrix
    still = [step.joint is None for step in taken.each]
    kinds = np.array([FIXED if f else TURNS for f in still])
    kinds[[step.aligned is not None for step in taken.each]] = TURNS_ALIGNED
    kinds[chain.kinds == PRISMATIC] = SLIDES
    eye = np.eye(4)
    lead = [chain.coupling.leader(j) for j in range(len(matrix))]
    return Arm(
        kinds=kinds,
        joint=np.array([-1 if step.joint is None else step.joint for step in taken.each]),
        turns=np.array([(step.turns[0].start, step.turns[1].start) for step in taken.each]),
        place=_rigid([step.place for step in taken.each]),
        aligned=_rigid([eye if step.aligned is None else step.aligned for step in taken.each]),
        back=_rigid([eye if taken.last is None else taken.last])[0],
        axes=np.array(chain.axes),
        movable=np.array(chain.movable),
        placed=np.array(chain.placed),
        lead=np.array([-1 if j is None else j for j in lead]),
        factor=np.array([0.0 if j is None else matrix[row, j] for row, j in enumerate(lead)]),
        offset=np.array(chain.coupling.offset),
        first=np.array([j not in lead[:row] for row, j in enumerate(lead)]),
        last=np.array([j not in lead[row + 1 :] for row, j in enumerate(lead)]),
        masses=np.array(chain.masses),
        centres=np.array(chain.mass_centres),
        point=np.array(np.zeros(3) if point is None else point),
    )


def _rigid(transposed: list[Array]) -> Array:
    return np.ascontiguousarray(np.array(transposed).transpose(0, 2, 1)[:, :3])
