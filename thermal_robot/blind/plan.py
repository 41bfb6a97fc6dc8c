"""Which cases a trial has: drawn from one seed, every effect and withholding of a kind in turn."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import get_args

import numpy as np

from thermal_robot.blind.cases import SEVERAL, Case, Kind, RobotChoice
from thermal_robot.blind.kinds import Asked, turns, turns_of_several
from thermal_robot.errors import EffectError, RobotError
from thermal_robot.robot import load_robot

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

SHORT = {
    "single": 12,
    "large": 6,
    "visits": 2,
    "lags": 3,
    "pair": 6,
    "many": 4,
    "null": 6,
    "hard": 6,
    "mixed": 8,
    "removed": 4,
    "hidden": 2,
    "unlisted": 8,
    "both": 2,
    "same": 1,
    "changed": 2,
    "steady": 1,
    "series": 2,
    "fleet": 1,
}
FULL = {
    "single": 200,
    "large": 100,
    "visits": 60,
    "lags": 99,
    "pair": 100,
    "many": 60,
    "null": 100,
    "hard": 100,
    "mixed": 700,
    "removed": 40,
    "hidden": 24,
    "unlisted": 216,
    "both": 48,
    "same": 60,
    "changed": 100,
    "steady": 60,
    "series": 96,
    "fleet": 30,
}


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
        In a drawn order, so that a case's number tells nothing; those of several campaigns after the others.

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
    effects = [name for name in (only_effects or FAULTS) if name in FAULTS]
    causes = list(unlisted or UNLISTED)
    alone = {kind: count for kind, count in counts.items() if kind not in SEVERAL}
    together = {kind: count for kind, count in counts.items() if kind in SEVERAL}
    rng = np.random.default_rng([seed, 4])
    drawn = _drawn(alone, lambda kind: turns(kind, effects, causes, rng))
    cases = _cases("c", drawn, alone, robots, rng)
    # a stream of their own: whoever asks for several campaigns, too, has the same single ones
    own = np.random.default_rng([seed, 6])
    drawn = _drawn(together, lambda kind: turns_of_several(kind, effects, own))
    return (*cases, *_cases("s", drawn, together, robots, own))


def _drawn(counts: Mapping[str, int], turn_of: Callable[[str], Iterator[Asked]]) -> list[Asked]:
    """Draw what is asked, kind by kind."""
    drawn: list[Asked] = []
    for kind, count in counts.items():
        turn = turn_of(kind)
        drawn += [{"kind": kind, **next(turn)} for _ in range(count)]
    return drawn


def _cases(
    letter: str,
    drawn: Sequence[Asked],
    counts: Mapping[str, int],
    robots: Sequence[RobotChoice],
    rng: np.random.Generator,
) -> Iterator[Case]:
    """Yield cases in a drawn order, each with a seed and a robot."""
    order = rng.permutation(len(drawn))
    seeds = rng.integers(2**62, size=len(drawn))
    places = {kind: 0 for kind in counts}
    for number, k in enumerate(order):
        asked = drawn[k]
        turn_of_robot = places[str(asked["kind"])] + int(rng.integers(len(robots)))
        places[str(asked["kind"])] += 1
        robot = robots[turn_of_robot % len(robots)]
        yield Case(f"{letter}{number:04d}", int(seeds[number]), robot=robot, **asked)
