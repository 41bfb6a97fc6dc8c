"""A fleet's summary in words: one line for each thing that is to be said, for text and page alike."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from thermal_robot.report import units

Plain = Mapping[str, Any]

FOUND = ("effect", "robots in which it was found", "mostly in")
GATHERED = ("effect", "group", "found there", "elsewhere", "by chance")
SHARED = ("effect", "parameter", "mean", "spread between robots", "robots", "zero by chance")
DIFFERS = ("effect", "parameter", "group", "mean there", "robots", "alike by chance")
APART = ("robot", "effect", "parameter", "value", "usual", "stands out")
CASES = ("robot", "campaign", "effect", "place", "probability", "gap", "after")
_MOST_PLACES = 4


def headline(summary: Plain) -> str:
    """Say how many campaigns there were and what became of them."""
    counts = [(n, what) for what, n in summary["outcomes"].items() if n]
    told = ", ".join(f"{n} {what}" for n, what in counts)
    return f"{_many(summary['campaigns'], 'campaign')} of {_many(summary['robots'], 'robot')}: {told}."


def _many(count: int, word: str) -> str:
    return f"{count} {word}{'' if count == 1 else 's'}"


def found(summary: Plain) -> Iterator[tuple[str, ...]]:
    """Yield how often each effect was found; those never found are left out."""
    for effect in summary["effects"]:
        if effect["found"]:
            places = list(effect["places"].items())
            told = ", ".join(f"{place} {n}" for place, n in places[:_MOST_PLACES])
            told += ", …" if len(places) > _MOST_PLACES else ""
            count = f"{effect['found']} of {effect['testable']}"
            yield _named(effect["effect"]), count + f", in {(n := effect['confounded'])} or another" * bool(n), told


def gathered(summary: Plain) -> Iterator[tuple[str, ...]]:
    """Yield what was found in one group more often than elsewhere."""
    for g in summary["gathered"]:
        group = f"{g['label']} {g['group']}"
        there, elsewhere = f"{g['found']} of {g['robots']}", f"{g['found_elsewhere']} of {g['robots_elsewhere']}"
        yield _named(g["effect"]), group, there, elsewhere, units.p_value(g["p_value"])


def shared(summary: Plain) -> Iterator[tuple[str, ...]]:
    """Yield the parameters that all robots share, and by how much robots differ."""
    for s in summary["shared"]:
        if not s["label"]:
            mean = units.measured(s["mean"], s["mean_std"], s["unit"])
            spread = units.measured(s["spread"], s["spread_std"], s["unit"])
            yield _named(s["effect"]), s["parameter"], mean, spread, str(s["robots"]), units.p_value(s["p_mean"])


def differs(summary: Plain) -> Iterator[tuple[str, ...]]:
    """Yield the parameters in which groups differ, each group in a line, the most different first."""
    for s in summary["shared"]:
        for k, g in enumerate(s["groups"]):
            first = (_named(s["effect"]), s["parameter"]) if not k else ("", "")
            mean = units.measured(g["mean"], g["mean_std"], s["unit"])
            yield *first, f"{s['label']} {g['group']}", mean, str(g["robots"]), "" if k else units.p_value(s["p_label"])


def apart(summary: Plain) -> Iterator[tuple[str, ...]]:
    """Yield the robots that stand out, each with its probability."""
    for a in summary["apart"]:
        value, usual = units.measured(a["value"], a["std"], a["unit"]), units.quantity(a["usual"], a["unit"])
        chance = units.probability(a["probability"])
        yield a["robot"], _named(a["effect"]), a["parameter"], value, usual, chance


def cases(summary: Plain) -> Iterator[tuple[str, ...]]:
    """Yield what was found in which campaign, the largest gaps first, and what else it may be."""
    for c in summary["found"]:
        before, after = (units.quantity(c[name], "m") for name in ("rms_before", "rms_after"))
        chance = units.probability(c["probability"])
        effect = _named(c["effect"] or "no effect explains it")
        effect += f" (or {' or '.join(map(_named, c['confounded_with']))})" * bool(c["confounded_with"])
        yield c["robot"], c["campaign"], effect, c["place"], chance, before, after


def failures(summary: Plain) -> Iterator[str]:
    """Yield the campaigns without a diagnosis, and why."""
    for name, outcome, reason in summary["failures"]:
        yield f"{name} ({outcome}): {reason}"


def _named(effect: str) -> str:
    return effect.replace("_", " ")


SECTIONS = (
    ("Effects by how often they were found", FOUND, found),
    ("Found in one group more often than elsewhere", GATHERED, gathered),
    ("The same in all robots", SHARED, shared),
    ("Different between groups", DIFFERS, differs),
    ("Robots that stand out", APART, apart),
    ("What is wrong with which robot, largest gaps first", CASES, cases),
)
"""Headings of the tables of a fleet, names of their columns, and what yields their lines."""
