"""Compiled kernels of batch kinematics: blocks of configurations, one vector lane each.

Imported only where numba is installed. Every loop over lanes has the same fixed length and no branch, so that the
compiler makes vector instructions of it and each lane is computed alike, wherever it stands in a block and whichever
thread works on it. What is worked on stands in one flat array, the room: rows of ``LANES`` numbers, given by their
place in it; so the compiler knows how far rows are apart. All kernels stand in this file, for numba looks at nothing
else to see whether what it has kept is old: touch it where ``LANES`` or ``Arm`` is changed.
"""

from __future__ import annotations

import math

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.compiling import compiled
from thermal_robot.kinematics.lanes import SLIDES, TURNS, TURNS_ALIGNED, Arm
from thermal_robot.kinematics.settings import LANES, LARGEST_REDUCED

WIDE = np.uint64(LANES)
_QUARTERS = 2.0 / math.pi
_HALF_PI = (1.57079632673412561417e00, 6.07710050630396597660e-11, 2.02226624879595063154e-21)
"""π/2 in three parts (fdlibm, e_rem_pio2.c): the product of the first two with a number below 2²⁰ is exact."""
_SINE = (-1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04,
         2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10)  # fmt: skip
_COSINE = (4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05,
           -2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11)  # fmt: skip
"""Least-maximum polynomials on ±π/4, below 2⁻⁵⁷ off (fdlibm, k_sin.c and k_cos.c)."""


@compiled
def at(row: int) -> np.uint64:
    """Offset of a row in the room, ``row * LANES``; unsigned, since a negative index counts from the end."""
    return np.uint64(row * LANES)


@compiled
def sincos(room: Array, x: int) -> None:
    """Write sines and cosines of row ``x``, angles below ``LARGEST_REDUCED`` rad, into the two rows behind it."""
    (p1, p2, p3), (s1, s2, s3, s4, s5, s6), (c1, c2, c3, c4, c5, c6) = _HALF_PI, _SINE, _COSINE
    angles, sines, cosines = at(x), at(x + 1), at(x + 2)
    for i in range(WIDE):
        angle = room[angles + i]
        turns = np.rint(angle * _QUARTERS)
        r = ((angle - turns * p1) - turns * p2) - turns * p3
        z = r * r
        s = r + r * z * (s1 + z * (s2 + z * (s3 + z * (s4 + z * (s5 + z * s6)))))
        c = 1.0 - z * (0.5 - z * (c1 + z * (c2 + z * (c3 + z * (c4 + z * (c5 + z * c6))))))
        half = np.floor(0.5 * turns)
        odd = turns - 2.0 * half
        sign = 1.0 - 2.0 * (half - 2.0 * np.floor(0.5 * half))
        room[sines + i] = sign * (c if odd == 1.0 else s)
        room[cosines + i] = sign * (-s if odd == 1.0 else c)


@compiled
def turn(room: Array, x: int, large: bool) -> None:
    """Write sines and cosines of row ``x``, angles of any size, into the two rows behind it; large ones one by one."""
    sincos(room, x)
    if large:
        angles, sines, cosines = at(x), at(x + 1), at(x + 2)
        for i in range(WIDE):
            angle = room[angles + i]
            if abs(angle) > LARGEST_REDUCED:
                room[sines + i], room[cosines + i] = math.sin(angle), math.cos(angle)


@compiled
def follow(room: Array, place: Array, x: int, to: int) -> None:
    """Multiply the frames in the twelve rows from ``x`` by a constant placement (3, 4), into those from ``to``."""
    a0, a1, a2, a3 = place[0]
    b0, b1, b2, b3 = place[1]
    c0, c1, c2, c3 = place[2]
    for row in range(0, 12, 4):
        u, v, w, p = at(x + row), at(x + row + 1), at(x + row + 2), at(x + row + 3)
        to_u, to_v, to_w, to_p = at(to + row), at(to + row + 1), at(to + row + 2), at(to + row + 3)
        for i in range(WIDE):
            a, b, c, d = room[u + i], room[v + i], room[w + i], room[p + i]
            room[to_u + i] = a0 * a + b0 * b + c0 * c
            room[to_v + i] = a1 * a + b1 * b + c1 * c
            room[to_w + i] = a2 * a + b2 * b + c2 * c
            room[to_p + i] = d + (a3 * a + b3 * b + c3 * c)


@compiled
def turn_and_follow(room: Array, a: int, b: int, joint: int, place: Array, x: int, to: int) -> None:
    """Rotate column a of the frames from row ``x`` towards b, then multiply by a constant placement, into ``to``.

    Sine and cosine of the joint's angle are the second and third row from ``joint``.
    """
    c = 3 - a - b
    a0, a1, a2, a3 = place[a]
    b0, b1, b2, b3 = place[b]
    c0, c1, c2, c3 = place[c]
    sines, cosines = at(joint + 1), at(joint + 2)
    for row in range(0, 12, 4):
        u, v, w, p = at(x + row + a), at(x + row + b), at(x + row + c), at(x + row + 3)
        to_u, to_v, to_w, to_p = at(to + row), at(to + row + 1), at(to + row + 2), at(to + row + 3)
        for i in range(WIDE):
            sine, cosine = room[sines + i], room[cosines + i]
            first = cosine * room[u + i] + sine * room[v + i]
            second = cosine * room[v + i] - sine * room[u + i]
            third, along = room[w + i], room[p + i]
            room[to_u + i] = a0 * first + b0 * second + c0 * third
            room[to_v + i] = a1 * first + b1 * second + c1 * third
            room[to_w + i] = a2 * first + b2 * second + c2 * third
            room[to_p + i] = along + (a3 * first + b3 * second + c3 * third)


@compiled
def slide(room: Array, axis: Array, joint: int, x: int, to: int) -> None:
    """Translate the frames from row ``x`` along their own ``axis`` by the positions in row ``joint``, into ``to``."""
    (ax, ay, az), moved = axis, at(joint)
    for row in range(0, 12, 4):
        u, v, w, p = at(x + row), at(x + row + 1), at(x + row + 2), at(x + row + 3)
        to_u, to_v, to_w, to_p = at(to + row), at(to + row + 1), at(to + row + 2), at(to + row + 3)
        for i in range(WIDE):
            a, b, c, d = room[u + i], room[v + i], room[w + i], room[p + i]
            room[to_u + i], room[to_v + i], room[to_w + i] = a, b, c
            room[to_p + i] = d + (ax * a + ay * b + az * c) * room[moved + i]


@compiled
def load(room: Array, arm: Arm, j: int, q: Array, start: np.uint64, to: int) -> bool:
    """Write the positions of a movable joint, coupled ones too, to row ``to``; whether one is too large to reduce."""
    lead, factor, offset, large, here = arm.lead[j], arm.factor[j], arm.offset[j], False, at(to)
    for i in range(WIDE):
        position = offset
        if lead >= 0:
            position += factor * q[start + i, lead]
        large |= abs(position) > LARGEST_REDUCED
        room[here + i] = position
    return large


@compiled
def frame_of(k: int, kept: int) -> int:
    """First row of the frame of element ``k`` before its motion; beyond the ``kept`` frames the last two alternate."""
    return 12 * (k if k < kept else kept - 2 + (k - kept) % 2)


@compiled
def still(arm: Arm) -> int:
    """Return the number of elements before the first joint that moves."""
    k = 0
    while k < len(arm.kinds) - 1 and arm.joint[k] < 0:
        k += 1
    return k


@compiled
def new_room(arm: Arm, kept: int, more: int) -> Array:
    """Allocate the work array of a block: frames, then temporaries, then ``more`` rows.

    The frames of the first elements, which do not move, are in it.
    """
    room = np.empty((12 * kept + 27 + more) * LANES)
    for row in range(12):
        room[at(row) : at(row + 1)] = arm.place[0, row // 4, row % 4]
    for k in range(still(arm)):
        follow(room, arm.place[k + 1], frame_of(k, kept), frame_of(k + 1, kept))
    return room


@compiled
def walk(room: Array, arm: Arm, kept: int, q: Array, start: np.uint64) -> int:
    """Forward kinematics of a block: each element's frame, twelve rows each; return the first row of the tool's."""
    elements, joint = len(arm.kinds), 12 * kept
    aligned, slid = joint + 3, joint + 15
    for k in range(still(arm), elements):
        here, to = frame_of(k, kept), frame_of(k + 1, kept)
        last = k == elements - 1
        place = arm.back if last else arm.place[k + 1]
        if arm.joint[k] < 0 and last:
            return int(here)
        if arm.joint[k] < 0:
            follow(room, place, here, to)
            continue
        large = load(room, arm, arm.joint[k], q, start, joint)
        if arm.kinds[k] == SLIDES:
            slide(room, arm.axes[k], joint, here, slid)
            follow(room, place, slid, to)
            continue
        turn(room, joint, large)
        if arm.kinds[k] == TURNS_ALIGNED:
            follow(room, arm.aligned[k], here, aligned)
            here = aligned
        turn_and_follow(room, arm.turns[k, 0], arm.turns[k, 1], joint, place, here, to)
    return int(frame_of(elements, kept))


@compiled
def begin(start: int, stop: int, number: int) -> np.uint64:
    """First configuration of a block; the last block ends at ``stop``, and so overlaps the one before."""
    return np.uint64(max(min(start + number * LANES, stop - LANES), 0))


@compiled
def give(room: Array, x: int, out: Array, row: int, start: np.uint64) -> None:
    """Copy row ``x`` of the room to row ``row`` of the results, for one block of configurations."""
    given = at(x)
    for i in range(WIDE):
        out[row, start + i] = room[given + i]


@compiled
def give_zeros(out: Array, row: int, start: np.uint64) -> None:
    """Write zeros to row ``row`` of the results, for one block of configurations."""
    for i in range(WIDE):
        out[row, start + i] = 0.0


@compiled
def give_cross(room: Array, a: int, b: int, c: int, d: int, out: Array, row: int, start: np.uint64) -> None:
    """Write one component of a cross product, a b − c d of four rows of the room, to row ``row`` of the results."""
    u, v, w, p = at(a), at(b), at(c), at(d)
    for i in range(WIDE):
        out[row, start + i] = room[u + i] * room[v + i] - room[w + i] * room[p + i]


@compiled
def add(room: Array, x: int, factor: float, out: Array, row: int, start: np.uint64) -> None:
    """Add row ``x`` of the room, times a factor, to row ``row`` of the results."""
    given = at(x)
    for i in range(WIDE):
        out[row, start + i] += factor * room[given + i]


@compiled
def poses(arm: Arm, q: Array, start: int, stop: int, out: Array) -> None:
    """Write homogeneous tool poses (16, N) of the configurations ``start`` to ``stop``, at least ``LANES`` of them."""
    kept = still(arm) + 3  # no frame is looked at again but those that stay, and the last
    room = new_room(arm, kept, 0)
    for number in range((stop - start + LANES - 1) // LANES):
        here = begin(start, stop, number)
        tool = walk(room, arm, kept, q, here)
        for row in range(12):
            give(room, tool + row, out, row, here)
        for row in range(12, 15):
            give_zeros(out, row, here)
        for i in range(WIDE):
            out[15, here + i] = 1.0


@compiled
def target(room: Array, arm: Arm, tool: int, to: int) -> None:
    """Write the root-frame position of the point fixed to the tool, ``arm.point``, into the three rows from ``to``."""
    x, y, z = arm.point
    for m in range(3):
        row, here = tool + 4 * m, at(to + m)
        u, v, w, p = at(row), at(row + 1), at(row + 2), at(row + 3)
        for i in range(WIDE):
            room[here + i] = room[p + i] + (x * room[u + i] + y * room[v + i] + z * room[w + i])


@compiled
def axis_of(room: Array, arm: Arm, k: int, to: int) -> tuple[int, int, float]:
    """First row of a joint's axis in root axes, stride of its components, and their sign.

    Where a joint turns about an axis of its frame this is a column of the frame; else the axis is written to ``to``.
    """
    if arm.kinds[k] == TURNS:
        a, b = arm.turns[k]
        return 12 * k + 3 - a - b, 4, 1.0 if (b - a) % 3 == 1 else -1.0
    x, y, z = arm.axes[k]
    for m in range(3):
        row, here = 12 * k + 4 * m, at(to + m)
        u, v, w = at(row), at(row + 1), at(row + 2)
        for i in range(WIDE):
            room[here + i] = x * room[u + i] + y * room[v + i] + z * room[w + i]
    return to, 1, 1.0


@compiled
def add_twist(
    room: Array, m: int, axis: int, step: int, factor: float, k: int, point: int, out: Array, row: int, start: np.uint64
) -> None:
    """Add component ``m`` of a point's velocity, axis × lever, for a unit turn about the axis of element ``k``."""
    a, b = (m + 1) % 3, (m + 2) % 3
    u, v, x, y = at(axis + step * a), at(axis + step * b), at(point + a), at(point + b)
    p, q = at(12 * k + 4 * a + 3), at(12 * k + 4 * b + 3)
    for i in range(WIDE):
        moved = room[u + i] * (room[y + i] - room[q + i]) - room[v + i] * (room[x + i] - room[p + i])
        out[row, start + i] += factor * moved


@compiled
def jacobians(arm: Arm, q: Array, start: int, stop: int, out: Array) -> None:
    """Write geometric Jacobians (6 n, N) at the tool's point; joints that follow one driving joint add up."""
    n, kept = q.shape[1], len(arm.kinds) + 1
    room = new_room(arm, kept, 6)
    point = 12 * kept + 27
    for number in range((stop - start + LANES - 1) // LANES):
        here = begin(start, stop, number)
        target(room, arm, walk(room, arm, kept, q, here), point)
        for j, k in enumerate(arm.movable):
            if arm.lead[j] < 0:
                continue
            axis, step, sign = axis_of(room, arm, k, point + 3)
            factor = sign * arm.factor[j]
            for m in range(3):
                linear, angular = m * n + arm.lead[j], (3 + m) * n + arm.lead[j]
                if arm.first[j]:
                    give_zeros(out, linear, here)
                    give_zeros(out, angular, here)
                if arm.kinds[k] == SLIDES:
                    add(room, axis + m * step, factor, out, linear, here)
                else:
                    add_twist(room, m, axis, step, factor, k, point, out, linear, here)
                    add(room, axis + m * step, factor, out, angular, here)


@compiled
def lever_of(room: Array, k: int, point: int, to: int) -> None:
    """Write the lever arm of a point from the origin of element ``k`` into the three rows from ``to``."""
    for m in range(3):
        origin, end, here = at(12 * k + 4 * m + 3), at(point + m), at(to + m)
        for i in range(WIDE):
            room[here + i] = room[end + i] - room[origin + i]


@compiled
def placements(arm: Arm, q: Array, start: int, stop: int, out: Array) -> None:
    """Write the kinematic regressor (36 S, N): twist of the tool's point per unit twist of each segment's placement."""
    segments, kept = len(arm.placed), len(arm.kinds) + 1
    room = new_room(arm, kept, 6)
    point, lever = 12 * kept + 27, 12 * kept + 30
    for number in range((stop - start + LANES - 1) // LANES):
        here = begin(start, stop, number)
        target(room, arm, walk(room, arm, kept, q, here), point)
        for s, k in enumerate(arm.placed):
            lever_of(room, k, point, lever)
            for m in range(3):
                a, b = (m + 1) % 3, (m + 2) % 3
                linear, angular = 6 * (m * segments + s), 6 * ((3 + m) * segments + s)
                for c in range(3):
                    row, x, y = 12 * k + 4 * m + c, 12 * k + 4 * a + c, 12 * k + 4 * b + c
                    give(room, row, out, linear + c, here)
                    give_cross(room, x, lever + b, y, lever + a, out, linear + 3 + c, here)
                    give_zeros(out, angular + c, here)
                    give(room, row, out, angular + 3 + c, here)


@compiled
def weigh(room: Array, arm: Arm, j: int, moment: int) -> None:
    """Add the first moment, about the root's origin, of the mass between a movable joint and the next one."""
    weight, (x, y, z) = arm.masses[j], arm.centres[j]
    for m in range(3):
        row, here = 12 * (arm.movable[j] + 1) + 4 * m, at(moment + m)
        u, v, w, p = at(row), at(row + 1), at(row + 2), at(row + 3)
        for i in range(WIDE):
            room[here + i] += weight * (room[p + i] + (x * room[u + i] + y * room[v + i] + z * room[w + i]))


@compiled
def add_torque(
    room: Array, axis: int, step: int, factor: float, pull: Array, moment: int, mass: float, k: int,
    out: Array, row: int, start: np.uint64,
) -> None:  # fmt: skip
    """Add the holding torque: factor · axis · (gravity × first moment about the origin of element ``k``)."""
    x, y, z = pull[0] * factor, pull[1] * factor, pull[2] * factor
    u, v, w = at(axis), at(axis + step), at(axis + 2 * step)
    along, across, up = at(moment), at(moment + 1), at(moment + 2)
    o, p, q = at(12 * k + 3), at(12 * k + 7), at(12 * k + 11)
    for i in range(WIDE):
        a = room[along + i] - mass * room[o + i]
        b, c = room[across + i] - mass * room[p + i], room[up + i] - mass * room[q + i]
        torque = room[u + i] * (y * c - z * b) + room[v + i] * (z * a - x * c)
        out[row, start + i] += torque + room[w + i] * (x * b - y * a)


@compiled
def gravity(arm: Arm, pull: Array, payload: float, q: Array, start: int, stop: int, out: Array) -> None:
    """Write generalized gravity (n, N), torques or forces that hold the arm and a payload at the tool's point."""
    kept = len(arm.kinds) + 1
    room = new_room(arm, kept, 6)
    moment = 12 * kept + 27
    for number in range((stop - start + LANES - 1) // LANES):
        here = begin(start, stop, number)
        target(room, arm, walk(room, arm, kept, q, here), moment)
        room[moment * LANES : (moment + 3) * LANES] *= payload
        mass = payload
        for j in range(len(arm.movable) - 1, -1, -1):
            k, row, mass = arm.movable[j], arm.lead[j], mass + arm.masses[j]
            weigh(room, arm, j, moment)
            if row < 0:
                continue
            if arm.last[j]:  # from the tool inwards it is the last that comes first
                give_zeros(out, row, here)
            axis, step, sign = axis_of(room, arm, k, moment + 3)
            factor = sign * arm.factor[j]
            if arm.kinds[k] == SLIDES:
                for m in range(3):
                    add(room, axis + m * step, -mass * factor * pull[m], out, row, here)
            else:
                add_torque(room, axis, step, factor, pull, moment, mass, k, out, row, here)
