"""Faults outside the library, fixed before the search for unlisted causes was tuned."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from thermal_robot.blind.reality.fault import (
    FAULTS,
    Draw,
    Fault,
    Place,
    Quantities,
    adds,
    at,
    clock,
    follows,
    in_joints,
    milli,
    one,
    own_position,
    parents,
    part,
    warmths,
    waves,
    within,
)
from thermal_robot.blind.reality.setting import Setting
from thermal_robot.blind.reality.world import Array
from thermal_robot.errors import EffectError

SLOW = (1.0, 2.5)
"""Orders a turn: of what comes round hardly more often than the joint, but no whole number of times."""
ELEMENTS = 4
_SLIPS = (0.05, 0.6)  # of a joint's range: how far it goes before an element slips
_LASTS = (0.5, 3.0)  # rows: how long what nobody records stays as it is
_SEEDS = 2**31
_SESSIONS = 3  # at most
_MIDDLE = (1.0, 1.5)  # of its change: what an effect is at the middle
GRAVITY = ("gravity.x", "gravity.y", "gravity.z")
"""Gravity's direction in the tool frame: a quantity that nobody records and anybody can compute."""
_SESSION = follows("session", "time", "order")
_NOTHING = follows("none")
"""Nothing that was recorded: that is the right answer."""


def _before(setting: Setting, places: Sequence[Place]) -> list[str]:
    names = setting.world.names
    return [names[names.index(name) - 1] for _, name in places]


def _products(first: Sequence[str], second: Sequence[str]) -> list[str]:
    return [name for a in first for b in second for name in (f"{a} * {b}", f"{b} * {a}")]


def _changing(of: Callable[[str], Sequence[str]], conditions: Quantities) -> Quantities:
    """Right quantities of an effect that a condition modulates: the condition, or that times the effect's driver."""

    def quantities(setting: Setting, places: Sequence[Place]) -> list[str]:
        known = conditions(setting, places)
        return [*known, *(name for _, joint in places for name in _products(of(joint), known))]

    return quantities


def _running(setting: Setting) -> Array:
    """Time (N,), s, since the first row of the same session."""
    assert setting.session is not None  # the fault asks for sessions
    first = np.array([setting.time[setting.session == s][0] for s in range(setting.session.max() + 1)])
    return np.asarray(setting.time - first[setting.session])


def _nest(setting: Setting, values: Array) -> Array:
    """Twist (N, 6) of a target in a magnetic nest with play: a shift along one axis to the side that gravity takes."""
    axis = int(values[0, 1])
    twist = np.zeros((setting.samples, 6))
    twist[:, axis] = values[0, 0] * np.tanh(-setting.poses[:, 2, axis] / 0.15)
    return twist


def _remounted(setting: Setting, values: Array) -> Array:
    """Twist (N, 6) of a target that is mounted anew, with another shift, in each session."""
    return np.pad(values, ((0, 0), (0, 3)))[setting.session]


def _bolt(setting: Setting, values: Array) -> Array:
    """Loose bolt: from one moment on the placements (N, S', 6) of the chain's joints are displaced by constants."""
    late = setting.time > values[:, 6].max() * setting.time[-1]
    return np.asarray(late[:, None, None] * values[None, :, :6])


def _draw_bolt(setting: Setting, rng: np.random.Generator) -> Array:
    movable = [k for k, j in enumerate(setting.world.chain) if j.movable][1:-1]
    values = np.zeros((len(setting.world.chain), 7))
    k = int(rng.choice(movable))
    across = np.cross(setting.world.chain[k].axis, rng.normal(size=3))  # about the joint's own axis it would be a slip
    values[k, 3:6] = 1e-3 * across / np.linalg.norm(across)
    values[k, 6] = rng.uniform(0.35, 0.65)
    return values


def _tilt(turned: float = 0.0) -> Draw:
    """Draw a rotation of the base: about 1 mrad about x and y, and ``turned`` times as much about the vertical."""

    def draw(setting: Setting, rng: np.random.Generator) -> Array:
        about = rng.normal(size=2), [turned * rng.normal() if turned else 0.0]
        return np.concatenate([np.zeros(3), *about])[None] * 1e-3

    return draw


_ALONE = (
    # a toothed belt jumps: from one moment on the joint is elsewhere
    in_joints(
        "slip",
        one(milli, part(0.35, 0.65)),
        lambda s, v: v[:, 0] * (s.time[:, None] > v[:, 1] * s.time[-1]),
        quantities=clock,
        fixed=((1, (0.5,)),),
    ),
    # a cable comes taut where the joint has turned far enough, and pulls it back the more the farther it goes
    in_joints(
        "cable_pull",
        one(milli, within(0.35, 0.75)),
        lambda s, v: -v[:, 0] * np.maximum(s.q - v[:, 1], 0.0),
        quantities=own_position,
        fixed=((1, (0.0,)),),
    ),
    # a hose along the arm: the joint before bends it, and it pushes this one
    in_joints(
        "hose",
        one(milli, within(0.3, 0.7)),
        lambda s, v: v[:, 0] * (np.roll(s.q, 1, axis=1) - v[:, 1]) ** 2,
        quantities=_before,
        fixed=((1, (0.0,)),),
    ),
    # a gearbox that stiffens and leans when its motor is hot: grows with the square of what a column records
    in_joints(
        "hot_motor",
        one(milli),
        lambda s, v: v[:, 0] * (((s.extra["motor_temperature"] - 20.0) / 25.0) ** 2)[:, None],
        wants=("motor_temperature",),
        quantities=follows("motor_temperature"),
    ),
    at(
        "tool",
        "loose_nest",
        lambda s, rng: np.array([[1e-4, float(rng.integers(3))]]),
        _nest,
        quantities=follows(*GRAVITY),
        fixed=((1, (0.0,)),),
    ),
    at(
        "tool",
        "remounted_target",
        lambda s, rng: rng.normal(size=(4, 3)) * 1e-4,
        _remounted,
        places=lambda s: [("tool", "tool")] * 4,
        wants=("sessions",),
        quantities=_SESSION,
    ),
    adds("placements", "yielding_bolt", _draw_bolt, _bolt, parents, few=True, quantities=clock, fixed=((6, (0.5,)),)),
    # a damaged stretch of a gear: off only while the joint stands there
    in_joints(
        "damaged_teeth",
        one(milli, within(0.25, 0.75), part(0.2, 0.4)),
        lambda s, v: v[:, 0] * np.exp(-0.5 * ((s.q - v[:, 1]) / np.maximum(v[:, 2], 1e-3)) ** 2),
        quantities=own_position,
        fixed=((1, (0.0,)), (2, (0.3,))),
    ),
    # an axis that has not settled when it came fast: the error grows with the square of the commanded speed
    in_joints(
        "speed_droop",
        one(milli),
        lambda s, v: v[:, 0] * (s.speed**2)[:, None],
        wants=("speed",),
        quantities=follows("speed"),
    ),
    # a wooden platform that swells with the air's humidity and tilts the base
    at(
        "base",
        "damp_platform",
        _tilt(0.2),
        lambda s, v: ((s.extra["humidity"] - s.extra["humidity"][0]) / 10.0)[:, None] * v[0, :6],
        wants=("humidity",),
        quantities=follows("humidity"),
    ),
    # a joint that creeps back to its place after each switching on: it depends on how long it has been running
    in_joints(
        "relaxing_joint",
        one(milli, part(0.03, 0.1)),
        lambda s, v: v[:, 0] * np.exp(-_running(s) / (v[:, 1].max() * s.time[-1]))[:, None],
        wants=("sessions",),
        quantities=follows("time", "order", "session"),
        fixed=((1, (0.05,)),),
    ),
)
"""One quantity at one place."""


def deviation(values: Array) -> Array:
    """Min-max scaling along the first axis to −1 to 1; zeros where values do not vary."""
    low, high = values.min(axis=0), values.max(axis=0)
    return np.asarray((2.0 * values - low - high) / np.where(high > low, high - low, 1.0))


def _at_and_around(size: float) -> Draw:
    """Draw one joint's size at mid-range of a condition, 1 to 1.5 × ``size``, and its change to an end, ± ``size``."""
    drawn = one(part(*_MIDDLE), lambda setting, j, rng: float(rng.choice([-1.0, 1.0])))
    return lambda setting, rng: size * drawn(setting, rng)


def _own_warmth(setting: Setting) -> Array:
    """Temperature (N, n) °C of the link before each joint, or of the last one before with a length."""
    world = setting.world
    columns = []
    for joint in world.joints:
        before = [s for s, k in enumerate(world.segments) if k <= world.chain.index(joint)]
        columns.append(setting.links[:, before[-1] if before else 0])
    return np.column_stack(columns)


def _product(first: Array, second: Array) -> Array:
    """Product (N, 1) of two conditions, each scaled to −1 to 1 over its range."""
    return np.asarray((deviation(first) * deviation(second))[:, None])


INTERPLAY = (
    # lost motion that a payload widens or narrows: it presses the teeth out of mesh, or into it
    in_joints(
        "loaded_play",
        _at_and_around(4e-4),
        lambda s, v: -0.5 * (v[:, 0] + v[:, 1] * deviation(s.payload)[:, None]) * s.approach,
        quantities=_changing(lambda joint: [f"approach.{joint}"], follows("payload")),
        also=(("backlash", (0,)),),
    ),
    # a joint's spring that softens, or stiffens, as its link warms
    in_joints(
        "warm_spring",
        _at_and_around(1e-5),
        lambda s, v: -(v[:, 0] + v[:, 1] * deviation(_own_warmth(s))) * s.torque,
        wants=("sensor:links",),
        quantities=_changing(lambda joint: [joint, f"torque.{joint}"], warmths),
        also=(("joint_compliance", (0,)),),
    ),
    # a graduation that grows with its link's temperature: a linear scale, a belt
    in_joints(
        "warm_gain",
        _at_and_around(1e-3),
        lambda s, v: (v[:, 0] + v[:, 1] * deviation(_own_warmth(s))) * s.q,
        wants=("sensor:links",),
        quantities=_changing(lambda joint: [joint], warmths),
        also=(("joint_gain", (0,)),),
    ),
    # a gearbox that winds one way when hot and loaded, the other when cold and loaded
    in_joints(
        "hot_under_load",
        one(milli),
        lambda s, v: v[:, 0] * _product(s.extra["motor_temperature"], s.payload),
        wants=("motor_temperature",),
        quantities=follows(*_products(["motor_temperature"], ["payload"])),
    ),
    # a loaded axis that has overshot when it came fast
    in_joints(
        "fast_under_load",
        one(milli),
        lambda s, v: v[:, 0] * _product(s.speed, s.payload),
        wants=("speed",),
        quantities=follows(*_products(["speed"], ["payload"])),
    ),
    # a hose that the joint before bends, and that stiffens in the course of the day
    in_joints(
        "late_hose",
        one(milli),
        lambda s, v: v[:, 0] * np.roll(deviation(s.q), 1, axis=1) * deviation(s.time)[:, None],
        quantities=lambda s, places: _products(("time", "order"), _before(s, places)),
    ),
    # a floor that gives way to the payload in the morning, and lifts under it in the evening
    at(
        "base",
        "sinking_floor",
        _tilt(),
        lambda s, v: _product(s.time, s.payload) * v[0, :6],
        quantities=follows(*_products(("time", "order"), ["payload"])),
    ),
)
"""Effects that change with a condition, and products of two quantities."""


def _jenkin_elements(setting: Setting, values: Array) -> Array:
    """Hysteresis error (N, n) of joints by parallel Jenkin elements (friction in series with springs).

    Each follows the joint until it slips: their strain depends on where the joint turned round, too.
    """
    moved = np.zeros_like(setting.q)
    for j in np.flatnonzero(values[:, 0]):
        slips, weights = values[j, 1 : 1 + ELEMENTS] * np.ptp(setting.q[:, j]), values[j, 1 + ELEMENTS :]
        strained = values[j, 0] * slipped(setting.q[:, j], setting.before, slips)
        moved[:, j] = -(strained @ (weights / weights.sum()))
    return moved


def slipped(q: Array, before: NDArray[np.int64], slips: Array) -> Array:
    """Strain (N, E) of each Jenkin element over its slip limit; 0 at the start.

    ``q`` (N,) positions of the joint; ``before`` the row that each came from, the first one's own; ``slips`` (E,) how
    far the joint goes before an element slips.
    """
    strained = np.zeros((len(q), len(slips)))
    for row, last in enumerate(before):
        if last != row:
            strained[row] = np.clip(strained[last] + q[row] - q[last], -slips, slips)
    return np.asarray(strained / slips)


def wandered(setting: Setting, lasts: float, seed: float) -> Array:
    """Ornstein-Uhlenbeck process (N,) of unit variance; correlation time: ``lasts`` × the mean time per given row."""
    chance = np.random.default_rng(int(seed)).normal(size=setting.samples)
    row = setting.time[-1] / max(int(setting.given.sum()), 1)
    kept = np.exp(-np.diff(setting.time) / (lasts * row))
    state = np.empty(setting.samples)
    state[0] = chance[0]
    for k, share in enumerate(kept):
        state[k + 1] = share * state[k] + np.sqrt(1.0 - share**2) * chance[k + 1]
    return state


def _coolant(setting: Setting, values: Array) -> Array:
    """Error (N, n) of joints with intermittent cooling: an Ornstein-Uhlenbeck process that no column records."""
    moved = np.zeros_like(setting.q)
    for j in np.flatnonzero(values[:, 0]):
        moved[:, j] = values[j, 0] * wandered(setting, values[j, 1], values[j, 2])
    return moved


def _draw_crane(setting: Setting, rng: np.random.Generator) -> Array:
    twist = 1e-4 * np.append(rng.normal(size=5), 0.0)
    return np.append(twist, [rng.uniform(*_LASTS), rng.integers(_SEEDS)])[None]


ELUSIVE = (
    waves("slow_wave", SLOW),
    in_joints(
        "winding",
        one(milli, *[part(*_SLIPS)] * ELEMENTS, *[part(0.3, 1.0)] * ELEMENTS),
        _jenkin_elements,
        quantities=lambda s, places: [q for _, joint in places for q in (f"since_turn.{joint}", joint)],
        fixed=tuple((column, (1.0,)) for column in range(1, 1 + 2 * ELEMENTS)),
    ),
    # a joint that finds another zero at each switching on
    in_joints(
        "rehomed",
        one(*[lambda s, j, rng: float(1e-3 * rng.normal())] * _SESSIONS),
        lambda s, v: v[:, s.session].T,
        wants=("sessions",),
        quantities=_SESSION,
    ),
    in_joints(
        "coolant",
        one(milli, part(*_LASTS), lambda s, j, rng: float(rng.integers(_SEEDS))),
        _coolant,
        quantities=_NOTHING,
        fixed=((1, (1.0,)), (2, (0.0,))),
    ),
    # a hall that tilts the base as its crane passes: nobody wrote down when
    at(
        "base",
        "crane",
        _draw_crane,
        lambda s, v: wandered(s, v[0, 6], v[0, 7])[:, None] * v[0, :6],
        quantities=_NOTHING,
        fixed=((6, (1.0,)), (7, (0.0,))),
    ),
)
"""Faults of free periods, memory, new zeros, and unrecorded quantities."""

UNLISTED: dict[str, Fault] = {fault.name: fault for fault in (*_ALONE, *INTERPLAY, *ELUSIVE)}
"""Eleven kinds of one quantity at one place, those that interplay and those that elude, by name."""


def load(where: str) -> Fault:
    """Load a :class:`Fault` from a Python file, ``file.py:NAME``, or from a function that returns one.

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
    """Fault by name: the user's own, else one of the trial's."""
    return load(own) if own else {**FAULTS, **UNLISTED}[name]
