"""Score of a blind trial as plain text for the command line."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from textwrap import wrap
from typing import Any

from thermal_robot.report import units

Plain = Mapping[str, Any]
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
    """Kind of case in plain words."""
    return KINDS.get(name, name)


def question(name: str, of_kind: str = "") -> str:
    """Question in plain words."""
    return _OF_KIND.get((of_kind, name), QUESTIONS.get(name, name))


def effect(name: str) -> str:
    """Effect, or the answer in its place, in plain words."""
    return _EFFECTS.get(name, name.replace("_", " "))


def count(rate: Plain) -> str:
    """Format a rate as ``20 of 22``, successes of trials."""
    return f"{rate['successes']} of {rate['trials']}"


def interval(rate: Plain) -> str:
    """Format the 95 % interval of a rate in per cent; empty text without trials."""
    return f"{units.interval(rate['interval'])} %" if rate["interval"] else ""


def cases(number: int) -> str:
    """Format a number of cases."""
    return f"{number} case{'s' * (number != 1)}"


def lost(score: Plain) -> str:
    """Return the number of failed diagnoses in words; empty without any."""
    one = score["failed"] == 1
    said = "diagnosis failed and counts" if one else "diagnoses failed and count"
    return f"; {score['failed']} {said} as wrong" if score["failed"] else ""


def left(of: Plain) -> str:
    """Median and 90 % quantile, in words, of the rms per axis over the noise on fresh samples, of cases of one kind."""
    return f"{of['fresh']['median']:.2f} in the median, 90 % below {of['fresh']['q90']:.2f}"


def step(bounds: Plain) -> str:
    """Bounds of a bin in words: ``0.5 to 0.7``, ``200 and more``."""
    low, high = bounds["low"], bounds["high"]
    return f"{low:g} and more" if high is None else f"{low:g} to {high:g}"


def needed(curve: Plain, wanted: Plain) -> str:
    """Rows needed to find an effect of some size in 90 % of cases, and whether that is extrapolated."""
    size = f"{wanted['ratio']:g} times the noise"
    if wanted["samples"] is None:
        return f"an effect of {size}: these cases do not tell how many rows it takes"
    rows, (low, high) = wanted["samples"], curve["rows"]
    beyond = not low <= rows <= high or not curve["ratios"][0] <= wanted["ratio"] <= curve["ratios"][1]
    number = "fewer than 10 rows" if rows < 10 else "over 10000 rows" if rows > 1e4 else f"about {rows:.0f} rows"
    guess = f", a guess: the cases have {low:.0f} to {high:.0f}" if beyond else ""
    return f"an effect of {size}: {number}{guess}"


def coefficients(curve: Plain) -> str:
    """Format the logistic detection curve in ln size and ln rows: coefficients with their standard deviations."""
    names = ("ln size", "ln rows")
    terms = (
        f"({curve[k]:.2g} ± {std:.1g}) {n}"
        for k, n, std in zip(("ratio", "samples"), names, curve["std"][1:], strict=True)
    )
    return f"logistic({curve['intercept']:.2g} + {' + '.join(terms)})".replace("-", "−")


def facts(score: Plain) -> tuple[tuple[str, str], ...]:
    """Names and texts of the score's single figures that have trials: calibration, shrinkage, laws, coverage, time."""
    all_, sure = score["calibration"]["all"], score["calibration"]["doubtful"]
    gap, time, held = score["shrinkage"], score["seconds"], score["coverage"]
    said = []
    if all_["trials"]:
        said.append(("calibration error", f"{units.percent(all_['error'])} over {all_['trials']} effects and laws"))
    if sure["trials"]:
        between = f"{units.percent(sure['error'])} over the {sure['trials']} that are 5 to 95 % probable"
        said.append(("calibration error where in doubt", between))
    if gap["pairs"]:
        apart = f"apart by {units.percent(gap['median_absolute_difference'])} of the gap in the median"
        said.append(("shrinkage claimed against reached", f"{apart}, {cases(len(gap['pairs']))}"))
    rates = (
        ("laws printed at 90 % and more", score["laws"], "right"),
        ("corrected model worse than none", score["worse"], "on fresh samples"),
        ("95 % intervals of parameters", held["parameters"], "hold the truth"),
        ("95 % intervals of the shrinkage", held["shrinkage"], "hold that on fresh samples"),
        ("95 % intervals of shares", held["shares"], "hold those on fresh samples"),
    )
    for name, rate, what in rates:
        if rate["trials"]:
            share = f"{units.percent(rate['value'])}, 95 % interval {interval(rate)}"
            said.append((name, f"{count(rate)} {what}: {share}"))
    if time["median"] is not None:
        most = f"95 % within {time['q95']:.2f} s, longest {time['longest']:.2f} s"
        said.append(("time of a diagnosis", f"{time['median']:.2f} s in the median, {most}"))
    return tuple(said)


def miss(case: Plain) -> tuple[str, str]:
    """Truth and answer of a wrong case in words."""
    true = ", ".join(case["truth"]) or "nothing"
    if case["error"] is not None:
        return true, case["error"]
    said = ", ".join(case["said"]) or ("" if case["unexplained"] else "nothing")
    rest = f"unexplained ({case['unexplained']})" if case["unexplained"] else ""
    sure = f"; {units.probability(case['probability'])}" if case["probability"] is not None else ""
    return true, " + ".join(part for part in (said, rest) if part) + sure


def markdown(score: Plain) -> str:
    """Markdown table of a score, format ``thermal-robot/blind/1``, for the README.

    One row for each kind of case, then the figures that stand alone; without a newline at the end.
    """
    lines = ["| case | number | right means | right | share | 95 % interval |", "|---|--:|---|--:|--:|--:|"]
    for of in score["kinds"]:
        asked = of["headline"]
        rate = of["rates"][asked]
        cells = (kind(of["kind"]), str(of["cases"]), question(asked, of["kind"]), count(rate))
        lines.append(f"| {' | '.join((*cells, units.percent(rate['value']), interval(rate)))} |")
    rest = [f"- {name[:1].upper()}{name[1:]}: {value}" for name, value in facts(score)]
    if score["failed"]:
        rest.append(f"- Diagnoses that failed, and count as wrong: {score['failed']}")
    return "\n".join((*lines, "", *rest) if rest else lines)


WIDTH = 100
_ANSWERS = ("nothing", "unexplained", "failed")
_SHORT = {"nothing": "n", "unexplained": "u", "failed": "f"}
ASKED = ("exact", "right", "first_named", "found", "false_alarm", "place", "near_place", "quantity")
_CHANGES = ("exact", "found", "way", "day")
_HEADS = {
    "exact": "exact",
    "first_named": "named first",
    "right": "right",
    "near_place": "or beside",
    "quantity": "what it follows",
    "way": "jump or trend",
    "day": "day",
}
_TABLES = {
    "single": "one effect, nothing, or a cause that no library knows",
    "hard": "one small effect, few rows",
    "removed": "effect taken out of the library: unexplained is right",
}

GROUPED = (
    ("by_effect", "By effect", "where one or several are at work", ASKED),
    ("by_robot", "By robot", "the same cases and those with nothing at work", ASKED),
    ("removed", "Effect taken out of the library", "by effect", ASKED),
    ("unlisted", "Cause that no library knows", "by cause", ASKED),
    ("changes", "Campaigns of one robot", "by what changes", _CHANGES),
)
"""Rates by group: their name in the score, what they are of, and the questions that are columns."""


def text(score: Plain) -> str:
    """Plain text of a score, format ``thermal-robot/blind/1``.

    At most 100 columns wide unless a name is longer, without a newline at the end.
    """
    blocks = [
        [f"Blind trial: {cases(score['cases'])}, {len(score['misses'])} answered wrongly{lost(score)}."],
        [f"{'HOW OFTEN':<64}{'share':>8}   95 % interval", *_kinds(score["kinds"])],
        *([f"{of.upper()}, {more}", *_groups(score[name], asked)] for name, of, more, asked in GROUPED),
        *([f"NAMED FIRST: {_TABLES.get(k, k)}", *_confusion(table)] for k, table in score["confusion"].items()),
        ["PROBABILITIES", *_calibration(score["calibration"]["all"])],
        ["WHAT IT TAKES TO BE FOUND, one effect at work", *_detection(score["detection"])],
        ["FIGURES", *(f"  {name:36}{value}" for name, value in facts(score))],
        ["REAL CAMPAIGNS", *_real(score["real"])],
        ["MISSES", *_misses(score["misses"])],
    ]
    return "\n\n".join("\n".join(block) for block in blocks if len(block) > 1 or block is blocks[0])


def _kinds(kinds: list[Plain]) -> Iterator[str]:
    for of in kinds:
        failed = f", {of['failed']} failed" if of["failed"] else ""
        yield f"  {kind(of['kind'])}, {cases(of['cases'])}{failed}"
        for name, rate in of["rates"].items():
            mark = ">" if name == of["headline"] else " "
            asked = question(name, of["kind"])
            yield f"  {mark} {asked:46}{count(rate):>12}  {units.percent(rate['value']):>8}   {interval(rate)}".rstrip()
        if of["fresh"]["count"]:
            yield f"    left on fresh samples, over the noise: {left(of)}"


def _groups(groups: Mapping[str, Plain], questions: Sequence[str]) -> Iterator[str]:
    if not groups:
        return
    asked = [q for q in questions if any(q in rates for rates in groups.values())]
    wide = max(len(name) for name in groups)
    column = 17
    yield f"  {'':{wide}}" + "".join(f"{_HEADS.get(q, question(q)):>{column}}" for q in asked)
    for name, rates in groups.items():
        yield f"  {name:{wide}}" + "".join(f"{_share(rates.get(q)):>{column}}" for q in asked).rstrip()


def _share(rate: Plain | None) -> str:
    if rate is None or not rate["trials"]:
        return units.MISSING
    return f"{rate['successes']}/{rate['trials']}{units.percent(rate['value']):>9}"


def _confusion(table: Plain) -> Iterator[str]:
    columns, rows = table["columns"], table["rows"]
    numbers = {name: _SHORT.get(name, str(k + 1)) for k, name in enumerate(columns)}
    wide = max(len(name) for name in rows)
    yield f"    {'':{wide}}" + "".join(f"{numbers[c]:>4}" for c in columns)
    for name, counts in zip(rows, table["counts"], strict=True):
        number = numbers.get(name, "") if name not in _ANSWERS else ""
        yield f"{number:>3} {name:{wide}}" + "".join(f"{c or '·':>4}" for c in counts)
    others = [f"{numbers[c]} {c}" for c in columns if c in _SHORT or c not in rows]
    yield from wrap("; ".join(others), WIDTH, initial_indent="  ", subsequent_indent="  ")


def _calibration(all_: Plain) -> Iterator[str]:
    if not all_["trials"]:
        return
    yield f"  {'said to be':>14}{'effects':>10}{'on average':>13}{'at work':>10}   95 % interval"
    for b in all_["bins"]:
        if b["present"]["trials"]:
            between = f"{100 * b['low']:.0f} to {100 * b['high']:.0f} %"
            cells = f"{b['present']['trials']:>10}{units.percent(b['mean']):>13}"
            yield f"  {between:>14}{cells}{units.percent(b['present']['value']):>10}   {interval(b['present'])}"


def _detection(detection: Plain) -> Iterator[str]:
    for name, bins in (("size over the noise", detection["ratio"]), ("rows", detection["samples"])):
        told = [b for b in bins if b["found"]["trials"]]
        if told:
            yield f"  {name:24}{'found':>10}{'share':>10}   95 % interval"
        for b in told:
            rate = b["found"]
            yield f"    {step(b):22}{count(rate):>10}{units.percent(rate['value']):>10}   {interval(rate)}"
    yield from _both(detection)
    curve = detection["curve"]
    if curve:
        yield f"  found in 90 % of cases, by the curve {coefficients(curve)}"
        yield from (f"    {needed(curve, wanted)}" for wanted in curve["needed"])


def _both(detection: Plain) -> Iterator[str]:
    """Yield the lines of a table of detections by size and rows; none unless cases fill two bins or more of each."""
    table = detection["table"]
    lines = [k for k, row in enumerate(table) if any(rate["trials"] for rate in row)]
    columns = [m for m in range(len(detection["samples"])) if any(row[m]["trials"] for row in table)]
    if len(lines) < 2 or len(columns) < 2:
        return
    steps = (step(detection["samples"][m]).replace(" and more", "+").replace(" to ", "–") for m in columns)
    yield "  size over the noise" + "".join(f"{rows:>9}" for rows in steps) + " rows"
    for k in lines:
        cells = (f"{r['successes']}/{r['trials']}" if r["trials"] else "·" for r in (table[k][m] for m in columns))
        yield f"    {step(detection['ratio'][k]):17}" + "".join(f"{cell:>9}" for cell in cells)


def _real(asked: list[Plain]) -> Iterator[str]:
    for case in asked:
        yield from _hanging(f"  {'right' if case['right'] else 'WRONG'}  {case['id']}  ", f"{case['asked']}")
        yield from _hanging(" " * 11 + "→ ", case["answer"])


def _misses(misses: list[Plain]) -> Iterator[str]:
    wide = max([len(m["id"]) for m in misses], default=0)
    for case in misses:
        true, said = miss(case)
        head = f"  {case['id']:{wide}}  {case['kind']:8} {case['robot']:8} "
        yield from _hanging(head, f"{true} → {said}")


def _hanging(head: str, sentence: str) -> list[str]:
    return wrap(
        sentence,
        WIDTH,
        initial_indent=head,
        subsequent_indent=" " * (len(head) + 2),
        break_long_words=False,
        break_on_hyphens=False,
    )
