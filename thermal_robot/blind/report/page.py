"""The score of a blind trial as one HTML page."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from math import sqrt
from textwrap import fill
from typing import TYPE_CHECKING

from matplotlib.patches import Rectangle
from matplotlib.ticker import FuncFormatter

from thermal_robot.blind.judged import KNOWN
from thermal_robot.blind.report import text
from thermal_robot.blind.report.text import Plain
from thermal_robot.report import units
from thermal_robot.report.drawing import (
    AFTER,
    BEFORE,
    BROAD,
    FAINT,
    INK,
    LARGE,
    MUTED,
    NARROW,
    PAPER,
    SMALL,
    THIRD,
    Drawing,
    log_axis,
    note,
    plain,
    tidy,
    title,
)
from thermal_robot.report.page import render

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


_HEADINGS = {
    "single": "Named first, by what is at work",
    "hard": "Named first, where one small effect is at work and rows are few",
    "removed": "Named first, where the effect at work is not in the library",
}
_LEAST_WIDE, _LETTERS = 3.6, 10.0  # inches of a small matrix, which a telephone shows whole; bold letters in an inch
_FEWEST = 4  # columns that a matrix has room for
_DARK = 0.55  # share of a row above which its number is written in the colour of the paper
_LEAST = 1e-4  # of the gap: what is less is drawn at the edge
_GROUPS = {
    "known effect at work": (AFTER, "o", (*KNOWN, "mixed")),
    "cause withheld": (THIRD, "^", ("removed", "hidden", "unlisted", "both")),
    "real campaign": (BEFORE, "s", ("real",)),
}


def confusion_figure(score: Plain, which: str = "single") -> Figure:
    """Draw the confusion matrix of true and first-named effects.

    Numbers are cases; the stronger the colour, the larger their share of the row; the right answer is framed.
    """
    table = score["confusion"].get(which)
    if table is None:
        return _empty(_HEADINGS.get(which, which), "No case of this kind.")
    rows, columns = table["rows"], table["columns"]
    wide = max(2.3 + 0.37 * len(columns), _LEAST_WIDE)
    figure = Drawing(wide, 2.3 + 0.3 * len(rows))
    axes = figure.subplots()
    for line, (name, counts) in enumerate(zip(rows, table["counts"], strict=True)):
        total, answer = sum(counts), "unexplained" if name == "unlisted" or which == "removed" else name
        for column, number in enumerate(counts):
            axes.add_patch(_cell(column, line, number / total, columns[column] == answer))
            if number:
                colour = PAPER if number / total > _DARK else INK
                axes.text(column, line, str(number), ha="center", va="center", fontsize=SMALL, color=colour)
        axes.text(len(columns) - 0.2, line, str(total), va="center", fontsize=SMALL, color=MUTED)
    above = axes.get_xaxis_transform()
    axes.text(len(columns) - 0.2, 1.0, "cases", va="bottom", fontsize=SMALL, color=MUTED, transform=above)
    axes.set_xlim(-0.5, max(len(columns), _FEWEST) - 0.5)
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.set_xticks(range(len(columns)), [plain(text.effect(c)) for c in columns])
    axes.set_yticks(range(len(rows)), [plain(text.effect(r)) for r in rows])
    axes.set_xlabel("said")
    axes.set_ylabel("true")
    tidy(axes, grid="")
    axes.tick_params(length=0)
    for tick in axes.get_xticklabels():
        tick.set(rotation=50, ha="right", rotation_mode="anchor")
    axes.spines[:].set_visible(False)
    heading = fill(_HEADINGS.get(which, which), round(_LETTERS * wide))
    figure.suptitle(heading, x=0.01, ha="left", fontsize=LARGE, color=INK, fontweight="bold")
    return figure


def _cell(column: int, line: int, share: float, right: bool) -> Rectangle:
    """Square of a confusion matrix: opacity is the share of the row, a dark frame marks the right answer."""
    edge, width, order = (INK, 1.0, 2.0) if right else (FAINT, 0.5, 1.0)
    corner = column - 0.5, line - 0.5
    return Rectangle(corner, 1.0, 1.0, facecolor=(AFTER, share), edgecolor=edge, linewidth=width, zorder=order)


def calibration_figure(score: Plain) -> Figure:
    """Draw the reliability diagram of effect probabilities.

    Above, for each bin of probabilities, the share with its 95 % bar; below, how many effects there were.
    """
    steps = score["calibration"]["all"]["bins"]
    if not any(b["present"]["trials"] for b in steps):
        return _empty("Probabilities", "No probability was given.")
    figure = Drawing(NARROW, 6.0)
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3.2, 1.0))
    _frequencies(upper, steps)
    upper.text(0.02, 0.97, _error(score["calibration"]), transform=upper.transAxes, va="top", fontsize=SMALL, color=INK)
    _numbers(lower, steps)
    lower.set_xlim(-2.0, 102.0)
    lower.set_xlabel("said to be probable (%)")
    for axes in (upper, lower):
        tidy(axes)
    title(upper, "Do the probabilities hold?")
    return figure


def _rates(axes: Axes, at: Sequence[float], rates: Sequence[Plain]) -> None:
    """Draw rates in per cent, each with its 95 % bar."""
    for x, rate in zip(at, rates, strict=True):
        axes.plot([x, x], [100.0 * bound for bound in rate["interval"]], color=AFTER, linewidth=1.3)
    shares = [100.0 * rate["value"] for rate in rates]
    axes.plot(at, shares, linestyle="none", marker="o", markersize=5.5, color=AFTER)


def _frequencies(axes: Axes, steps: Sequence[Plain]) -> None:
    axes.plot([0.0, 100.0], [0.0, 100.0], color=MUTED, linewidth=0.9, linestyle="--")
    said = axes.text(13.0, 15.5, "as it should be", fontsize=SMALL, color=MUTED)
    said.set(rotation=45, rotation_mode="anchor", transform_rotates_text=True)
    told = [b for b in steps if b["present"]["trials"]]
    _rates(axes, [100.0 * b["mean"] for b in told], [b["present"] for b in told])
    axes.set_ylabel("at work, 95 % bars (%)")
    axes.set_ylim(-3.0, 103.0)


def _numbers(axes: Axes, steps: Sequence[Plain]) -> None:
    for b in steps:
        number, width = b["present"]["trials"], 100.0 * (b["high"] - b["low"])
        axes.bar(100.0 * b["low"], number, width=width, align="edge", color=FAINT, edgecolor=MUTED, linewidth=0.8)
        if number:
            top = (50.0 * (b["low"] + b["high"]), number)
            axes.annotate(str(number), top, (0, 2), textcoords="offset points", fontsize=SMALL, color=INK, ha="center")
    axes.set_yscale("log")
    axes.set_ylim(0.7, 4.0 * max(b["present"]["trials"] for b in steps))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.minorticks_off()
    axes.set_ylabel("effects")


def _error(calibration: Plain) -> str:
    all_, sure = calibration["all"], calibration["doubtful"]
    said = f"calibration error {units.percent(all_['error'])} over {all_['trials']} effects"
    if sure["trials"]:
        said += f"\n{units.percent(sure['error'])} over the {sure['trials']} between 5 and 95 %"
    return said


def shrinkage_figure(score: Plain) -> Figure:
    """Scatter the remaining share of the gap's mean square on fresh samples against the claimed one, log-log."""
    pairs = score["shrinkage"]["pairs"]
    if not pairs:
        return _empty("How far the gap shrinks", "No case has fresh samples.")
    figure = Drawing(NARROW, 4.8)
    axes = figure.subplots()
    most = max(1.0, *(1.0 - p[side] for p in pairs for side in ("claimed", "real")))
    limits = (100.0 * _LEAST / 1.5, 150.0 * most)
    axes.plot(limits, limits, color=MUTED, linewidth=0.9, linestyle="--")
    for name, (colour, marker, kinds) in _GROUPS.items():
        chosen = [p for p in pairs if p["kind"] in kinds]
        if chosen:
            x, y = ([100.0 * max(1.0 - p[side], _LEAST) for p in chosen] for side in ("claimed", "real"))
            label = f"{name} ({len(chosen)})"
            axes.plot(x, y, marker, color=colour, markersize=4.5, markeredgewidth=0.0, alpha=0.75, label=label)
    axes.set(xscale="log", yscale="log", xlim=limits, ylim=limits)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(FuncFormatter(_remains))
    axes.minorticks_off()
    axes.set_aspect("equal")
    axes.set_xlabel("claimed to stay of the gap's mean square, from rows held out (%)")
    axes.set_ylabel("stays on fresh samples (%)")
    axes.legend(loc="upper left", fontsize=SMALL, frameon=False, labelcolor=INK, handletextpad=0.2)
    apart = units.percent(score["shrinkage"]["median_absolute_difference"])
    said = f"apart by {apart} of the gap\nin the median"
    axes.text(0.98, 0.03, said, transform=axes.transAxes, ha="right", fontsize=SMALL, color=INK)
    tidy(axes, grid="both")
    title(axes, "Does the gap shrink as claimed?")
    return figure


def _remains(value: float, _: int) -> str:
    return f"≤ {value:g}" if value <= 100.0 * _LEAST * 1.001 else f"{value:g}"


def _empty(heading: str, why: str) -> Drawing:
    figure = Drawing(NARROW, 1.6)
    axes: Axes = figure.subplots()
    title(axes, heading)
    note(axes, why)
    return figure


_LAST = 1.5  # times the lower bound: where a step without an upper one ends in the drawing


def power_figure(score: Plain) -> Figure:
    """Draw the power of the diagnosis against effect size and number of rows.

    Points: detection rate of the cases in one bin, with 95 % bars and their number; lines: the logistic curve fitted to
    all cases, at the lower and the upper quartile of the other quantity.
    """
    detection = score["detection"]
    figure = Drawing(BROAD, 4.0)
    size, rows = figure.subplots(1, 2, sharey=True)
    curve = detection["curve"] or {"over_ratio": (), "over_samples": ()}
    _panel(size, detection["ratio"], curve["over_ratio"], lambda n: f"with {n:.0f} rows")
    size.set_xlabel("size: what it leaves over the noise, rms")
    size.set_ylabel("found, 95 % bars (%)")
    _panel(rows, detection["samples"], curve["over_samples"], lambda n: f"{n:.2g} times the noise")
    rows.set_xlabel("rows of the campaign")
    if size.lines:
        size.text(-0.015, 106.0, "cases", transform=size.get_yaxis_transform(), fontsize=SMALL, color=MUTED, ha="right")
    rows.set_ylabel("found, 95 % bars (%)")
    rows.tick_params(labelleft=True)
    title(size, "Found, by size")
    title(rows, "Found, by number of rows")
    return figure


def _panel(axes: Axes, steps: Sequence[Plain], lines: Sequence[Plain], other: Callable[[float], str]) -> None:
    told = [s for s in steps if s["found"]["trials"]]
    if not told:
        note(axes, "No case with one effect of known size.")
        return
    for line, style in zip(lines, ("--", "-"), strict=False):
        shown = [100.0 * p for p in line["chance"]]
        axes.plot(line["x"], shown, color=THIRD, linestyle=style, linewidth=1.4, label=other(line["other"]))
    ends = [(s["low"], s["high"] or _LAST * s["low"]) for s in told]
    middles = [sqrt(low * high) for low, high in ends]
    for s, between, middle in zip(told, ends, middles, strict=True):
        axes.plot(between, [100.0 * s["found"]["value"]] * 2, color=AFTER, linewidth=0.9, alpha=0.6)
        axes.text(middle, 106.0, str(s["found"]["trials"]), ha="center", fontsize=SMALL, color=MUTED)
    _rates(axes, middles, [s["found"] for s in told])
    log_axis(axes, ends[0][0] / 1.1, 1.1 * ends[-1][1])
    axes.set_xticks(sorted({s["low"] for s in told} | {s["high"] for s in told if s["high"]}))
    axes.minorticks_off()
    axes.set_ylim(-3.0, 112.0)
    axes.set_yticks(range(0, 101, 20))
    if lines:
        axes.legend(loc="lower right", fontsize=SMALL, frameon=False, labelcolor=INK)
    tidy(axes, grid="y")


def html(score: Plain, generated: str) -> str:
    """HTML page of a score, format ``thermal-robot/blind/1``, self-contained, for A4.

    ``generated`` is when it was made, in the words that shall stand in the footer; may be empty.
    """
    groups = [_groups(f"{of}, {more}", score[name], ask) for name, of, more, ask in text.GROUPED if score[name]]
    real = [(c["id"], c["asked"], c["answer"], "right" if c["right"] else "wrong") for c in score["real"]]
    misses = [(c["id"], text.kind(c["kind"]), c["robot"], *text.miss(c)) for c in score["misses"]]
    shown = {"score": score, "text": text, "figures": sys.modules[__name__]}
    shown |= {"groups": groups, "real": real, "misses": misses}
    return render("blind.html", shown, title="Blind trial", generated=generated)


def _groups(heading: str, groups: Plain, columns: Sequence[str]) -> tuple[str, tuple[str, ...], list[tuple[str, ...]]]:
    """Heading, column names and rows of a table of rates by group, with the columns that any group has."""
    asked = [q for q in dict.fromkeys((*columns, "false_alarm")) if any(q in rates for rates in groups.values())]
    rows = [(group, *(_share(rates.get(q)) for q in asked)) for group, rates in groups.items()]
    return heading, ("", *map(text.question, asked)), rows


def _share(rate: Plain | None) -> str:
    if rate is None or not rate["trials"]:
        return units.MISSING
    return f"{text.count(rate)}, {units.percent(rate['value'])}"
