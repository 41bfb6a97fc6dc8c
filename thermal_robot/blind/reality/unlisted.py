"""Causes that no library knows, as nasty as life: frozen before anything that looks for them was tuned."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from thermal_robot.blind.reality.elusive import ELUSIVE
from thermal_robot.blind.reality.fault import Fault, Place, clock, joints, milli, one, own_position, part, within
from thermal_robot.blind.reality.interplay import INTERPLAY
from thermal_robot.blind.reality.setting import Setting
from thermal_robot.blind.reality.world import Body

Array = NDArray[np.float64]

GRAVITY = ("gravity.x", "gravity.y", "gravity.z")
"""Gravity's direction in the tool frame: a quantity that nobody records and anybody can compute."""


def _slip(body: Body, setting: Setting, values: Array) -> None:
    """A toothed belt jumps: from one moment on the joint is elsewhere."""
    late = setting.time[:, None] > values[:, 1] * setting.time[-1]
    body.joints += values[:, 0] * late


def _cable(body: Body, setting: Setting, values: Array) -> None:
    """A cable comes taut where the joint has turned far enough, and pulls it back the more the farther it goes."""
    body.joints -= values[:, 0] * np.maximum(setting.q - values[:, 1], 0.0)


def _hose(body: Body, setting: Setting, values: Array) -> None:
    """A hose along the arm: the joint before bends it, and it pushes this one."""
    before = np.roll(setting.q, 1, axis=1)
    body.joints += values[:, 0] * (before - values[:, 1]) ** 2


def _hot_motor(body: Body, setting: Setting, values: Array) -> None:
    """A gearbox that stiffens and leans when its motor is hot: grows with the square of what a column records."""
    heat = setting.extra["motor_temperature"] - 20.0
    body.joints += values[:, 0] * ((heat / 25.0) ** 2)[:, None]


def _nest(body: Body, setting: Setting, values: Array) -> None:
    """A magnetic nest with play: the target falls to the side where gravity pulls it, along one axis only."""
    axis = int(values[0, 1])
    down = -setting.poses[:, 2, axis]
    twist = np.zeros((setting.samples, 6))
    twist[:, axis] = values[0, 0] * np.tanh(down / 0.15)
    body.move("tool", twist)


def _remounted(body: Body, setting: Setting, values: Array) -> None:
    """The target is taken off between two sessions, and does not come back to where it was."""
    assert setting.session is not None  # the fault asks for sessions
    twist = np.zeros((setting.samples, 6))
    twist[:, :3] = values[setting.session, :3]
    body.move("tool", twist)


def _bolt(body: Body, setting: Setting, values: Array) -> None:
    """A bolt gives way: from one moment on a link's far end is tilted against it."""
    late = setting.time > values[:, 6].max() * setting.time[-1]
    body.placements = body.placements + late[:, None, None] * values[None, :, :6]


def _draw_bolt(setting: Setting, rng: np.random.Generator) -> Array:
    movable = [k for k, j in enumerate(setting.world.chain) if j.movable][1:-1]
    values = np.zeros((len(setting.world.chain), 7))
    k = int(rng.choice(movable))
    joint = setting.world.chain[k]
    across = np.cross(joint.axis, rng.normal(size=3))  # about the joint's own axis it would be a slip
    values[k, 3:6] = 1e-3 * across / np.linalg.norm(across)
    values[k, 6] = rng.uniform(0.35, 0.65)
    return values


def _tooth(body: Body, setting: Setting, values: Array) -> None:
    """A damaged stretch of a gear: off only while the joint stands there."""
    body.joints += values[:, 0] * np.exp(-0.5 * ((setting.q - values[:, 1]) / np.maximum(values[:, 2], 1e-3)) ** 2)


def _droop(body: Body, setting: Setting, values: Array) -> None:
    """An axis that has not settled when it came fast: the error grows with the square of the commanded speed."""
    body.joints += values[:, 0] * (setting.speed**2)[:, None]


def _platform(body: Body, setting: Setting, values: Array) -> None:
    """A wooden platform that swells with the air's humidity and tilts the base."""
    damp = (setting.extra["humidity"] - setting.extra["humidity"][0]) / 10.0
    body.move("base", damp[:, None] * values[0, :6])


def _brake(body: Body, setting: Setting, values: Array) -> None:
    """A joint that creeps back to its place after each switching on: it depends on how long it has been running."""
    assert setting.session is not None
    first = np.array([setting.time[setting.session == s][0] for s in range(setting.session.max() + 1)])
    run = setting.time - first[setting.session]
    body.joints += values[:, 0] * np.exp(-run / (values[:, 1].max() * setting.time[-1]))[:, None]


def _base(setting: Setting) -> list[Place]:
    return [("base", "base")]


def _tool(setting: Setting) -> list[Place]:
    return [("tool", "tool")]


def _before(setting: Setting, places: Sequence[Place]) -> list[str]:
    names = setting.world.names
    return [names[names.index(name) - 1] for _, name in places]


def _tilt(setting: Setting, rng: np.random.Generator) -> Array:
    return np.concatenate([np.zeros(3), rng.normal(size=2), [0.2 * rng.normal()]])[None] * 1e-3


UNLISTED: dict[str, Fault] = {
    fault.name: fault
    for fault in (
        Fault("slip", one(milli, part(0.35, 0.65)), _slip, joints, few=True, quantities=clock, fixed=((1, (0.5,)),)),
        Fault(
            "cable_pull",
            one(milli, within(0.35, 0.75)),
            _cable,
            joints,
            few=True,
            quantities=own_position,
            fixed=((1, (0.0,)),),
        ),
        Fault("hose", one(milli, within(0.3, 0.7)), _hose, joints, few=True, quantities=_before, fixed=((1, (0.0,)),)),
        Fault(
            "hot_motor",
            one(milli),
            _hot_motor,
            joints,
            few=True,
            wants=("motor_temperature",),
            quantities=lambda s, places: ["motor_temperature"],
        ),
        Fault(
            "loose_nest",
            lambda s, rng: np.array([[1e-4, float(rng.integers(3))]]),
            _nest,
            _tool,
            quantities=lambda s, places: GRAVITY,
            fixed=((1, (0.0,)),),
        ),
        Fault(
            "remounted_target",
            lambda s, rng: rng.normal(size=(4, 3)) * 1e-4,
            _remounted,
            lambda s: [("tool", "tool")] * 4,
            wants=("sessions",),
            quantities=lambda s, places: ["session", "time", "order"],
        ),
        Fault(
            "yielding_bolt",
            _draw_bolt,
            _bolt,
            lambda s: [("link", j.parent) for j in s.world.chain],
            few=True,
            quantities=clock,
            fixed=((6, (0.5,)),),
        ),
        Fault(
            "damaged_teeth",
            one(milli, within(0.25, 0.75), part(0.2, 0.4)),
            _tooth,
            joints,
            few=True,
            quantities=own_position,
            fixed=((1, (0.0,)), (2, (0.3,))),
        ),
        Fault(
            "speed_droop",
            one(milli),
            _droop,
            joints,
            few=True,
            wants=("speed",),
            quantities=lambda s, places: ["speed"],
        ),
        Fault(
            "damp_platform",
            _tilt,
            _platform,
            _base,
            wants=("humidity",),
            quantities=lambda s, places: ["humidity"],
        ),
        Fault(
            "relaxing_joint",
            one(milli, part(0.03, 0.1)),
            _brake,
            joints,
            few=True,
            wants=("sessions",),
            quantities=lambda s, places: ["time", "order", "session"],
            fixed=((1, (0.05,)),),
        ),
        *INTERPLAY,
        *ELUSIVE,
    )
}
"""Eleven kinds of one quantity at one place, and those of the two other modules, by name."""
