"""Faults of the trial: size distribution, displacement, and right answers in the words of formats.md."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from thermal_robot.blind.reality.setting import Setting
from thermal_robot.blind.reality.world import Array, Body

Place = tuple[str, str]
Draw = Callable[[Setting, np.random.Generator], Array]
Does = Callable[[Setting, Array], Array]
"""Displacement of each row by a fault, from (setting, values)."""
Quantities = Callable[[Setting, Sequence[Place]], Sequence[str]]
Known = Callable[[Setting, Array], Mapping[str, float]]


@dataclass(frozen=True)
class Fault:
    """Model of one kind of fault: draw of its sizes, action on the robot, and right answers.

    Attributes
    ----------
    name
        As in formats.md, or a name of its own.
    draw
        (setting, rng) → (P, D) values in each of P places, D numbers each, in no particular scale: the trial scales
        them.
    act
        (body, setting, values) applies the fault to the body, in place.
    places
        (setting) → the P places.
    few
        Whether it sits in few places, so that the diagnosis is asked which.
    wants
        What the campaign must be like: ``moving``, ``repeats``, ``sessions``, ``sensor:links``, ``base_known`` ...
    quantities
        (setting, places) → names of columns, each a right answer to the question which quantity the fault follows.
    random
        Whether it scatters anew at every visit.
    also
        Names of other effects that are part of it by definition, each with the columns of the values that belong to it.
    known_as
        (setting, values) → true parameters by the names that the diagnosis has for them, in its units and with its
        signs, where formats.md leaves no doubt what is meant.
    fixed
        Columns of the values that are no size (a phase, a time constant), each with the settings that span it.
    """

    name: str
    draw: Draw
    act: Callable[[Body, Setting, Array], None]
    places: Callable[[Setting], Sequence[Place]]
    few: bool = False
    wants: tuple[str, ...] = ()
    quantities: Quantities = lambda setting, places: ()
    random: bool = False
    known_as: Known = lambda setting, values: {}
    also: tuple[tuple[str, tuple[int, ...]], ...] = ()
    fixed: tuple[tuple[int, tuple[float, ...]], ...] = ()

    def scaled(self, values: Array, factor: float) -> Array:
        """Copy of the fault's values (P, D) times a factor, but for the :attr:`fixed` columns, which are no sizes."""
        result = values * factor
        for column, _ in self.fixed:
            result[:, column] = values[:, column]
        return result


def joints(setting: Setting) -> list[Place]:
    """Places of a fault: every commanded joint of the chain."""
    return [("joint", name) for name in setting.world.names]


def segments(setting: Setting) -> list[Place]:
    """Places of a fault: the link of every segment."""
    return [("link", link) for link in setting.world.links]


def parents(setting: Setting) -> list[Place]:
    """Places of a fault: the parent link of each joint of the chain, fixed ones too."""
    return [("link", joint.parent) for joint in setting.world.chain]


def adds(
    to: str, name: str, draw: Draw, what: Does, places: Callable[[Setting], Sequence[Place]], **more: Any
) -> Fault:
    """Fault that adds ``what(setting, values)`` to the attribute ``to`` of a :class:`~.world.Body`."""

    def act(body: Body, setting: Setting, values: Array) -> None:
        setattr(body, to, getattr(body, to) + what(setting, values))

    return Fault(name, draw, act, places, **more)


def in_joints(name: str, draw: Draw, err: Does, **more: Any) -> Fault:
    """Fault of few joints: ``err(setting, values)`` adds to their positions, (N, n) or broadcastable, rad or m."""
    return adds("joints", name, draw, err, joints, few=True, **more)


def at(where: str, name: str, draw: Draw, twist: Does, **more: Any) -> Fault:
    """Fault of the ``base`` or the ``tool`` by twists (N, 6) or (1, 6): translations (m) and rotation vectors."""

    def act(body: Body, setting: Setting, values: Array) -> None:
        body.move(where, twist(setting, values))

    return Fault(name, draw, act, **{"places": lambda setting: [(where, where)], **more})


def own_position(setting: Setting, places: Sequence[Place]) -> list[str]:
    """Right quantities of a fault that follows its own joint's position: the columns of the joints at fault."""
    return [name for _, name in places]


def follows(*columns: str) -> Quantities:
    """Right quantities that are the same in every place: these columns."""
    return lambda setting, places: columns


clock = follows("time", "order")
"""Time and the order of rows, which are one."""


def weights(setting: Setting, places: Sequence[Place]) -> list[str]:
    """Right quantities of a fault that follows moments of gravity: payload, and all joint positions."""
    return ["payload", *setting.world.names]


def warmths(setting: Setting, places: Sequence[Place]) -> list[str]:
    """Right quantities of a thermal fault: the columns of all temperatures that may be recorded of a robot."""
    return ["temperature", *(f"temperature.{link}" for link in dict.fromkeys(setting.world.links))]


def each_joint(label: str, of: Callable[[Array], Array] = lambda values: np.abs(values[:, 0])) -> Known:
    """True parameters ``label, joint``, one a joint: ``of`` the values (n, D), by default the size's absolute value."""
    return lambda setting, values: {
        f"{label}, {name}": float(value) for name, value in zip(setting.world.names, of(values), strict=True)
    }


def twist(where: str) -> Known:
    """True parameters of the base or tool frame: the first row of the values, translation (m), then rotation (rad)."""
    names = [f"{kind} {axis}, {where}" for kind in ("translation", "rotation") for axis in "xyz"]
    return lambda setting, values: dict(zip(names, values[0].tolist(), strict=True))


def some(size: float, numbers: int = 1, *, first: bool = True, positive: bool = False, turning: bool = False) -> Draw:
    """Draw normal values of one to three joints, never the last, nor the first unless ``first``; zeros for the others.

    ``size`` is their standard deviation, and added to the magnitude in one joint; ``turning`` leaves out sliding ones.
    """

    def draw(setting: Setting, rng: np.random.Generator) -> Array:
        n = setting.world.n
        allowed = np.arange(0 if first else 1, n - 1)
        if turning:
            allowed = allowed[~setting.world.slides[allowed]]
        values = np.zeros((n, numbers))
        if not len(allowed):
            return values
        chosen = rng.choice(allowed, min(int(rng.integers(1, 4)), len(allowed)), replace=False)
        values[chosen] = size * rng.normal(size=(len(chosen), numbers))
        values[chosen[0]] += size * np.sign(values[chosen[0]])  # one of them is a real fault, not a draw near zero
        return np.abs(values) if positive else values

    return draw


Number = Callable[[Setting, int, np.random.Generator], float]
"""Draws a number for a joint, by its index."""


def one(*numbers: Number) -> Draw:
    """Draw one joint, neither the first nor the last, and a value by each of ``numbers``; zeros for other joints."""

    def draw(setting: Setting, rng: np.random.Generator) -> Array:
        values = np.zeros((setting.world.n, len(numbers)))
        j = int(rng.integers(1, setting.world.n - 1))
        values[j] = [number(setting, j, rng) for number in numbers]
        return values

    return draw


def milli(setting: Setting, j: int, rng: np.random.Generator) -> float:
    """Draw 10⁻³ with a random sign."""
    return float(rng.choice([-1e-3, 1e-3]))


def part(low: float, high: float) -> Number:
    """Draw a uniform number between two."""
    return lambda setting, j, rng: float(rng.uniform(low, high))


def within(low: float, high: float) -> Number:
    """Draw a joint position between two quantiles of its positions."""
    return lambda setting, j, rng: float(np.quantile(setting.q[:, j], rng.uniform(low, high)))


def waves(name: str, orders: tuple[float, float]) -> Fault:
    """Fault of one joint by a sine wave of its own position, of a log-uniform order (waves a turn) between two bounds.

    Teeth, balls or a motor's wheel come round; of a joint that slides the order is in rad/m.
    """

    def ripple(setting: Setting, values: Array) -> Array:
        size, order, phase = values.T
        return np.asarray(size * np.sin(order * setting.q + phase))

    def order(setting: Setting, j: int, rng: np.random.Generator) -> float:
        return float(np.exp(rng.uniform(*np.log(orders))))

    draw, fixed = one(milli, order, part(0.0, 2 * np.pi)), ((1, (1.0,)), (2, (0.0,)))
    return in_joints(name, draw, ripple, quantities=own_position, fixed=fixed)


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
"""Position error, rad (m), of a loop without integral part by dry friction, 1 to 10 N·m against 5e4 N·m/rad."""
STEEL = 12e-6  # 1/K
_SETTLES = (600.0, 72000.0)
"""s, evenly over the logarithm. Fastest: ρ c d / h of a steel tube of 2 mm in still air, 3.6e6 · 0.002 / 12. Between:
a laser tracker is stable two hours after it was switched on (Pollack Periodica 15 (3), 2020), three times 40 minutes.
Slowest: 4 d² / (π² κ) of a concrete floor that is warm on one side, 0.35 m thick and with κ of 7e-7 m²/s."""
_SPRINGS = (0.4, 1.6)  # of one another: what stands on a plate is up to four times as stiff about one axis; ours
_DEPTHS = (0.0, 1.0)  # m: from the flange down to the floor under a pedestal
_TEETH = (5.0, 200.0)  # a turn: of gear stages, teeth, balls and motors whose ratio nobody states
_HOLDS = 1e9  # N·m: friction against which no gravity helps


def _wheels(setting: Setting, values: Array) -> Array:
    """Encoder reading error (N, n), rad, of an eccentric disc plus an oval wheel, in exact geometry.

    The disc turns with the joint, or ``ratio`` times as fast with its motor.
    """
    across, along, oval, phase, ratio = values.T
    angle = setting.q * ratio
    sine, cosine = np.sin(angle), np.cos(angle)
    # the direction of the true mark from the centre that is off, seen from the mark itself
    disc = np.arctan2(along * sine - across * cosine, 1.0 - across * sine - along * cosine)
    return np.asarray(disc + np.arctan2(oval * np.sin(2 * (angle + phase)), 1.0 + oval * np.cos(2 * (angle + phase))))


def _draw_wheels(setting: Setting, rng: np.random.Generator) -> Array:
    """Draw eccentricities of discs, across and along, ovality of wheels, their phase (rad) and ratio.

    A joint that slides has no disc of its own, only its motor has: its ratio is in rad/m.
    """
    ratio = round(float(rng.uniform(*_RATIOS)), 2) if rng.random() < 0.2 else 1.0
    values = some(1e-3, 5, turning=ratio == 1.0)(setting, rng)
    values[:, 2] *= rng.choice([0.0, 0.6])
    values[:, 3] = rng.uniform(0, np.pi)
    values[:, 4] = ratio
    return values


def _harmonics(setting: Setting, values: Array) -> dict[str, float]:
    """True parameters of :func:`_wheels`: Fourier amplitudes of orders ``ratio`` and twice that, to second order."""
    found = {}
    for name, (across, along, oval, phase, ratio) in zip(setting.world.names, values, strict=True):
        disc = complex(along, -across)
        second = disc**2 / 2.0 + oval * np.exp(2j * phase)
        for turns, amplitude in ((ratio, disc), (2.0 * ratio, second)):
            found[f"sine, order {turns:g}, {name}"] = float(amplitude.real)
            found[f"cosine, order {turns:g}, {name}"] = float(amplitude.imag)
    return found


def _play(setting: Setting, values: Array) -> Array:
    """Backlash error (N, n) of joints, rad or m: teeth rest on the side to which the torque through them presses.

    A joint that arrived on its way s = ±1 is pushed there against dry friction F (N·m) while gravity wants the
    torque τ: its teeth carry τ + F s. The grease between them is pressed out gradually, over a share of F. One that
    has not moved yet, s = 0, stands in the middle of where the two ways would have left it.
    """
    moved = np.zeros_like(setting.q)
    for j, (half, friction, soft) in enumerate(values):
        if half:
            load, way = setting.torque[:, j], setting.approach[:, j]
            up, down = (np.tanh((load + side * friction) / (soft * friction)) for side in (1.0, -1.0))
            moved[:, j] = -abs(half) * (up * (1.0 + way) + down * (1.0 - way)) / 2.0
    return moved


def _draw_play(setting: Setting, rng: np.random.Generator) -> Array:
    """Draw half of each backlash, rad or m; friction, N·m or N; and the share of it over which teeth change sides.

    Gears of one arm are of one make and one grease: friction is one share of what each is built to hold, but for a
    fifth. Where gravity has its way in more than three rows of four, hardly anything is left of the play but an offset
    of the joint, that nobody can tell from one: such a share is not drawn.
    """
    values = some(2e-4, 3, positive=True)(setting, rng)
    size = ratings(setting) * np.exp(rng.normal(0.0, _ALIKE, setting.world.n))
    seldom = np.quantile(np.abs(setting.torque), _PLAYS, axis=0) / size
    least = np.append(seldom[values[:, 0] > 0.0], _FRICTION[0]).max()
    values[:, 1] = size * np.exp(rng.uniform(np.log(least), np.log(max(_FRICTION[1], least))))
    values[:, 2] = rng.uniform(*_SOFT)
    return values


def ratings(setting: Setting) -> Array:
    """Rated torque (n,) of each joint's gear, N·m or N: arm and payload, stretched out level.

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


def _draw_springs(setting: Setting, rng: np.random.Generator) -> Array:
    """Draw the compliance (n, 1) of every joint, rad/(N·m) or m/N; with chance 0.4 one soft gear among stiff ones."""
    values = np.abs(rng.normal(1.0, 0.5, (setting.world.n, 1))) * 1e-5
    if rng.random() < 0.4:  # one worn gear
        values *= 0.05
        loaded = np.argsort((setting.torque**2).mean(axis=0))[-3:]
        values[rng.choice(loaded)] = 3e-5
    return values


def _servo(setting: Setting, values: Array) -> Array:
    """Lag error (N, n) of servos, rad or m: by delay to second order, and by dry friction.

    Of the delay T a share p is the loop's, which has a bandwidth, the rest the clock's, which is a dead time:
    exp(−(1 − p) T s) / (1 + p T s) = 1 − T s + ((1 + p²) / 2) T² s² − …
    """
    delay, friction, loop = values.T
    late = -setting.velocity * delay + setting.acceleration * (1.0 + loop**2) / 2.0 * delay**2
    return np.asarray(late - friction * setting.approach)


def _lags(setting: Setting, values: Array) -> dict[str, float]:
    """True delay, friction and coefficient of acceleration ½ (1 + p²) T² by joint, from rows (T, friction, p)."""
    delay, friction, loop = values.T
    each = (("delay", delay), ("friction", friction), ("effect of acceleration", (1.0 + loop**2) / 2.0 * delay**2))
    return {f"{label}, {name}": float(v) for label, of in each for name, v in zip(setting.world.names, of, strict=True)}


def _draw_servo(setting: Setting, rng: np.random.Generator) -> Array:
    """Draw each joint's delay, s, friction error, rad or m, and the loop's share of the delay."""
    erring = some(1.0)(setting, rng) != 0.0
    low, high = np.log(np.array([_DELAY, _DRAG])).T
    values = np.exp(rng.uniform(low, high, (setting.world.n, 2)))
    return np.column_stack([values * erring, np.full(setting.world.n, rng.uniform())])


def _ticks(setting: Setting, values: Array) -> Array:
    """Quantisation error (N, n): a joint stands at the nearest multiple of its step; 0 without a step."""
    step = np.abs(values[:, 0])
    known = np.where(step > 0.0, step, 1.0)
    return np.where(step > 0.0, np.round(setting.q / known) * step - setting.q, 0.0)


def _scatter(setting: Setting, values: Array) -> Array:
    """Normal scatter (N, n) of joints at every visit, rad or m; its seed follows from the campaign's times alone."""
    chance = np.random.default_rng(int(setting.time.sum() * 10) % 2**32)
    return np.asarray(chance.normal(size=setting.q.shape) * np.abs(values[:, 0]))


def _draw_manufacture(setting: Setting, rng: np.random.Generator) -> Array:
    values = rng.normal(size=(len(setting.world.chain), 6)) * np.array([2e-4, 2e-4, 2e-4, 5e-4, 5e-4, 5e-4])
    values[[not (j.movable or k in setting.world.segments) for k, j in enumerate(setting.world.chain)]] = 0.0
    if rng.random() < 0.3:  # a crash: one link is bent
        values[np.arange(len(values)) != rng.choice(np.flatnonzero(values.any(axis=1)))] *= 0.1
    return np.asarray(values)


def _strains(setting: Setting, values: Array) -> dict[str, float]:
    """True strain per kelvin of each segment; empty unless each link's temperature is recorded."""
    if setting.sensor != "links":
        return {}
    placed = zip((setting.world.chain[k] for k in setting.world.segments), values[:, 0], strict=True)
    return {f"strain per kelvin of {joint.name}, {joint.parent}": float(value) for joint, value in placed}


def _creep(setting: Setting, values: Array) -> Array:
    """Twist (N, 6) of the base by a stand or floor that settles exponentially in time: Newton's law of cooling."""
    grown = -np.expm1(-(setting.time - setting.time[0]) / values[0, 6])
    return np.asarray(grown[:, None] * values[0, :6])


def _crept(setting: Setting, values: Array) -> Mapping[str, float]:
    """True parameters of :func:`_creep`: the twist of the base in the last measured row."""
    last = setting.time[setting.given][-1] - setting.time[0]
    return twist("base")(setting, values[:, :6] * -np.expm1(-last / values[0, 6]))


def _tip(setting: Setting, values: Array) -> Array:
    """Twist (N, 6) of a base on springs by the moment of all weights, about a point on its origin's vertical."""
    springs, depth = np.abs(values[0, :2]), values[0, 2]
    turn = np.column_stack([setting.overturning[:, :2] * springs, np.zeros(setting.samples)])
    return np.hstack([depth * np.cross(turn, [0.0, 0.0, 1.0]), turn])


def _draw_tip(setting: Setting, rng: np.random.Generator) -> Array:
    depth = rng.choice([0.0, rng.uniform(*_DEPTHS)])
    low, high = np.log(_SPRINGS)
    return np.append(1e-6 * np.exp(rng.uniform(low, high, 2)), depth)[None]


def _tipped(setting: Setting, values: Array) -> dict[str, float]:
    """True parameters of :func:`_tip`: spring compliances, and shifts by the moment about a point below the base."""
    depth = float(values[0, 2])
    found = {}
    for axis, spring in zip("xy", np.abs(values[0, :2]).tolist(), strict=True):
        found[f"compliance about {axis}, base"] = spring
        if depth > 0.0:
            found[f"shift by the moment about {axis}, base"] = depth * spring
    return found


def _rigid(setting: Setting, rng: np.random.Generator) -> Array:
    return np.asarray(2e-3 * rng.normal(size=(1, 6)))


def _all_segments(size: float, spread: tuple[float, float], numbers: int = 1) -> Draw:
    return lambda setting, rng: size * rng.uniform(*spread, (len(setting.world.segments), numbers))


def _always(setting: Setting, values: Array) -> Array:
    return values


def _signed(values: Array) -> Array:
    return np.asarray(values[:, 0])


_ALL = (
    at("base", "base_frame", _rigid, _always, wants=("base_known",), known_as=twist("base")),
    at("tool", "tool_frame", _rigid, _always, wants=("tool_known",)),
    # each joint stands elsewhere by a constant
    in_joints(
        "joint_offset", some(1e-3, first=False), lambda s, v: v[:, 0], known_as=each_joint("zero offset", _signed)
    ),
    # each joint is graduated with too many lines a turn, from its zero on
    in_joints(
        "joint_gain",
        some(1e-3),
        lambda s, v: s.q * v[:, 0],
        quantities=own_position,
        known_as=each_joint("gain error", _signed),
    ),
    in_joints(
        "transmission_error",
        _draw_wheels,
        _wheels,
        quantities=own_position,
        known_as=_harmonics,
        fixed=((3, (0.0, np.pi / 4)), (4, (1.0,))),
    ),
    waves("joint_ripple", _TEETH),
    in_joints(
        "backlash",
        _draw_play,
        _play,
        quantities=lambda s, places: [f"approach.{name}" for _, name in places],
        known_as=each_joint("lost motion", lambda values: 2.0 * np.abs(values[:, 0])),
        fixed=((1, (_HOLDS,)), (2, (0.05,))),
    ),
    adds(
        "springs",
        "joint_compliance",
        _draw_springs,
        lambda s, v: np.abs(v[:, 0]),
        joints,
        quantities=weights,
        known_as=each_joint("compliance"),
    ),
    in_joints(
        "tracking_lag",
        _draw_servo,
        _servo,
        wants=("moving",),
        quantities=lambda s, places: [f"velocity.{n}" for _, n in places] + [f"approach.{n}" for _, n in places],
        # a step of dry friction against the way is what formats.md calls lost motion
        also=(("backlash", (1,)),),
        known_as=_lags,
        fixed=((2, (0.0, 1.0)),),
    ),
    # the errors of manufacture are there before anything else, and stay
    adds("placements", "geometric", _draw_manufacture, _always, parents, quantities=lambda s, places: s.world.names),
    adds(
        "beams",
        "link_compliance",
        _all_segments(1e-6, (0.4, 1.6), 2),
        lambda s, v: np.abs(v),
        segments,
        quantities=weights,
    ),
    adds(
        "growth",
        "thermal_elongation",
        _all_segments(STEEL, (0.7, 1.7)),
        lambda s, v: v[:, 0] * (s.links - 20.0),
        segments,
        wants=("temperature",),
        quantities=warmths,
        known_as=_strains,
    ),
    # the sun or a motor warms one side: the flanks differ as the link differs from the hall
    adds(
        "bow",
        "thermal_bending",
        lambda s, rng: 1e-4 * rng.normal(size=(len(s.world.segments), 2)),
        lambda s, v: (s.links - s.air[:, None])[:, :, None] * v[None],
        segments,
        wants=("sensor:links",),
        quantities=warmths,
    ),
    at(
        "base",
        "drift",
        lambda s, rng: np.append(1e-4 * rng.normal(size=6), np.exp(rng.uniform(*np.log(_SETTLES))))[None],
        _creep,
        quantities=clock,
        known_as=_crept,
        fixed=((6, (1e3, 5e3, 1e6)),),
    ),
    at("base", "base_compliance", _draw_tip, _tip, quantities=weights, known_as=_tipped, fixed=((2, (0.0, 1.0)),)),
    adds(
        "scale",
        "instrument_scale",
        lambda s, rng: np.array([[rng.choice([-1e-4, 1e-4])]]),
        lambda s, v: v[0, 0].item(),
        lambda s: [],
        known_as=lambda s, values: {"scale error, instrument": float(values[0, 0])},
    ),
    in_joints("encoder_resolution", some(2e-4, positive=True), _ticks, random=True, known_as=each_joint("step")),
    in_joints(
        "excess_repeatability",
        some(1e-4, positive=True),
        _scatter,
        wants=("repeats",),
        random=True,
        known_as=each_joint("standard deviation"),
    ),
)
FAULTS: dict[str, Fault] = {fault.name: fault for fault in _ALL}
"""The effects of formats.md by name."""
