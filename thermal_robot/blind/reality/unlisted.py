"""Causes that no library knows, as nasty as life: frozen before anything that looks for them was tuned."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from thermal_robot.blind.reality.fault import (
    FAULTS,
    Fault,
    Place,
    Quantities,
    base,
    clock,
    follows,
    in_joints,
    milli,
    one,
    own_position,
    parents,
    part,
    tool,
    warmths,
    waves,
    within,
)
from thermal_robot.blind.reality.setting import Setting
from thermal_robot.blind.reality.world import Body
from thermal_robot.errors import EffectError

Array = NDArray[np.float64]


SLOW = (1.0, 2.5)
"""Orders a turn: of what comes round hardly more often than the joint, but no whole number of times."""
ELEMENTS = 4
_SLIPS = (0.05, 0.6)  # of a joint's range: how far it goes before an element slips
_LASTS = (0.5, 3.0)  # rows: how long what nobody records stays as it is
_SEEDS = 2**31
_SESSIONS = 3  # at most


def _seed(setting: Setting, j: int, rng: np.random.Generator) -> float:
    return float(rng.integers(_SEEDS))


def _winding(body: Body, setting: Setting, values: Array) -> None:
    """Friction elements in series with springs (Jenkin), side by side: each follows the joint until it slips.

    What they hold depends on where the joint turned round, and not only on its last direction.
    """
    for j in np.flatnonzero(values[:, 0]):
        slips, weights = values[j, 1 : 1 + ELEMENTS] * np.ptp(setting.q[:, j]), values[j, 1 + ELEMENTS :]
        body.joints[:, j] -= values[j, 0] * slipped(setting.q[:, j], setting.before, slips) @ (weights / weights.sum())


def slipped(q: Array, before: NDArray[np.int64], slips: Array) -> Array:
    """(N, E) how far each element is strained, as a share of what makes it slip; 0 at the start.

    Parameters
    ----------
    q
        (N,) where the joint stands.
    before
        (N,) the row that it came from, the first one's own.
    slips
        (E,) how far it goes before an element slips.
    """
    strained = np.zeros((len(q), len(slips)))
    for row, last in enumerate(before):
        if last != row:
            strained[row] = np.clip(strained[last] + q[row] - q[last], -slips, slips)
    return np.asarray(strained / slips)


def _rehomed(body: Body, setting: Setting, values: Array) -> None:
    """A joint that finds another zero at each switching on."""
    assert setting.session is not None  # the fault asks for sessions
    body.joints += values[:, setting.session].T


def _zero(setting: Setting, j: int, rng: np.random.Generator) -> float:
    return float(1e-3 * rng.normal())


def _coolant(body: Body, setting: Setting, values: Array) -> None:
    """A joint whose coolant comes and goes: what it follows is in no column."""
    for j in np.flatnonzero(values[:, 0]):
        body.joints[:, j] += values[j, 0] * wandered(setting, values[j, 1], values[j, 2])


def _crane(body: Body, setting: Setting, values: Array) -> None:
    """A hall that tilts the base as its crane passes: nobody wrote down when."""
    body.move("base", wandered(setting, values[0, 6], values[0, 7])[:, None] * values[0, :6])


def wandered(setting: Setting, lasts: float, seed: float) -> Array:
    """(N,) of size 1: a state that forgets itself within some rows' time, so that no law of time holds it."""
    chance = np.random.default_rng(int(seed)).normal(size=setting.samples)
    row = setting.time[-1] / max(int(setting.given.sum()), 1)
    kept = np.exp(-np.diff(setting.time) / (lasts * row))
    state = np.empty(setting.samples)
    state[0] = chance[0]
    for k, share in enumerate(kept):
        state[k + 1] = share * state[k] + np.sqrt(1.0 - share**2) * chance[k + 1]
    return state


def _draw_crane(setting: Setting, rng: np.random.Generator) -> Array:
    twist = 1e-4 * np.append(rng.normal(size=5), 0.0)
    return np.append(twist, [rng.uniform(*_LASTS), rng.integers(_SEEDS)])[None]


_SESSION = follows("session", "time", "order")
_NOTHING = follows("none")
"""Nothing that was recorded: that is the right answer."""
ELUSIVE = (
    waves("slow_wave", SLOW),
    in_joints(
        "winding",
        one(milli, *[part(*_SLIPS)] * ELEMENTS, *[part(0.3, 1.0)] * ELEMENTS),
        _winding,
        quantities=lambda s, places: [q for _, joint in places for q in (f"since_turn.{joint}", joint)],
        fixed=tuple((column, (1.0,)) for column in range(1, 1 + 2 * ELEMENTS)),
    ),
    in_joints(
        "rehomed",
        one(*[_zero] * _SESSIONS),
        _rehomed,
        wants=("sessions",),
        quantities=_SESSION,
    ),
    in_joints(
        "coolant", one(milli, part(*_LASTS), _seed), _coolant, quantities=_NOTHING, fixed=((1, (1.0,)), (2, (0.0,)))
    ),
    Fault("crane", _draw_crane, _crane, base, quantities=_NOTHING, fixed=((6, (1.0,)), (7, (0.0,)))),
)
"""Free periods, memory, new zeros, and what nobody records."""


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


def _products(first: Sequence[str], second: Sequence[str]) -> list[str]:
    """Name products in either order."""
    return [name for a in first for b in second for name in (f"{a} * {b}", f"{b} * {a}")]


def _changing(of: Callable[[str], Sequence[str]], conditions: Quantities) -> Quantities:
    """Name the condition, or its product with what drives the effect itself."""

    def quantities(setting: Setting, places: Sequence[Place]) -> list[str]:
        known = conditions(setting, places)
        return [*known, *(name for _, joint in places for name in _products(of(joint), known))]

    return quantities


def _late(setting: Setting, places: Sequence[Place]) -> list[str]:
    return _products(("time", "order"), _before(setting, places))


INTERPLAY = (
    in_joints(
        "loaded_play",
        _at_and_around(4e-4),
        _loaded_play,
        quantities=_changing(lambda joint: [f"approach.{joint}"], follows("payload")),
        also=(("backlash", (0,)),),
    ),
    in_joints(
        "warm_spring",
        _at_and_around(1e-5),
        _warm_spring,
        wants=("sensor:links",),
        quantities=_changing(lambda joint: [joint, f"torque.{joint}"], warmths),
        also=(("joint_compliance", (0,)),),
    ),
    in_joints(
        "warm_gain",
        _at_and_around(1e-3),
        _warm_gain,
        wants=("sensor:links",),
        quantities=_changing(lambda joint: [joint], warmths),
        also=(("joint_gain", (0,)),),
    ),
    in_joints(
        "hot_under_load",
        one(milli),
        _hot_under_load,
        wants=("motor_temperature",),
        quantities=follows(*_products(["motor_temperature"], ["payload"])),
    ),
    in_joints(
        "fast_under_load",
        one(milli),
        _fast_under_load,
        wants=("speed",),
        quantities=follows(*_products(["speed"], ["payload"])),
    ),
    in_joints("late_hose", one(milli), _late_hose, quantities=_late),
    Fault(
        "sinking_floor",
        _draw_tilt,
        _sinking_floor,
        base,
        quantities=follows(*_products(("time", "order"), ["payload"])),
    ),
)
"""Effects that change with a condition, and products of two quantities."""


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


def _draw_nest(setting: Setting, rng: np.random.Generator) -> Array:
    return np.array([[1e-4, float(rng.integers(3))]])


def _before(setting: Setting, places: Sequence[Place]) -> list[str]:
    names = setting.world.names
    return [names[names.index(name) - 1] for _, name in places]


def _tilt(setting: Setting, rng: np.random.Generator) -> Array:
    return np.concatenate([np.zeros(3), rng.normal(size=2), [0.2 * rng.normal()]])[None] * 1e-3


_ALL = (
    in_joints("slip", one(milli, part(0.35, 0.65)), _slip, quantities=clock, fixed=((1, (0.5,)),)),
    in_joints("cable_pull", one(milli, within(0.35, 0.75)), _cable, quantities=own_position, fixed=((1, (0.0,)),)),
    in_joints("hose", one(milli, within(0.3, 0.7)), _hose, quantities=_before, fixed=((1, (0.0,)),)),
    in_joints(
        "hot_motor", one(milli), _hot_motor, wants=("motor_temperature",), quantities=follows("motor_temperature")
    ),
    Fault("loose_nest", _draw_nest, _nest, tool, quantities=follows(*GRAVITY), fixed=((1, (0.0,)),)),
    Fault(
        "remounted_target",
        lambda s, rng: rng.normal(size=(4, 3)) * 1e-4,
        _remounted,
        lambda s: tool(s) * 4,
        wants=("sessions",),
        quantities=_SESSION,
    ),
    Fault("yielding_bolt", _draw_bolt, _bolt, parents, few=True, quantities=clock, fixed=((6, (0.5,)),)),
    in_joints(
        "damaged_teeth",
        one(milli, within(0.25, 0.75), part(0.2, 0.4)),
        _tooth,
        quantities=own_position,
        fixed=((1, (0.0,)), (2, (0.3,))),
    ),
    in_joints("speed_droop", one(milli), _droop, wants=("speed",), quantities=follows("speed")),
    Fault("damp_platform", _tilt, _platform, base, wants=("humidity",), quantities=follows("humidity")),
    in_joints(
        "relaxing_joint",
        one(milli, part(0.03, 0.1)),
        _brake,
        wants=("sessions",),
        quantities=follows("time", "order", "session"),
        fixed=((1, (0.05,)),),
    ),
)
UNLISTED: dict[str, Fault] = {fault.name: fault for fault in (*_ALL, *INTERPLAY, *ELUSIVE)}
"""Eleven kinds of one quantity at one place, those that interplay and those that elude, by name."""


def load(where: str) -> Fault:
    """Load a :class:`Fault` that a Python file defines.

    Parameters
    ----------
    where
        ``file.py:NAME``: the file, and the name of the fault, or of something that returns it when called.

    Raises
    ------
    EffectError
        If there is no such file or name, or if it is no fault.
    """
    file, _, name = where.rpartition(":")
    path = Path(file)
    if not path.is_file():
        raise EffectError(f"fault {where!r}: there is no file {file!r}; expected file.py:NAME")
    spec = importlib.util.spec_from_file_location(f"fault_of_{path.stem}", path)
    if spec is None or spec.loader is None:
        raise EffectError(f"fault {where!r}: {file!r} is not a Python file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    try:
        spec.loader.exec_module(module)
        found = getattr(module, name)
        fault = found() if callable(found) and not isinstance(found, Fault) else found
    except Exception as error:
        raise EffectError(f"fault {where!r}: {type(error).__name__}: {error}") from error
    if not isinstance(fault, Fault):
        raise EffectError(f"fault {where!r} is a {type(fault).__name__}, not a Fault")
    return fault


def known(name: str, own: str = "") -> Fault:
    """Return a fault by name: the user's own where one is given, else one of the trial's."""
    return load(own) if own else {**FAULTS, **UNLISTED}[name]
