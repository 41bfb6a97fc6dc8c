"""A robot over time: each parameter in each campaign, with its deviation, and how it moves."""

from __future__ import annotations

from math import ceil
from typing import TYPE_CHECKING

import numpy as np

from thermal_robot.report import units
from thermal_robot.report.drawing import AFTER, BEFORE, FAINT, INK, MUTED, SMALL, Drawing, note, plain, tidy

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from thermal_robot.fleet.wear_result import Wear, Worn

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
