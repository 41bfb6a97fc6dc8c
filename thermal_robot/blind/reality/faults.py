"""What goes wrong in a robot, as it goes wrong there: joints, gears, links, base, instrument."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from thermal_robot.blind.reality.setting import Setting
from thermal_robot.blind.reality.world import Body

Array = NDArray[np.float64]
Place = tuple[str, str]

STEEL = 12e-6  # 1/K


@dataclass(frozen=True)
class Fault:
    """One kind of fault.

    Attributes
    ----------
    name
        As in formats.md, or a name of its own.
    draw
        (setting, rng) → (P, D) how large it is in each of P places, D numbers each, in no particular scale: the trial
        makes it as large as it wants.
    act
        (body, setting, values) does it to the robot.
    places
        (setting) → the P places.
    few
        Whether it sits in few places, so that asking where makes sense.
    wants
        What the campaign must be like: ``moving``, ``repeats``, ``sessions``, ``sensor:links``, ``base_known`` ...
    quantities
        (setting) → names of columns, each a right answer to what it follows.
    random
        Whether it scatters anew at every visit.
    also
        Names of other effects that do part of it by definition, each with the columns of the values that do.
    fixed
        Columns of the values that are no size (a phase, a time constant), each with the settings that span it.
    """

    name: str
    draw: Callable[[Setting, np.random.Generator], Array]
    act: Callable[[Body, Setting, Array], None]
    places: Callable[[Setting], Sequence[Place]]
    few: bool = False
    wants: tuple[str, ...] = ()
    quantities: Callable[[Setting, Sequence[Place]], Sequence[str]] = lambda setting, places: ()
    random: bool = False
    also: tuple[tuple[str, tuple[int, ...]], ...] = ()
    fixed: tuple[tuple[int, tuple[float, ...]], ...] = ()

    def scaled(self, values: Array, factor: float) -> Array:
        """Return values of another size."""
        result = values * factor
        for column, _ in self.fixed:
            result[:, column] = values[:, column]
        return result


def joints(setting: Setting) -> list[Place]:
    """Return every joint."""
    return [("joint", name) for name in setting.world.names]


def segments(setting: Setting) -> list[Place]:
    """Return the link of every segment."""
    return [("link", link) for link in setting.world.links]


def own_position(setting: Setting, places: Sequence[Place]) -> list[str]:
    """Return that joint's own position."""
    return [name for _, name in places]


def clock(setting: Setting, places: Sequence[Place]) -> list[str]:
    """Return time and the order of rows, which are one."""
    return ["time", "order"]


def some(
    size: float, numbers: int = 1, *, first: bool = True, last: bool = True, positive: bool = False
) -> Callable[[Setting, np.random.Generator], Array]:
    """Draw values for one to three joints; the first and last can be left out where frames would hide them."""

    def draw(setting: Setting, rng: np.random.Generator) -> Array:
        n = setting.world.n
        allowed = np.arange(0 if first else 1, n if last else n - 1)
        chosen = rng.choice(allowed, rng.integers(1, 4), replace=False)
        values = np.zeros((n, numbers))
        values[chosen] = size * rng.normal(size=(len(chosen), numbers))
        values[chosen[0]] += size * np.sign(values[chosen[0]])  # one of them is a real fault, not a draw near zero
        return np.abs(values) if positive else values

    return draw


def _offset(body: Body, setting: Setting, values: Array) -> None:
    body.joints += values[:, 0]


def _gain(body: Body, setting: Setting, values: Array) -> None:
    # a graduation that counts too many lines a turn, from the joint's zero on
    body.joints += setting.q * values[:, 0]


def _wheels(body: Body, setting: Setting, values: Array) -> None:
    """Read an angle on a disc whose centre is off, and turn an oval wheel: a ray of a circle, not a sine.

    The disc turns with the joint, or ``ratio`` times as fast with its motor.
    """
    for j, (across, along, oval, phase, ratio) in enumerate(values):
        angle = setting.q[:, j] * ratio
        read = np.arctan2(np.sin(angle) - across, np.cos(angle) - along)
        body.joints[:, j] += np.angle(np.exp(1j * (read - angle)))
        body.joints[:, j] += np.arctan2(oval * np.sin(2 * (angle + phase)), 1.0 + oval * np.cos(2 * (angle + phase)))


def _draw_wheels(setting: Setting, rng: np.random.Generator) -> Array:
    values = some(1e-3, 5, last=False)(setting, rng)
    values[:, 2] *= rng.choice([0.0, 0.6])
    values[:, 3] = rng.uniform(0, np.pi)
    values[:, 4] = rng.choice([51.0, 80.0, 101.0]) if rng.random() < 0.2 else 1.0
    return values


def _play(body: Body, setting: Setting, values: Array) -> None:
    """Teeth lie against the side that pushed last, unless gravity outweighs friction and lays them on its own."""
    heaviest = np.abs(setting.torque).max()
    for j, (half, friction) in enumerate(values):
        load = setting.torque[:, j]
        hangs = friction > 0 and np.abs(load).max() > 0.02 * heaviest
        heavy = np.abs(load) > friction * np.abs(load).max() if hangs else np.zeros(len(load), bool)
        # friction stops a joint short of where it was sent: behind, on the way it came; a weight lets it hang down
        body.joints[:, j] -= abs(half) * np.where(heavy, np.sign(load), setting.approach[:, j])


def _draw_play(setting: Setting, rng: np.random.Generator) -> Array:
    values = some(2e-4, 2, last=False, positive=True)(setting, rng)
    values[:, 1] = rng.choice([0.0, 0.0, rng.uniform(0.5, 0.9)]) if setting.torque.any() else 0.0
    return values


def _springs(body: Body, setting: Setting, values: Array) -> None:
    body.springs += np.abs(values[:, 0])


def _draw_springs(setting: Setting, rng: np.random.Generator) -> Array:
    n = setting.world.n
    values = np.abs(rng.normal(1.0, 0.5, (n, 1))) * 1e-5
    if rng.random() < 0.4:  # one worn gear
        values *= 0.05
        loaded = np.argsort((setting.torque**2).mean(axis=0))[-3:]
        values[rng.choice(loaded)] = 3e-5
    return values


def _servo(body: Body, setting: Setting, values: Array) -> None:
    """A servo that follows its command with a delay, dragged by dry friction: q(t − T) and a step against the way."""
    delay, friction = values[:, 0], values[:, 1]
    body.joints += -setting.velocity * delay + 0.5 * setting.acceleration * delay**2 - friction * setting.approach


def _draw_servo(setting: Setting, rng: np.random.Generator) -> Array:
    values = np.abs(some(1.0, 2, last=False)(setting, rng))
    return np.asarray(values * np.array([1e-3, 1e-4]))


def _manufacture(body: Body, setting: Setting, values: Array) -> None:
    # the errors of manufacture are there before anything else, and stay
    body.placements = body.placements + values


def _draw_manufacture(setting: Setting, rng: np.random.Generator) -> Array:
    values = rng.normal(size=(len(setting.world.chain), 6)) * np.array([2e-4, 2e-4, 2e-4, 5e-4, 5e-4, 5e-4])
    values[[not (j.movable or k in setting.world.segments) for k, j in enumerate(setting.world.chain)]] = 0.0
    if rng.random() < 0.3:  # a crash: one link is bent
        values[np.arange(len(values)) != rng.choice(np.flatnonzero(values.any(axis=1)))] *= 0.1
    return np.asarray(values)


def _beams(body: Body, setting: Setting, values: Array) -> None:
    body.beams += np.abs(values)


def _warm(body: Body, setting: Setting, values: Array) -> None:
    body.growth += values[:, 0] * (setting.links - 20.0)


def _bow(body: Body, setting: Setting, values: Array) -> None:
    """The sun or a motor warms one side: the flanks differ as the link differs from the hall."""
    body.bow += (setting.links - setting.air[:, None])[:, :, None] * values[None]


def _creep(body: Body, setting: Setting, values: Array) -> None:
    kind, constant = values[0, 6:]
    run = setting.time - setting.time[0]
    grown = run / run[-1] if kind == 0 else -np.expm1(-run / (constant * run[-1]))
    body.move("base", grown[:, None] * values[0, :6])


def _draw_creep(setting: Setting, rng: np.random.Generator) -> Array:
    twist = rng.normal(size=6) * np.array([1e-4, 1e-4, 1e-4, 1e-4, 1e-4, 1e-4])
    return np.append(twist, [rng.integers(2), rng.uniform(0.1, 0.4)])[None]


def _scale(body: Body, setting: Setting, values: Array) -> None:
    body.scale += float(values[0, 0])


def _misplaced(where: str) -> Callable[[Body, Setting, Array], None]:
    def act(body: Body, setting: Setting, values: Array) -> None:
        body.move(where, np.repeat(values, setting.samples, axis=0))

    return act


def _ticks(body: Body, setting: Setting, values: Array) -> None:
    """An encoder that counts in steps: the joint stands at the nearest one."""
    for j, (step,) in enumerate(np.abs(values)):
        if step:
            body.joints[:, j] += np.round(setting.q[:, j] / step) * step - setting.q[:, j]


def _scatter(body: Body, setting: Setting, values: Array) -> None:
    chance = np.random.default_rng(
        int(setting.time.sum() * 10) % 2**32
    )  # the same at any size, another in any campaign
    body.joints += chance.normal(size=body.joints.shape) * np.abs(values[:, 0])


def _rigid(setting: Setting, rng: np.random.Generator) -> Array:
    return np.asarray(2e-3 * rng.normal(size=(1, 6)))


def _all_segments(size: float, spread: tuple[float, float], numbers: int = 1) -> Callable[..., Array]:
    return lambda setting, rng: size * rng.uniform(*spread, (len(setting.world.segments), numbers))


FAULTS: dict[str, Fault] = {
    fault.name: fault
    for fault in (
        Fault("base_frame", _rigid, _misplaced("base"), lambda s: [("base", "base")], wants=("base_known",)),
        Fault("tool_frame", _rigid, _misplaced("tool"), lambda s: [("tool", "tool")], wants=("tool_known",)),
        Fault("joint_offset", some(1e-3, first=False, last=False), _offset, joints, few=True),
        Fault("joint_gain", some(1e-3, last=False), _gain, joints, few=True, quantities=own_position),
        Fault(
            "transmission_error",
            _draw_wheels,
            _wheels,
            joints,
            few=True,
            quantities=own_position,
            fixed=((3, (0.0, np.pi / 4)), (4, (1.0,))),
        ),
        Fault(
            "backlash",
            _draw_play,
            _play,
            joints,
            few=True,
            quantities=lambda s, places: [f"approach.{name}" for _, name in places],
            fixed=((1, (0.0,)),),
        ),
        Fault(
            "joint_compliance",
            _draw_springs,
            _springs,
            joints,
            quantities=lambda s, places: ["payload", *s.world.names],
        ),
        Fault(
            "tracking_lag",
            _draw_servo,
            _servo,
            joints,
            few=True,
            wants=("moving",),
            quantities=lambda s, places: [f"velocity.{n}" for _, n in places] + [f"approach.{n}" for _, n in places],
            # a step of dry friction against the way is what formats.md calls lost motion
            also=(("backlash", (1,)),),
        ),
        Fault(
            "geometric",
            _draw_manufacture,
            _manufacture,
            lambda s: [("link", j.parent) for j in s.world.chain],
            quantities=lambda s, places: s.world.names,
        ),
        Fault(
            "link_compliance",
            _all_segments(1e-6, (0.4, 1.6), 2),
            _beams,
            segments,
            quantities=lambda s, places: ["payload", *s.world.names],
        ),
        Fault(
            "thermal_elongation",
            _all_segments(STEEL, (0.7, 1.7)),
            _warm,
            segments,
            wants=("temperature",),
            quantities=lambda s, places: ["temperature", *(f"temperature.{link}" for link in s.world.links)],
        ),
        Fault(
            "thermal_bending",
            lambda s, rng: 1e-4 * rng.normal(size=(len(s.world.segments), 2)),
            _bow,
            segments,
            wants=("sensor:links",),
            quantities=lambda s, places: ["temperature", *(f"temperature.{link}" for link in s.world.links)],
        ),
        Fault(
            "drift",
            _draw_creep,
            _creep,
            lambda s: [("base", "base")],
            quantities=clock,
            fixed=((6, (0.0, 1.0)), (7, (0.1, 0.25))),
        ),
        Fault("instrument_scale", lambda s, rng: np.array([[rng.choice([-1e-4, 1e-4])]]), _scale, lambda s: []),
        Fault("encoder_resolution", some(2e-4, last=False, positive=True), _ticks, joints, few=True, random=True),
        Fault(
            "excess_repeatability",
            some(1e-4, last=False, positive=True),
            _scatter,
            joints,
            few=True,
            wants=("repeats",),
            random=True,
        ),
    )
}
"""The effects of formats.md by name."""
