"""How far the gap shrinks: its distribution before and after, against the noise."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.report import units
from thermal_robot.report.drawing import AFTER, BEFORE, INK, PAPER, SMALL, THIRD, Drawing, log_axis, note, tidy, title

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from thermal_robot.diagnosis.result import Diagnosis


_BELOW_KEY = 0.77  # of a panel's height for the bars; the key stands above
_ROOM = 1.08  # beside the outermost bins, as a factor


def plot_how_far(diagnosis: Diagnosis) -> Figure:
    """Draw how many rows have which distance |gap|: before, after, and after while the row was held out.

    Returns
    -------
    Figure
        One panel for the position; a second one for the orientation where it was measured. Rows that were set
        aside are not counted.
    """
    pose = diagnosis.gap.orientation_before is not None and diagnosis.rows.gap.shape[1] >= 6
    figure = Drawing(7.6, 5.6 if pose else 3.5)
    panels = figure.subplots(2 if pose else 1, 1, squeeze=False)[:, 0]
    draw_how_far(panels[0], diagnosis)
    title(panels[0], "Position: measured against predicted")
    if pose:
        _draw_orientation(panels[1], diagnosis)
        title(panels[1], "Orientation: measured against predicted")
    return figure


def draw_how_far(axes: Axes, diagnosis: Diagnosis) -> None:
    """Draw the distances of the position into a panel."""
    rows, gap = diagnosis.rows, diagnosis.gap
    used = ~rows.outliers
    said = units.together((gap.rms_before, gap.rms_after, gap.held_out.rms_after, gap.noise_floor), "m")
    best = units.scale("m", gap.rms_before)
    _draw(
        axes,
        np.linalg.norm(rows.gap[used, :3], axis=1) * best.factor,
        np.linalg.norm(rows.remainder[used, :3], axis=1) * best.factor,
        rows.held_out_after[np.isfinite(rows.held_out_after)] * best.factor,
        said,
        gap.noise_floor * best.factor,
    )
    axes.set_xlabel(f"distance between measured and predicted position ({best.unit})")


def _draw_orientation(axes: Axes, diagnosis: Diagnosis) -> None:
    rows, gap = diagnosis.rows, diagnosis.gap
    used = ~rows.outliers
    best = units.scale("rad", gap.orientation_before or 0.0)
    _draw(
        axes,
        np.linalg.norm(rows.gap[used, 3:6], axis=1) * best.factor,
        np.linalg.norm(rows.remainder[used, 3:6], axis=1) * best.factor,
        np.zeros(0),
        units.together((gap.orientation_before, gap.orientation_after), "rad"),
        0.0,
    )
    axes.set_xlabel(f"angle between measured and predicted orientation ({best.unit})")


def _draw(axes: Axes, before: Array, after: Array, held_out: Array, said: list[str], floor: float) -> None:
    everything = np.concatenate([before, after, held_out])
    everything = everything[everything > 0.0]
    if not everything.size:
        note(axes, "There is no gap to be drawn.")
        return
    bins = _bins(everything, len(before), floor)
    before, after, held_out = (np.clip(v, bins[0], bins[-1]) for v in (before, after, held_out))
    # the outline before is the broader one, so that it is seen where the one after covers it
    _shape(axes, before, bins, BEFORE, f"before: rms {said[0]}", width=3.0, fill=0.5)
    _shape(axes, after, bins, AFTER, f"after: rms {said[1]}", fill=0.6)
    if held_out.size:
        _shape(axes, held_out, bins, THIRD, f"after, on rows held out: rms {said[2]}", style=(0, (4, 2)))
    if floor > 0.0:
        label = f"noise floor: rms {said[3]}"
        along = axes.get_xaxis_transform()
        axes.plot([floor] * 2, [0.0, _BELOW_KEY], transform=along, color=INK, linewidth=1.2, linestyle=":", label=label)
    # room beside the outermost bins, so that none looks cut off
    log_axis(axes, float(bins[0]) / _ROOM, float(bins[-1]) * _ROOM)
    axes.set_ylabel("rows")
    axes.set_ylim(0.0, axes.get_ylim()[1] / _BELOW_KEY)
    axes.locator_params(axis="y", integer=True, nbins=5)
    axes.legend(
        loc="upper left",
        ncols=2,
        fontsize=SMALL,
        labelcolor=INK,
        facecolor=PAPER,
        edgecolor="none",
        framealpha=0.9,
        handlelength=1.6,
    )
    tidy(axes)


def _bins(values: Array, rows: int, floor: float) -> Array:
    """Return edges of bins that are equally wide on a logarithmic axis and hold the noise floor, too."""
    # a few rows that happen to fit perfectly must not stretch the axis over decades
    low, high = float(np.quantile(values, 0.01)) / 1.6, float(values.max()) * 1.25
    if floor > 0.0:
        low, high = min(low, floor / 1.3), max(high, floor * 1.3)
    return np.geomspace(low, high, int(np.clip(2.2 * np.sqrt(rows), 14, 60)))


def _shape(
    axes: Axes,
    values: Array,
    bins: Array,
    colour: str,
    label: str,
    *,
    width: float = 1.5,
    style: Any = "-",
    fill: float = 0.0,
) -> None:
    """Draw a histogram from its first filled bin to its last: the outline, and the area with opacity ``fill``."""
    counts, _ = np.histogram(values, bins)
    filled = np.flatnonzero(counts)
    part = slice(int(filled[0]), int(filled[-1]) + 1)
    counts, edges = counts[part], bins[part.start : part.stop + 1]
    if fill > 0.0:
        axes.stairs(counts, edges, color=colour, alpha=fill, fill=True, linewidth=0, label=label)
    line = axes.stairs(counts, edges, color=colour, linewidth=width, linestyle=style)
    if fill == 0.0:
        line.set_label(label)
