"""The words of a blind trial that text, table and page share."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from thermal_robot.report import units

KINDS = {
    "single": "one effect",
    "large": "one large effect",
    "visits": "encoder steps, poses visited 2 to 5 times",
    "lags": "one large effect with a lag",
    "pair": "two effects",
    "many": "three to five effects",
    "null": "nothing but noise",
    "hard": "one small effect, few rows",
    "mixed": "effects and causes by chance, of any size",
    "removed": "effect taken out of the library",
    "hidden": "condition not recorded",
    "unlisted": "cause that no library knows",
    "both": "such a cause beside one or two effects",
    "real": "real campaigns",
    "same": "two campaigns, nothing changed",
    "changed": "two campaigns, one parameter changed",
    "steady": "twelve days, nothing changed",
    "series": "twelve days, something begins, jumps or grows",
    "fleet": "a small fleet, shared faults and single ones",
}
QUESTIONS = {
    "exact": "exactly what is at work, nothing else",
    "sound": "nothing named that is not at work",
    "first_named": "named first is an effect at work",
    "false_alarm": "false alarm",
    "located": "place named first is the first true one",
    "among_places": "place named first is a true one",
    "flagged": "called unexplained",
    "not_blamed": "no innocent effect named as 90 % probable",
    "place": "where it enters",
    "near_place": "there or beside it",
    "listed": "all listed effects found",
    "quantity": "what it follows, or rightly nothing",
    "named": "named what must be recorded",
    "asks": "advised to record it",
    "right": "right",
    "found": "found",
    "way": "told as a jump or as a trend, rightly",
    "day": "the day right",
    "day_within": "the day within its 95 % interval",
    "amount": "its size within its 95 % interval",
    "shared_found": "shared fault called shared",
    "own_kept": "fault of one robot not called shared",
    "own_named": "fault of one robot told of that robot",
}
_OF_KIND = {
    ("null", "exact"): "nothing found, nothing unexplained",
    ("removed", "right"): "called unexplained, none innocent named",
    ("unlisted", "right"): "called unexplained, none innocent named",
    ("both", "right"): "listed ones found, the rest unexplained",
    ("hidden", "right"): "unexplained, nobody blamed, told to record it",
    ("real", "right"): "right, by the rule of each question",
    **dict.fromkeys((("same", "exact"), ("steady", "exact")), "nothing told to have changed"),
    ("same", "listed"): "all effects at work keep their name",
    ("changed", "listed"): "all effects at work keep their name",
    ("changed", "exact"): "what changed is told, and nothing else",
    ("series", "exact"): "what, where, how and when, and nothing else",
    ("series", "place"): "the joint rings, whatever is blamed",
    ("fleet", "exact"): "all that is shared, and nothing else",
    **dict.fromkeys((("changed", "found"), ("series", "found")), "effect and place of the change told"),
    **dict.fromkeys((("changed", "false_alarm"), ("series", "false_alarm")), "another change told"),
    ("fleet", "false_alarm"): "something else called shared",
}
_EFFECTS = {
    "geometric": "link geometry",
    "joint_offset": "joint zero",
    "excess_repeatability": "excess scatter",
    "unlisted": "not in any library",
    "failed": "no answer",
}


def kind(name: str) -> str:
    """Say in plain words what kind of case."""
    return KINDS.get(name, name)


def question(name: str, of_kind: str = "") -> str:
    """Say in plain words what was asked."""
    return _OF_KIND.get((of_kind, name), QUESTIONS.get(name, name))


def effect(name: str) -> str:
    """Say in plain words which effect, or what was said instead of one."""
    return _EFFECTS.get(name, name.replace("_", " "))


def count(rate: Mapping[str, Any]) -> str:
    """Write ``20 of 22``."""
    return f"{rate['successes']} of {rate['trials']}"


def interval(rate: Mapping[str, Any]) -> str:
    """Write a rate's 95 % interval in per cent; nothing without trials."""
    return f"{units.interval(rate['interval'])} %" if rate["interval"] else ""


def step(bounds: Mapping[str, Any]) -> str:
    """Write the bounds of a step: ``0.5 to 0.7``, ``200 and more``."""
    low, high = bounds["low"], bounds["high"]
    return f"{low:g} and more" if high is None else f"{low:g} to {high:g}"


def needed(curve: Mapping[str, Any], wanted: Mapping[str, Any]) -> str:
    """Say how many rows find an effect of some size in 90 % of cases, and whether data reach so far."""
    size = f"{wanted['ratio']:g} times the noise"
    if wanted["samples"] is None:
        return f"an effect of {size}: these cases do not tell how many rows it takes"
    rows, (low, high) = wanted["samples"], curve["rows"]
    beyond = not low <= rows <= high or not curve["ratios"][0] <= wanted["ratio"] <= curve["ratios"][1]
    number = "fewer than 10 rows" if rows < 10 else "over 10000 rows" if rows > 1e4 else f"about {rows:.0f} rows"
    guess = f", a guess: the cases have {low:.0f} to {high:.0f}" if beyond else ""
    return f"an effect of {size}: {number}{guess}"


def coefficients(curve: Mapping[str, Any]) -> str:
    """Write the curve of detection with its standard deviations: where they are large, the cases do not tell."""
    names = ("ln size", "ln rows")
    terms = (
        f"({curve[k]:.2g} ± {std:.1g}) {n}"
        for k, n, std in zip(("ratio", "samples"), names, curve["std"][1:], strict=True)
    )
    return f"logistic({curve['intercept']:.2g} + {' + '.join(terms)})".replace("-", "−")


def facts(score: Mapping[str, Any]) -> tuple[tuple[str, str], ...]:
    """Return the figures that stand alone: what they are, and their values."""
    sure, all_, gap, time = (
        score["calibration"]["doubtful"],
        score["calibration"]["all"],
        score["shrinkage"],
        score["seconds"],
    )
    said = []
    if all_["trials"]:
        said.append(("calibration error", f"{units.percent(all_['error'])} over {all_['trials']} effects and laws"))
    if sure["trials"]:
        between = f"{units.percent(sure['error'])} over the {sure['trials']} that are 5 to 95 % probable"
        said.append(("calibration error where in doubt", between))
    if gap["pairs"]:
        apart = (
            f"{units.percent(gap['median_absolute_difference'])} of the gap in the median, {len(gap['pairs'])} cases"
        )
        said.append(("shrinkage claimed against reached", f"apart by {apart}"))
    said += _rates(score)
    if time["median"] is not None:
        spent = (
            f"{time['median']:.2f} s in the median, 95 % within {time['q95']:.2f} s, longest {time['longest']:.2f} s"
        )
        said.append(("time of a diagnosis", spent))
    return tuple(said)


def _rates(score: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return laws that were sure, models that do harm, and intervals that hold."""
    held = score["coverage"]
    rates = (
        ("laws printed at 90 % and more", score["laws"], "right"),
        ("corrected model worse than none", score["worse"], "on fresh samples"),
        ("95 % intervals of parameters", held["parameters"], "hold the truth"),
        ("95 % intervals of the shrinkage", held["shrinkage"], "hold that on fresh samples"),
        ("95 % intervals of shares", held["shares"], "hold those on fresh samples"),
    )
    return [
        (name, f"{count(rate)} {what}: {units.percent(rate['value'])}, 95 % interval {interval(rate)}")
        for name, rate, what in rates
        if rate["trials"]
    ]


def miss(case: Mapping[str, Any]) -> tuple[str, str]:
    """Say what was true of a case that was answered wrongly, and what was said."""
    true = ", ".join(case["truth"]) or "nothing"
    if case["error"] is not None:
        return true, case["error"]
    said = ", ".join(case["said"]) or ("" if case["unexplained"] else "nothing")
    rest = f"unexplained ({case['unexplained']})" if case["unexplained"] else ""
    sure = f"; {units.probability(case['probability'])}" if case["probability"] is not None else ""
    return true, " + ".join(part for part in (said, rest) if part) + sure
