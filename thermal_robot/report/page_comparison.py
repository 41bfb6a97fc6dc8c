"""A comparison as HTML: a page to hand on, and a piece of a notebook."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from html import escape
from typing import Any

import numpy as np

from thermal_robot.report.comparison_words import (
    campaign_in_words,
    change_in_words,
    effects,
    headline,
    parameters,
    predictions,
)
from thermal_robot.report.drawing import AFTER, BEFORE, INK, Drawing, plain, tidy, title
from thermal_robot.report.html_parts import (
    bullets,
    checksums,
    css,
    document,
    figure,
    paragraph,
    row,
    signature,
    table,
    wide,
)

_LEADING = 24


def comparison_html(
    comparison: Mapping[str, Any], generated: str | None = None, files: Mapping[str, str] | None = None
) -> str:
    """Write a comparison as a page that needs nothing beside itself and prints on A4.

    Parameters
    ----------
    comparison
        Of the format ``thermal-robot/comparison/1``.
    generated
        When it was made, in the words that shall stand in the footer; nothing is said where absent.
    files
        Names of the files that it was made from, with the SHA-256 of each, for the footer.

    Returns
    -------
    str
        A complete HTML document.
    """
    foot = checksums(files or {}) + escape(signature(generated))
    body = "\n".join((*_header(comparison), *_sections(comparison), f"<footer>{foot}</footer>"))
    return document("Comparison of campaigns", body)


def comparison_fragment(comparison: Mapping[str, Any]) -> str:
    """Write a comparison as a piece of HTML for a notebook: one ``<div>`` with its own style."""
    body = "\n".join((paragraph(headline(comparison), strong=True), *_sections(comparison)))
    return f'<div class="thermal-robot"><style>{css("page.css")}</style>{body}</div>'


def _header(comparison: Mapping[str, Any]) -> Iterator[str]:
    yield '<header><div class="tr-kicker">What the same robot shares between campaigns, and what changed</div>'
    yield f"<h1>{escape(headline(comparison))}</h1></header>"
    yield bullets(campaign_in_words(c) for c in comparison["campaigns"])


def _sections(comparison: Mapping[str, Any]) -> Iterator[str]:
    names = [c["name"] for c in comparison["campaigns"]]
    told = [change_in_words(change, names) for change in comparison["changes"]]
    yield f"<section><h2>What changed</h2>{bullets(told) or paragraph('Nothing.')}</section>"
    rows = list(effects(comparison))
    if rows:
        heads = ("effect", "in the joint fit", "χ²", "by chance")
        yield _section("Effects", heads, rows, 2, "χ² of equal parameters in all campaigns, all other effects free.")
    rows_of_parameters = list(parameters(comparison))
    if rows_of_parameters:
        drawn = figure(plot_differences(comparison), "Differences of parameters in standard deviations")
        heads = ("effect", "parameter", *names, "difference", "by chance")
        said = "Each by its own campaign, ± one standard deviation; the difference is of the two furthest apart."
        yield _section("Parameters", heads, rows_of_parameters, 2, said, drawn)
    columns = ("campaigns", "differ, rms", "stated", "beyond twice", "verdict")
    said = "Where both campaigns measured, unknown frames aligned. Beyond twice the stated deviation a model is wrong."
    yield _section("Predictions", columns, list(predictions(comparison)), 1, said)
    if comparison["not_told"]:
        yield f"<section><h2>Not compared</h2>{paragraph('Frames or other parameters take this up:')}"
        yield f"{bullets(comparison['not_told'])}</section>"


def _section(
    heading: str, heads: Sequence[str], rows: Sequence[Sequence[str]], words: int, said: str, drawn: str = ""
) -> str:
    shown = [row((*(escape(cell) for cell in line[:words]), *line[words:]), words) for line in rows]
    told = wide(table(heads, shown, words), heading)
    return f"<section><h2>{escape(heading)}</h2>{paragraph(said)}{drawn}{told}</section>"


def plot_differences(comparison: Mapping[str, Any]) -> Drawing:
    """Draw the difference of each parameter in its standard deviations, the largest first."""
    told = [
        (f"{p['name']}", p["difference"] / p["std"])
        for effect in comparison["effects"]
        for p in effect["parameters"]
        if p["std"]
    ]
    told = sorted(told, key=lambda one: -abs(one[1]))[:_LEADING]
    drawn = Drawing(7.6, 1.2 + 0.26 * max(len(told), 1))
    axes = drawn.subplots()
    places = np.arange(len(told))
    colours = [AFTER if abs(size) > 3.0 else BEFORE for _, size in told]
    axes.barh(places, [size for _, size in told], color=colours, height=0.62)
    axes.axvline(0.0, color=INK, linewidth=0.8)
    axes.set_yticks(places, [plain(name) for name, _ in told])
    axes.invert_yaxis()
    axes.set_xlabel("difference in standard deviations; dark beyond three")
    tidy(axes, grid="x")
    title(axes, "Parameters that differ most between two campaigns")
    return drawn
