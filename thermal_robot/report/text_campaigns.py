"""Campaigns compared, and fleets, in words: what text, page and notebook say, and the text itself."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from textwrap import fill
from typing import Any

from thermal_robot.report import units
from thermal_robot.report.words import capitalised, listed

Plain = Mapping[str, Any]
STATUS = {
    "shared": "the same in all campaigns",
    "changed": "changed",
    "contradicts": "loses its name",
    "not_needed": "not needed",
    "not_compared": "not compared",
    "absent": "not at work",
}
"""What each status of an effect is called."""


def comparison_headline(comparison: Plain) -> str:
    """Return what stayed and what changed in one plain sentence or two."""
    same = [e["title"] for e in comparison["effects"] if e["status"] == "shared"]
    lost = [e["title"] for e in comparison["effects"] if e["name"] in comparison["verdict"]["lost"]]
    names = [c["name"] for c in comparison["campaigns"]]
    kept = [c for c in comparison["changes"] if _status(comparison, c["effect"]) != "contradicts"]
    told = []
    if kept:
        told.append(f"{capitalised(listed([change_in_short(c) for c in kept[:3]]))}{_and_more(len(kept) - 3)}.")
    elif not lost:
        what = "What differs" if comparison["changes"] else "Nothing changed"
        told.append(f"{what} between {listed(names)}{' has no name' * bool(comparison['changes'])}.")
    if same:
        told.append(f"They share {listed(same)}." if not kept else f"The same in all: {listed(same)}.")
    if lost:
        told.append(f"{capitalised(listed(lost))} {'loses its' if len(lost) == 1 else 'lose their'} name.")
    return " ".join(told)


def _status(comparison: Plain, name: str) -> str:
    return next((str(e["status"]) for e in comparison["effects"] if e["name"] == name), "")


def _and_more(count: int) -> str:
    return f" and {count} more" if count > 0 else ""


def campaign_in_words(campaign: Plain) -> str:
    """Tell what was compared: a campaign with what its diagnosis says, or a model file."""
    samples = f"{campaign['samples']} samples. " if campaign["samples"] else ""
    return f"{campaign['name']}: {samples}{campaign['diagnosis']}"


def change_in_short(change: Plain) -> str:
    """Name a change and when it came."""
    place = change["place"] or change["kind"]
    where = f" at {place}" if place else ""
    return f"{change['title']}{where} changed{_when(change)}"


def _when(change: Plain) -> str:
    if change["since"]:
        return f" since {change['since']}"
    return f" between {' | '.join(', '.join(group) for group in change['groups'])}"


def change_in_words(change: Plain, names: Sequence[str]) -> str:
    """Tell a change: where, when, from what to what, and how sure that is."""
    told = change_in_short(change)
    if change["values"]:
        shown = units.together(change["values"], change["unit"])
        told += ": " + ", ".join(f"{value} in {name}" for name, value in zip(names, shown, strict=True))
    elif len(change["parameters"]) > 1:
        told += f" ({len(change['parameters'])} parameters)"
    return f"{told}; χ² {change['chi2']:.1f} on {change['degrees']}, {chance(change['p_value'])} by chance"


def chance(p_value: float | None) -> str:
    """Write the probability that chance alone does as much."""
    if p_value is None:
        return units.MISSING
    if p_value < 1e-5:
        return "below 0.001 %"
    return units.percent(p_value, 0) if p_value > 0.1 else f"{100.0 * p_value:.2g} %"


def effects(comparison: Plain) -> Iterator[tuple[str, str, str, str]]:
    """Yield for each effect that is named or at work: name, what became of it, χ² over its degrees, probability."""
    for effect in comparison["effects"]:
        if effect["status"] == "absent":
            continue
        status = STATUS[effect["status"] if effect["named"] or effect["status"] != "contradicts" else "absent"]
        status += f": {effect['reason']}" if effect["reason"] else ""
        ratio = f"{effect['chi2']:.1f} on {effect['degrees']}" if effect["degrees"] else units.MISSING
        yield effect["name"], status, ratio, chance(effect["p_value"]) if effect["degrees"] else units.MISSING


def parameters(comparison: Plain) -> Iterator[tuple[str, ...]]:
    """Yield for each parameter that a campaign tells: effect, name, value ± deviation each, difference, probability."""
    for effect in comparison["effects"]:
        for p in effect["parameters"]:
            told = [v for v in p["values"] if v is not None]
            if not told:
                continue
            size = max(max(abs(v) for v in told), max(s for s in p["stds"] if s is not None))
            each = [with_deviation(v, s, p["unit"], size) for v, s in zip(p["values"], p["stds"], strict=True)]
            apart = with_deviation(p["difference"], p["std"], p["unit"], size)
            yield effect["name"], p["name"], *each, apart, chance(p["p_value"])


def with_deviation(value: float | None, std: float | None, unit: str, size: float) -> str:
    """Write a value with its deviation in the unit that suits ``size``."""
    if value is None or std is None:
        return units.MISSING
    scale = units.scale(unit, size)
    digits = units.number(std * scale.factor, 2)
    places = len(digits.split(".")[1]) if "." in digits else 0
    number = f"{value * scale.factor:.{places}f}".replace("-", "−")
    return f"{number} ± {digits}{f' {scale.unit}' if scale.unit != '1' else ''}"


def predictions(comparison: Plain) -> Iterator[tuple[str, str, str, str, str]]:
    """Yield for each two campaigns: which, rms difference, its stated deviation, share beyond twice that, verdict."""
    for p in comparison["predicted"]:
        both = " and ".join(p["campaigns"])
        if p["note"]:
            yield both, units.MISSING, units.MISSING, units.MISSING, p["note"]
            continue
        difference, stated = units.together((p["rms"], p["stated"]), "m")
        verdict = "agree" if p["agrees"] else "differ by more than noise: a model is wrong, or the robot changed"
        yield both, difference, stated, f"{units.percent(p['beyond'], 0)} of {p['poses']}", verdict


_WIDTH = 96
_MOST = 40


def comparison_text(comparison: Plain) -> str:
    """Write a comparison for the person who measured.

    Parameters
    ----------
    comparison
        Of the format ``thermal-robot/comparison/1``.

    Returns
    -------
    str
        Plain text without a newline at the end: what stayed and what changed, effect by effect, parameter by
        parameter, and whether predictions agree.
    """
    return "\n".join(_comparison_lines(comparison))


def _comparison_lines(comparison: Plain) -> Iterator[str]:
    names = [c["name"] for c in comparison["campaigns"]]
    yield fill(comparison_headline(comparison), _WIDTH)
    yield ""
    for c in comparison["campaigns"]:
        yield fill(campaign_in_words(c), _WIDTH, subsequent_indent="  ")
    yield from ("", "CHANGED")
    told = [change_in_words(change, names) for change in comparison["changes"]]
    yield from (fill(line, _WIDTH, initial_indent="  ", subsequent_indent="    ") for line in told or ["nothing"])
    yield from ("", "EFFECTS")
    yield from _table([("effect", "in the joint fit", "χ²", "by chance"), *effects(comparison)])
    rows = list(parameters(comparison))
    if rows:
        yield from ("", "PARAMETERS, each by its own campaign, ± one standard deviation")
        yield from _table([("effect", "parameter", *names, "difference", "by chance"), *rows[:_MOST]])
        if len(rows) > _MOST:
            yield f"  … and {len(rows) - _MOST} more, in the JSON"
    yield from ("", "PREDICTIONS where both measured, frames aligned")
    yield from _table([("campaigns", "differ, rms", "stated", "beyond twice", ""), *predictions(comparison)])
    if comparison["not_told"]:
        yield from ("", "NOT COMPARED, as frames or other parameters take it up")
        yield fill(", ".join(comparison["not_told"]), _WIDTH, initial_indent="  ", subsequent_indent="  ")


def _table(rows: Sequence[Sequence[str]]) -> Iterator[str]:
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    for row in rows:
        yield "  " + "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()


FOUND = ("effect", "robots in which it was found", "mostly in")
GATHERED = ("effect", "group", "found there", "elsewhere", "by chance")
SHARED = ("effect", "parameter", "mean", "spread between robots", "robots", "zero by chance")
DIFFERS = ("effect", "parameter", "group", "mean there", "robots", "alike by chance")
APART = ("robot", "effect", "parameter", "value", "usual", "stands out")
CASES = ("robot", "campaign", "effect", "place", "probability", "gap", "after")
_MOST_PLACES = 4


def fleet_headline(summary: Plain) -> str:
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


_MOST_LINES = 12
_REST = "the page and the table have all"


def fleet_text(summary: Plain) -> str:
    """Return a summary in words: a headline, and tables of a few lines each.

    Parameters
    ----------
    summary
        Of the format ``thermal-robot/fleet/1``.
    """
    return "\n".join(_fleet_lines(summary))


def _fleet_lines(summary: Plain) -> Iterator[str]:
    yield fleet_headline(summary)
    for heading, heads, told in SECTIONS:
        if rows := list(told(summary)):
            yield from ("", heading)
            yield from _table([heads, *rows[:_MOST_LINES]])
            yield from _more(len(rows))
    if reasons := list(failures(summary)):
        yield from ("", "Without a diagnosis")
        yield from (f"  {line}" for line in reasons[:_MOST_LINES])
        yield from _more(len(reasons))


def _more(count: int) -> Iterator[str]:
    if count > _MOST_LINES:
        yield f"  … and {count - _MOST_LINES} more; {_REST}"
