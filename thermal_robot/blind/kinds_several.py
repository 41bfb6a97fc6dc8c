"""What is asked in cases of several campaigns: pairs, series of days and fleets, each in turn."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product

import numpy as np

from thermal_robot.blind.cases import How, Several
from thermal_robot.blind.kinds import Asked, alike, in_turn
from thermal_robot.errors import EffectError

LOCAL = ("joint_offset", "joint_gain", "backlash", "joint_compliance")
"""Effects with one number a joint that formats.md defines: of such a number it can be asked whether it changed, and of
which joint. Of a bent link's six numbers some are a joint's zero as well."""
BESIDE = (*LOCAL, "link_compliance", "thermal_elongation")
"""Effects that a robot may have on all days: its own, and none that begins anew with a campaign."""
SIZES = {"changes": (4.0, 4.0), "jumps": (4.0, 4.0), "begins": (16.0, 64.0), "grows": (8.0, 16.0)}
"""Of a change, in deviations. Four are what the program is to find. What begins has to be named in campaigns that have
it: with 90 rows 16 to 64 deviations leave one to four times the noise, as the effects of other kinds do. What grows by
8 to 16 over all has passed four in the middle."""
PAIR, DAYS, ROBOTS = (2, 2), (12, 12), (10, 14)
"""Campaigns of a pair, of a series (a year of months), and robots of a fleet: few, in two halls of five or more, which
is the least of which the program tells a mean."""
APART = (2, 4)
"""Fewest and most robots of a fleet with a fault of their own."""
PLACES = 2
"""Joints between the first and the last of the arm with the fewest: so many faults of one kind have room in a fleet."""
_FLEETS: tuple[How, ...] = ("all", "hall", "")


def turns_of_several(kind: str, effects: Sequence[str], rng: np.random.Generator) -> Iterator[Asked]:
    """Yield what is asked in cases of one kind, without end.

    Parameters
    ----------
    kind
        ``same``, ``changed``, ``steady``, ``series`` or ``fleet``.
    effects
        That may be asked for.
    rng
        For the order, and for what is left to chance.

    Raises
    ------
    EffectError
        If no case of this kind can be made of them.
    """
    local = [name for name in LOCAL if name in effects]
    always = [name for name in BESIDE if name in effects]
    if not (always if kind in ("same", "steady") else local):
        raise EffectError(f"no case of kind {kind!r} can be made of {', '.join(effects)}; it takes {', '.join(LOCAL)}")
    if kind == "fleet":
        return _fleets(local, rng)
    if kind in ("same", "steady"):
        return _unchanged(PAIR if kind == "same" else DAYS, always, rng)
    ways: tuple[How, ...] = ("changes",) if kind == "changed" else ("begins", "jumps", "grows")
    campaigns = PAIR if kind == "changed" else DAYS
    menu = [{"several": Several(campaigns, how, name, SIZES[how])} for name, how in product(local, ways)]
    return _changing(menu, always, rng)


def _unchanged(campaigns: tuple[int, int], always: Sequence[str], rng: np.random.Generator) -> Iterator[Asked]:
    """Yield robots with one or two effects that stay."""
    for asked in in_turn([{"effects": (name,)} for name in always], rng):
        yield {"effects": _with_another(asked["effects"], always, rng), "several": Several(campaigns)}


def _changing(menu: Sequence[Asked], always: Sequence[str], rng: np.random.Generator) -> Iterator[Asked]:
    """Yield changes in turn, every second robot with another effect that stays."""
    for asked in in_turn(menu, rng):
        yield {**asked, "effects": _with_another((asked["several"].moves,), always, rng)}


def _with_another(first: tuple[str, ...], always: Sequence[str], rng: np.random.Generator) -> tuple[str, ...]:
    """Add another effect in every second case, by chance, unless the two do the same."""
    second = str(always[int(rng.integers(len(always)))])
    wanted = bool(rng.random() < 0.5)
    return first if not wanted or second in first or alike((*first, second)) else (*first, second)


def _fleets(local: Sequence[str], rng: np.random.Generator) -> Iterator[Asked]:
    """Yield fleets in which all robots, those of one hall or none share a fault, and some have one of their own."""
    menu: list[Asked] = [{"how": how, "moves": name} for how, name in product(_FLEETS, local)]
    for asked in in_turn(menu, rng):
        how, moves = asked["how"], asked["moves"] if asked["how"] else ""
        effects = (moves,) if moves else ()
        yield {"effects": effects, "several": Several(ROBOTS, how, moves, apart=_apart(effects, local, rng))}


def _apart(shared: tuple[str, ...], local: Sequence[str], rng: np.random.Generator) -> tuple[str, ...]:
    """Draw faults of single robots, no more of one kind than every arm has places for."""
    places = [name for name in local for _ in range(PLACES - shared.count(name))]
    count = min(int(rng.integers(APART[0], APART[1] + 1)), len(places))
    return tuple(places[k] for k in rng.permutation(len(places))[:count])
