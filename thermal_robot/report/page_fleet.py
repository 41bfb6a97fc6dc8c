"""A fleet's summary as one HTML page."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from html import escape
from typing import Any

from thermal_robot.report.drawing import AFTER, BEFORE, INK, SMALL, Drawing, plain, tidy, title
from thermal_robot.report.fleet_words import SECTIONS, failures, headline
from thermal_robot.report.html_parts import bullets, document, figure, paragraph, signature, table, wide

_LEADING = 12
_EXPLAINED = {
    "The same in all robots": "A mean that is not zero, of every robot that can tell it, whether the effect was "
    "found there or not. Effects that do nearly the same may show one cause in two lines: the upper one counts.",
    "Robots that stand out": "Each against its own group, with the probability that it is unlike the others.",
}


def fleet_html(summary: Mapping[str, Any], generated: str | None = None) -> str:
    """Write a summary as a page that needs nothing beside itself and prints on A4.

    Parameters
    ----------
    summary
        Of the format ``thermal-robot/fleet/1``.
    generated
        When it was made, in the words that shall stand in the footer; nothing is said where absent.

    Returns
    -------
    str
        A complete HTML document.
    """
    return document("Fleet", "\n".join(_whole(summary, generated)))


def _whole(summary: Mapping[str, Any], generated: str | None) -> Iterator[str]:
    yield '<header><div class="tr-kicker">What is wrong with which robot, and what several share</div>'
    yield f"<h1>{escape(headline(summary))}</h1></header>"
    if any(effect["found"] for effect in summary["effects"]):
        said = "How many robots each effect was found in"
        yield f"<section>{figure(plot_fleet(summary), said)}</section>"
    for heading, heads, told in SECTIONS:
        rows = [f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in line)}</tr>" for line in told(summary)]
        if rows:
            why = paragraph(_EXPLAINED[heading]) if heading in _EXPLAINED else ""
            shown = wide(table(heads, rows, words=len(heads)), heading)
            yield f"<section><h2>{escape(heading)}</h2>{why}{shown}</section>"
    if reasons := list(failures(summary)):
        yield f"<section><h2>Without a diagnosis</h2>{bullets(reasons)}</section>"
    yield f"<footer>{escape(signature(generated))}</footer>"


def plot_fleet(summary: Mapping[str, Any]) -> Drawing:
    """Draw in how many robots each effect was found, of those in which it could be."""
    counts = [effect for effect in summary["effects"] if effect["found"]][:_LEADING]
    drawn = Drawing(7.6, 1.2 + 0.3 * len(counts))
    axes = drawn.subplots()
    places = range(len(counts))
    axes.barh(places, [c["testable"] for c in counts], color="none", edgecolor=BEFORE, height=0.62)
    axes.barh(places, [c["found"] for c in counts], color=AFTER, height=0.62)
    axes.set_yticks(places, [plain(c["effect"].replace("_", " ")) for c in counts])
    axes.invert_yaxis()
    axes.set_xlabel("robots: found (filled), could be tested (frame)")
    for place, c in enumerate(counts):
        axes.annotate(
            f"{c['found']}",
            (c["found"], place),
            (4, 0),
            textcoords="offset points",
            va="center",
            fontsize=SMALL,
            color=INK,
        )
    tidy(axes, grid="x")
    title(axes, "Effects by how often they were found")
    return drawn
