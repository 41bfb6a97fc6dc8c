"""The score of a blind trial as plain text: what the command line prints."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from html import escape
from textwrap import wrap
from typing import Any

from thermal_robot.blind.report.words import coefficients, count, facts, interval, kind, miss, needed, question, step
from thermal_robot.report import units


def markdown(score: Mapping[str, Any]) -> str:
    """Write the table of the README.

    Parameters
    ----------
    score
        Of the format ``thermal-robot/blind/1``.

    Returns
    -------
    str
        Markdown without a newline at the end: one row for each kind of case, then the figures that stand alone.
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


def section(heading: str, *content: str) -> str:
    """Return a section; its content is HTML."""
    return f"<section><h2>{escape(heading)}</h2>{''.join(content)}</section>"


WIDTH = 100
_ANSWERS = ("nothing", "unexplained", "failed")
_SHORT = {"nothing": "n", "unexplained": "u", "failed": "f"}
_ASKED = ("exact", "right", "first_named", "found", "false_alarm", "place", "near_place", "quantity")
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

Plain = Mapping[str, Any]


def text(score: Plain) -> str:
    """Write a score for whoever ran the trial.

    Parameters
    ----------
    score
        Of the format ``thermal-robot/blind/1``.

    Returns
    -------
    str
        Plain text, at most 100 columns wide unless a name is longer, without a newline at the end.
    """
    blocks = [
        [_heading(score)],
        [f"{'HOW OFTEN':<64}{'share':>8}   95 % interval", *_kinds(score["kinds"])],
        ["BY EFFECT, where one or several are at work", *_groups(score["by_effect"])],
        ["BY ROBOT, the same cases and those with nothing at work", *_groups(score["by_robot"])],
        ["EFFECT TAKEN OUT OF THE LIBRARY, by effect", *_groups(score["removed"])],
        ["CAUSE THAT NO LIBRARY KNOWS, by cause", *_groups(score["unlisted"])],
        ["CAMPAIGNS OF ONE ROBOT, by what changes", *_groups(score["changes"], _CHANGES)],
        *(
            [f"NAMED FIRST: {_TABLES.get(name, name)}", *_confusion(table)]
            for name, table in score["confusion"].items()
        ),
        ["PROBABILITIES", *_calibration(score["calibration"]["all"])],
        ["WHAT IT TAKES TO BE FOUND, one effect at work", *_detection(score["detection"])],
        ["FIGURES", *(f"  {name:36}{value}" for name, value in facts(score))],
        ["REAL CAMPAIGNS", *_real(score["real"])],
        ["MISSES", *_misses(score["misses"])],
    ]
    return "\n\n".join("\n".join(block) for block in blocks if len(block) > 1 or block is blocks[0])


def _heading(score: Plain) -> str:
    failed = f"; {score['failed']} diagnoses failed and count as wrong" if score["failed"] else ""
    return f"Blind trial: {score['cases']} cases, {len(score['misses'])} answered wrongly{failed}."


def _kinds(kinds: list[Plain]) -> Iterator[str]:
    for of in kinds:
        failed = f", {of['failed']} failed" if of["failed"] else ""
        yield f"  {kind(of['kind'])}, {of['cases']} cases{failed}"
        for name, rate in of["rates"].items():
            mark = ">" if name == of["headline"] else " "
            asked = question(name, of["kind"])
            yield f"  {mark} {asked:46}{count(rate):>12}  {units.percent(rate['value']):>8}   {interval(rate)}".rstrip()
        if of["fresh"]["count"]:
            left = of["fresh"]
            spread = f"{left['median']:.2f} in the median, 90 % below {left['q90']:.2f}"
            yield f"    left on fresh samples, over the noise: {spread}"


def _groups(groups: Mapping[str, Plain], questions: Sequence[str] = _ASKED) -> Iterator[str]:
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
    steps = {
        "size over the noise": detection["ratio"],
        "rows": detection["samples"],
    }
    for name, bins in steps.items():
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
    """Show size and rows at once, where there are several of both."""
    table = detection["table"]
    lines = [k for k, row in enumerate(table) if any(rate["trials"] for rate in row)]
    columns = [m for m in range(len(detection["samples"])) if any(row[m]["trials"] for row in table)]
    if len(lines) < 2 or len(columns) < 2:
        return
    yield "  size over the noise" + "".join(f"{_brief(detection['samples'][m]):>9}" for m in columns) + " rows"
    for k in lines:
        cells = (f"{r['successes']}/{r['trials']}" if r["trials"] else "·" for r in (table[k][m] for m in columns))
        yield f"    {step(detection['ratio'][k]):17}" + "".join(f"{cell:>9}" for cell in cells)


def _brief(bounds: Plain) -> str:
    return f"{bounds['low']:g}+" if bounds["high"] is None else f"{bounds['low']:g}–{bounds['high']:g}"


def _real(cases: list[Plain]) -> Iterator[str]:
    for case in cases:
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
