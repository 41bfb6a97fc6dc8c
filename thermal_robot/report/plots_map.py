"""The gap as arrows where the tool was, before and after."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from thermal_robot.report import units
from thermal_robot.report.drawing import (
    AFTER,
    BEFORE,
    INK,
    SMALL,
    Array,
    Drawing,
    note,
    plain,
    round_down,
    thinned,
    tidy,
    title,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from thermal_robot.diagnosis.result import Diagnosis

_ARROWS = 250
_LONGEST = 0.12  # of the workspace's extent, for an arrow of the gap's 95th percentile


def plot_map(diagnosis: Diagnosis) -> Figure:
    """Draw the gap before and after at the positions of the tool, from above and from the side.

    Returns
    -------
    Figure
        Arrows are exaggerated; the labels say by how much. Rows that were set aside are left out.
    """
    figure = Drawing(11.0, 5.2)
    panels = figure.subplots(1, 2)
    position = diagnosis.rows.position
    flat = int(np.argmax(np.ptp(position[:, :2], axis=0))) if len(position) else 0
    for axes, (across, up), heading in zip(
        panels, ((0, 1), (flat, 2)), ("Seen from above", "Seen from the side"), strict=True
    ):
        draw_map(axes, diagnosis, across, up)
        title(axes, heading)
    return figure


def draw_map(axes: Axes, diagnosis: Diagnosis, across: int = 0, up: int = 1) -> None:
    """Draw the arrows into a panel: ``across`` and ``up`` are the axes of the root frame that span it."""
    rows = diagnosis.rows
    used = np.flatnonzero(~rows.outliers & np.isfinite(rows.position).all(axis=1))
    if not used.size:
        note(axes, "No row is left to be drawn.")
        return
    plane = [across, up]
    factor, sample = _exaggeration(rows.position[used], rows.gap[used, :3])
    chosen = used[thinned(len(used), _ARROWS)]
    start = rows.position[np.ix_(chosen, plane)]
    before, after = rows.gap[np.ix_(chosen, plane)], rows.remainder[np.ix_(chosen, plane)]
    _arrows(axes, start, before * factor, BEFORE, "before", 0.0042)
    _arrows(axes, start, after * factor, AFTER, "after", 0.0042)
    ends = np.vstack([start, start + before * factor, start + after * factor])
    _frame(axes, ends)
    key = units.quantity(sample, "m")
    axes.plot([], [], linestyle="none", label=f"drawn {units.number(factor, 1)} times larger")
    x, y = _key_place(axes)
    axes.annotate(
        "",
        xy=(x + sample * factor, y),
        xytext=(x, y),
        arrowprops={"arrowstyle": "|-|,widthA=0.25,widthB=0.25", "color": INK, "linewidth": 1.2, "shrinkA": 0, "shrinkB": 0},
        annotation_clip=False,
    )
    axes.annotate(
        f"gap of {key}, drawn {factor:,.0f} times larger".replace(",", " "),
        xy=(x + sample * factor, y),
        xytext=(6, 0),
        textcoords="offset points",
        va="center",
        fontsize=SMALL,
        color=INK,
    )
    axes.set_xlabel(f"{'xyz'[across]} of the root frame (m)")
    axes.set_ylabel(f"{'xyz'[up]} of the root frame (m)")
    tidy(axes, grid="both")
