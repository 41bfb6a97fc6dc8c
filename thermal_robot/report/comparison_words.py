"""A comparison in words: what text, page and notebook have in common."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from thermal_robot.report import units
from thermal_robot.report.sentence import listed

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


def headline(comparison: Plain) -> str:
    """Return what stayed and what changed in one plain sentence or two."""
    same = [e["title"] for e in comparison["effects"] if e["status"] == "shared"]
    lost = [e["title"] for e in comparison["effects"] if e["name"] in comparison["verdict"]["lost"]]
    names = [c["name"] for c in comparison["campaigns"]]
    kept = [c for c in comparison["changes"] if _status(comparison, c["effect"]) != "contradicts"]
    told = []
    if kept:
        told.append(f"{_upper(listed([change_in_short(c) for c in kept[:3]]))}{_more(len(kept) - 3)}.")
    elif not lost:
        what = "What differs" if comparison["changes"] else "Nothing changed"
        told.append(f"{what} between {listed(names)}{' has no name' * bool(comparison['changes'])}.")
    if same:
        told.append(f"They share {listed(same)}." if not kept else f"The same in all: {listed(same)}.")
    if lost:
        told.append(f"{_upper(listed(lost))} {'loses its' if len(lost) == 1 else 'lose their'} name.")
    return " ".join(told)


def _status(comparison: Plain, name: str) -> str:
    return next((str(e["status"]) for e in comparison["effects"] if e["name"] == name), "")


def _upper(text: str) -> str:
    return text[:1].upper() + text[1:]


def _more(count: int) -> str:
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
