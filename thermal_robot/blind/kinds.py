"""What is asked in cases of each kind: effects and causes in turn, or each by a chance of its own."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations
from typing import Any

import numpy as np

from thermal_robot.effects import library
from thermal_robot.errors import EffectError

Asked = dict[str, Any]
"""Fields of a :class:`~thermal_robot.blind.cases.Case`."""

LARGE, LAGGING = (10.0, 60.0), (10.0, 40.0)
"""× noise: effects as large as on real robots, and those with a lag or a time constant."""
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
"""Of a mixture: the largest chance of an effect, as each draws its own in each case, and that of an unlisted cause."""
MIXED: Asked = {"ratio": (0.3, 10.0), "samples": (40, 140)}
EVERYTHING = ("moving", "temperature", "sensor:links", "sessions", "humidity", "motor_temperature", "speed")
"""Recorded in every mixture: a column that is there for its cause alone would give it away."""
REPEATED = 1.0 / 3.0
"""Share of mixtures whose poses are visited several times, without which nobody tells scatter from steps."""

CONTAINS = {"geometric": {"joint_offset", "instrument_scale"}}
"""What a larger effect can do exactly as well (formats.md)."""
IMITATES = {"transmission_error": {"joint_gain"}, "link_compliance": {"base_compliance"}}
"""What a larger effect can do nearly as well: over less than a turn, two harmonics are a straight line; the upright
link that stands on the base bends under the moment that tips it."""
RANDOM = ("encoder_resolution", "excess_repeatability")
"""Effects that scatter: they leave nothing for a mean to explain, and are asked alone."""
CONDITION = {
    "thermal_elongation": ("temperature",),
    "drift": ("time",),
    "backlash": ("approach",),
    "tracking_lag": ("velocity", "acceleration", "approach"),
}
"""Columns that a cause cannot be seen without."""
_FRAMES = ("base_frame", "tool_frame")


def turns(kind: str, effects: Sequence[str], causes: Sequence[str], rng: np.random.Generator) -> Iterator[Asked]:
    """Yield what is asked in cases of one kind, without end.

    Parameters
    ----------
    kind
        As in :mod:`thermal_robot.blind.cases`, without ``real``.
    effects, causes
        Listed and unlisted ones that may be asked for.
    rng
        For the order, and for what is left to chance.

    Raises
    ------
    EffectError
        If no case of this kind can be made of them.
    """
    apart = [name for name in effects if name not in (*RANDOM, *_FRAMES)]
    if kind == "mixed":
        return _mixtures([name for name in effects if name not in _FRAMES], causes, rng)
    if kind == "many":
        return _together(apart, rng)
    menu = _menu(kind, effects, apart, causes)
    if not menu or (kind == "both" and not apart):
        raise EffectError(f"no case of kind {kind!r} can be made of {', '.join(effects)}")
    return _beside(menu, apart, rng) if kind == "both" else in_turn(menu, rng)


def _menu(kind: str, effects: Sequence[str], apart: Sequence[str], causes: Sequence[str]) -> list[Asked]:
    # contained effects are no loss where the library keeps the container
    contained = {name for outer, inner in (*CONTAINS.items(), *IMITATES.items()) if outer in effects for name in inner}
    menus: dict[str, list[Asked]] = {
        "null": [{}],
        "single": [{"effects": (name,)} for name in effects],
        "large": [{"effects": (name,), "ratio": LARGE} for name in effects],
        "visits": [{"effects": (n,), "wants": ("repeats",)} for n in effects if n == "encoder_resolution"],
        "lags": [{**asked, "ratio": LAGGING} for asked in LAGS if asked["effects"][0] in effects],
        "hard": [{"effects": (name,), **HARD} for name in apart],
        "pair": [{"effects": chosen} for chosen in combinations(apart, 2) if not alike(chosen)],
        # one that the library does not have yet needs not be taken out
        "removed": [{"effects": (n,), "without": (n,) if n in library() else ()} for n in apart if n not in contained],
        "hidden": [{"effects": (name,), "hidden": CONDITION[name]} for name in apart if name in CONDITION],
        "unlisted": [{"unlisted": name} for name in causes],
        "both": [{"unlisted": name} for name in causes],
    }
    return menus[kind]


def in_turn(menu: Sequence[Asked], rng: np.random.Generator) -> Iterator[Asked]:
    """Yield every item as often as any other."""
    while True:
        for k in rng.permutation(len(menu)):
            yield menu[k]


def _beside(menu: Sequence[Asked], apart: Sequence[str], rng: np.random.Generator) -> Iterator[Asked]:
    """Yield causes in turn, each with one or two effects by chance."""
    for asked in in_turn(menu, rng):
        yield {**asked, "effects": _several(apart, int(rng.integers(1, 3)), rng)}


def _together(apart: Sequence[str], rng: np.random.Generator) -> Iterator[Asked]:
    """Yield sets of many effects, each number of them as often as any other."""
    if len(apart) < MANY[1]:
        raise EffectError(f"many effects together are up to {MANY[1]}, of {', '.join(apart) or 'none'}")
    while True:
        yield {"effects": _several(apart, int(rng.integers(MANY[0], MANY[1] + 1)), rng)}


def _several(apart: Sequence[str], number: int, rng: np.random.Generator) -> tuple[str, ...]:
    while True:
        chosen = tuple(apart[k] for k in sorted(rng.permutation(len(apart))[:number]))
        if not alike(chosen):
            return chosen


def _mixtures(effects: Sequence[str], causes: Sequence[str], rng: np.random.Generator) -> Iterator[Asked]:
    """Yield cases in which every effect has a chance of its own: something to hold probabilities against.

    Sets in which one contains another are drawn again.
    """
    while True:
        repeated = bool(rng.random() < REPEATED)
        asked = [n for n in effects if repeated or n != "excess_repeatability"]
        drawn = tuple(name for name in asked if rng.random() < rng.uniform(0.0, CHANCE))
        if not _containing(drawn):
            strange = causes[int(rng.integers(len(causes)))] if causes and rng.random() < STRANGE else None
            wants = (*EVERYTHING, *(("repeats",) if repeated else ()))
            yield {"effects": drawn, "unlisted": strange, "wants": wants, **MIXED}


def _containing(chosen: Sequence[str]) -> bool:
    return any(inner in CONTAINS.get(outer, ()) for outer in chosen for inner in chosen)


def alike(chosen: Sequence[str]) -> bool:
    """Whether one of them contains another, or can do nearly the same."""
    return _containing(chosen) or any(inner in IMITATES.get(outer, ()) for outer in chosen for inner in chosen)
