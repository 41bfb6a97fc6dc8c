"""Which cases a trial has: drawn from one seed, every effect and withholding of a kind in turn."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations
from typing import Any, get_args

import numpy as np

from thermal_robot.blind.cases import Case, Kind, RobotChoice
from thermal_robot.effects import library
from thermal_robot.errors import EffectError, RobotError
from thermal_robot.robot import load_robot

ROBOTS = (
    ("rv_m2", "builtin:rv_m2", "tool0"),
    ("ur3", "example-robot-data:ur3", "tool0"),
    ("ur10", "example-robot-data:ur10", "tool0"),
    ("panda", "example-robot-data:panda", "panda_hand"),
    ("xarm7", "example-robot-data:xarm7", "link_eef"),
    ("z1", "example-robot-data:z1", "gripperStator"),
    ("kinova", "example-robot-data:kinova", "j2s6s200_end_effector"),
)
"""Name, URDF and tool frame of the trial's robots."""

SHORT = {"single": 16, "pair": 8, "triple": 2, "null": 8, "hard": 10, "removed": 6, "hidden": 4, "unlisted": 6}
FULL = {
    "single": 200,
    "pair": 100,
    "triple": 20,
    "null": 100,
    "hard": 200,
    "faint": 1100,
    "removed": 40,
    "hidden": 24,
    "unlisted": 108,
}

CHANCE = 0.07
"""How probable each effect of a faint case is, and an unlisted cause: of these 14 one is at work on average."""
CONTAINS = {"geometric": {"joint_offset", "instrument_scale"}}
"""What a larger effect can do exactly as well (formats.md)."""
IMITATES = {"transmission_error": {"joint_gain"}}
"""What a larger effect can do nearly as well: over less than a turn, two harmonics are a straight line."""
RANDOM = ("encoder_resolution", "excess_repeatability")
"""Effects that scatter: they leave nothing for a mean to explain, and are asked alone."""
CONDITION = {
    "thermal_elongation": ("temperature",),
    "drift": ("time",),
    "backlash": ("approach",),
    "tracking_lag": ("velocity", "acceleration", "approach"),
}
"""Columns that a cause cannot be seen without."""
_MOST = 3  # effects of a faint case: more want conditions that no campaign has


def robots(chosen: Sequence[tuple[str, str, str]] = ROBOTS) -> tuple[RobotChoice, ...]:
    """Return robots with their URDF's text, so that nothing else has to find it again.

    Parameters
    ----------
    chosen
        Name, URDF (a path, ``builtin:`` or ``example-robot-data:`` and a name) and tool frame of each.

    Raises
    ------
    RobotError
        If one cannot be loaded, or if gravity moves nothing in it.
    """
    found = []
    for name, urdf, tool_frame in chosen:
        robot = load_robot(urdf, tool_frame)
        if robot.n < 4:
            raise RobotError(f"robot {name!r} has {robot.n} joints: the trial asks for at least 4", name=name)
        found.append(RobotChoice(name, robot.urdf, tool_frame))
    return tuple(found)


def plan(
    seed: int,
    counts: Mapping[str, int],
    robots: Sequence[RobotChoice],
    only_effects: Sequence[str] = (),
    unlisted: Sequence[str] = (),
) -> tuple[Case, ...]:
    """Draw the cases of a trial.

    Parameters
    ----------
    seed
        Of the trial.
    counts
        Number of cases by kind (:data:`~thermal_robot.blind.cases.Kind` without ``real``).
    robots
        Each as probable as any other in every case.
    only_effects
        Effects to ask for; all of formats.md where empty.
    unlisted
        Causes that no library knows; all of them where empty.

    Returns
    -------
    tuple of Case
        In a drawn order, so that a case's number tells nothing.

    Raises
    ------
    EffectError
        If a kind or an effect is not known.
    """
    from thermal_robot.blind.reality import FAULTS, UNLISTED

    for kind in counts:
        if kind not in get_args(Kind) or kind == "real":
            raise EffectError(
                f"there is no kind of case {kind!r}; known: {', '.join(k for k in get_args(Kind) if k != 'real')}"
            )
    for name in (*only_effects, *unlisted):
        if name not in FAULTS and name not in UNLISTED:
            raise EffectError(f"the trial cannot make {name!r}; it can make {', '.join((*FAULTS, *UNLISTED))}")
    rng = np.random.default_rng([seed, 4])
    effects = [name for name in (only_effects or FAULTS) if name in FAULTS]
    mean = [name for name in effects if name not in RANDOM]
    causes = list(unlisted or UNLISTED)
    drawn: list[dict[str, Any]] = []
    for kind, count in counts.items():
        turn = _turns(kind, effects, mean, causes, rng)
        drawn += [{"kind": kind, **next(turn)} for _ in range(count)]
    order = rng.permutation(len(drawn))
    seeds = rng.integers(2**62, size=len(drawn))
    places = {kind: 0 for kind in counts}
    cases: list[Case] = []
    for number, k in enumerate(order):
        asked = drawn[k]
        turn_of_robot = places[str(asked["kind"])] + int(rng.integers(len(robots)))
        places[str(asked["kind"])] += 1
        cases.append(Case(f"c{number:04d}", int(seeds[number]), robot=robots[turn_of_robot % len(robots)], **asked))
    return tuple(cases)


def _turns(
    kind: str, effects: Sequence[str], mean: Sequence[str], causes: Sequence[str], rng: np.random.Generator
) -> Iterator[dict[str, Any]]:
    """Yield what is asked in cases of one kind, every effect (pair, condition) as often as any other."""
    hard: dict[str, Any] = {"ratio": (0.7, 1.5), "samples": (30, 60), "background": 0.15, "heavy": True}
    framed = ("base_frame", "tool_frame")
    apart = [n for n in mean if n not in framed]
    # contained effects are no loss where the library keeps the container
    contained = {name for outer, inner in (*CONTAINS.items(), *IMITATES.items()) if outer in effects for name in inner}
    menu: list[dict[str, Any]]
    if kind == "null":
        menu = [{}]
    elif kind == "single":
        menu = [{"effects": (name,)} for name in effects]
    elif kind == "hard":
        menu = [{"effects": (name,), **hard} for name in apart]
    elif kind == "faint":
        # the other random effect wants repeats
        yield from _by_chance([*apart, *(n for n in effects if n == "encoder_resolution")], causes, rng)
    elif kind in ("pair", "triple"):
        sets = combinations(apart, 2 if kind == "pair" else 3)
        menu = [{"effects": chosen} for chosen in sets if not _containing(chosen)]
    elif kind == "removed":
        # one that the library does not have yet needs not be taken out
        menu = [{"effects": (n,), "without": (n,) if n in library() else ()} for n in apart if n not in contained]
    elif kind == "hidden":
        menu = [{"effects": (name,), "hidden": CONDITION[name]} for name in apart if name in CONDITION]
    else:
        menu = [{"unlisted": name} for name in causes]
    if not menu:
        raise EffectError(f"no case of kind {kind!r} can be made of {', '.join(effects)}")
    while True:
        for k in rng.permutation(len(menu)):
            yield menu[k]


def _by_chance(effects: Sequence[str], causes: Sequence[str], rng: np.random.Generator) -> Iterator[dict[str, Any]]:
    """Yield cases without end in which every effect has its own chance: something to hold probabilities against."""
    while True:
        drawn = tuple(name for name in effects if rng.random() < CHANCE)
        if len(drawn) <= _MOST and not _containing(drawn):
            strange = causes[int(rng.integers(len(causes)))] if causes and rng.random() < CHANCE else None
            yield {"effects": drawn, "unlisted": strange, "ratio": (0.5, 1.5), "samples": (30, 90)}


def _containing(chosen: Sequence[str]) -> bool:
    return any(inner in CONTAINS.get(outer, ()) for outer in chosen for inner in chosen)
