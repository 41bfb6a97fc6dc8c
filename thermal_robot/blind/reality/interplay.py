"""Causes of two quantities: a known effect whose size changes with a condition, and products. Frozen as the others are.

A condition counts by its deviation from the middle of its range, from −1 to 1. An effect that changes is there at the
middle, too, and larger there than its change, so that a play or a compliance never turns negative: so much of it the
library knows (``also``). In a product neither quantity does anything by itself.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from thermal_robot.blind.reality.fault import Fault, Place, joints, milli, one, part
from thermal_robot.blind.reality.setting import Setting
from thermal_robot.blind.reality.world import Body

Array = NDArray[np.float64]
Quantities = Callable[[Setting, Sequence[Place]], Sequence[str]]

_MIDDLE = (1.0, 1.5)  # of its change: what an effect is at the middle


def deviation(values: Array) -> Array:
    """Return how far values are from the middle of their range, −1 to 1; zeros where they do not vary."""
    low, high = values.min(axis=0), values.max(axis=0)
    return np.asarray((2.0 * values - low - high) / np.where(high > low, high - low, 1.0))


def _at_and_around(size: float) -> Callable[[Setting, np.random.Generator], Array]:
    """Draw one joint's effect at the middle of a condition, and by how much it changes to its ends."""
    drawn = one(part(*_MIDDLE), lambda setting, j, rng: float(rng.choice([-1.0, 1.0])))
    return lambda setting, rng: size * drawn(setting, rng)


def _own_warmth(setting: Setting) -> Array:
    """(N, n) °C of the link that carries each joint, or of the last one before it that has a length."""
    world = setting.world
    columns = []
    for joint in world.joints:
        before = [s for s, k in enumerate(world.segments) if k <= world.chain.index(joint)]
        columns.append(setting.links[:, before[-1] if before else 0])
    return np.column_stack(columns)


def _loaded_play(body: Body, setting: Setting, values: Array) -> None:
    """Lost motion that a payload widens or narrows: it presses the teeth out of mesh, or into it."""
    play = values[:, 0] + values[:, 1] * deviation(setting.payload)[:, None]
    body.joints -= 0.5 * play * setting.approach


def _warm_spring(body: Body, setting: Setting, values: Array) -> None:
    """A joint's spring that softens, or stiffens, as its link warms."""
    compliance = values[:, 0] + values[:, 1] * deviation(_own_warmth(setting))
    body.joints -= compliance * setting.torque


def _warm_gain(body: Body, setting: Setting, values: Array) -> None:
    """A graduation that grows with its link's temperature: a linear scale, a belt."""
    body.joints += (values[:, 0] + values[:, 1] * deviation(_own_warmth(setting))) * setting.q


def _hot_under_load(body: Body, setting: Setting, values: Array) -> None:
    """A gearbox that winds one way when hot and loaded, the other when cold and loaded."""
    heat = deviation(setting.extra["motor_temperature"])
    body.joints += values[:, 0] * (heat * deviation(setting.payload))[:, None]


def _fast_under_load(body: Body, setting: Setting, values: Array) -> None:
    """A loaded axis that has overshot when it came fast."""
    body.joints += values[:, 0] * (deviation(setting.speed) * deviation(setting.payload))[:, None]


def _late_hose(body: Body, setting: Setting, values: Array) -> None:
    """A hose that the joint before bends, and that stiffens in the course of the day."""
    before = np.roll(deviation(setting.q), 1, axis=1)
    body.joints += values[:, 0] * before * deviation(setting.time)[:, None]


def _sinking_floor(body: Body, setting: Setting, values: Array) -> None:
    """A floor that gives way to the payload in the morning, and lifts under it in the evening."""
    lean = deviation(setting.time) * deviation(setting.payload)
    body.move("base", lean[:, None] * values[0, :6])


def _draw_tilt(setting: Setting, rng: np.random.Generator) -> Array:
    return np.concatenate([np.zeros(3), rng.normal(size=2), [0.0]])[None] * 1e-3


def _warmths(setting: Setting) -> list[str]:
    return ["temperature", *(f"temperature.{link}" for link in dict.fromkeys(setting.world.links))]


def _payload(setting: Setting) -> list[str]:
    return ["payload"]


def _products(first: Sequence[str], second: Sequence[str]) -> list[str]:
    """Name products in either order."""
    return [name for a in first for b in second for name in (f"{a} * {b}", f"{b} * {a}")]


def _changing(of: Callable[[str], Sequence[str]], conditions: Callable[[Setting], Sequence[str]]) -> Quantities:
    """Name the condition, or its product with what drives the effect itself."""

    def quantities(setting: Setting, places: Sequence[Place]) -> list[str]:
        known = conditions(setting)
        return [*known, *(name for _, joint in places for name in _products(of(joint), known))]

    return quantities


def _late(setting: Setting, places: Sequence[Place]) -> list[str]:
    names = setting.world.names
    before = [names[names.index(joint) - 1] for _, joint in places]
    return _products(("time", "order"), before)


INTERPLAY = (
    Fault(
        "loaded_play",
        _at_and_around(4e-4),
        _loaded_play,
        joints,
        few=True,
        quantities=_changing(lambda joint: [f"approach.{joint}"], _payload),
        also=(("backlash", (0,)),),
    ),
    Fault(
        "warm_spring",
        _at_and_around(1e-5),
        _warm_spring,
        joints,
        few=True,
        wants=("sensor:links",),
        quantities=_changing(lambda joint: [joint, f"torque.{joint}"], _warmths),
        also=(("joint_compliance", (0,)),),
    ),
    Fault(
        "warm_gain",
        _at_and_around(1e-3),
        _warm_gain,
        joints,
        few=True,
        wants=("sensor:links",),
        quantities=_changing(lambda joint: [joint], _warmths),
        also=(("joint_gain", (0,)),),
    ),
    Fault(
        "hot_under_load",
        one(milli),
        _hot_under_load,
        joints,
        few=True,
        wants=("motor_temperature",),
        quantities=lambda s, places: _products(["motor_temperature"], ["payload"]),
    ),
    Fault(
        "fast_under_load",
        one(milli),
        _fast_under_load,
        joints,
        few=True,
        wants=("speed",),
        quantities=lambda s, places: _products(["speed"], ["payload"]),
    ),
    Fault("late_hose", one(milli), _late_hose, joints, few=True, quantities=_late),
    Fault(
        "sinking_floor",
        _draw_tilt,
        _sinking_floor,
        lambda s: [("base", "base")],
        quantities=lambda s, places: _products(("time", "order"), ["payload"]),
    ),
)
"""Effects that change with a condition, and products of two quantities."""
