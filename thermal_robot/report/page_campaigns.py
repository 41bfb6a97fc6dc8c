"""More than one campaign as HTML: a comparison, a fleet, a robot over time; pages to hand on and their figures."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from html import escape
from math import ceil
from typing import TYPE_CHECKING, Any

import numpy as np

from thermal_robot.report import units
from thermal_robot.report.drawing import AFTER, BEFORE, FAINT, INK, MUTED, SMALL, Drawing, note, plain, tidy, title
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
from thermal_robot.report.text_campaigns import (
    SECTIONS,
    campaign_in_words,
    change_in_words,
    comparison_headline,
    effects,
    failures,
    fleet_headline,
    parameters,
    predictions,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from thermal_robot.fleet.wear_result import Wear, Worn


_MOST_DIFFERENCES = 24


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
    body = "\n".join((*_of_comparison(comparison), *_sections(comparison), f"<footer>{foot}</footer>"))
    return document("Comparison of campaigns", body)


def comparison_fragment(comparison: Mapping[str, Any]) -> str:
    """Write a comparison as a piece of HTML for a notebook: one ``<div>`` with its own style."""
    body = "\n".join((paragraph(comparison_headline(comparison), strong=True), *_sections(comparison)))
    return f'<div class="thermal-robot"><style>{css("page.css")}</style>{body}</div>'


def _of_comparison(comparison: Mapping[str, Any]) -> Iterator[str]:
    yield '<header><div class="tr-kicker">What the same robot shares between campaigns, and what changed</div>'
    yield f"<h1>{escape(comparison_headline(comparison))}</h1></header>"
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
    told = sorted(told, key=lambda one: -abs(one[1]))[:_MOST_DIFFERENCES]
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
    return document("Fleet", "\n".join(_of_fleet(summary, generated)))


def _of_fleet(summary: Mapping[str, Any], generated: str | None) -> Iterator[str]:
    yield '<header><div class="tr-kicker">What is wrong with which robot, and what several share</div>'
    yield f"<h1>{escape(fleet_headline(summary))}</h1></header>"
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


_COLUMNS, _MOST = 2, 12


def plot_wear(wear: Wear) -> Figure:
    """Draw the parameters over time, those that ring first: dots as each campaign has them, with one deviation.

    Returns
    -------
    Figure
        A line as its kind has it, orange where it rings; a grey band where a jump lies with 95 %; the limit dashed
        where it is near.
    """
    shown = [worn for worn in wear.parameters if worn.comparable][:_MOST]
    lines = max(ceil(len(shown) / _COLUMNS), 1)
    figure = Drawing(8.6, 0.5 + 2.0 * lines)
    panels = figure.subplots(lines, _COLUMNS, squeeze=False, sharex=True).ravel()
    for axes, worn in zip(panels, shown, strict=False):
        _draw(axes, wear, worn)
    for axes in panels[len(shown) :]:
        axes.axis("off")
    for axes in panels[max(len(shown) - _COLUMNS, 0) : len(shown)]:
        axes.set_xlabel(f"days since {wear.campaigns[0].date}" if wear.dated else "campaign")
        axes.tick_params(labelbottom=True)
    if not shown:
        note(panels[0], "No parameter can be compared.")
    return figure


def _draw(axes: Axes, wear: Wear, worn: Worn) -> None:
    """Draw one parameter about its middle, so that what changes is seen beside what it is."""
    seen = [k for k, value in enumerate(worn.values) if value is not None]
    times = np.array([visit.time for visit in wear.campaigns]) + (0.0 if wear.dated else 1.0)
    values, stds = (np.array([each[k] for k in seen], dtype=float) for each in (worn.values, worn.stds))
    middle = float(np.mean(worn.fitted))
    scale = units.scale(worn.unit, float(np.max(np.abs(values - middle) + stds)))
    if worn.jump is not None and worn.alarm:
        axes.axvspan(times[worn.jump.earliest], times[worn.jump.latest], color=FAINT, linewidth=0)
    colour = BEFORE if worn.alarm else MUTED
    x, y = _path(worn, times)
    axes.plot(x, scale.factor * (y - middle), color=colour, linewidth=2.0 if worn.alarm else 1.2)
    axes.errorbar(
        times[seen], scale.factor * (values - middle), scale.factor * stds, fmt="o", markersize=3.5, color=AFTER,
        ecolor=AFTER, elinewidth=1.0,
    )  # fmt: skip
    low, high = axes.get_ylim()
    for limit in () if worn.crossing is None else (worn.crossing.limit, -worn.crossing.limit):
        if low < (place := scale.factor * (limit - middle)) < high:
            axes.axhline(place, color=INK, linestyle="--", linewidth=0.9)
    tidy(axes)
    axes.set_ylabel(scale.unit or "1", fontsize=SMALL)
    said = f"ALARM: {worn.kind}" if worn.alarm else f"moved: {units.probability(worn.moved)}"
    axes.set_title(
        plain(f"{worn.parameter}\n{said}"), loc="left", fontsize=SMALL, color=INK if worn.alarm else MUTED,
        fontweight="bold" if worn.alarm else "normal",
    )  # fmt: skip


def _path(worn: Worn, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return where the line of a parameter goes: a jump stands upright between the campaigns beside it."""
    fitted = np.array(worn.fitted)
    if worn.jump is None:
        return times, fitted
    k = worn.jump.after
    between = 0.5 * (times[k] + times[k + 1])
    return np.insert(times, k + 1, [between, between]), np.insert(fitted, k + 1, [fitted[k], fitted[k + 1]])


_OF_PARAMETER = ("parameter", "it", "change", "a day", "moved", "by chance", "limit")


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
    return document(f"{wear.robot} over time", "\n".join(_of_wear(wear, footer)))


def _of_wear(wear: Wear, footer: str) -> Iterator[str]:
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
    yield wide(table(_OF_PARAMETER, shown, 2), "Every parameter: how it moves, how far, how sure that is")
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
