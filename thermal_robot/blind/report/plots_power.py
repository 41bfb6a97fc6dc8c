"""The figure of a blind trial that shows how large an effect must be, and how many rows it takes, to be found."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import sqrt
from typing import TYPE_CHECKING, Any

from thermal_robot.report.drawing import (
    AFTER,
    INK,
    MUTED,
    SMALL,
    THIRD,
    Drawing,
    log_axis,
    note,
    tidy,
    title,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_LAST = 1.5  # times the lower bound: where a step without an upper one ends in the drawing


def power_figure(score: Mapping[str, Any]) -> Figure:
    """Draw the share of effects found against their size and against the number of rows.

    Returns
    -------
    Figure
        Points: cases of one step, with 95 % bars and their number; lines: the curve fitted to all cases, at the lower
        and the upper quartile of the other quantity.
    """
    detection = score["detection"]
    figure = Drawing(9.6, 4.0)
    left, right = figure.subplots(1, 2, sharey=True)
    curve = detection["curve"] or {"over_ratio": (), "over_samples": ()}
    _panel(left, detection["ratio"], curve["over_ratio"], lambda rows: f"with {rows:.0f} rows")
    left.set_xlabel("size: what it leaves over the noise, rms")
    left.set_ylabel("found, 95 % bars (%)")
    _panel(right, detection["samples"], curve["over_samples"], lambda size: f"{size:.2g} times the noise")
    right.set_xlabel("rows of the campaign")
    if left.lines:
        left.text(-0.015, 106.0, "cases", transform=left.get_yaxis_transform(), fontsize=SMALL, color=MUTED, ha="right")
    title(left, "Found, by size")
    title(right, "Found, by number of rows")
    return figure


def _panel(
    axes: Axes, steps: Sequence[Mapping[str, Any]], lines: Sequence[Mapping[str, Any]], other: Callable[[float], str]
) -> None:
    told = [s for s in steps if s["found"]["trials"]]
    if not told:
        note(axes, "No case with one effect of known size.")
        return
    for line, style in zip(lines, ("--", "-"), strict=False):
        shown = [100.0 * p for p in line["chance"]]
        axes.plot(line["x"], shown, color=THIRD, linestyle=style, linewidth=1.4, label=other(line["other"]))
    for s in told:
        low, high = s["low"], s["high"] or _LAST * s["low"]
        middle = sqrt(low * high)
        bottom, top = (100.0 * bound for bound in s["found"]["interval"])
        value = 100.0 * s["found"]["value"]
        axes.plot([low, high], [value, value], color=AFTER, linewidth=0.9, alpha=0.6)
        axes.plot([middle, middle], [bottom, top], color=AFTER, linewidth=1.3)
        axes.text(middle, 106.0, str(s["found"]["trials"]), ha="center", fontsize=SMALL, color=MUTED)
    axes.plot(
        [sqrt(s["low"] * (s["high"] or _LAST * s["low"])) for s in told],
        [100.0 * s["found"]["value"] for s in told],
        linestyle="none",
        marker="o",
        markersize=5.5,
        color=AFTER,
    )
    log_axis(axes, told[0]["low"] / 1.1, 1.1 * (told[-1]["high"] or _LAST * told[-1]["low"]))
    axes.set_xticks(sorted({s["low"] for s in told} | {s["high"] for s in told if s["high"]}))
    axes.minorticks_off()
    axes.set_ylim(-3.0, 112.0)
    axes.set_yticks(range(0, 101, 20))
    if lines:
        axes.legend(loc="lower right", fontsize=SMALL, frameon=False, labelcolor=INK)
    tidy(axes, grid="y")
