"""A robot over time as a page to hand on: what rings and how sure that is, all parameters in figures and a table."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from html import escape
from typing import TYPE_CHECKING

from thermal_robot.report import units
from thermal_robot.report.html_parts import (
    bullets,
    checksums,
    document,
    figure,
    paragraph,
    row,
    signature,
    table,
    wide,
)
from thermal_robot.report.plots_wear import plot_wear

if TYPE_CHECKING:
    from thermal_robot.fleet.wear_result import Wear, Worn

_HEADS = ("parameter", "it", "change", "a day", "moved", "by chance", "limit")


def wear_html(wear: Wear, generated: str | None = None, files: Mapping[str, str] | None = None) -> str:
    """Write a robot over time as a page that needs nothing beside itself and prints on A4.

    Parameters
    ----------
    wear
        The result.
    generated
        When it was made, for the footer; nothing is said where absent, so that equal results give equal pages.
    files
        Names of the files that it was made from, with the SHA-256 of each, for the footer.

    Returns
    -------
    str
        A complete HTML document.
    """
    footer = checksums(files or {}) + escape(signature(generated))
    return document(f"{wear.robot} over time", "\n".join(_whole(wear, footer)))


def _whole(wear: Wear, footer: str) -> Iterator[str]:
    yield '<header><div class="tr-kicker">What moves, at once or steadily, and when it crosses a limit</div>'
    yield f"<h1>{escape(wear.summary)}</h1>"
    rate = units.percent(wear.false_alarm)
    yield paragraph(
        f"Without any change, at most {rate} of such series ring at all, whatever the parameter and the day. "
        f"Campaigns scatter {wear.scatter:.2f} times as much as their deviations say."
    )
    yield "</header><section><h2>Over time</h2>"
    yield figure(plot_wear(wear), "Each parameter in each campaign, with one standard deviation, and how it moves")
    yield paragraph(
        "Dots are the value that each campaign has by itself, all other parameters as they are over time, with one "
        "standard deviation, about the mean of the line. The line is what is told. A jump lies in its band with 95 %."
    )
    yield "</section><section><h2>Parameters</h2>"
    shown = (row((escape(f"{w.title}: {w.parameter}"), escape(_does(w)), *_figures(w)), 2) for w in wear.parameters)
    yield wide(table(_HEADS, shown, 2), "Every parameter: how it moves, how far, how sure that is")
    yield paragraph(
        "Moved: posterior probability. By chance: at most so many series without any change show a move as clear."
    )
    yield "</section><section><h2>Campaigns</h2>"
    visits = (row((escape(v.name), escape(v.date), str(v.rows)), 2) for v in wear.campaigns)
    yield wide(table(("campaign", "date", "rows used"), visits, 2), "Campaigns in the order of time") + "</section>"
    if wear.notes:
        yield f"<section><h2>To know</h2>{bullets(wear.notes)}</section>"
    yield f"<footer>{footer}</footer>"


def _does(worn: Worn) -> str:
    if not worn.comparable:
        return f"cannot be compared: {worn.reason}"
    if worn.alarm or worn.kind != "constant":
        does = {"jump": "jumps", "trend": "moves steadily", "walk": "wanders", "constant": "stays"}[worn.kind]
        beside = f"; or {', '.join(worn.confounded_with)}" if worn.confounded_with else ""
        return f"{does}{'' if worn.alarm else ', perhaps'}{beside}"
    return "stays"


def _figures(worn: Worn) -> Iterator[str]:
    """Yield the numbers of a parameter: change, rate, probability, chance, limit."""
    if not worn.comparable:
        yield from [units.MISSING] * 5
        return
    yield units.measured(worn.change, worn.change_std, worn.unit) if worn.kind != "constant" else units.MISSING
    yield units.measured(worn.rate.value, worn.rate.std, worn.unit) if worn.rate else units.MISSING
    yield units.probability(worn.moved)
    yield f"{min(worn.chance, 1.0):.1g}"
    crossing = worn.crossing
    if crossing is None:
        yield units.MISSING
    elif crossing.state == "expected":
        yield f"{crossing.dates[0]} ({crossing.dates[1]} to {crossing.dates[2] or 'never'})"
    else:
        yield crossing.state
