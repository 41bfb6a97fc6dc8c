"""Servo model of joints that move together: a forward simulation of what encoders read, from the commands alone.

Per joint j, everything over the servo's stiffness K (rad for N·m), with the command u, Coulomb and load friction exact
in sticking,

    I q̈ + τ₁ q̇(t + s/2) + F = clip(D[(1 + g) u(t + s/2 − T) + z − q] − τ_d q̇(t + s/2), ±L) − c load ,
    load = Σ_k M_jk q̈_k + h_j + Σ_k (∂h_j/∂q_k (q − q̄)_k + ∂h_j/∂q̇_k (q̇ − q̄̇)_k) ,
    |F| ≤ w + μ c |load| + w_s e^{−(q̇/v_s)²} ,

u̇ and ü no more than the limits of the servo's profile, D a dead zone d, D[e] = e − d sign e beyond it, below zero a
starting force, c = 1/K, I the drive's own inertia over K, L the torque limit over K. Mass matrix M and bias torques h
are those of a reference motion q̄ (Newton's method on waveforms: Lelarasmee, Ruehli and Sangiovanni-Vincentelli,
*IEEE Transactions on Computer-Aided Design* 1, 1982), so that a motion near it needs no rigid-body algorithm. One
step of the implicit midpoint rule solves a monotone inclusion for the velocities at its middle (Moreau's time
stepping: Acary and Brogliato, *Numerical Methods for Nonsmooth Dynamical Systems*, 2008), by semismooth Newton, and a
joint that sticks is at rest at its end. A step ends where a command changes, or of a single joint averages it, so
that the answer is smooth in the delay.

A log of a simulator has its integrator's errors. Semi-implicit Euler in steps s, with implicit damping, as MuJoCo's,
is to first order a system whose commands and dampings are s/2 early (modified equation: Hairer, Lubich and Wanner,
*Geometric Numerical Integration*, 2006, IX). Its friction is soft: a joint is held by f = −H (q̈ + b q̇) up to
|f| = w, as if it had the inertia H more, H = (1 − c)/c of its inertia at zero with the other joints free (MuJoCo's
documentation, *Computation*, constraint model: c is one less the impedance).
"""

from __future__ import annotations

import math
from functools import cache
from importlib.util import find_spec
from threading import Lock
from typing import Any

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.compiling import compiled
from thermal_robot.errors import EstimationError

PARAMETERS = tuple(
    "zero gain delay lag inertia droop coulomb load_friction stribeck dead_zone saturation low high derivative "
    "step hold slew ramp".split()
)
"""Numbers of a joint: rad, –, s, s, s², rad/(N·m), rad, –, rad, rad, 1/rad, rad, rad, s, s, H, s², s/rad, s²/rad."""
CREEP_RATE = 2.0 / (0.95 * 0.02)
"""1/s: at which MuJoCo's friction brakes a joint that it holds, by its usual ``solref`` and ``solimp``."""
SHORTEST = 1e-7
"""s: what a step leaves below this to a change of a command is rounding."""
STRIBECK_VELOCITY = 0.1
"""rad/s: v_s, at which sliding has begun: BAM's measured servos, 0.05 to 0.2."""
NEAR = 0.5
"""rad: farther from where it was taken a load grows no more; it is a sine."""
STEPS, SWEEPS, EXACT = 10, 100, 1e-9
"""Newton steps, then Gauss-Seidel sweeps at most of one time step (two or three steps are usual), and the change of a
velocity, rad/s, below which they end: in a step of 4 ms a millionth of what the finest encoder reads."""
FINER, NEARLY = 8, 0.5
"""Parts of a step in which a servo may saturate, where its torque bends, and share of its limit from which it may."""
TRIES = 30
"""Forces of a plane that are tried in a time step: six are usual."""
_ONE = Lock()
LEVEL, RISES, LIFT = 1e-7, 0.02, 1e-3
"""m: by which a tool on a plane may stand beside it; s: in which one below rises to a third, as MuJoCo's contacts; m/N:
by which a force is thought to lift the tool in a time step, until that is known from the step before."""
LEAST = 0.1
"""Of a sliding joint's derivative by its load what friction leaves of it at least."""
HELD = 1e9
"""s²: slope where the starting force holds a joint at its set point."""
FASTEST = 1e3
"""rad/s: no joint turns faster, whatever a set of numbers says of its inertia."""


def _led(led, rate, command, slowness, ramp, h):  # type: ignore[no-untyped-def]
    """Trapezoidal velocity profile: mean of the set point in a step h, where it ends, and its velocity there.

    ``led`` to a command at 1/``slowness`` rad/s and 1/``ramp`` rad/s² at most, as fast as lets it stop there. A step in
    which it moves for a part only has its mean nearer to the end.
    """
    if slowness <= 0.0 and ramp <= 0.0:
        return command, command, 0.0
    far, way = abs(command - led), math.copysign(1.0, command - led)
    then = 2.0 * far / (h + math.sqrt(h * h + 2.0 * far * ramp))
    then = way / slowness if then * slowness > 1.0 else way * then
    if abs(then - rate) * ramp > h:
        then = rate + math.copysign(h / ramp, then - rate)
    part = min((far * slowness + math.sqrt(2.0 * far * ramp)) / h, 1.0)
    return led + h * then * (1.0 - 0.5 * part), led + h * then, then


def _breakaway(stribeck, v):  # type: ignore[no-untyped-def]
    """Stribeck friction at a velocity; an exponential is slow, and its tail below a rounding error is nothing."""
    square = (v / STRIBECK_VELOCITY) ** 2
    return stribeck * math.exp(-square) if stribeck != 0.0 and square < 36.0 else 0.0


def _sliding(e, pull, kick, damping, derivative, early, half, dead, limit):  # type: ignore[no-untyped-def]
    """Root of a servo's monotone equation of motion in the velocity, and its slope: unclipped, or else at the limit."""
    free, edge = damping + derivative * (1.0 + early), max(dead, 0.0)
    slope = free + half
    # in the piece of D that holds; where that asks for too much, the limit
    w = (pull + kick + e - dead) / slope
    if e - half * w <= edge:
        w = (pull + kick + e + dead) / slope
        if e - half * w >= -edge:
            slope = free if dead >= 0.0 else HELD
            w = (pull + kick) / free if dead >= 0.0 else 0.5 * e / half
    asked = damping * w - pull
    if abs(asked) > limit:
        slope = damping
        w = (pull + (limit if asked > 0.0 else -limit)) / damping
    return max(min(w, FASTEST), -FASTEST), slope


def _middle(  # type: ignore[no-untyped-def]
    q, v, u, load, most, more, side, inertia, drag, derivative, early, bend, half, dead, limit, hold
):
    """Velocity at the middle of a step, the root of a monotone function; minus its derivative by load, inverse; side.

    Where friction holds the joint all are zero, or it creeps. ``more`` is the derivative of friction ``most`` by load.
    What slid to one ``side`` at the last try is held before it slides to the other: else Newton's steps may leap over.
    """
    e, pull, kick = u - q, inertia * v - load, derivative * early * v
    rest, drive = drag + bend * half, kick
    if e > max(dead, 0.0):
        drive += e - dead
    elif e < -max(dead, 0.0):
        drive += e + dead
    at_rest = pull + max(min(drive, limit), -limit)
    if hold > 0.0 and most > 0.0:
        soft = hold / half
        held, brake = inertia + soft, soft * half * CREEP_RATE
        damping = max(held + rest + brake, 1e-12)
        w, slope = _sliding(e, held * v - load, kick, damping, derivative, early, half, dead, limit)  # type: ignore[no-untyped-call]
        at_rest = soft * (w - v) + brake * w
        if abs(at_rest) <= most or at_rest * side < 0.0:
            return w, slope, 0.0
    elif abs(at_rest) <= most or at_rest * side < 0.0:
        return 0.0, 0.0, 0.0
    way = 1.0 if at_rest > 0.0 else -1.0
    pull -= way * most
    w, slope = _sliding(e, pull, kick, max(inertia + rest, 1e-12), derivative, early, half, dead, limit)  # type: ignore[no-untyped-call]
    if w * way < 0.0 and hold == 0.0:
        return 0.0, 0.0, 0.0
    return w, slope / max(1.0 + way * more, LEAST), way


def _solve(matrix, right):  # type: ignore[no-untyped-def]
    """Solve a small linear system in place by Gauss's elimination; a mass matrix of scaled rows needs no pivots."""
    for k in range(len(right)):
        for i in range(k + 1, len(right)):
            share = matrix[i, k] / matrix[k, k]
            if share != 0.0:
                for j in range(k + 1, len(right)):
                    matrix[i, j] -= share * matrix[k, j]
                right[i] -= share * right[k]
    for k in range(len(right) - 1, -1, -1):
        for j in range(k + 1, len(right)):
            right[k] -= matrix[k, j] * right[j]
        right[k] /= matrix[k, k]


def _latest(times, k, last, t):  # type: ignore[no-untyped-def]
    """Index from k to ``last`` of the latest stamp at an instant t."""
    while k < last and times[k + 1] <= t:
        k += 1
    return k


def _held(times, commands, command_begins):  # type: ignore[no-untyped-def]
    """Integral of a command that is held (M,) up to each stamp, rad s, and the instants at which it changes then, s."""
    integral, until = np.zeros(len(times)), np.full(len(times), np.inf)
    for k in range(1, len(times)):
        integral[k] = integral[k - 1] + commands[k - 1] * (times[k] - times[k - 1])
    for m in range(len(command_begins) - 1):
        for k in range(command_begins[m + 1] - 2, command_begins[m] - 1, -1):
            until[k] = until[k + 1] if commands[k + 1] == commands[k] else times[k + 1]
    return integral, until


def _advanced(  # type: ignore[no-untyped-def]
    x, state, k, last, t, end, h, substeps, times, commands, integral, until, push, spring, there, force, mass, slope,
    about,
):  # fmt: skip
    """Integrate a joint of numbers x (18,) from an instant to the next point of the grid at ``end`` by its own clock.

    Return what ``state`` has, position, velocity, the command's integral, set point and its velocity, and its stamp k.
    A plane's ``push`` is that at ``there``, beside which the others yield as a ``spring``; it does not pull.
    """
    q, v, before, led, rate = state
    half, heavy, bend = 0.5 * h, 2.0 * max(x[5] * mass + x[4], 0.0) / h, x[5] * slope + spring
    # without inertia the midpoint rule would ring about a command that is followed at once
    drag = max(x[3], half - x[13]) if heavy < half else x[3]
    limit = 1.0 / x[10] if x[10] > 0.0 else 1e9
    for _ in range(substeps):
        t += h
        k = _latest(times, k, last, t)  # type: ignore[no-untyped-call]
        late = integral[k] + commands[k] * (t - times[k])
        u, led, rate = _led(led, rate, (late - before) / h, x[16], x[17], h)  # type: ignore[no-untyped-call]
        u, before = (1.0 + x[1]) * u + x[0], late
        plane = push + spring * (q - there)
        load = (plane if plane * push > 0.0 else 0.0) + x[5] * force
        load += x[5] * slope * max(min(q - about, NEAR), -NEAR)
        most = x[6] + x[7] * abs(load) + _breakaway(x[8], v)  # type: ignore[no-untyped-call]
        middle, _slope, _side = _middle(  # type: ignore[no-untyped-call]
            q, v, u, load, most, 0.0, 0.0, heavy, drag, x[13], 0.0, bend, half, x[9], limit, 0.0
        )
        then = q + h * middle
        if then < x[11] or then > x[12]:
            then, middle = max(min(then, x[12]), x[11]), 0.0
        still = v == 0.0 and middle == 0.0 and abs(led - commands[k]) < EXACT
        v, q = 2.0 * middle - v if middle != 0.0 else 0.0, then
        if still and until[k] >= end:  # nothing changes until then
            before = late + commands[k] * (end - t)
            break
    return (q, v, before, led, rate), k


def _alone(  # type: ignore[no-untyped-def]
    numbers, weights, begins, first, step, substeps, times, commands, command_begins, loads, masses, slopes, about,
    start, out,
):  # fmt: skip
    """Integrate all motions of a single joint; a command is averaged over a step, in which it may change."""
    h = step / substeps
    integral, until = _held(times, commands, command_begins)  # type: ignore[no-untyped-call]
    for s in range(numbers.shape[0]):
        x = numbers[s]
        for m in range(len(begins) - 1):
            t, last = first[m] - x[2], command_begins[m + 1] - 1
            k = _latest(times, command_begins[m], last, t)  # type: ignore[no-untyped-call]
            state = start[m], 0.0, integral[k] + commands[k] * (t - times[k]), start[m], 0.0
            out[s, begins[m]] = start[m]
            for n in range(begins[m] + 1, begins[m + 1]):
                push = weights[s, 1] * loads[2, n] + weights[s, 2] * loads[3, n]
                push += weights[s, 3] * loads[4, n] + weights[s, 4] * loads[5, n]
                force = loads[0, n] + weights[s, 0] * loads[1, n]
                mass, slope = masses[0, n] + weights[s, 0] * masses[1, n], slopes[0, n] + weights[s, 0] * slopes[1, n]
                end = first[m] - x[2] + step * (n - begins[m])
                state, k = _advanced(  # type: ignore[no-untyped-call]
                    x, state, k, last, end - step, end, h, substeps, times, commands, integral, until, push,
                    weights[s, 1] * loads[6, n], loads[7, n], force, mass, slope, about[n],
                )  # fmt: skip
                out[s, n] = state[0]


def _pressing(  # type: ignore[no-untyped-def]
    numbers, soft, begins, first, step, substeps, times, commands, command_begins, drag, forces, masses, slopes, about,
    gap, rise, flex, most, start, out,
):  # fmt: skip
    """Write the force (n,), N, of a plane on J joints that go their own ways: none, or what holds the tool there.

    The tool is below the plane by ``gap`` less ``rise`` times positions and ``flex`` times the force, m: by regula
    falsi (Illinois) in each step, up to a force ``most``, with which the tool passes.
    """
    joints, h = len(numbers), step / substeps
    integral, until = _held(times, commands, command_begins.ravel())  # type: ignore[no-untyped-call]
    for m in range(len(begins) - 1):
        now, then = np.zeros((joints, 5)), np.zeros((joints, 5))
        ks, news = np.zeros(joints, dtype=np.int64), np.zeros(joints, dtype=np.int64)
        for j in range(joints):
            t = first[m] - numbers[j, 2]
            k = _latest(times, command_begins[j, m], command_begins[j, m + 1] - 1, t)  # type: ignore[no-untyped-call]
            ks[j] = k
            now[j, 0], now[j, 3], now[j, 2] = start[m, j], start[m, j], integral[k] + commands[k] * (t - times[k])
        for n in range(begins[m] + 1, begins[m + 1]):
            force, low, high, below, above = 0.0, 0.0, 0.0, 0.0, 0.0
            for number in range(TRIES):
                left = gap[n] - flex * force
                for j in range(joints):
                    x = numbers[j]
                    end = first[m] - x[2] + step * (n - begins[m])
                    state = now[j, 0], now[j, 1], now[j, 2], now[j, 3], now[j, 4]
                    state, news[j] = _advanced(  # type: ignore[no-untyped-call]
                        x, state, ks[j], command_begins[j, m + 1] - 1, end - step, end, h, substeps, times, commands,
                        integral, until, drag[n, j] - soft[j] * rise[n, j] * force, 0.0, 0.0, forces[n, j],
                        masses[n, j], slopes[n, j], about[n, j],
                    )  # fmt: skip
                    then[j, 0], then[j, 1], then[j, 2], then[j, 3], then[j, 4] = state
                    left -= rise[n, j] * state[0]
                if (number == 0 and left <= 0.0) or abs(left) < LEVEL or (left > 0.0 and force >= most[n]):
                    break
                if left > 0.0:
                    above *= 0.5 if low > 0.0 else 1.0
                    low, below = force, left
                else:
                    below *= 0.5 if high > 0.0 else 1.0
                    high, above = force, left
                if high > 0.0:
                    force = low + (high - low) * below / (below - above)
                else:
                    force = min(max(2.0 * force, out[n - 1], 1.0), most[n])
            now, then = then, now
            ks, news = news, ks
            out[n] = force


def _couple(  # type: ignore[no-untyped-def]
    s, n, numbers, weights, loads, masses, slopes, drags, about, pace, q, v, h, base, joined, heavy, drag, bend
):
    """Write the load that joints of set s have at rest, and its derivatives by their velocities, over the stiffness."""
    joints, half, payload = len(base), 0.5 * h, weights[s, 0]
    for j in range(joints):
        droop, lag, derivative = numbers[s, j, 5], numbers[s, j, 3], numbers[s, j, 13]
        told = loads[0, n, j] + payload * loads[1, n, j]
        for i in range(joints):
            mass = masses[0, n, j, i] + payload * masses[1, n, j, i]
            slope = slopes[0, n, j, i] + payload * slopes[1, n, j, i]
            turn = drags[0, n, j, i] + payload * drags[1, n, j, i]
            told += slope * max(min(q[s, i] - about[n, i], NEAR), -NEAR) - turn * pace[n, i]
            if i == j:
                bend[j], drag[j] = droop * slope, droop * turn
                inertia = droop * mass + numbers[s, j, 4] + 0.5 * lag * numbers[s, j, 14]
                heavy[j] = 2.0 * max(inertia, 0.0) / h
            else:
                told -= 2.0 * mass * v[s, i] / h
                joined[j, i] = droop * (2.0 * mass / h + turn + half * slope)
        base[j] = droop * told
        # without inertia the midpoint rule would ring about a command that is followed at once
        drag[j] += max(lag, half - derivative) if heavy[j] < half else lag


def _velocities(s, numbers, limits, q, v, u, base, joined, heavy, drag, bend, h, w, stops, sides, left, matrix):  # type: ignore[no-untyped-def]
    """Solve a time step of set s for all joints' velocities ``w`` (S, J) at its middle, by semismooth Newton."""
    joints, half = len(u), 0.5 * h
    sides[:] = 0.0
    for number in range(STEPS + SWEEPS):
        change = 0.0
        for j in range(joints):
            load = base[j]
            for i in range(joints):
                load += joined[j, i] * w[s, i]
            most = numbers[s, j, 6] + numbers[s, j, 7] * abs(load)
            most += _breakaway(numbers[s, j, 8], v[s, j])  # type: ignore[no-untyped-call]
            more = numbers[s, j, 7] if load > 0.0 else -numbers[s, j, 7]
            middle, slope, sides[j] = _middle(  # type: ignore[no-untyped-call]
                q[s, j], v[s, j], u[j], load, most, more, sides[j], heavy[j], drag[j], numbers[s, j, 13],
                numbers[s, j, 14] / h, bend[j], half, numbers[s, j, 9], limits[s, j], numbers[s, j, 15],
            )  # fmt: skip
            then = q[s, j] + h * middle
            stops[j] = then < numbers[s, j, 11] or then > numbers[s, j, 12]
            if stops[j]:
                middle, slope = (max(min(then, numbers[s, j, 12]), numbers[s, j, 11]) - q[s, j]) / h, 0.0
            left[j] = middle - w[s, j]
            change = max(change, abs(left[j]))
            if number >= STEPS:
                w[s, j] = middle
            for i in range(joints):
                matrix[j, i] = joined[j, i] / slope if slope > 0.0 else 0.0
            matrix[j, j] = 1.0
        if change < EXACT:
            return
        if number < STEPS:
            _solve(matrix, left)  # type: ignore[no-untyped-call]
            for j in range(joints):
                w[s, j] = max(min(w[s, j] + left[j], FASTEST), -FASTEST)


def _height(s, n, plane, heights, loads, about, q, h, w):  # type: ignore[no-untyped-def]
    """Height of the tool above a plane, m, in set s after it has turned for h."""
    gap = heights[n] - plane
    for j in range(q.shape[1]):
        gap += loads[2, n, j] * max(min(q[s, j] + h * w[s, j] - about[n, j], NEAR), -NEAR)
    return gap


def _above(  # type: ignore[no-untyped-def]
    s, n, plane, heights, loads, about, numbers, limits, q, v, u, base, joined, heavy, drag, bend, h, w, stops, sides,
    left, matrix, force, steep,
):  # fmt: skip
    """Solve a time step as :func:`_velocities`, with the least ``force`` (S,) that keeps the tool above a plane.

    A unilateral constraint: the height after the step grows with the force, whose root the secant method finds. A tool
    below the plane rises to it exponentially.
    """
    floor = min(_height(s, n, plane, heights, loads, about, q, 0.0, w), 0.0) * math.exp(-h / RISES)  # type: ignore[no-untyped-call]
    more, before = force[s], 0.0
    for number in range(STEPS):
        for j in range(q.shape[1]):
            base[j] -= numbers[s, j, 5] * loads[2, n, j] * more
        _velocities(s, numbers, limits, q, v, u, base, joined, heavy, drag, bend, h, w, stops, sides, left, matrix)  # type: ignore[no-untyped-call]
        gap = _height(s, n, plane, heights, loads, about, q, h, w) - floor  # type: ignore[no-untyped-call]
        if abs(gap) < LEVEL or (force[s] == 0.0 and gap > 0.0):
            return
        # where pushing does not lift the tool, as far from where its height was taken, nothing pushes
        lifts = number == 0 or (gap - before) * more > 0.0
        if number > 0 and lifts:
            steep[s] = (gap - before) / more
        if not lifts and force[s] == 0.0:
            return
        more = max(min(-gap / steep[s], force[s] if force[s] > 0.0 else np.inf), -force[s]) if lifts else -force[s]
        force[s], before = force[s] + more, gap


def _lead(  # type: ignore[no-untyped-def]
    s, m, numbers, limits, times, commands, command_begins, q, v, rest, step, t, k, led, rate, u
):
    """Lead the set points ``u`` (J,) of set s over the next time step, and return its length, s."""
    h = rest
    for j in range(len(u)):
        last = command_begins[j, m + 1] - 1
        k[s, j] = _latest(times, k[s, j], last, t[s, j] + SHORTEST)  # type: ignore[no-untyped-call]
        if numbers[s, j, 16] <= 0.0 and numbers[s, j, 17] <= 0.0:
            led[s, j] = commands[k[s, j]]
        point = (1.0 + numbers[s, j, 1]) * led[s, j] + numbers[s, j, 0]
        if k[s, j] < last:
            h = min(h, times[k[s, j] + 1] - t[s, j])
        if abs(point - q[s, j] - numbers[s, j, 13] * v[s, j]) > NEARLY * limits[s, j]:
            h = min(h, step / FINER)
    for j in range(len(u)):
        t[s, j] += h
        mean, led[s, j], rate[s, j] = _led(  # type: ignore[no-untyped-call]
            led[s, j], rate[s, j], commands[k[s, j]], numbers[s, j, 16], numbers[s, j, 17], h
        )
        u[j] = (1.0 + numbers[s, j, 1]) * mean + numbers[s, j, 0]
    return h


def _together(  # type: ignore[no-untyped-def]
    numbers, weights, begins, first, step, times, commands, command_begins, loads, masses, slopes, drags, about, pace,
    heights, start, out,
):  # fmt: skip
    """Integrate all motions of several joints; a step ends where a command changes."""
    sets, joints = shape = numbers.shape[:2]
    q, v, w = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    t, led, rate = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    k = np.zeros(shape, dtype=np.int64)
    u, heavy, drag, bend = np.zeros(joints), np.zeros(joints), np.zeros(joints), np.zeros(joints)
    base, left, sides, stops = np.zeros(joints), np.zeros(joints), np.zeros(joints), np.zeros(joints, dtype=np.bool_)
    joined, matrix = np.zeros((joints, joints)), np.zeros((joints, joints))
    limits, force, steep = 1.0 / np.maximum(numbers[:, :, 10], 1e-9), np.zeros(sets), np.full(sets, LIFT)
    for m in range(len(begins) - 1):
        for s in range(sets):
            force[s] = 0.0
            for j in range(joints):
                q[s, j], v[s, j], w[s, j], k[s, j] = start[m, j], 0.0, 0.0, command_begins[j, m]
                led[s, j], rate[s, j] = q[s, j], 0.0
                t[s, j] = first[m] - numbers[s, j, 2] + 0.5 * numbers[s, j, 14]
                out[s, begins[m], j] = q[s, j]
        for n in range(begins[m] + 1, begins[m + 1]):
            for s in range(sets):  # all of one instant, whose matrices are then at hand
                rest = step
                while rest > SHORTEST:
                    h = _lead(  # type: ignore[no-untyped-call]
                        s, m, numbers, limits, times, commands, command_begins, q, v, rest, step, t, k, led, rate, u
                    )
                    rest -= h
                    _couple(  # type: ignore[no-untyped-call]
                        s, n, numbers, weights, loads, masses, slopes, drags, about, pace, q, v, h, base, joined, heavy,
                        drag, bend,
                    )  # fmt: skip
                    _above(  # type: ignore[no-untyped-call]
                        s, n, weights[s, 1], heights, loads, about, numbers, limits, q, v, u, base, joined, heavy, drag,
                        bend, h, w, stops, sides, left, matrix, force, steep,
                    )  # fmt: skip
                    for j in range(joints):
                        q[s, j] += h * w[s, j]
                        v[s, j] = 2.0 * w[s, j] - v[s, j] if w[s, j] != 0.0 and not stops[j] else 0.0
                        if force[s] > 0.0:  # an impact leaves nothing of the speed towards the plane
                            v[s, j] = w[s, j]
                out[s, n] = q[s]


@cache
def _kernels() -> tuple[Any, Any, Any]:
    """Return the loops of one joint, of several and of several on a plane, compiled at the first call.

    Raises :class:`EstimationError` without numba.
    """
    global _latest, _led, _breakaway, _held, _sliding, _middle, _solve, _lead, _couple, _velocities, _height, _above
    global _advanced
    if find_spec("numba") is None:
        raise EstimationError('servos are simulated by numba, which is missing: pip install "thermal-robot[fast]"')
    with _ONE:  # threads ask at once
        if not hasattr(_middle, "py_func"):
            _led, _breakaway, _sliding = (compiled(one) for one in (_led, _breakaway, _sliding))
            _middle, _solve, _held, _latest = (compiled(one) for one in (_middle, _solve, _held, _latest))
            _lead, _couple, _velocities = (compiled(one) for one in (_lead, _couple, _velocities))
            _height, _above, _advanced = compiled(_height), compiled(_above), compiled(_advanced, inline=True)
    return compiled(_alone), compiled(_together), compiled(_pressing)


def simulate(
    numbers: Array, weights: Array, grid: tuple[Any, ...], command: tuple[Any, ...], around: tuple[Array, ...],
    start: Array, step: float, substeps: int,
) -> Array:  # fmt: skip
    """Forward simulation of J joints by time stepping in all motions, for S sets of numbers: (S, n, J) rad on the grid.

    ``numbers`` (S, J, 18) as :data:`PARAMETERS`, ``weights`` (S, 5) of payload, kg, and contact; ``grid`` begins of
    motions and their first instants; ``command`` stamps, values and begins (J, M + 1); ``around``, in the
    middle of the step that ends at each grid point: ``loads`` (8, n, J), N·m, of the model and of 1 kg of payload, then
    what a joint yields to contact, rad, its derivatives by height, friction and flex, by how much less for a rad from
    which position, of several joints first the gradient of the tool's height; of the first two mass matrices,
    derivatives by position and by velocity (2, n, J, J); positions and velocities (n, J) at which they hold, and
    heights there (n,), m; ``start`` (M, J) rad. Of contact several joints have a plane's height, single ones a factor
    and changes of height, friction and flex.
    """
    out, (alone, together, _) = np.empty((len(numbers), grid[0][-1], numbers.shape[1])), _kernels()
    if numbers.shape[1] > 1:
        together(numbers, weights, *grid, step, *command, *around, start, out)
        return out
    loads, masses, slopes, _, about, _, _ = around
    times, values, begins = command
    own = (np.ascontiguousarray(one[..., 0]) for one in (loads, masses[..., 0], slopes[..., 0], about, start))
    alone(numbers[:, 0], weights, *grid, step, substeps, times, values, begins[0], *own, out[..., 0])
    return out


def plane_forces(
    numbers: Array, soft: Array, grid: tuple[Any, ...], command: tuple[Any, ...], around: tuple[Array, ...],
    plane: tuple[Array, Array, float, Array], start: Array, step: float, substeps: int,
) -> Array:  # fmt: skip
    """Force (n,), N, of a plane in the step that ends at each grid point, on J joints that go their own ways.

    ``numbers`` (J, 18), ``soft`` (J,) compliances by which the force moves them, ``plane``: what the tool is below it
    with all joints at zero (n,), its height's derivatives by them (n, J), the flex, m/N, and the largest force (n,).
    ``around``: further loads, rad, torques, masses, slopes and positions (n, J). The others as in :func:`simulate`.
    """
    out = np.zeros(grid[0][-1])
    _kernels()[2](numbers, soft, *grid, step, substeps, *command, *around, *plane, start, out)
    return out
