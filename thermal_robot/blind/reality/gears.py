"""What goes wrong in a joint: its zero, encoder, gears, springs, friction and servo."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from thermal_robot.blind.reality.fault import some
from thermal_robot.blind.reality.setting import Setting
from thermal_robot.blind.reality.world import Body

Array = NDArray[np.float64]


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
        read = np.arctan2(np.sin(angle) - across, np.cos(angle) - along)
        body.joints[:, j] += np.angle(np.exp(1j * (read - angle)))
        body.joints[:, j] += np.arctan2(oval * np.sin(2 * (angle + phase)), 1.0 + oval * np.cos(2 * (angle + phase)))


def draw_wheels(setting: Setting, rng: np.random.Generator) -> Array:
    """Draw how far discs are off, across and along, how oval wheels are, their phase (rad) and ratio.

    A joint that slides has no disc of its own, only its motor has: its ratio is in rad/m.
    """
    ratio = float(rng.choice([51.0, 80.0, 101.0])) if rng.random() < 0.2 else 1.0
    values = some(1e-3, 5, last=False, turning=ratio == 1.0)(setting, rng)
    values[:, 2] *= rng.choice([0.0, 0.6])
    values[:, 3] = rng.uniform(0, np.pi)
    values[:, 4] = ratio
    return values


def play(body: Body, setting: Setting, values: Array) -> None:
    """Lay teeth against the side that pushed last, unless gravity outweighs friction, on its own."""
    heaviest = np.abs(setting.torque).max()
    for j, (half, friction) in enumerate(values):
        load = setting.torque[:, j]
        hangs = friction > 0 and np.abs(load).max() > 0.02 * heaviest
        heavy = np.abs(load) > friction * np.abs(load).max() if hangs else np.zeros(len(load), bool)
        # friction stops a joint short of where it was sent: behind, on the way it came; a weight lets it hang down
        body.joints[:, j] -= abs(half) * np.where(heavy, np.sign(load), setting.approach[:, j])


def draw_play(setting: Setting, rng: np.random.Generator) -> Array:
    """Draw half of each play, rad or m, and what holds it against gravity."""
    values = some(2e-4, 2, last=False, positive=True)(setting, rng)
    values[:, 1] = rng.choice([0.0, 0.0, rng.uniform(0.5, 0.9)]) if setting.torque.any() else 0.0
    return values


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
    """Follow the command with a delay, dragged by dry friction: q(t − T) and a step against the way."""
    delay, friction = values[:, 0], values[:, 1]
    body.joints += -setting.velocity * delay + 0.5 * setting.acceleration * delay**2 - friction * setting.approach


def draw_servo(setting: Setting, rng: np.random.Generator) -> Array:
    """Draw each joint's delay, s, and what friction leaves, rad or m."""
    values = np.abs(some(1.0, 2, last=False)(setting, rng))
    return np.asarray(values * np.array([1e-3, 1e-4]))


def ticks(body: Body, setting: Setting, values: Array) -> None:
    """Count in steps: the joint stands at the nearest one."""
    for j, (step,) in enumerate(np.abs(values)):
        if step:
            body.joints[:, j] += np.round(setting.q[:, j] / step) * step - setting.q[:, j]


def scatter(body: Body, setting: Setting, values: Array) -> None:
    """Scatter each joint anew at every visit: the same at any size, another in any campaign."""
    chance = np.random.default_rng(int(setting.time.sum() * 10) % 2**32)
    body.joints += chance.normal(size=body.joints.shape) * np.abs(values[:, 0])
