"""Texts of comparisons, fleets and wear: headlines, tables, and plain text."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import isfinite
from typing import TYPE_CHECKING, Any

from thermal_robot.report import units
from thermal_robot.report.plain_text import wrap
from thermal_robot.report.words import about_in_line, capitalised, listed
from thermal_robot.tables import aligned

if TYPE_CHECKING:
    from thermal_robot.fleet.wear_result import Crossing, Wear, Worn

Plain = Mapping[str, Any]
Line = tuple[str, ...]
_STATUS = {
    "shared": "the same in all campaigns",
    "changed": "changed",
    "contradicts": "loses its name",
    "not_needed": "not needed",
    "not_compared": "not compared",
    "absent": "not at work",
}


def comparison_headline(comparison: Plain) -> str:
    """Return the result of a comparison in one or two sentences."""
    effects, changes = comparison["effects"], comparison["changes"]
    same = [e["title"] for e in effects if e["status"] == "shared"]
    lost = [e["title"] for e in effects if e["name"] in comparison["verdict"]["lost"]]
    nameless = {e["name"] for e in effects if e["status"] == "contradicts"}
    kept = [change for change in changes if change["effect"] not in nameless]
    told = []
    if kept:
        more = f" and {len(kept) - 3} more" if len(kept) > 3 else ""
        told.append(f"{capitalised(listed([_in_short(change) for change in kept[:3]]))}{more}.")
    elif not lost:
        what = "What differs" if changes else "Nothing changed"
        names = listed([c["name"] for c in comparison["campaigns"]])
        told.append(f"{what} between {names}{' has no name' * bool(changes)}.")
    if same:
        told.append(f"They share {listed(same)}." if not kept else f"The same in all: {listed(same)}.")
    if lost:
        told.append(f"{capitalised(listed(lost))} {'loses its' if len(lost) == 1 else 'lose their'} name.")
    return " ".join(told)


def campaigns_in_words(comparison: Plain) -> Iterator[str]:
    """Yield each campaign with its diagnosis, or a model file, in words."""
    for campaign in comparison["campaigns"]:
        samples = f"{campaign['samples']} samples. " if campaign["samples"] else ""
        about = f" ({about_in_line(campaign['about'])})" if campaign.get("about") else ""
        yield f"{campaign['name']}{about}: {samples}{campaign['diagnosis']}"


def changes(comparison: Plain) -> list[str]:
    """Return the changes in words: place, time, values, certainty."""
    names = [c["name"] for c in comparison["campaigns"]]
    return [_change(change, names) for change in comparison["changes"]]


def _change(change: Plain, names: Sequence[str]) -> str:
    told = _in_short(change)
    if change["values"]:
        shown = units.together(change["values"], change["unit"])
        told += ": " + ", ".join(f"{value} in {name}" for name, value in zip(names, shown, strict=True))
    elif len(change["parameters"]) > 1:
        told += f" ({len(change['parameters'])} parameters)"
    return f"{told}; χ² {change['chi2']:.1f} on {change['degrees']}, {_chance(change['p_value'])} by chance"


def _in_short(change: Plain) -> str:
    place = change["place"] or change["kind"]
    groups = listed([" with ".join(group) for group in change["groups"]])
    when = f" since {change['since']}" if change["since"] else f" between {groups}"
    return f"{change['title']}{f' at {place}' if place else ''} changed{when}"


def _chance(p_value: float | None) -> str:
    """Format a p-value in per cent; what is unknown is a dash."""
    if p_value is None or not isfinite(p_value):
        return units.MISSING
    if p_value < 1e-5:
        return "below 0.001 %"
    return units.percent(p_value, 0) if p_value > 0.1 else f"{100.0 * p_value:.2g} %"


def comparison_tables(comparison: Plain) -> dict[str, list[Line]]:
    """Tables of effects, parameters and predictions, the names of the columns first.

    Effects: what became of each that is named or at work, χ² of equal parameters over its degrees, and the p-value.
    Parameters: each campaign's value ± one standard deviation, and the largest difference. Predictions: of each two
    campaigns the rms difference, its stated deviation, and the share of poses beyond twice that.
    """
    names = [c["name"] for c in comparison["campaigns"]]
    return {
        "effects": [("effect", "in the joint fit", "χ²", "by chance"), *_effects(comparison)],
        "parameters": [("effect", "parameter", *names, "difference", "by chance"), *_parameters(comparison)],
        "predictions": [("campaigns", "verdict", "differ, rms", "stated", "beyond twice"), *_predictions(comparison)],
    }


def _effects(comparison: Plain) -> Iterator[Line]:
    for effect in comparison["effects"]:
        if effect["status"] == "absent":
            continue
        status = _STATUS[effect["status"] if effect["named"] or effect["status"] != "contradicts" else "absent"]
        status += f": {effect['reason']}" if effect["reason"] else ""
        ratio, chance = units.MISSING, units.MISSING
        if effect["degrees"]:
            ratio, chance = f"{effect['chi2']:.1f} on {effect['degrees']}", _chance(effect["p_value"])
        yield effect["name"], status, ratio, chance


def _parameters(comparison: Plain) -> Iterator[Line]:
    for (effect, name, difference, _, chance), each in comparison_parameters(comparison):
        yield effect, name, *(value for _, value in each), difference, chance


def comparison_parameters(comparison: Plain) -> Iterator[tuple[Line, list[Line]]]:
    """Yield each parameter: effect, name, largest difference, between which campaigns, chance; then each value."""
    names = [c["name"] for c in comparison["campaigns"]]
    for effect in comparison["effects"]:
        for p in effect["parameters"]:
            values = [abs(v) for v in p["values"] if v is not None]
            if not values:
                continue
            scale = units.scale(p["unit"], max(*values, *(s for s in p["stds"] if s is not None)))
            each = [_with_deviation(v, s, scale) for v, s in zip(p["values"], p["stds"], strict=True)]
            difference = _with_deviation(p["difference"], p["std"], scale)
            cells = effect["name"], p["name"], difference, listed(p["between"]), _chance(p["p_value"])
            yield cells, list(zip(names, each, strict=True))


def _with_deviation(value: float | None, std: float | None, scale: units.Scale) -> str:
    if value is None or std is None:
        return units.MISSING
    digits = units.number(std * scale.factor, 2)
    places = len(digits.partition(".")[2])
    number = f"{value * scale.factor:.{places}f}".replace("-", "−")
    return f"{number} ± {digits}{f' {scale.unit}' if scale.unit != '1' else ''}"


def _predictions(comparison: Plain) -> Iterator[Line]:
    for p in comparison["predicted"]:
        both = " and ".join(p["campaigns"])
        if p["note"]:
            yield both, p["note"], units.MISSING, units.MISSING, units.MISSING
            continue
        difference, stated = units.together((p["rms"], p["stated"]), "m")
        verdict = "agree" if p["agrees"] else "differ by more than noise: a model is wrong, or the robot changed"
        yield both, verdict, difference, stated, f"{units.percent(p['beyond'], 0)} of {p['poses']}"


_MOST_PARAMETERS = 40


def comparison_text(comparison: Plain) -> str:
    """Plain text of a comparison.

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
    yield wrap(comparison_headline(comparison), "")
    yield ""
    for said in campaigns_in_words(comparison):
        yield wrap(said, "", 2)
    yield from ("", "CHANGED")
    for line in changes(comparison) or ["nothing"]:
        yield wrap(line, "  ", 2)
    told = comparison_tables(comparison)
    yield from ("", "EFFECTS", *_table(told["effects"]))
    if told["parameters"][1:]:
        yield from ("", "PARAMETERS, each by its own campaign, ± one standard deviation")
        yield from _table(told["parameters"], _MOST_PARAMETERS, ", in the JSON")
    (both, _, *heads), *rows = told["predictions"]
    verdict_last = [(both, *heads, ""), *((both, *figures, verdict) for both, verdict, *figures in rows)]
    yield from ("", "PREDICTIONS where both measured, frames aligned", *_table(verdict_last))
    if comparison["not_told"]:
        yield from ("", "NOT COMPARED, as frames or other parameters take it up")
        yield wrap(", ".join(comparison["not_told"]))


def _table(rows: Sequence[Line], most: int | None = None, elsewhere: str = "") -> Iterator[str]:
    """Align a limited number of rows below their heads, and count the others."""
    shown = rows if most is None else rows[: 1 + most]
    yield from (f"  {line}" for line in aligned(shown, left=range(len(rows[0]))))
    if len(rows) > len(shown):
        yield f"  … and {len(rows) - len(shown)} more{elsewhere}"


_MOST_PLACES = 4


def fleet_headline(summary: Plain) -> str:
    """Return the number of campaigns and their outcomes in words."""
    campaigns, robots = summary["campaigns"], summary["robots"]
    told = ", ".join(f"{n} {what}" for what, n in summary["outcomes"].items() if n)
    return f"{campaigns} campaign{'s' * (campaigns != 1)} of {robots} robot{'s' * (robots != 1)}: {told}."


def _found(summary: Plain) -> Iterator[Line]:
    yield ("effect", "robots in which it was found", "mostly in")
    for effect in summary["effects"]:
        if effect["found"]:
            places = [f"{place} {n}" for place, n in effect["places"].items()]
            told = [*places[:_MOST_PLACES], *["…"] * (len(places) > _MOST_PLACES)]
            count = f"{effect['found']} of {effect['testable']}"
            rivals = f", in {effect['confounded']} or another" if effect["confounded"] else ""
            yield _named(effect["effect"]), count + rivals, ", ".join(told)


def _gathered(summary: Plain) -> Iterator[Line]:
    yield ("effect", "group", "found there", "elsewhere", "by chance")
    for g in summary["gathered"]:
        there, elsewhere = f"{g['found']} of {g['robots']}", f"{g['found_elsewhere']} of {g['robots_elsewhere']}"
        yield _named(g["effect"]), f"{g['label']} {g['group']}", there, elsewhere, _chance(g["p_value"])


def _shared(summary: Plain) -> Iterator[Line]:
    yield ("effect", "parameter", "mean", "spread between robots", "robots", "zero by chance")
    for s in summary["shared"]:
        if not s["label"]:
            mean, spread = (units.measured(s[k], s[f"{k}_std"], s["unit"]) for k in ("mean", "spread"))
            yield _named(s["effect"]), s["parameter"], mean, spread, str(s["robots"]), _chance(s["p_mean"])


def _differs(summary: Plain) -> Iterator[Line]:
    yield ("effect", "parameter", "group", "mean there", "robots", "alike by chance")
    for s in summary["shared"]:
        for k, g in enumerate(s["groups"]):
            first = (_named(s["effect"]), s["parameter"]) if not k else ("", "")
            mean = units.measured(g["mean"], g["mean_std"], s["unit"])
            yield *first, f"{s['label']} {g['group']}", mean, str(g["robots"]), "" if k else _chance(s["p_label"])


def _apart(summary: Plain) -> Iterator[Line]:
    yield ("robot", "effect", "parameter", "value", "usual", "stands out")
    for a in summary["apart"]:
        value, usual = units.measured(a["value"], a["std"], a["unit"]), units.quantity(a["usual"], a["unit"])
        yield a["robot"], _named(a["effect"]), a["parameter"], value, usual, units.probability(a["probability"])


def _cases(summary: Plain) -> Iterator[Line]:
    yield ("robot", "campaign", "effect", "place", "probability", "gap", "after")
    for c in summary["found"]:
        before, after = (units.quantity(c[name], "m") for name in ("rms_before", "rms_after"))
        rivals = f" (or {' or '.join(map(_named, c['confounded_with']))})" if c["confounded_with"] else ""
        effect = _named(c["effect"] or "no effect explains it") + rivals
        yield c["robot"], c["campaign"], effect, c["place"], units.probability(c["probability"]), before, after


def _named(effect: str) -> str:
    return effect.replace("_", " ")


def failures(summary: Plain) -> list[str]:
    """Campaigns without a diagnosis, with the reason."""
    return [f"{name} ({outcome}): {reason}" for name, outcome, reason in summary["failures"]]


_SECTIONS = {
    "Effects by how often they were found": _found,
    "Found in one group more often than elsewhere": _gathered,
    "The same in all robots": _shared,
    "Different between groups": _differs,
    "Robots that stand out": _apart,
    "What is wrong with which robot, largest gaps first": _cases,
}


def fleet_tables(summary: Plain) -> dict[str, list[Line]]:
    """Tables of a fleet by heading, the names of the columns first; empty ones are left out."""
    told = {heading: list(lines(summary)) for heading, lines in _SECTIONS.items()}
    return {heading: table for heading, table in told.items() if table[1:]}


_MOST_LINES = 12
_REST = "; the page and the table have all"


def fleet_text(summary: Plain) -> str:
    """Plain text of a fleet's summary.

    Parameters
    ----------
    summary
        Of the format ``thermal-robot/fleet/1``.
    """
    lines = [fleet_headline(summary)]
    for heading, table in fleet_tables(summary).items():
        lines += ["", heading, *_table(table, _MOST_LINES, _REST)]
    if reasons := failures(summary):
        lines += ["", "Without a diagnosis", *(f"  {line}" for line in reasons[:_MOST_LINES])]
        lines += [f"  … and {len(reasons) - _MOST_LINES} more{_REST}"] * (len(reasons) > _MOST_LINES)
    return "\n".join(lines)


def wear_table(wear: Wear) -> list[Line]:
    """Table of the parameters over time: kind of change, limit, size, rate, certainty."""
    heads = ("parameter", "how it moves", "limit", "change", "a day", "moved", "by chance")
    return [heads, *((w.parameter, _does(w), *_figures(w)) for w in wear.parameters)]


def _does(worn: Worn) -> str:
    if not worn.comparable:
        return f"cannot be compared: {worn.reason}"
    does = {"jump": "jumps", "trend": "moves steadily", "walk": "wanders", "constant": "stays"}[worn.kind]
    if not worn.alarm and worn.kind == "constant":
        return does
    beside = f"; or {', '.join(worn.confounded_with)}" if worn.confounded_with else ""
    return f"{does}{'' if worn.alarm else ', perhaps'}{beside}"


def _figures(worn: Worn) -> Line:
    if not worn.comparable:
        return (units.MISSING,) * 5
    change = rate = limit = units.MISSING
    if worn.kind != "constant":
        change = units.measured(worn.change, worn.change_std, worn.unit)
    if worn.rate:
        rate = units.measured(worn.rate.value, worn.rate.std, worn.unit)
    if worn.crossing is not None:
        limit, dates = worn.crossing.state, worn.crossing.dates
        if limit == "expected":
            limit = f"{dates[0]} ({dates[1]} to {dates[2] or 'never'})".replace("-", "\u2011")  # dates do not break
    return limit, change, rate, units.probability(worn.moved), _chance(min(worn.chance, 1.0))


def wear_visits(wear: Wear) -> list[Line]:
    """Table of the campaigns in the order of time, with a column ``about`` only where the user stated anything."""
    told = any(visit.about for visit in wear.campaigns)
    lines: list[Line] = [("campaign", "date", "about", "rows used")]
    lines += [(v.name, v.date, about_in_line(v.about), str(v.rows)) for v in wear.campaigns]
    return lines if told else [(name, date, rows) for name, date, _, rows in lines]


def wear_headline(wear: Wear) -> str:
    """Return what moved over time, how and when, in one sentence."""
    span = f"{len(wear.campaigns)} campaigns of {wear.robot}"
    if not wear.alarms:
        return f"Over {span} nothing moves that would not by chance in {_rarely(wear.false_alarm)} of such series."
    return f"Over {span}: {'; '.join(_moves(wear, worn) for worn in wear.alarms)}."


def wear_text(wear: Wear) -> str:
    """Plain text of one robot over time: parameters with alarms by kind of change, those that stay, and the others."""
    return "\n".join(_wear_lines(wear))


def _wear_lines(wear: Wear) -> Iterator[str]:
    first, last = wear.campaigns[0], wear.campaigns[-1]
    days = f", {first.date} to {last.date}, {last.time:.0f} days" if wear.dated else ", in order; no dates, so no rates"
    yield wear.summary
    yield ""
    yield f"campaigns    {len(wear.campaigns)}{days}"
    yield f"alarms       at most {_rarely(max(wear.false_alarm, 1e-5))} of series without a change ring"
    nothing = units.probability(wear.nothing)
    yield f"scatter      {wear.scatter:.2f} of what the deviations say; nothing moved: {nothing}"
    for worn in wear.alarms:
        yield ""
        yield from _of_one(wear, worn)
    if doubtful := [w for w in wear.parameters if w.perhaps]:
        yield ""
    for w in doubtful:
        yield f"perhaps      {_moves(wear, w)}: {units.percent(w.moved, 0)}, but no alarm"
    yield ""
    stays = [w for w in wear.parameters if w.comparable and not w.alarm and not w.perhaps]
    if stays:
        yield f"stays        {'; '.join(f'{w.parameter} (moved: {units.percent(w.moved)})' for w in stays)}"
    yield from (f"limit        {w.parameter}: {_reaches(w.crossing, w.unit)}" for w in stays if w.crossing is not None)
    hidden = [w for w in wear.parameters if not w.comparable]
    for reason in dict.fromkeys(w.reason for w in hidden):
        yield f"not compared {', '.join(w.parameter for w in hidden if w.reason == reason)}: {reason}"
    yield from (f"note         {note}" for note in wear.notes)


def _of_one(wear: Wear, worn: Worn) -> Iterator[str]:
    yield f"ALARM        {_moves(wear, worn)}"
    kinds = ", ".join(f"{kind} {units.percent(p, 0)}" for kind, p in worn.kinds.items() if p >= 0.005)
    yield f"             chance of such an alarm without a change: at most {worn.chance:.1g}; {kinds}"
    if worn.jump:
        yield f"             95 %: {_between(wear, worn.jump.earliest, worn.jump.latest)}"
    if worn.confounded_with:
        yield f"             cannot be told from a change of {', '.join(worn.confounded_with)}"
    if worn.crossing:
        yield f"             {_reaches(worn.crossing, worn.unit)}"


def _moves(wear: Wear, worn: Worn) -> str:
    """Describe the change of one parameter."""
    name = worn.parameter
    if worn.jump is not None:
        size = _signed(worn.jump.size, worn.jump.std, worn.unit)
        where = _between(wear, worn.jump.after, worn.jump.after + 1)
        return f"{name} jumped by {size} {where} ({units.percent(worn.jump.probability, 0)})"
    if worn.rate is not None:
        return f"{name} moves by {_signed(worn.rate.value, worn.rate.std, worn.unit)} a day"
    how = "moves steadily" if worn.kind == "trend" else "wanders"
    return f"{name} {how}, by {_signed(worn.change, worn.change_std, worn.unit)} from first to last"


def _signed(value: float, std: float, unit: str) -> str:
    return f"{'+' if value > 0.0 else ''}{units.measured(value, std, unit)}"


def _between(wear: Wear, first: int, last: int) -> str:
    visits = (wear.campaigns[first], wear.campaigns[last])
    return "between " + " and ".join(f"{v.name} ({v.date})" if wear.dated else v.name for v in visits)


def _reaches(crossing: Crossing, unit: str) -> str:
    limit = f"limit {units.quantity(crossing.limit, unit)}"
    said = {
        "passed": "passed",
        "never": "never, as it does not go there",
        "unknown": "not foreseen, for lack of a rate",
    }
    if crossing.state in said:
        return f"{limit}: {said[crossing.state]}"
    expected, low, high = crossing.dates
    return f"{limit}: about {expected} (95 %: {low} to {high or 'never'})"


def _rarely(probability: float) -> str:
    return f"{100.0 * probability:.2g} %"
