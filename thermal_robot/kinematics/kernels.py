"""Compiled loops of the batch functions: a block of configurations side by side, one lane each, in the inner loop.

Imported only where numba is installed. Every loop over lanes has the same fixed length and no branch, so that the
compiler makes vector instructions of it and each lane is computed alike, wherever it stands in a block and whichever
thread works on it. Results are rows with the configurations last. Functions are compiled where they stand, for each
uses the compiled ones before it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from thermal_robot.kinematics.settings import LANES, LARGEST_REDUCED

Array = NDArray[np.float64]

FIXED, TURNS, TURNS_ALIGNED, SLIDES = 0, 1, 2, 3
"""What happens behind a placement: nothing, a turn about an axis of the frame, or about any other, a slide."""

_QUARTERS = 2.0 / math.pi
_HALF_PI = (1.57079632673412561417e00, 6.07710050630396597660e-11, 2.02226624879595063154e-21)
"""π/2 in three parts (fdlibm, e_rem_pio2.c): the product of the first two with a number below 2²⁰ is exact."""
_SINE = (-1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04,
         2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10)  # fmt: skip
_COSINE = (4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05,
           -2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11)  # fmt: skip
"""Least-maximum polynomials on ±π/4, below 2⁻⁵⁷ off (fdlibm, k_sin.c and k_cos.c)."""


def _compiled(function: Callable[..., Any]) -> Any:
    """Compile a function when it is first called, and keep it on disk where that can be written.

    Products and sums may be contracted to one rounding; nothing else is loosened: what is no number stays none.
    """
    options = {"nogil": True, "fastmath": {"contract"}}
    try:
        return numba.njit(cache=True, **options)(function)
    except RuntimeError:  # numba finds no folder for its cache
        return numba.njit(**options)(function)


class Arm(NamedTuple):
    """Constant arrays of a chain of K elements, M movable joints, n driving ones and S segments.

    Parameters
    ----------
    kinds, joint
        (K,) what happens behind each placement, and the number of the movable joint, −1 for a fixed element.
    turns
        (K, 2) columns of the rotation: the first turns towards the second.
    place, aligned, back
        (K, 3, 4), (K, 3, 4) and (3, 4): placements of the walk, rotations that put the third axis on that of the
        joint, and the way back behind the last one; as :class:`~thermal_robot.kinematics.walk.Steps` has them.
    axes
        (K, 3) of the joints.
    movable, placed
        (M,) and (S,) elements.
    lead, factor, offset, first
        (M,) column of the driving joint (−1: none), how a joint follows it, and whether it is the first to.
    masses, centres
        (M,) kg and (M, 3) m, as a chain has them.
    point
        (3,) m, of the tool.
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
    masses: Array
    centres: Array
    point: Array


def _sincos(angle: Array, sine: Array, cosine: Array) -> None:
    """Write sines and cosines of a block of angles below ``LARGEST_REDUCED``."""
    (p1, p2, p3), (s1, s2, s3, s4, s5, s6), (c1, c2, c3, c4, c5, c6) = _HALF_PI, _SINE, _COSINE
    for i in range(LANES):
        x = angle[i]
        turns = np.rint(x * _QUARTERS)
        r = ((x - turns * p1) - turns * p2) - turns * p3
        z = r * r
        s = r + r * z * (s1 + z * (s2 + z * (s3 + z * (s4 + z * (s5 + z * s6)))))
        c = 1.0 - z * (0.5 - z * (c1 + z * (c2 + z * (c3 + z * (c4 + z * (c5 + z * c6))))))
        half = np.floor(0.5 * turns)
        odd = turns - 2.0 * half
        sign = 1.0 - 2.0 * (half - 2.0 * np.floor(0.5 * half))
        sine[i] = sign * (c if odd == 1.0 else s)
        cosine[i] = sign * (-s if odd == 1.0 else c)


sincos = _compiled(_sincos)


def _sincos_any(angle: Array, sine: Array, cosine: Array) -> None:
    """Do the same for angles of any size, those that are large one by one."""
    sincos(angle, sine, cosine)
    for i in range(LANES):
        if abs(angle[i]) > LARGEST_REDUCED:
            sine[i], cosine[i] = math.sin(angle[i]), math.cos(angle[i])


sincos_any = _compiled(_sincos_any)


def _mix(a: float, x: Array, b: float, y: Array, c: float, z: Array, out: Array) -> None:
    for i in range(LANES):
        out[i] = a * x[i] + b * y[i] + c * z[i]


mix = _compiled(_mix)


def _add_mix(a: float, x: Array, b: float, y: Array, c: float, z: Array, out: Array) -> None:
    for i in range(LANES):
        out[i] += a * x[i] + b * y[i] + c * z[i]


add_mix = _compiled(_add_mix)


def _copy(x: Array, out: Array) -> None:
    for i in range(LANES):
        out[i] = x[i]


copy = _compiled(_copy)


def _follow(place: Array, x: Array, out: Array) -> None:
    """Follow frames, (12, L), by a constant placement, (3, 4)."""
    for i in range(0, 12, 4):
        for m in range(3):
            mix(place[0, m], x[i], place[1, m], x[i + 1], place[2, m], x[i + 2], out[i + m])
        copy(x[i + 3], out[i + 3])
        add_mix(place[0, 3], x[i], place[1, 3], x[i + 1], place[2, 3], x[i + 2], out[i + 3])


follow = _compiled(_follow)


def _rotate(x: Array, y: Array, sine: Array, cosine: Array, out_x: Array, out_y: Array) -> None:
    """Turn x towards y."""
    for i in range(LANES):
        out_x[i] = cosine[i] * x[i] + sine[i] * y[i]
    for i in range(LANES):
        out_y[i] = cosine[i] * y[i] - sine[i] * x[i]


rotate = _compiled(_rotate)


def _add_product(x: Array, y: Array, out: Array) -> None:
    for i in range(LANES):
        out[i] += x[i] * y[i]


add_product = _compiled(_add_product)


def _move(arm: Arm, k: int, joint: Array, frame: Array, work: Array, out: Array) -> None:
    """Move frames, (12, L), as the joint behind them does: position, sine and cosine are the rows of ``joint``."""
    if arm.kinds[k] == SLIDES:
        for i in range(12):
            copy(frame[i], out[i])
        for i in range(0, 12, 4):
            mix(arm.axes[k, 0], frame[i], arm.axes[k, 1], frame[i + 1], arm.axes[k, 2], frame[i + 2], work[0])
            add_product(work[0], joint[0], out[i + 3])
        return
    source, a, b = frame, arm.turns[k, 0], arm.turns[k, 1]
    if arm.kinds[k] == TURNS_ALIGNED:
        follow(arm.aligned[k], frame, work)
        source = work
    for i in range(0, 12, 4):
        rotate(source[i + a], source[i + b], joint[1], joint[2], out[i + a], out[i + b])
        copy(source[i + 3 - a - b], out[i + 3 - a - b])
        copy(source[i + 3], out[i + 3])


move = _compiled(_move)


def _walk(arm: Arm, q: Array, start: int, frames: Array, work: Array) -> None:
    """Write the frames of a block, (K + 1, 12, L): of every element before its motion, and of the tool.

    ``work`` has room for three frames.
    """
    here, aligned, joint = work[0], work[1], work[2]
    for k in range(len(arm.kinds)):
        if k == 0:
            for i in range(12):
                frames[0, i, :] = arm.place[0, i // 4, i % 4]
        else:
            follow(arm.place[k], frames[k - 1] if arm.kinds[k - 1] == FIXED else here, frames[k])
        j = arm.joint[k]
        if j < 0:
            continue
        lead, factor, offset = arm.lead[j], arm.factor[j], arm.offset[j]
        for lane in range(LANES):
            joint[0, lane] = offset + (factor * q[start + lane, lead] if lead >= 0 else 0.0)
        if arm.kinds[k] != SLIDES:
            sincos_any(joint[0], joint[1], joint[2])
        move(arm, k, joint, frames[k], aligned, here)
    last = len(arm.kinds) - 1
    if arm.kinds[last] == TURNS_ALIGNED:
        follow(arm.back, here, frames[last + 1])
    else:
        end = frames[last] if arm.kinds[last] == FIXED else here
        for i in range(12):
            copy(end[i], frames[last + 1, i])


walk = _compiled(_walk)


def _block(start: int, stop: int, number: int) -> int:
    """Where a block begins: the last one ends with the rows, and works on some of them once more."""
    return min(start + number * LANES, stop - LANES)


block = _compiled(_block)


def _rooms(arm: Arm) -> tuple[Array, Array, Array]:
    """Memory for the frames of a block, for work, and for vectors."""
    return np.empty((len(arm.kinds) + 1, 12, LANES)), np.empty((3, 12, LANES)), np.empty((12, LANES))


rooms = _compiled(_rooms)


def _poses(arm: Arm, q: Array, start: int, stop: int, out: Array) -> None:
    """Write the poses of the tool, (16, N), of rows from ``start`` to ``stop``, at least ``LANES`` of them."""
    frames, work, _ = rooms(arm)
    tool = frames[len(arm.kinds)]
    for number in range((stop - start + LANES - 1) // LANES):
        at = block(start, stop, number)
        walk(arm, q, at, frames, work)
        for i in range(12):
            copy(tool[i], out[i, at : at + LANES])
        for i in range(12, 16):
            out[i, at : at + LANES] = 1.0 if i == 15 else 0.0


poses = _compiled(_poses)


def _target(arm: Arm, tool: Array, out: Array) -> None:
    """Write where the point of the tool is, (3, L)."""
    for i in range(3):
        copy(tool[4 * i + 3], out[i])
        add_mix(arm.point[0], tool[4 * i], arm.point[1], tool[4 * i + 1], arm.point[2], tool[4 * i + 2], out[i])


target = _compiled(_target)


def _minus(x: Array, y: Array, out: Array) -> None:
    for i in range(LANES):
        out[i] = x[i] - y[i]


minus = _compiled(_minus)


def _cross(a: Array, b: Array, c: Array, d: Array, out: Array) -> None:
    for i in range(LANES):
        out[i] = a[i] * b[i] - c[i] * d[i]


cross = _compiled(_cross)


def _hand_on(first: bool, factor: float, x: Array, out: Array) -> None:
    """Write what a movable joint does to the column of the one that drives it, or add to it."""
    if first:
        for i in range(LANES):
            out[i] = factor * x[i]
    else:
        for i in range(LANES):
            out[i] += factor * x[i]


hand_on = _compiled(_hand_on)


def _jacobians(arm: Arm, q: Array, start: int, stop: int, out: Array) -> None:
    """Write the Jacobians at the point, (6 n, N)."""
    frames, work, room = rooms(arm)
    point, lever, axis, column, n = room[0:3], room[3:6], room[6:9], room[9], q.shape[1]
    for number in range((stop - start + LANES - 1) // LANES):
        at = block(start, stop, number)
        walk(arm, q, at, frames, work)
        target(arm, frames[len(arm.kinds)], point)
        for j, k in enumerate(arm.movable):
            lead, frame = arm.lead[j], frames[k]
            if lead < 0:
                continue
            for i in range(3):
                x, y, z = frame[4 * i], frame[4 * i + 1], frame[4 * i + 2]
                mix(arm.axes[k, 0], x, arm.axes[k, 1], y, arm.axes[k, 2], z, axis[i])
                minus(point[i], frame[4 * i + 3], lever[i])
            for i in range(3):
                a, b = (i + 1) % 3, (i + 2) % 3
                first, factor = arm.first[j], arm.factor[j]
                linear, angular = out[i * n + lead, at : at + LANES], out[(3 + i) * n + lead, at : at + LANES]
                if arm.kinds[k] == SLIDES:
                    hand_on(first, factor, axis[i], linear)
                    hand_on(first, 0.0, axis[i], angular)
                else:
                    cross(axis[a], lever[b], axis[b], lever[a], column)
                    hand_on(first, factor, column, linear)
                    hand_on(first, factor, axis[i], angular)


jacobians = _compiled(_jacobians)


def _placements(arm: Arm, q: Array, start: int, stop: int, out: Array) -> None:
    """Write the sensitivities of the point to every placement, (36 S, N)."""
    frames, work, room = rooms(arm)
    point, lever, segments = room[0:3], room[3:6], len(arm.placed)
    for number in range((stop - start + LANES - 1) // LANES):
        at = block(start, stop, number)
        end = at + LANES
        walk(arm, q, at, frames, work)
        target(arm, frames[len(arm.kinds)], point)
        for s, k in enumerate(arm.placed):
            frame = frames[k]
            for i in range(3):
                minus(point[i], frame[4 * i + 3], lever[i])
            for i in range(3):
                a, b = (i + 1) % 3, (i + 2) % 3
                linear, angular = 6 * (i * segments + s), 6 * ((3 + i) * segments + s)
                for m in range(3):
                    copy(frame[4 * i + m], out[linear + m, at:end])
                    cross(frame[4 * a + m], lever[b], frame[4 * b + m], lever[a], out[linear + 3 + m, at:end])
                    out[angular + m, at:end] = 0.0
                    copy(frame[4 * i + m], out[angular + 3 + m, at:end])


placements = _compiled(_placements)


def _gravity(arm: Arm, pull: Array, payload: float, q: Array, start: int, stop: int, out: Array) -> None:
    """Write the torques, (n, N), that hold the arm and a payload at the point."""
    frames, work, room = rooms(arm)
    moment, lever, axis, term, total = room[0:3], room[3:6], room[6:9], room[9:11], room[11]
    for number in range((stop - start + LANES - 1) // LANES):
        at = block(start, stop, number)
        walk(arm, q, at, frames, work)
        target(arm, frames[len(arm.kinds)], lever)
        for i in range(3):
            hand_on(True, payload, lever[i], moment[i])
        mass = payload
        for j in range(len(arm.movable) - 1, -1, -1):
            k = arm.movable[j]
            weight, centre, body, frame = arm.masses[j], arm.centres[j], frames[k + 1], frames[k]
            mass += weight
            for i in range(3):
                x, y, z, origin = body[4 * i], body[4 * i + 1], body[4 * i + 2], body[4 * i + 3]
                mix(centre[0], x, centre[1], y, centre[2], z, term[0])
                mix(1.0, moment[i], weight, term[0], weight, origin, term[1])
                copy(term[1], moment[i])
                x, y, z, origin = frame[4 * i], frame[4 * i + 1], frame[4 * i + 2], frame[4 * i + 3]
                mix(arm.axes[k, 0], x, arm.axes[k, 1], y, arm.axes[k, 2], z, axis[i])
                mix(1.0, moment[i], -mass, origin, 0.0, origin, lever[i])
            if arm.lead[j] < 0:
                continue
            if arm.kinds[k] == SLIDES:
                mix(-mass * pull[0], axis[0], -mass * pull[1], axis[1], -mass * pull[2], axis[2], total)
            else:  # axis · (pull × lever)
                total[:] = 0.0
                for i in range(3):
                    a, b = (i + 1) % 3, (i + 2) % 3
                    mix(pull[a], lever[b], -pull[b], lever[a], 0.0, lever[a], term[0])
                    add_product(axis[i], term[0], total)
            hand_on(arm.first[j], arm.factor[j], total, out[arm.lead[j], at : at + LANES])


gravity = _compiled(_gravity)
