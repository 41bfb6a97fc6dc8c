"""What remains, in the order of measurement and against the quantity that it follows."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.report import units
from thermal_robot.report.drawing import (
    AFTER,
    BEFORE,
    FAINT,
    INK,
    MUTED,
    RASTER_ABOVE,
    SMALL,
    Drawing,
    plain,
    thinned,
    tidy,
    title,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from thermal_robot.diagnosis.parts import Rows
    from thermal_robot.diagnosis.result import Diagnosis

_MIDDLES = 60
_LEVELS = 12
_FEW_CROSSES = 25
_EDGE = 0.88  # of a panel's height: a cross that is held there stays whole
_WITHOUT_UNIT = {"speed": "share of the maximum", "approach": "−1, 0, 1", "order": "number"}
"""What stands in a unit's place on the axis of a quantity that has none."""


def plot_remainder(diagnosis: Diagnosis) -> Figure:
    """Draw the remainder's x, y and z in the root frame.

    Returns
    -------
    Figure
        Left against the row in the file, right against the quantity that the remainder follows most, if any. The
        line is the running median, the band two sigma of the noise; crosses are rows that were set aside, at the
        edge where they lie beyond it.
    """
    rows = diagnosis.rows
    columns = [("row in the file", rows.rows.astype(float))]
    followed = _followed(diagnosis)
    if followed is not None:
        columns.append(followed)
    figure = Drawing(7.6 if followed is None else 9.2, 4.6)
    panels = figure.subplots(3, len(columns), squeeze=False, sharey=True, sharex="col")
    best, limit = _extent(diagnosis)
    for k, axis in enumerate("xyz"):
        for (_, along), axes in zip(columns, panels[k], strict=True):
            _draw(axes, along, rows.remainder[:, k] * best.factor, rows.outliers, limit)
            band = 2.0 * diagnosis.gap.noise_floor / np.sqrt(3.0) * best.factor
            axes.axhspan(-band, band, color=FAINT, linewidth=0, zorder=0, label="±2 σ of the noise")
            tidy(axes, grid="")
        panels[k][0].set_ylabel(f"{axis} ({best.unit})")
    for (name, _), axes in zip(columns, panels[2], strict=True):
        axes.set_xlabel(plain(name))
    title(panels[0][0], "Remainder, row by row")
    if followed is not None:
        title(panels[0][1], f"Against {diagnosis.unexplained.depends_on[0].covariate}")
    handles, labels = panels[0][0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, fontsize=SMALL, labelcolor=INK, frameon=False)
    return figure


def _followed(diagnosis: Diagnosis) -> tuple[str, Array] | None:
    """Return label and values of the quantity that the remainder follows most; ``None`` if not recorded."""
    if not diagnosis.unexplained.depends_on:
        return None
    name, rows = diagnosis.unexplained.depends_on[0].covariate, diagnosis.rows
    if name in rows.covariates:
        return _labelled(name, rows), np.asarray(rows.covariates[name], dtype=float)
    if name == "order":  # not recorded: the rows as they stand in the file
        return "order of the rows", np.arange(len(rows.rows), dtype=float)
    if name in diagnosis.joint_names:
        return _labelled(name, rows), rows.q[:, diagnosis.joint_names.index(name)]
    return None


def _labelled(name: str, rows: Rows) -> str:
    """Return a quantity's name with its unit, as an axis bears it."""
    unit = rows.units.get(name) or _WITHOUT_UNIT.get(name.partition(".")[0], "")
    return f"{name} ({unit})" if unit else name


def _extent(diagnosis: Diagnosis) -> tuple[units.Scale, float]:
    """Return the unit and the largest value drawn, which rows that were set aside do not decide."""
    rows = diagnosis.rows
    used = np.abs(rows.remainder[~rows.outliers, :3])
    largest = max(float(used.max()) if used.size else 0.0, 2.4 * diagnosis.gap.noise_floor / np.sqrt(3.0), 1e-12)
    best = units.scale("m", largest)
    return best, 1.15 * largest * best.factor


def _draw(axes: Axes, along: Array, values: Array, aside: NDArray[np.bool_], limit: float) -> None:
    known = np.isfinite(along) & np.isfinite(values)
    used, marked = np.flatnonzero(known & ~aside), np.flatnonzero(known & aside)
    drawn = used[thinned(len(used))]
    many, few = len(used) > RASTER_ABOVE, len(marked) <= _FEW_CROSSES
    axes.plot(
        along[drawn],
        values[drawn],
        linestyle="none",
        marker="o",
        markersize=1.6 if many else 3.0,
        markeredgewidth=0,
        color=MUTED,
        alpha=0.35 if many else 0.7,
        rasterized=many,
        label="remainder",
    )
    _draw_middles(axes, along[used], values[used])
    axes.plot(
        along[marked],
        np.clip(values[marked], -_EDGE * limit, _EDGE * limit),
        linestyle="none",
        marker="x",
        markersize=6.0 if few else 3.0,
        markeredgewidth=1.8 if few else 0.9,
        color=BEFORE,
        label="set aside",
    )
    axes.set_ylim(-limit, limit)
    axes.axhline(0.0, color=MUTED, linewidth=0.7)


def _draw_middles(axes: Axes, along: Array, values: Array) -> None:
    """Draw medians: a line over equally many rows each, or a dash at each value of a quantity with few of them."""
    levels = np.unique(along)
    if len(levels) <= _LEVELS:  # between two directions of approach there is nothing that a line could tell
        middle = np.array([np.median(values[along == level]) for level in levels])
        axes.plot(
            levels,
            middle,
            linestyle="none",
            marker="_",
            markersize=22.0,
            markeredgewidth=2.2,
            color=AFTER,
            label="median at each value",
        )
        return
    order = np.argsort(along, kind="stable")
    parts = np.array_split(order, int(np.clip(1.4 * np.sqrt(len(order)), 1, _MIDDLES)))
    where, middle = (np.array([np.median(of[part]) for part in parts]) for of in (along, values))
    axes.plot(where, middle, color=AFTER, linewidth=1.8, label="running median")
