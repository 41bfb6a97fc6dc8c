"""What goes wrong in a joint: its zero, encoder, gears, springs, friction and servo."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from thermal_robot.blind.reality.fault import Fault, joints, milli, one, order, own_position, part, some
from thermal_robot.blind.reality.setting import Setting
from thermal_robot.blind.reality.world import Body

Array = NDArray[np.float64]

# What these numbers rest on, and what of it is the trial's own choice: docs/blind.md, "What is shared".
_GRAVITY = 9.81  # m/s²
_SMALLEST = 1.0  # N·m (N): no gear of these arms is built for less
_FRICTION = (0.1, 3.0)
"""Dry friction of a gear driven backwards, as a share of what it is built to hold: about a tenth in a harmonic drive
that is run in; above one where the gear holds by itself, as worm gears do. Evenly over the logarithm: ours."""
_PLAYS = 0.25  # least share of rows in which the way of arrival decides
_ALIKE = 0.2  # scatter of friction among gears of one make, of its logarithm
_SOFT = (0.02, 0.1)  # of friction: films of grease are thin
_RATIOS = (30.0, 160.0)  # of gears, harmonic drives' among them
_DELAY = (5e-4, 8e-3)  # s: half a cycle of a controller at 1 kHz, a whole one at 125 Hz
_DRAG = (2e-5, 2e-4)
"""rad (m): what a loop without integral part leaves of dry friction, 1 to 10 N·m against 5e4 N·m/rad."""


def offset(body: Body, setting: Setting, values: Array) -> None:
    """Let each joint stand elsewhere by a constant."""
    body.joints += values[:, 0]


def gain(body: Body, setting: Setting, values: Array) -> None:
    """Graduate each joint with too many lines a turn, from its zero on."""
    body.joints += setting.q * values[:, 0]


def wheels(body: Body, setting: Setting, values: Array) -> None:
    """Read an angle on a disc whose centre is off, and turn an oval wheel: a ray of a circle, not a sine.

    The disc turns with the joint, or ``ratio`` times as fast with its motor.
    """
    for j, (across, along, oval, phase, ratio) in enumerate(values):
        angle = setting.q[:, j] * ratio
        sine, cosine = np.sin(angle), np.cos(angle)
        # the direction of the true mark from the centre that is off, seen from the mark itself
        body.joints[:, j] += np.arctan2(along * sine - across * cosine, 1.0 - across * sine - along * cosine)
        body.joints[:, j] += np.arctan2(oval * np.sin(2 * (angle + phase)), 1.0 + oval * np.cos(2 * (angle + phase)))


def draw_wheels(setting: Setting, rng: np.random.Generator) -> Array:
    """Draw how far discs are off, across and along, how oval wheels are, their phase (rad) and ratio.

    A joint that slides has no disc of its own, only its motor has: its ratio is in rad/m.
    """
    ratio = round(float(rng.uniform(*_RATIOS)), 2) if rng.random() < 0.2 else 1.0
    values = some(1e-3, 5, last=False, turning=ratio == 1.0)(setting, rng)
    values[:, 2] *= rng.choice([0.0, 0.6])
    values[:, 3] = rng.uniform(0, np.pi)
    values[:, 4] = ratio
    return values


def harmonics(setting: Setting, values: Array) -> dict[str, float]:
    """Fourier's amplitudes of :func:`wheels`: a disc off by e adds eᵏ/k of order k, an oval one nearly order 2."""
    found = {}
    for name, (across, along, oval, phase, ratio) in zip(setting.world.names, values, strict=True):
        disc = complex(along, -across)
        second = disc**2 / 2.0 + oval * np.exp(2j * phase)
        for turns, amplitude in ((ratio, disc), (2.0 * ratio, second)):
            found[f"sine, order {turns:g}, {name}"] = float(amplitude.real)
            found[f"cosine, order {turns:g}, {name}"] = float(amplitude.imag)
    return found


def ripple(body: Body, setting: Setting, values: Array) -> None:
    """Let teeth, balls or a motor's wheel come round: a wave of the joint's own position; one that slides has rad/m."""
    size, order, phase = values.T
    body.joints += size * np.sin(order * setting.q + phase)


def waves(name: str, orders: tuple[float, float]) -> Fault:
    """Return the fault of one joint that errs by a wave, of an order drawn between two."""
    draw, fixed = one(milli, order(orders), part(0.0, 2 * np.pi)), ((1, (1.0,)), (2, (0.0,)))
    return Fault(name, draw, ripple, joints, few=True, quantities=own_position, fixed=fixed)


def play(body: Body, setting: Setting, values: Array) -> None:
    """Lay teeth on the side to which the torque through them presses.

    A joint that arrived on its way s = ±1 is pushed there against dry friction F (N·m) while gravity wants the
    torque τ: its teeth carry τ + F s. The grease between them is pressed out gradually, over a share of F. One that
    has not moved yet, s = 0, stands in the middle of where the two ways would have left it.
    """
    for j, (half, friction, soft) in enumerate(values):
        if half == 0.0:
            continue
        load, way = setting.torque[:, j], setting.approach[:, j]
        up, down = (np.tanh((load + side * friction) / (soft * friction)) for side in (1.0, -1.0))
        body.joints[:, j] -= abs(half) * (up * (1.0 + way) + down * (1.0 - way)) / 2.0


def draw_play(setting: Setting, rng: np.random.Generator) -> Array:
    """Draw half of each play, rad or m; friction, N·m or N; and the share of it over which teeth change sides.

    Gears of one arm are of one make and one grease: friction is one share of what each is built to hold, but for a
    fifth. Where gravity has its way in more than three rows of four, hardly anything is left of the play but an offset
    of the joint, that nobody can tell from one: such a share is not drawn.
    """
    values = some(2e-4, 3, last=False, positive=True)(setting, rng)
    size = ratings(setting) * np.exp(rng.normal(0.0, _ALIKE, setting.world.n))
    seldom = np.quantile(np.abs(setting.torque), _PLAYS, axis=0) / size
    least = np.append(seldom[values[:, 0] > 0.0], _FRICTION[0]).max()
    values[:, 1] = size * np.exp(rng.uniform(np.log(least), np.log(max(_FRICTION[1], least))))
    values[:, 2] = rng.uniform(*_SOFT)
    return values


def ratings(setting: Setting) -> Array:
    """Return what each joint's gear is built to hold, (n,) N·m or N: arm and payload, stretched out level.

    The arm's own weight counts half way out, the payload's at the tool; a joint that slides lifts them.
    """
    world, carried = setting.world, float(setting.payload.max())
    held = []
    for k, joint in enumerate(world.chain):
        if joint.commanded:
            arm, out = world.tree.carried(joint.child), float(sum(np.linalg.norm(j.xyz) for j in world.chain[k + 1 :]))
            lift = joint.kind == "prismatic"
            held.append(_GRAVITY * (arm + carried if lift else (arm / 2.0 + carried) * out))
    return np.maximum(held, _SMALLEST)


def springs(body: Body, setting: Setting, values: Array) -> None:
    """Put joints on springs."""
    body.springs += np.abs(values[:, 0])


def draw_springs(setting: Setting, rng: np.random.Generator) -> Array:
    """Draw the compliance of every joint; now and then one worn gear among stiff ones."""
    n = setting.world.n
    values = np.abs(rng.normal(1.0, 0.5, (n, 1))) * 1e-5
    if rng.random() < 0.4:  # one worn gear
        values *= 0.05
        loaded = np.argsort((setting.torque**2).mean(axis=0))[-3:]
        values[rng.choice(loaded)] = 3e-5
    return values


def servo(body: Body, setting: Setting, values: Array) -> None:
    """Follow the command late, dragged by dry friction.

    Of the delay T a share p is the loop's, which has a bandwidth, the rest the clock's, which is a dead time:
    exp(−(1 − p) T s) / (1 + p T s) = 1 − T s + ((1 + p²) / 2) T² s² − …
    """
    delay, friction, loop = values.T
    late = -setting.velocity * delay + setting.acceleration * (1.0 + loop**2) / 2.0 * delay**2
    body.joints += late - friction * setting.approach


def lags(setting: Setting, values: Array) -> dict[str, float]:
    """Delay, friction and what acceleration does, of each joint."""
    delay, friction, loop = values.T
    names = setting.world.names
    each = (("delay", delay), ("friction", friction), ("effect of acceleration", (1.0 + loop**2) / 2.0 * delay**2))
    return {f"{label}, {name}": float(v) for label, of in each for name, v in zip(names, of, strict=True)}


def draw_servo(setting: Setting, rng: np.random.Generator) -> Array:
    """Draw each joint's delay, s, what friction leaves, rad or m, and the loop's share of the delay."""
    erring = some(1.0, last=False)(setting, rng) != 0.0
    low, high = np.log(np.array([_DELAY, _DRAG])).T
    values = np.exp(rng.uniform(low, high, (setting.world.n, 2)))
    return np.column_stack([values * erring, np.full(setting.world.n, rng.uniform())])


def ticks(body: Body, setting: Setting, values: Array) -> None:
    """Count in steps: the joint stands at the nearest one."""
    for j, (step,) in enumerate(np.abs(values)):
        if step:
            body.joints[:, j] += np.round(setting.q[:, j] / step) * step - setting.q[:, j]


def scatter(body: Body, setting: Setting, values: Array) -> None:
    """Scatter each joint anew at every visit: the same at any size, another in any campaign."""
    chance = np.random.default_rng(int(setting.time.sum() * 10) % 2**32)
    body.joints += chance.normal(size=body.joints.shape) * np.abs(values[:, 0])
