"""Compiled loops of the batch functions: a block of configurations side by side, one lane each, in the inner loop.

Imported only where numba is installed. Every loop over lanes has the same fixed length and no branch, so that the
compiler makes vector instructions of it and each lane is computed alike, wherever it stands in a block and whichever
thread works on it. What is worked on stands in one array, the room: rows of one number for each lane, given by their
place in it, since a view of a row would be counted by every function that it is handed to. All kernels stand in this
file, for numba looks at nothing else to see whether what it has kept is old: touch it where ``LANES`` is changed.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from thermal_robot.compiling import compiled
from thermal_robot.kinematics.arm import SLIDES, TURNS_ALIGNED, Arm
from thermal_robot.kinematics.settings import LANES, LARGEST_REDUCED

Array = NDArray[np.float64]

_QUARTERS = 2.0 / math.pi
_HALF_PI = (1.57079632673412561417e00, 6.07710050630396597660e-11, 2.02226624879595063154e-21)
"""π/2 in three parts (fdlibm, e_rem_pio2.c): the product of the first two with a number below 2²⁰ is exact."""
_SINE = (-1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04,
         2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10)  # fmt: skip
_COSINE = (4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05,
           -2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11)  # fmt: skip
"""Least-maximum polynomials on ±π/4, below 2⁻⁵⁷ off (fdlibm, k_sin.c and k_cos.c)."""


@compiled
def sincos(room: Array, x: int) -> None:
    """Write sines and cosines of the angles of a row, below ``LARGEST_REDUCED``, to the next two rows."""
    (p1, p2, p3), (s1, s2, s3, s4, s5, s6), (c1, c2, c3, c4, c5, c6) = _HALF_PI, _SINE, _COSINE
    for i in range(LANES):
        angle = room[x, i]
        turns = np.rint(angle * _QUARTERS)
        r = ((angle - turns * p1) - turns * p2) - turns * p3
        z = r * r
        s = r + r * z * (s1 + z * (s2 + z * (s3 + z * (s4 + z * (s5 + z * s6)))))
        c = 1.0 - z * (0.5 - z * (c1 + z * (c2 + z * (c3 + z * (c4 + z * (c5 + z * c6))))))
        half = np.floor(0.5 * turns)
        odd = turns - 2.0 * half
        sign = 1.0 - 2.0 * (half - 2.0 * np.floor(0.5 * half))
        room[x + 1, i] = sign * (c if odd == 1.0 else s)
        room[x + 2, i] = sign * (-s if odd == 1.0 else c)


@compiled
def turn(room: Array, x: int, large: bool) -> None:
    """Write sines and cosines of angles of any size: the large ones, if there are any, one by one."""
    sincos(room, x)
    if large:
        for i in range(LANES):
            if abs(room[x, i]) > LARGEST_REDUCED:
                room[x + 1, i], room[x + 2, i] = math.sin(room[x, i]), math.cos(room[x, i])


@compiled
def follow(room: Array, place: Array, x: int, to: int) -> None:
    """Follow the frame in twelve rows by a constant placement, (3, 4)."""
    for row in range(0, 12, 4):
        for m in range(4):
            a, b, c = place[0, m], place[1, m], place[2, m]
            if m < 3:
                for i in range(LANES):
                    room[to + row + m, i] = a * room[x + row, i] + b * room[x + row + 1, i] + c * room[x + row + 2, i]
            else:
                for i in range(LANES):
                    along = a * room[x + row, i] + b * room[x + row + 1, i] + c * room[x + row + 2, i]
                    room[to + row + 3, i] = room[x + row + 3, i] + along


@compiled
def mix(room: Array, a: float, x: int, b: float, y: int, c: float, z: int, to: int) -> None:
    """Write the sum of three rows, each times a number."""
    for i in range(LANES):
        room[to, i] = a * room[x, i] + b * room[y, i] + c * room[z, i]


@compiled
def move(room: Array, arm: Arm, k: int, joint: int, frame: int, work: int, to: int) -> None:
    """Move the frame as the joint behind it does: position, sine and cosine are the rows from ``joint``."""
    a, b, source = arm.turns[k, 0], arm.turns[k, 1], frame
    if arm.kinds[k] == SLIDES:
        x, y, z = arm.axes[k]
        for row in range(0, 12, 4):
            for i in range(LANES):
                room[to + row, i] = room[frame + row, i]
                room[to + row + 1, i] = room[frame + row + 1, i]
                room[to + row + 2, i] = room[frame + row + 2, i]
            for i in range(LANES):
                along = x * room[frame + row, i] + y * room[frame + row + 1, i] + z * room[frame + row + 2, i]
                room[to + row + 3, i] = room[frame + row + 3, i] + along * room[joint, i]
        return
    if arm.kinds[k] == TURNS_ALIGNED:
        follow(room, arm.aligned[k], frame, work)
        source = work
    for row in range(0, 12, 4):
        for i in range(LANES):
            sine, cosine = room[joint + 1, i], room[joint + 2, i]
            room[to + row + a, i] = cosine * room[source + row + a, i] + sine * room[source + row + b, i]
        for i in range(LANES):
            sine, cosine = room[joint + 1, i], room[joint + 2, i]
            room[to + row + b, i] = cosine * room[source + row + b, i] - sine * room[source + row + a, i]
        for i in range(LANES):
            room[to + row + 3 - a - b, i] = room[source + row + 3 - a - b, i]
        for i in range(LANES):
            room[to + row + 3, i] = room[source + row + 3, i]


@compiled
def load(room: Array, arm: Arm, j: int, q: Array, start: int, to: int) -> bool:
    """Write the positions of a movable joint; return whether one is too large for the short reduction."""
    lead, factor, offset, large = arm.lead[j], arm.factor[j], arm.offset[j], False
    for i in range(LANES):
        position = offset
        if lead >= 0:
            position += factor * q[start + i, lead]
        large |= abs(position) > LARGEST_REDUCED
        room[to, i] = position
    return large


@compiled
def walk(room: Array, arm: Arm, kept: int, q: Array, start: int) -> None:
    """Write the frames of a block, twelve rows each: of the last elements before their motion, and of the tool."""
    elements = len(arm.kinds)
    here = 12 * (kept + 1)
    aligned, joint, came = here + 12, here + 24, 0
    for k in range(elements):
        if k == 0:
            for row in range(12):
                room[row, :] = arm.place[0, row // 4, row % 4]
        else:
            follow(room, arm.place[k], came, 12 * (k % kept))
        came = 12 * (k % kept)
        if arm.joint[k] >= 0:
            large = load(room, arm, arm.joint[k], q, start, joint)
            if arm.kinds[k] != SLIDES:
                turn(room, joint, large)
            move(room, arm, k, joint, came, aligned, here)
            came = here
    if arm.kinds[elements - 1] == TURNS_ALIGNED:
        follow(room, arm.back, here, 12 * kept)
    else:
        for row in range(12):
            for i in range(LANES):
                room[12 * kept + row, i] = room[came + row, i]


@compiled
def new_room(kept: int) -> Array:
    """Memory for that many frames of a block, the tool's and the walk's, and behind them for twelve more rows."""
    return np.empty((12 * (kept + 3) + 3 + 12, LANES))


@compiled
def begin(start: int, stop: int, number: int) -> int:
    """Where a block begins: the last one ends with the rows, and works on some of them once more."""
    return min(start + number * LANES, stop - LANES)


@compiled
def give(room: Array, x: int, out: Array, row: int, start: int) -> None:
    """Hand a row over to the results."""
    for i in range(LANES):
        out[row, start + i] = room[x, i]


@compiled
def give_zeros(out: Array, row: int, start: int) -> None:
    """Write zeros to the results."""
    for i in range(LANES):
        out[row, start + i] = 0.0


@compiled
def give_cross(room: Array, a: int, b: int, c: int, d: int, out: Array, row: int, start: int) -> None:
    """Hand one component of a cross product over to the results."""
    for i in range(LANES):
        out[row, start + i] = room[a, i] * room[b, i] - room[c, i] * room[d, i]


@compiled
def add(room: Array, x: int, out: Array, row: int, start: int) -> None:
    """Add a row to the results."""
    for i in range(LANES):
        out[row, start + i] += room[x, i]


@compiled
def add_cross(room: Array, a: int, b: int, c: int, d: int, out: Array, row: int, start: int) -> None:
    """Add one component of a cross product to the results."""
    for i in range(LANES):
        out[row, start + i] += room[a, i] * room[b, i] - room[c, i] * room[d, i]


@compiled
def poses(arm: Arm, q: Array, start: int, stop: int, out: Array) -> None:
    """Write the poses of the tool, (16, N), of rows from ``start`` to ``stop``, at least ``LANES`` of them."""
    room = new_room(2)  # no frame is looked at again but the last
    for number in range((stop - start + LANES - 1) // LANES):
        at = begin(start, stop, number)
        walk(room, arm, 2, q, at)
        for row in range(12):
            give(room, 24 + row, out, row, at)
        for row in range(12, 15):
            give_zeros(out, row, at)
        for i in range(LANES):
            out[15, at + i] = 1.0


@compiled
def target(room: Array, arm: Arm, to: int) -> None:
    """Write where the point of the tool is."""
    tool, (x, y, z) = 12 * len(arm.kinds), arm.point
    for m in range(3):
        row = tool + 4 * m
        for i in range(LANES):
            room[to + m, i] = room[row + 3, i] + x * room[row, i] + y * room[row + 1, i] + z * room[row + 2, i]


@compiled
def axis_of(room: Array, arm: Arm, k: int, factor: float, to: int) -> None:
    """Write the axis of a joint in root axes, times a factor."""
    x, y, z = arm.axes[k]
    for m in range(3):
        row = 12 * k + 4 * m
        mix(room, factor * x, row, factor * y, row + 1, factor * z, row + 2, to + m)


@compiled
def lever_of(room: Array, k: int, point: int, mass: float, to: int) -> None:
    """Write a point, or a moment of some mass, seen from the origin of an element."""
    for m in range(3):
        for i in range(LANES):
            room[to + m, i] = room[point + m, i] - mass * room[12 * k + 4 * m + 3, i]


@compiled
def jacobians(arm: Arm, q: Array, start: int, stop: int, out: Array) -> None:
    """Write the Jacobians at the point, (6 n, N): the first joint that follows a driving one writes, others add."""
    room, n = new_room(len(arm.kinds)), q.shape[1]
    point = len(room) - 12
    lever, axis = point + 3, point + 6
    for number in range((stop - start + LANES - 1) // LANES):
        at = begin(start, stop, number)
        walk(room, arm, len(arm.kinds), q, at)
        target(room, arm, point)
        for j, k in enumerate(arm.movable):
            lead, first, slides = arm.lead[j], arm.first[j], arm.kinds[k] == SLIDES
            if lead < 0:
                continue
            axis_of(room, arm, k, arm.factor[j], axis)
            lever_of(room, k, point, 1.0, lever)
            for m in range(3):
                a, b, linear, angular = (m + 1) % 3, (m + 2) % 3, m * n + lead, (3 + m) * n + lead
                if first and slides:
                    give(room, axis + m, out, linear, at)
                    give_zeros(out, angular, at)
                elif first:
                    give_cross(room, axis + a, lever + b, axis + b, lever + a, out, linear, at)
                    give(room, axis + m, out, angular, at)
                elif slides:
                    add(room, axis + m, out, linear, at)
                else:
                    add_cross(room, axis + a, lever + b, axis + b, lever + a, out, linear, at)
                    add(room, axis + m, out, angular, at)


@compiled
def placements(arm: Arm, q: Array, start: int, stop: int, out: Array) -> None:
    """Write the sensitivities of the point to every placement, (36 S, N)."""
    room, segments = new_room(len(arm.kinds)), len(arm.placed)
    point = len(room) - 12
    lever = point + 3
    for number in range((stop - start + LANES - 1) // LANES):
        at = begin(start, stop, number)
        walk(room, arm, len(arm.kinds), q, at)
        target(room, arm, point)
        for s, k in enumerate(arm.placed):
            lever_of(room, k, point, 1.0, lever)
            for m in range(3):
                a, b = (m + 1) % 3, (m + 2) % 3
                linear, angular = 6 * (m * segments + s), 6 * ((3 + m) * segments + s)
                for c in range(3):
                    row, x, y = 12 * k + 4 * m + c, 12 * k + 4 * a + c, 12 * k + 4 * b + c
                    give(room, row, out, linear + c, at)
                    give_cross(room, x, lever + b, y, lever + a, out, linear + 3 + c, at)
                    give_zeros(out, angular + c, at)
                    give(room, row, out, angular + 3 + c, at)


@compiled
def weigh(room: Array, arm: Arm, j: int, moment: int) -> None:
    """Add the first moment of the bodies behind a movable joint."""
    weight, (x, y, z) = arm.masses[j], arm.centres[j]
    for m in range(3):
        row = 12 * (arm.movable[j] + 1) + 4 * m
        for i in range(LANES):
            centre = room[row + 3, i] + x * room[row, i] + y * room[row + 1, i] + z * room[row + 2, i]
            room[moment + m, i] += weight * centre


@compiled
def hold(room: Array, axis: int, lever: int, pull: Array, to: int) -> None:
    """Write axis · (pull × lever)."""
    x, y, z = pull
    for i in range(LANES):
        a, b, c = room[lever, i], room[lever + 1, i], room[lever + 2, i]
        torque = room[axis, i] * (y * c - z * b) + room[axis + 1, i] * (z * a - x * c)
        room[to, i] = torque + room[axis + 2, i] * (x * b - y * a)


@compiled
def gravity(arm: Arm, pull: Array, payload: float, q: Array, start: int, stop: int, out: Array) -> None:
    """Write the torques, (n, N), that hold the arm and a payload at the point."""
    room = new_room(len(arm.kinds))
    moment = len(room) - 12
    lever, axis, torque = moment + 3, moment + 6, moment + 9
    for number in range((stop - start + LANES - 1) // LANES):
        at = begin(start, stop, number)
        walk(room, arm, len(arm.kinds), q, at)
        target(room, arm, moment)
        for m in range(3):
            mix(room, payload, moment + m, 0.0, moment + m, 0.0, moment + m, moment + m)
        mass = payload
        for j in range(len(arm.movable) - 1, -1, -1):
            k, mass = arm.movable[j], mass + arm.masses[j]
            weigh(room, arm, j, moment)
            if arm.lead[j] < 0:
                continue
            axis_of(room, arm, k, arm.factor[j], axis)
            if arm.kinds[k] == SLIDES:
                mix(room, -mass * pull[0], axis, -mass * pull[1], axis + 1, -mass * pull[2], axis + 2, torque)
            else:
                lever_of(room, k, moment, mass, lever)
                hold(room, axis, lever, pull, torque)
            if arm.last[j]:  # from the tool inwards it is the last that writes
                give(room, torque, out, arm.lead[j], at)
            else:
                add(room, torque, out, arm.lead[j], at)
