"""The score of a blind trial as one HTML page."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from html import escape
from typing import Any

from thermal_robot.blind.report.plots import calibration_figure, confusion_figure, power_figure, shrinkage_figure
from thermal_robot.blind.report.text import section
from thermal_robot.blind.report.words import coefficients, count, facts, interval, kind, miss, needed, question
from thermal_robot.report import units
from thermal_robot.report.html_parts import bullets, document, figure, paragraph, row, signature, table

Plain = Mapping[str, Any]

_CARDS = ("single", "null", "removed", "unlisted")
_CHANGES = ("exact", "found", "way", "day", "false_alarm")
_ASKED = ("exact", "right", "first_named", "found", "false_alarm", "place", "near_place", "quantity")


def html(score: Plain, generated: str) -> str:
    """Write a score as a page that needs nothing beside itself and prints on A4.

    Parameters
    ----------
    score
        Of the format ``thermal-robot/blind/1``.
    generated
        When it was made, in the words that shall stand in the footer; may be empty.

    Returns
    -------
    str
        A complete HTML document.
    """
    return document("Blind trial", "\n".join(_whole(score, generated)))


def _whole(score: Plain, generated: str) -> Iterator[str]:
    yield _header(score)
    yield section("How often", _kinds(score["kinds"]))
    if score["confusion"]:
        yield section("What was named", *_confusions(score))
    yield from _one_by_one(score)
    said = "How often effects and laws were true against how probable they were said to be"
    yield section("Probabilities", figure(calibration_figure(score), said))
    power = figure(power_figure(score), "Share of effects found, by size and by number of rows")
    yield section("What it takes to be found", power, *_needed(score["detection"]["curve"]))
    left = figure(shrinkage_figure(score), "What stays of the gap: claimed, and reached on fresh samples")
    yield section("How far the gap shrinks", left)
    if score["real"]:
        yield section("Real campaigns", _real(score["real"]))
    if score["misses"]:
        yield section("Misses", _misses(score["misses"]))
    yield f"<footer>{escape(signature(generated))}</footer>"


def _header(score: Plain) -> str:
    right = score["cases"] - len(score["misses"])
    failed = f"; {score['failed']} diagnoses failed and count as wrong" if score["failed"] else ""
    kicker = '<div class="tr-kicker">Faults that the program was not told of, named by it</div>'
    heading = f"<h1>Blind trial: {right} of {score['cases']} cases answered rightly{failed}</h1>"
    alone = "".join(f"<dt>{escape(k)}</dt><dd>{escape(v)}</dd>" for k, v in facts(score))
    return f"<header>{kicker}\n{heading}\n{_cards(score['kinds'])}\n<dl>{alone}</dl></header>"


def _confusions(score: Plain) -> Iterator[str]:
    yield paragraph(
        "Numbers are cases; the stronger the colour, the larger the share of its row; the right answer is framed."
    )
    for name in score["confusion"]:
        yield figure(confusion_figure(score, name), "Truth against what was named first")


def _one_by_one(score: Plain) -> Iterator[str]:
    groups = (
        ("By effect, where one or several are at work", score["by_effect"]),
        ("By robot, the same cases and those with nothing at work", score["by_robot"]),
        ("Effect taken out of the library, by effect", score["removed"]),
        ("Cause that no library knows, by cause", score["unlisted"]),
    )
    tables = [_groups(heading, rates) for heading, rates in groups if rates]
    if score["changes"]:
        tables.append(_groups("Campaigns of one robot, by what changes", score["changes"], _CHANGES))
    if tables:
        yield section("One by one", *tables)


def _cards(kinds: Iterable[Plain]) -> str:
    shown = []
    for of in kinds:
        rate = of["rates"][of["headline"]]
        if of["kind"] in _CARDS and rate["trials"]:
            asked = question(of["headline"], of["kind"])
            lines = (f"{asked[:1].upper()}{asked[1:]}", count(rate), f"95 % interval {interval(rate)}")
            small = "".join(f"<span>{escape(line)}</span>" for line in lines)
            heading = kind(of["kind"])
            value = escape(units.percent(rate["value"]))
            card = f"<span>{escape(heading[:1].upper() + heading[1:])}</span><b>{value}</b>{small}"
            shown.append(f'<div class="tr-number" style="flex-basis:11rem">{card}</div>')
    return f'<div class="tr-numbers">{"".join(shown)}</div>'


def _kinds(kinds: Iterable[Plain]) -> str:
    rows = []
    for of in kinds:
        failed = f", {of['failed']} failed" if of["failed"] else ""
        rows.append(
            f"<tr><td colspan=4><strong>{escape(kind(of['kind']))}</strong>, {of['cases']} cases{failed}</td></tr>"
        )
        for name, rate in of["rates"].items():
            asked = escape(question(name, of["kind"]))
            first = f'<span class="tr-found">{asked}</span>' if name == of["headline"] else asked
            rows.append(row((first, count(rate), units.percent(rate["value"]), interval(rate))))
        if of["fresh"]["count"]:
            left = of["fresh"]
            said = f"{left['median']:.2f} in the median, 90 % below {left['q90']:.2f}"
            rows.append(f"<tr><td>left on fresh samples, over the noise</td><td colspan=3 class=tr-n>{said}</td></tr>")
    return table(("", "cases", "share", "95 % interval"), rows)


def _groups(heading: str, groups: Mapping[str, Plain], questions: Sequence[str] = _ASKED) -> str:
    asked = [q for q in questions if any(q in rates for rates in groups.values())]
    rows = (row((escape(name), *(_share(rates.get(q)) for q in asked))) for name, rates in groups.items())
    return f'<p class="tr-kicker">{escape(heading)}</p>{table(("", *map(question, asked)), rows)}'


def _share(rate: Plain | None) -> str:
    if rate is None or not rate["trials"]:
        return units.MISSING
    return f"{count(rate)}, {units.percent(rate['value'])}"


def _needed(curve: Plain | None) -> Iterator[str]:
    if curve:
        yield paragraph(f"Fitted to all cases: chance = {coefficients(curve)}. By that, these are found in 90 %:")
        yield bullets([needed(curve, wanted) for wanted in curve["needed"]])


def _real(cases: Iterable[Plain]) -> str:
    rows = (
        f"<tr><td>{escape(c['id'])}</td><td>{escape(c['asked'])}</td><td>{escape(c['answer'])}</td>"
        f"<td class=tr-word>{'right' if c['right'] else '<strong>wrong</strong>'}</td></tr>"
        for c in cases
    )
    return table(("case", "asked", "answered", ""), rows, words=4)


def _misses(misses: Iterable[Plain]) -> str:
    rows = []
    for case in misses:
        true, said = miss(case)
        cells = (case["id"], kind(case["kind"]), case["robot"], true, said)
        rows.append(row(map(escape, cells), words=len(cells)))
    return table(("case", "kind", "robot", "true", "said"), rows, words=5)
