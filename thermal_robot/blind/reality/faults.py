"""The effects of formats.md as they happen in a robot: joints, links, base, instrument."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from thermal_robot.blind.reality import gears
from thermal_robot.blind.reality.fault import (
    Fault,
    clock,
    each_joint,
    joints,
    own_position,
    segments,
    some,
    twist,
)
from thermal_robot.blind.reality.setting import Setting
from thermal_robot.blind.reality.world import Body

Array = NDArray[np.float64]

STEEL = 12e-6  # 1/K
_SETTLES = (600.0, 72000.0)
"""s, evenly over the logarithm. Fastest: ρ c d / h of a steel tube of 2 mm in still air, 3.6e6 · 0.002 / 12. Between:
a laser tracker is stable two hours after it was switched on (Pollack Periodica 15 (3), 2020), three times 40 minutes.
Slowest: 4 d² / (π² κ) of a concrete floor that is warm on one side, 0.35 m thick and with κ of 7e-7 m²/s."""
_SPRINGS = (0.4, 1.6)  # of one another: what stands on a plate is up to four times as stiff about one axis; ours
_DEPTHS = (0.0, 1.0)  # m: from the flange down to the floor under a pedestal
_TEETH = (5.0, 200.0)  # a turn: of gear stages, teeth, balls and motors whose ratio nobody states
_HOLDS = 1e9  # N·m: friction against which no gravity helps


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
    """A stand or floor warms through towards a hall that has changed: Newton's law of cooling."""
    grown = -np.expm1(-(setting.time - setting.time[0]) / values[0, 6])
    body.move("base", grown[:, None] * values[0, :6])


def _draw_creep(setting: Setting, rng: np.random.Generator) -> Array:
    return np.append(1e-4 * rng.normal(size=6), np.exp(rng.uniform(*np.log(_SETTLES))))[None]


def _strains(setting: Setting, values: Array) -> dict[str, float]:
    """Only where each link's temperature is recorded: another sensor's kelvin is not the link's."""
    if setting.sensor != "links":
        return {}
    world = setting.world
    placed = zip(world.segments, values[:, 0], strict=True)
    joints = ((world.chain[k], float(value)) for k, value in placed)
    return {f"strain per kelvin of {joint.name}, {joint.parent}": value for joint, value in joints}


def _crept(setting: Setting, values: Array) -> dict[str, float]:
    """How far the base has gone in the last row that was measured."""
    last = setting.time[setting.given][-1] - setting.time[0]
    return dict(twist("base")(setting, values[:, :6] * -np.expm1(-last / values[0, 6])))


def _tip(body: Body, setting: Setting, values: Array) -> None:
    """A base on springs turns under the moment of all weights, about a point on the vertical through its origin."""
    springs, depth = np.abs(values[0, :2]), values[0, 2]
    turn = np.column_stack([setting.overturning[:, :2] * springs, np.zeros(setting.samples)])
    body.move("base", np.hstack([depth * np.cross(turn, [0.0, 0.0, 1.0]), turn]))


def _draw_tip(setting: Setting, rng: np.random.Generator) -> Array:
    depth = rng.choice([0.0, rng.uniform(*_DEPTHS)])
    low, high = np.log(_SPRINGS)
    return np.append(1e-6 * np.exp(rng.uniform(low, high, 2)), depth)[None]


def _tipped(setting: Setting, values: Array) -> dict[str, float]:
    """The springs; and, where the base turns about a point below, how far the moment shifts it."""
    depth = float(values[0, 2])
    found = {}
    for axis, spring in zip("xy", np.abs(values[0, :2]).tolist(), strict=True):
        found[f"compliance about {axis}, base"] = spring
        if depth > 0.0:
            found[f"shift by the moment about {axis}, base"] = depth * spring
    return found


def _scale(body: Body, setting: Setting, values: Array) -> None:
    body.scale += float(values[0, 0])


def _misplaced(where: str) -> Callable[[Body, Setting, Array], None]:
    def act(body: Body, setting: Setting, values: Array) -> None:
        body.move(where, np.repeat(values, setting.samples, axis=0))

    return act


def _rigid(setting: Setting, rng: np.random.Generator) -> Array:
    return np.asarray(2e-3 * rng.normal(size=(1, 6)))


def _all_segments(size: float, spread: tuple[float, float], numbers: int = 1) -> Callable[..., Array]:
    return lambda setting, rng: size * rng.uniform(*spread, (len(setting.world.segments), numbers))


FAULTS: dict[str, Fault] = {
    fault.name: fault
    for fault in (
        Fault(
            "base_frame",
            _rigid,
            _misplaced("base"),
            lambda s: [("base", "base")],
            wants=("base_known",),
            known_as=twist("base"),
        ),
        Fault("tool_frame", _rigid, _misplaced("tool"), lambda s: [("tool", "tool")], wants=("tool_known",)),
        Fault(
            "joint_offset",
            some(1e-3, first=False, last=False),
            gears.offset,
            joints,
            few=True,
            known_as=each_joint("zero offset", lambda values: values[:, 0]),
        ),
        Fault(
            "joint_gain",
            some(1e-3, last=False),
            gears.gain,
            joints,
            few=True,
            quantities=own_position,
            known_as=each_joint("gain error", lambda values: values[:, 0]),
        ),
        Fault(
            "transmission_error",
            gears.draw_wheels,
            gears.wheels,
            joints,
            few=True,
            quantities=own_position,
            known_as=gears.harmonics,
            fixed=((3, (0.0, np.pi / 4)), (4, (1.0,))),
        ),
        gears.waves("joint_ripple", _TEETH),
        Fault(
            "backlash",
            gears.draw_play,
            gears.play,
            joints,
            few=True,
            quantities=lambda s, places: [f"approach.{name}" for _, name in places],
            known_as=each_joint("lost motion", lambda values: 2.0 * np.abs(values[:, 0])),
            fixed=((1, (_HOLDS,)), (2, (0.05,))),
        ),
        Fault(
            "joint_compliance",
            gears.draw_springs,
            gears.springs,
            joints,
            quantities=lambda s, places: ["payload", *s.world.names],
            known_as=each_joint("compliance", lambda values: np.abs(values[:, 0])),
        ),
        Fault(
            "tracking_lag",
            gears.draw_servo,
            gears.servo,
            joints,
            few=True,
            wants=("moving",),
            quantities=lambda s, places: [f"velocity.{n}" for _, n in places] + [f"approach.{n}" for _, n in places],
            # a step of dry friction against the way is what formats.md calls lost motion
            also=(("backlash", (1,)),),
            known_as=gears.lags,
            fixed=((2, (0.0, 1.0)),),
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
            known_as=_strains,
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
            known_as=_crept,
            fixed=((6, (1e3, 5e3, 1e6)),),
        ),
        Fault(
            "base_compliance",
            _draw_tip,
            _tip,
            lambda s: [("base", "base")],
            quantities=lambda s, places: ["payload", *s.world.names],
            known_as=_tipped,
            fixed=((2, (0.0, 1.0)),),
        ),
        Fault(
            "instrument_scale",
            lambda s, rng: np.array([[rng.choice([-1e-4, 1e-4])]]),
            _scale,
            lambda s: [],
            known_as=lambda s, values: {"scale error, instrument": float(values[0, 0])},
        ),
        Fault(
            "encoder_resolution",
            some(2e-4, last=False, positive=True),
            gears.ticks,
            joints,
            few=True,
            random=True,
            known_as=each_joint("step", lambda values: np.abs(values[:, 0])),
        ),
        Fault(
            "excess_repeatability",
            some(1e-4, last=False, positive=True),
            gears.scatter,
            joints,
            few=True,
            wants=("repeats",),
            random=True,
            known_as=each_joint("standard deviation", lambda values: np.abs(values[:, 0])),
        ),
    )
}
"""The effects of formats.md by name."""
