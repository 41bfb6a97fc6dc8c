"""Servo model of one joint: a free-running simulation of what the encoder reads, from the command alone.

Per joint, everything over the servo's stiffness K (rad for N·m), with the command u, Coulomb and load friction exact in
sticking,

    τ₂ q̈ + τ₁ q̇ + F = clip(D[(1 + g) u(t − T) + z − q] − τ_d q̇, ±L) − c load(q) ,
    |F| ≤ w + μ c |load| + w_s e^{−(q̇/v_s)²} ,

D a dead zone, c = 1/K, τ₂ = c (M(q) + I_a), L the torque limit over K, load the torque of
gravity and of the other joints. One step of the
implicit midpoint rule solves a monotone inclusion for the velocity at its middle (Moreau's time stepping: Acary and
Brogliato, *Numerical Methods for Nonsmooth Dynamical Systems*, 2008), and a joint that sticks is at rest at its end; a
command that is held between its stamps is averaged over the step, so that the answer is smooth in the delay.
"""

from __future__ import annotations

import math
from functools import cache
from importlib.util import find_spec
from typing import Any

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.compiling import compiled
from thermal_robot.errors import EstimationError

PARAMETERS = tuple(
    "zero gain delay lag inertia droop coulomb load_friction stribeck dead_zone saturation low high derivative".split()
)
"""Numbers of one joint: rad, –, s, s, s², rad/(N·m), rad, –, rad, rad, 1/rad, rad, rad, s."""
STRIBECK_VELOCITY = 0.1
"""rad/s: v_s, at which sliding has begun: BAM's measured servos, 0.05 to 0.2."""
NEAR = 0.5
"""rad: farther from where it was taken a load grows no more; it is a sine."""
FASTEST = 1e3
"""rad/s: no joint turns faster, whatever a set of numbers says of its inertia."""


def _middle(q, v, u, load, most, inertia, drag, derivative, bend, half, dead, limit):  # type: ignore[no-untyped-def]
    """Velocity at the middle of a step: zero where friction holds the joint, else the root of a monotone function."""
    e, pull, drive = u - q, inertia * v - load, 0.0
    if e > dead:
        drive = min(e - dead, limit)
    elif e < -dead:
        drive = max(e + dead, -limit)
    at_rest = pull + drive
    if abs(at_rest) <= most:
        return 0.0
    pull += -most if at_rest > 0.0 else most
    damping = max(inertia + drag + bend * half, 1e-12)
    # unclipped, in the piece of D that holds; where that asks for too much, the limit
    free = damping + derivative
    w = pull / free
    if e - half * w > dead:
        w = (pull + e - dead) / (free + half)
    elif e - half * w < -dead:
        w = (pull + e + dead) / (free + half)
    asked = damping * w - pull
    if asked > limit:
        w = (pull + limit) / damping
    elif asked < -limit:
        w = (pull - limit) / damping
    w = max(min(w, FASTEST), -FASTEST)
    return w if w * at_rest > 0.0 else 0.0


def _simulate(  # type: ignore[no-untyped-def]
    numbers, weights, begins, first, step, substeps, times, integral, command_begins, loads, slope, about, inertias,
    start, out,
):  # fmt: skip
    """Integrate all motions for each set of numbers; ``out`` (S, n) is q on the grid."""
    h, half = step / substeps, 0.5 * step / substeps
    for s in range(numbers.shape[0]):
        zero, gain, delay, lag, inertia, droop = numbers[s, :6]
        coulomb, load_friction, stribeck, dead, saturation, low, high, derivative = numbers[s, 6:]
        limit = 1.0 / saturation if saturation > 0.0 else 1e9
        for m in range(len(begins) - 1):
            q, v, t = start[m], 0.0, first[m] - delay
            k, last = command_begins[m], command_begins[m + 1] - 1
            while k < last and times[k + 1] <= t:
                k += 1
            before = integral[k, 0] + integral[k, 1] * (t - times[k])
            for n in range(begins[m], begins[m + 1]):
                force, mass = 0.0, 0.0
                for i in range(weights.shape[1]):
                    force += droop * weights[s, i] * loads[i, n]
                    mass += droop * weights[s, i] * inertias[i, n]
                heavy, bend = 2.0 * max(mass + inertia, 0.0) / h, droop * slope[n]
                # without inertia the midpoint rule would ring about a command that is followed at once
                drag = max(lag, half - derivative) if heavy < half else lag
                for _ in range(substeps if n > begins[m] else 0):
                    t += h
                    while k < last and times[k + 1] <= t:
                        k += 1
                    late = integral[k, 0] + integral[k, 1] * (t - times[k])
                    u, before = (1.0 + gain) * (late - before) / h + zero, late
                    load = force + bend * max(min(q - about[n], NEAR), -NEAR)
                    most = coulomb + load_friction * abs(load) + stribeck * math.exp(-((v / STRIBECK_VELOCITY) ** 2))
                    middle = _middle(  # type: ignore[no-untyped-call]
                        q, v, u, load, most, heavy, drag, derivative, bend, half, dead, limit
                    )
                    then = q + h * middle
                    if then < low or then > high:
                        then, middle = max(min(then, high), low), 0.0
                    v, q = 2.0 * middle - v if middle != 0.0 else 0.0, then
                out[s, n] = q


@cache
def _kernel() -> Any:
    """Return the simulation loops, compiled at the first call; raise :class:`EstimationError` without numba."""
    global _middle
    if find_spec("numba") is None:
        raise EstimationError('servos are simulated by numba, which is missing: pip install "thermal-robot[fast]"')
    if not hasattr(_middle, "py_func"):
        _middle = compiled(_middle)
    return compiled(_simulate)


def simulate(
    numbers: Array, weights: Array, grid: tuple[Any, ...], command: tuple[Any, ...], around: tuple[Array, ...],
    start: Array, step: float, substeps: int,
) -> Array:  # fmt: skip
    """Simulate one joint by time stepping in all motions, for S sets of numbers: (S, n) rad on the grid.

    ``numbers`` (S, 14) as :data:`PARAMETERS`, ``weights`` (S, k) of the ``loads`` (k, n), N·m, and ``inertias`` (k, n),
    kg·m²; ``grid`` begins of motions and their first instants; ``command`` stamps, integral with slope and begins;
    ``around`` loads, their slope (n,), N·m/rad, the position (n,) at which they hold, and inertias; ``start`` (M,) rad.
    """
    out = np.empty((len(numbers), grid[0][-1]))
    _kernel()(numbers, weights, *grid, step, substeps, *command, *around, start, out)
    return out
