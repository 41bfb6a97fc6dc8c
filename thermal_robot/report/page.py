"""A diagnosis as HTML: a page to hand on, and a piece of a notebook."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from html import escape
from typing import TYPE_CHECKING

from thermal_robot.report.details import details
from thermal_robot.report.html_parts import bullets, checksums, css, document, figure, paragraph, signature
from thermal_robot.report.page_arm import arm_figure, script
from thermal_robot.report.page_criteria import criteria_section
from thermal_robot.report.page_model import model_section
from thermal_robot.report.page_tables import effects_table, extremes_table, numbers, outliers_table
from thermal_robot.report.plots_how_far import plot_how_far
from thermal_robot.report.plots_map import plot_map
from thermal_robot.report.plots_overview import overview
from thermal_robot.report.plots_remainder import plot_remainder
from thermal_robot.report.plots_where import plot_where
from thermal_robot.report.plots_which import plot_which
from thermal_robot.report.words import (
    campaign,
    hardest,
    laws,
    left_out,
    noise_of,
    one_sigma,
    rows_used,
    sentences,
    set_aside,
    struck,
    turned,
    verdict,
    with_aside,
)

if TYPE_CHECKING:
    from thermal_robot.diagnosis.result import Diagnosis


def html(diagnosis: Diagnosis, generated: str | None = None, files: Mapping[str, str] | None = None) -> str:
    """Write a diagnosis as a page that needs nothing beside itself and prints on A4.

    Of a table that does not fit the robot it says what is wrong with it and what to do, and nothing of the robot.

    Parameters
    ----------
    diagnosis
        The result.
    generated
        When it was made, in the words that shall stand in the footer; nothing is said where absent, so that equal
        diagnoses give equal pages.
    files
        Names of the files that the diagnosis was made from, with the SHA-256 of each, for the footer.

    Returns
    -------
    str
        A complete HTML document.
    """
    name, arm = diagnosis.campaign or diagnosis.robot, arm_figure(diagnosis)
    body = "\n".join(_whole(diagnosis, arm, checksums(files or {}) + escape(signature(generated))))
    return document(f"Diagnosis of {name}", body, script() if arm else "")


def fragment(diagnosis: Diagnosis) -> str:
    """Write a diagnosis as a piece of HTML for a notebook: verdict, numbers, one figure, effects.

    Of a table that does not fit the robot it says what is wrong with it and what to do, and nothing of the robot.

    Returns
    -------
    str
        One ``<div>`` with its own style, which touches nothing around it.
    """
    body = "\n".join(
        (
            *map(paragraph, turned(diagnosis)),
            paragraph(diagnosis.summary, strong=True),
            *(_in_short(diagnosis) if diagnosis.usable else (paragraph(diagnosis.advice), _facts(diagnosis))),
            *(['<p class="tr-kicker">Warnings</p>', bullets(diagnosis.warnings)] if diagnosis.warnings else []),
        )
    )
    return f'<div class="thermal-robot">\n<style>\n{css("page.css")}</style>\n{body}\n</div>'


def _in_short(diagnosis: Diagnosis) -> Iterator[str]:
    """Yield what a notebook shows of a robot between the verdict and the warnings."""
    yield from map(paragraph, details(diagnosis))
    yield numbers(diagnosis)
    yield figure(overview(diagnosis, headline=False), f"Overview: {diagnosis.summary}")
    yield effects_table(diagnosis)
    yield '<p class="tr-kicker">Unexplained</p>'
    yield from _unexplained(diagnosis)


def _whole(diagnosis: Diagnosis, arm: str, footer: str) -> Iterator[str]:
    yield '<header><div class="tr-kicker">Where the gap lies, what causes it, how far it shrinks</div>'
    yield from map(paragraph, turned(diagnosis))
    yield f"<h1>{escape(diagnosis.summary)}</h1>"
    yield from map(paragraph, details(diagnosis))
    yield _facts(diagnosis)
    yield (numbers(diagnosis) if diagnosis.usable else "") + "</header>"
    if diagnosis.usable:
        yield from _of_the_robot(diagnosis, arm)
    yield from _next(diagnosis)
    if diagnosis.usable and diagnosis.outliers:
        yield f"<section><h2>Set aside</h2>{outliers_table(diagnosis)}</section>"
    if diagnosis.warnings:
        yield f"<section><h2>Warnings</h2>{bullets(diagnosis.warnings)}</section>"
    yield f"<footer>{footer}</footer>"


def _of_the_robot(diagnosis: Diagnosis, arm: str) -> Iterator[str]:
    """Yield the sections that hold only where robot and table describe the same motion."""
    yield "<section><h2>How far</h2>"
    held = diagnosis.gap.held_out
    yield paragraph(
        "The gap is the distance between measured and predicted pose. Shrinkage is the share of its mean square that "
        f"the correction removes on rows that were not used for the fit ({held.scheme}, {held.folds} folds). "
        "Figures of rows held out have the noise of these rows in them."
    )
    if told := with_aside(diagnosis):
        yield paragraph(f"The gap on rows held out {told}.")
    if told := hardest(diagnosis):
        yield paragraph(f"Rows held out in the hardest way: {told}.")
    yield paragraph(f"Noise alone would leave {noise_of(diagnosis)}.")
    yield figure(plot_how_far(diagnosis), "Distribution of the gap before and after") + extremes_table(diagnosis)
    yield "</section><section><h2>Which</h2>"
    yield figure(plot_which(diagnosis), "Share of the gap and probability of every effect")
    yield effects_table(diagnosis)
    yield (paragraph(told) if (told := one_sigma(diagnosis)) else "") + "</section>"
    yield f"<section><h2>Where</h2>{arm}"
    yield figure(plot_where(diagnosis), "Shares of the gap along the chain, by axis and by quantity")
    yield figure(plot_map(diagnosis), "The gap as arrows at the positions of the tool") + "</section>"
    yield "<section><h2>Unexplained</h2>"
    yield from _unexplained(diagnosis)
    yield figure(plot_remainder(diagnosis), "The remainder in the order of measurement")
    if diagnosis.fit is not None:
        for law in laws(diagnosis):
            yield figure(diagnosis.explain(law.name), f"{law.name}: the error there against what it follows")
    yield "</section>"
    yield from model_section(diagnosis)
    yield from criteria_section(diagnosis)


def _facts(diagnosis: Diagnosis) -> str:
    facts = {"Verdict": verdict(diagnosis), "Campaign": campaign(diagnosis)}
    if diagnosis.usable:
        facts |= {"Set aside": set_aside(diagnosis), "Rows used": rows_used(diagnosis), "Left out": left_out(diagnosis)}
    facts["Struck"] = struck(diagnosis)
    return f"<dl>{''.join(f'<dt>{k}</dt><dd>{escape(v)}</dd>' for k, v in facts.items() if v)}</dl>"


def _unexplained(diagnosis: Diagnosis) -> Iterator[str]:
    said = "".join(paragraph(s) for s in sentences(diagnosis))
    yield f'<div class="tr-flag">{said}</div>' if diagnosis.unexplained.flagged else said


def _next(diagnosis: Diagnosis) -> Iterator[str]:
    apart = [f"to tell apart: {', '.join(group)}" for group in (diagnosis.separates if diagnosis.usable else ())]
    if not diagnosis.advice and not apart:
        return
    advice = paragraph(diagnosis.advice) if diagnosis.advice else ""
    yield f"<section><h2>Next</h2>{advice}{bullets(apart)}</section>"
