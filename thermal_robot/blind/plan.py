"""Plan of a trial: cases drawn from one seed, every effect and withholding of a kind in turn."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import combinations, islice, repeat
from pathlib import Path
from typing import Any, get_args

import numpy as np

from thermal_robot.blind.cases import CONDITION, SEVERAL, Case, How, Kind, RobotChoice, Several
from thermal_robot.effects import library
from thermal_robot.errors import EffectError, RobotError
from thermal_robot.robot import load_robot

Asked = dict[str, Any]
"""Fields of a :class:`~thermal_robot.blind.cases.Case`."""

LARGE, LAGGING = (10.0, 60.0), (10.0, 40.0)
"""Sizes over the noise: of effects as large as on real robots, and of those with a lag or a time constant."""
LAGS: tuple[Asked, ...] = (
    {"effects": ("tracking_lag",)},
    {"effects": ("drift",)},
    {"effects": ("thermal_elongation",), "wants": ("sensor:air",)},
)
"""Effects with a lag or a time constant; of elongation, links follow the air that is recorded."""
HARD: Asked = {"ratio": (0.7, 1.5), "samples": (30, 60), "background": 0.15, "heavy": True}
MANY = (3, 5)
"""Fewest and most effects of many together."""
CHANCE, STRANGE = 0.3, 0.3
"""Probabilities in a mixture: the largest of an effect, as each draws its own, and that of an unlisted cause."""
MIXED: Asked = {"ratio": (0.3, 10.0), "samples": (40, 140)}
EVERYTHING = ("moving", "temperature", "sensor:links", "sessions", "humidity", "motor_temperature", "speed")
"""Columns recorded in every mixture: one that is there for its cause alone would give it away."""
REPEATED = 1.0 / 3.0
"""Share of mixtures whose poses are visited several times, without which scatter and steps are confounded."""

CONTAINS = {"geometric": {"joint_offset", "instrument_scale"}}
"""Effects that a larger effect contains exactly (formats.md)."""
IMITATES = {"transmission_error": {"joint_gain"}, "link_compliance": {"base_compliance"}}
"""Effects that a larger effect nearly imitates: over less than a turn, two harmonics are a straight line; the upright
link that stands on the base bends under the moment that tips it."""
RANDOM = ("encoder_resolution", "excess_repeatability")
"""Random effects: they leave nothing for a mean to explain, and are asked alone."""
_FRAMES = ("base_frame", "tool_frame")


LOCAL = ("joint_offset", "joint_gain", "backlash", "joint_compliance")
"""Effects with one number a joint that formats.md defines: of such a number it can be asked whether it changed, and of
which joint. Of a bent link's six numbers some are a joint's zero as well."""
BESIDE = (*LOCAL, "link_compliance", "thermal_elongation")
"""Effects that a robot may have on all days: its own, and none that begins anew with a campaign."""
SIZES = {"changes": (4.0, 4.0), "jumps": (4.0, 4.0), "begins": (16.0, 64.0), "grows": (8.0, 16.0)}
"""Size of a change, in deviations. Four are what the program is to find. What begins has to be named in campaigns with
it: with 90 rows 16 to 64 deviations leave one to four times the noise, as the effects of other kinds do. What grows by
8 to 16 over all has passed four in the middle."""
PAIR, DAYS, FLEET = (2, 2), (12, 12), (10, 14)
"""Campaigns of a pair, of a series (a year of months), and robots of a fleet: few, in two halls of five or more, which
is the least of which the program tells a mean."""
APART = (2, 4)
"""Fewest and most robots of a fleet with a fault of their own."""
PLACES = 2
"""Joints between the first and the last of the arm with the fewest: so many faults of one kind have room in a fleet."""
_WAYS: tuple[How, ...] = ("begins", "jumps", "grows")
_FLEETS: tuple[How, ...] = ("all", "hall", "")


def turns(kind: str, effects: Sequence[str], causes: Sequence[str], rng: np.random.Generator) -> Iterator[Asked]:
    """Yield the fields of cases of one kind without end; each cycle is a permutation of its effects or unlisted causes.

    Raises
    ------
    EffectError
        If no case of this kind can be made of them.
    """
    menu = _menu(kind, effects, causes)
    if not menu or (kind == "both" and not _apart(effects)):
        takes = f"; it takes {', '.join(LOCAL)}" if kind in SEVERAL else ""
        raise EffectError(f"no case of kind {kind!r} can be made of {', '.join(effects)}{takes}")
    orders = map(rng.permutation, repeat(len(menu)))
    return ({**menu[k], **_beside(kind, menu[k], effects, causes, rng)} for order in orders for k in order)


def _menu(kind: str, effects: Sequence[str], causes: Sequence[str]) -> list[Asked]:
    """Fields of the cases in one cycle of a kind: one for each effect, pair of effects, unlisted cause or change."""
    # contained effects are no loss where the library keeps the container
    contained = {name for outer, inner in (*CONTAINS.items(), *IMITATES.items()) if outer in effects for name in inner}
    apart, local = _apart(effects), [name for name in LOCAL if name in effects]
    alone: list[Asked] = [{"effects": (name,)} for name in effects]
    always: list[Asked] = [{"effects": (name,)} for name in BESIDE if name in effects]
    beyond: list[Asked] = [{"unlisted": name} for name in causes]
    menus: dict[str, list[Asked]] = {
        "null": [{}],
        "many": [{}],
        "mixed": [{}],
        "single": alone,
        "large": [{**asked, "ratio": LARGE} for asked in alone],
        "visits": [{"effects": (n,), "wants": ("repeats",)} for n in effects if n == "encoder_resolution"],
        "lags": [{**asked, "ratio": LAGGING} for asked in LAGS if asked["effects"][0] in effects],
        "hard": [{"effects": (name,), **HARD} for name in apart],
        "pair": [{"effects": chosen} for chosen in combinations(apart, 2) if not alike(chosen)],
        # one that the library does not have yet needs not be taken out
        "removed": [{"effects": (n,), "without": (n,) if n in library() else ()} for n in apart if n not in contained],
        "hidden": [{"effects": (name,), "hidden": CONDITION[name]} for name in apart if name in CONDITION],
        "unlisted": beyond,
        "both": beyond,
        "same": [{**asked, "several": Several(PAIR)} for asked in always],
        "steady": [{**asked, "several": Several(DAYS)} for asked in always],
    }
    if kind in menus:
        return menus[kind]
    moving: dict[str, tuple[tuple[int, int], list[tuple[How, str]]]] = {
        "changed": (PAIR, [("changes", name) for name in local]),
        "series": (DAYS, [(how, name) for name in local for how in _WAYS]),
        "fleet": (FLEET, [(how, name if how else "") for how in _FLEETS for name in local]),
    }
    campaigns, items = moving[kind]
    return [
        {"effects": (name,) if name else (), "several": Several(campaigns, how, name, SIZES.get(how, Several.change))}
        for how, name in items
    ]


def _beside(kind: str, asked: Asked, effects: Sequence[str], causes: Sequence[str], rng: np.random.Generator) -> Asked:
    apart, always = _apart(effects), [name for name in BESIDE if name in effects]
    if kind == "both":
        return {"effects": _several(apart, int(rng.integers(1, 3)), rng)}
    if kind == "many":
        if len(apart) < MANY[1]:
            raise EffectError(f"many effects together are up to {MANY[1]}, of {', '.join(apart) or 'none'}")
        return {"effects": _several(apart, int(rng.integers(MANY[0], MANY[1] + 1)), rng)}
    if kind == "mixed":
        return _mixture([name for name in effects if name not in _FRAMES], causes, rng)
    if kind == "fleet":
        return {"several": replace(asked["several"], apart=_own(asked["effects"], effects, rng))}
    return {"effects": _with_another(asked["effects"], always, rng)} if kind in SEVERAL else {}


def _apart(effects: Sequence[str]) -> list[str]:
    return [name for name in effects if name not in (*RANDOM, *_FRAMES)]


def _several(apart: Sequence[str], number: int, rng: np.random.Generator) -> tuple[str, ...]:
    if all(map(alike, combinations(apart, min(number, len(apart))))):
        raise EffectError(f"{number} effects together: of {', '.join(apart)} any so many do the same")
    while True:
        chosen = tuple(apart[k] for k in sorted(rng.permutation(len(apart))[:number]))
        if not alike(chosen):
            return chosen


def _mixture(effects: Sequence[str], causes: Sequence[str], rng: np.random.Generator) -> Asked:
    """Draw the effects of a mixture independently, each with a probability of its own up to 0.3, and an unlisted cause.

    Sets in which one effect contains another are drawn again.
    """
    while True:
        repeated = bool(rng.random() < REPEATED)
        asked = [n for n in effects if repeated or n != "excess_repeatability"]
        drawn = tuple(name for name in asked if rng.random() < rng.uniform(0.0, CHANCE))
        if not _holds(CONTAINS, drawn):
            strange = causes[int(rng.integers(len(causes)))] if causes and rng.random() < STRANGE else None
            wants = (*EVERYTHING, *(("repeats",) if repeated else ()))
            return {"effects": drawn, "unlisted": strange, "wants": wants, **MIXED}


def _with_another(first: tuple[str, ...], always: Sequence[str], rng: np.random.Generator) -> tuple[str, ...]:
    """Add, with probability one half, a random effect that all days share, unless it is present or confounded."""
    second = str(always[int(rng.integers(len(always)))])
    wanted = bool(rng.random() < 0.5)
    return first if not wanted or second in first or alike((*first, second)) else (*first, second)


def _own(shared: tuple[str, ...], effects: Sequence[str], rng: np.random.Generator) -> tuple[str, ...]:
    """Draw the names of two to four faults of single robots in a fleet; with the shared ones, at most two of a kind."""
    places = [name for name in LOCAL if name in effects for _ in range(PLACES - shared.count(name))]
    count = min(int(rng.integers(APART[0], APART[1] + 1)), len(places))
    return tuple(places[k] for k in rng.permutation(len(places))[:count])


def _holds(contents: Mapping[str, set[str]], chosen: Sequence[str]) -> bool:
    return any(inner in contents.get(outer, ()) for outer in chosen for inner in chosen)


def alike(chosen: Sequence[str]) -> bool:
    """Whether any of the effects contains another of them, or nearly imitates it (:data:`IMITATES`)."""
    return _holds(CONTAINS, chosen) or _holds(IMITATES, chosen)


ARMS = Path(__file__).parent / "reality" / "arms"
"""Arms of other builds: a rail, a SCARA, a gantry, parallelograms."""
PARALLELOGRAMS = ("palletiser", str(ARMS / "palletiser.urdf"), "tool0")
ROBOTS = (
    ("rv_m2", "builtin:rv_m2", "tool0"),
    ("ur3", "example-robot-data:ur3", "tool0"),
    ("ur10", "example-robot-data:ur10", "tool0"),
    ("panda", "example-robot-data:panda", "panda_hand"),
    ("xarm7", "example-robot-data:xarm7", "link_eef"),
    ("z1", "example-robot-data:z1", "gripperStator"),
    ("kinova", "example-robot-data:kinova", "j2s6s200_end_effector"),
    *((name, str(ARMS / f"{name}.urdf"), "tool0") for name in ("rail", "scara", "gantry")),
    PARALLELOGRAMS,
)
"""Name, URDF and tool frame of the trial's robots."""

_SIZES = {
    "single": (12, 200),
    "large": (6, 100),
    "visits": (2, 60),
    "lags": (3, 99),
    "pair": (6, 100),
    "many": (4, 60),
    "null": (6, 100),
    "hard": (6, 100),
    "mixed": (8, 700),
    "removed": (4, 40),
    "hidden": (2, 24),
    "unlisted": (8, 216),
    "both": (2, 48),
    "same": (1, 60),
    "changed": (2, 100),
    "steady": (1, 60),
    "series": (2, 96),
    "fleet": (1, 30),
}
"""Number of cases of each kind in a short trial, and in a full one."""
SHORT, FULL = ({kind: counts[k] for kind, counts in _SIZES.items()} for k in (0, 1))


def robots(chosen: Sequence[tuple[str, str, str]] = ROBOTS) -> tuple[RobotChoice, ...]:
    """Load robots, and return each with the text of its URDF.

    ``chosen``: name, URDF (a path, ``builtin:`` or ``example-robot-data:`` and a name) and tool frame of each.

    Raises
    ------
    RobotError
        If one cannot be loaded, or has fewer than four joints.
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
    """Draw the cases of a trial from its seed, in random order, so that a case's number gives nothing away.

    Parameters
    ----------
    counts
        Number of cases by kind (:data:`~thermal_robot.blind.cases.Kind` without ``real``); those of several campaigns
        come after the others.
    robots
        Each as probable as any other in every case.
    only_effects, unlisted
        Effects to ask for, and causes that no library knows; all of them where empty.

    Raises
    ------
    EffectError
        If a kind or an effect is not known, or no case of a kind can be made of these effects.
    """
    from thermal_robot.blind.reality import FAULTS, UNLISTED

    for kind in counts:
        known = [k for k in get_args(Kind) if k != "real"]
        if kind not in known:
            raise EffectError(f"there is no kind of case {kind!r}; known: {', '.join(known)}")
    for name in (*only_effects, *unlisted):
        if name not in FAULTS and name not in UNLISTED:
            raise EffectError(f"the trial cannot make {name!r}; it can make {', '.join((*FAULTS, *UNLISTED))}")
    effects = [name for name in (only_effects or FAULTS) if name in FAULTS]
    causes = list(unlisted or UNLISTED)
    cases: list[Case] = []
    # several campaigns have a stream of their own: whoever asks for them, too, has the same single ones
    for letter, stream, several in (("c", 4, False), ("s", 6, True)):
        rng, drawn, places = np.random.default_rng([seed, stream]), list[Asked](), dict.fromkeys(counts, 0)
        for kind, count in counts.items():
            if (kind in SEVERAL) is several:
                drawn += [{"kind": kind, **asked} for asked in islice(turns(kind, effects, causes, rng), count)]
        order, seeds = rng.permutation(len(drawn)), rng.integers(2**62, size=len(drawn))
        for number, k in enumerate(order):
            kind = drawn[k]["kind"]
            robot = robots[(places[kind] + int(rng.integers(len(robots)))) % len(robots)]
            places[kind] += 1
            cases.append(Case(f"{letter}{number:04d}", int(seeds[number]), robot=robot, **drawn[k]))
    return tuple(cases)
