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
_SHAPE, _FILLED = 1.2, 0.84  # width to height of a panel, and how much of the height arrows may fill
_LONGEST = 0.18  # of the workspace's extent, for an arrow of the gap's 95th percentile


def plot_map(diagnosis: Diagnosis) -> Figure:
    """Draw the gap before and after at the positions of the tool, from above and from the side.

    Returns
    -------
    Figure
        Arrows are exaggerated; the labels say by how much. Rows that were set aside are left out.
    """
    figure = Drawing(9.2, 4.4)
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
    sample, factor = _exaggeration(rows.position[used], rows.gap[used, :3])
    chosen = used[thinned(len(used), _ARROWS)]
    plane = np.ix_(chosen, np.array([across, up]))
    start = rows.position[plane]
    ends = [start]
    for values, colour, label in ((rows.gap, BEFORE, "before"), (rows.remainder, AFTER, "after")):
        arrow = values[plane] * factor
        drawn = axes.quiver(
            *start.T,
            *arrow.T,
            color=colour,
            units="inches",
            width=0.018,
            minlength=1.5,
            label=label,
            angles="xy",
            scale_units="xy",
            scale=1.0,
        )
        ends.append(start + arrow)
    _frame(axes, np.vstack(ends))
    exaggerated = f"drawn {factor:,.0f} times larger".replace(",", "\u2009") if factor > 1.0 else "drawn to scale"
    axes.quiverkey(
        drawn,
        0.02 + sample * factor / float(np.ptp(axes.get_xlim())),  # where its tip is
        0.90,
        sample * factor,
        f"gap of {units.quantity(sample, 'm')}, {exaggerated}",
        labelpos="E",
        color=INK,
        labelcolor=INK,
        fontproperties={"size": SMALL},
    )
    axes.legend(loc="upper left", ncols=2, fontsize=SMALL, labelcolor=INK, frameon=False, borderaxespad=0.2)
    axes.set_xlabel(f"{'xyz'[across]} of the root frame (m)")
    axes.set_ylabel(f"{'xyz'[up]} of the root frame (m)")
    tidy(axes, grid="both")


def _exaggeration(position: Array, gap: Array) -> tuple[float, float]:
    """Return a round length of the gap for the key, m, and how many times larger arrows are drawn."""
    typical = float(np.quantile(np.linalg.norm(gap, axis=1), 0.95))
    extent = float(np.ptp(position, axis=0).max())
    if typical <= 0.0 or extent <= 0.0:
        return 1e-3, 1.0
    return round_down(typical), max(round_down(_LONGEST * extent / typical), 1.0)


def _frame(axes: Axes, points: Array) -> None:
    """Show all points undistorted, with room above them for the key; every panel has the same shape."""
    low, high = points.min(axis=0), points.max(axis=0)
    middle, size = (low + high) / 2.0, 1.06 * np.maximum(high - low, 1e-6)
    width = max(size[0], _SHAPE * size[1] / _FILLED)
    height = width / _SHAPE
    axes.set_xlim(middle[0] - width / 2.0, middle[0] + width / 2.0)
    axes.set_ylim(middle[1] - _FILLED * height / 2.0, middle[1] + (1.0 - _FILLED / 2.0) * height)
    axes.set_aspect("equal", adjustable="box")
