"""One walk along a chain, from the root to the tool, for a chunk of configurations at once.

A frame of C configurations is an array (3, 4, C): rotation and position side by side, as in the first three rows of a
homogeneous matrix, and the configurations last, so that every NumPy call works on long contiguous rows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.kinematics.displaced import Displaced
from thermal_robot.kinematics.model import FIXED, PRISMATIC, Chain
from thermal_robot.kinematics.scratch import scratch
from thermal_robot.kinematics.turns import sines_and_cosines


@dataclass(frozen=True, eq=False)
class Step:
    """What the walk does at one element: it goes on by a constant placement, then turns or slides.

    Parameters
    ----------
    place
        (4, 4), transposed: from where the walk stands to the element's frame.
    joint
        Number among the movable joints; ``None`` for a fixed element.
    slides
        (3,) axis of a prismatic joint; ``None`` for any other.
    turns
        Columns (a, b) of the rotation, where a revolute joint turns a towards b; (b, a); and the others of a frame.
    aligned
        (4, 4), transposed: constant rotation that puts the third axis on that of the joint; ``None`` where it is there.
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

    Parameters
    ----------
    chain
        With K elements.
    q
        (N, n) rad or m.
    moved
        Displacements of all N.
    part
        The chunk: C of the N rows.
    frames
        K arrays (3, 4, C) to write to: the frame after the placement of each element, before its motion. Consecutive
        ones must not be the same.
    tool
        (3, 4, C) to write to.
    keep
        Whether all frames are wanted; if not, ``frames`` are only worked in.
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
