"""The gap as arrows where the tool was, before and after."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.transforms import ScaledTranslation, blended_transform_factory
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.report import units
from thermal_robot.report.drawing import AFTER, BEFORE, INK, SMALL, Drawing, note, thinned, tidy, title

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from thermal_robot.diagnosis.result import Diagnosis

_ARROWS = 250
_LONGEST = 0.18  # of the workspace's extent, for an arrow of the gap's 95th percentile
_FILLED = 0.84  # of a panel's height; the key stands above
_SHAPES = (0.85, 1.6)  # width to height of a panel


@dataclass(frozen=True, eq=False)
class _View:
    """Arrows as they are seen in one plane.

    Attributes
    ----------
    start, before, after
        (N, 2) positions and exaggerated arrows, m.
    factor
        How many times longer than in truth the arrows are.
    sample
        A round length of the gap for the key, m.
    """

    start: Array
    before: Array
    after: Array
    factor: float
    sample: float

    def limits(self) -> tuple[Array, Array]:
        """Return middle and size of what is to be seen, (2,) each, with a small margin."""
        ends = np.vstack([self.start, self.start + self.before, self.start + self.after])
        low, high = ends.min(axis=0), ends.max(axis=0)
        return (low + high) / 2.0, 1.06 * np.maximum(high - low, 1e-6)

    def shape(self) -> float:
        """Return the width of the panel over its height."""
        _, size = self.limits()
        return float(np.clip(_FILLED * size[0] / size[1], *_SHAPES))


def plot_map(diagnosis: Diagnosis) -> Figure:
    """Draw the gap before and after at the positions of the tool, from above and from the side.

    Returns
    -------
    Figure
        Arrows are exaggerated; the labels say by how much. Rows that were set aside are left out.
    """
    planes = _planes(diagnosis)
    shapes = [_shape(diagnosis, plane) for plane in planes.values()]
    figure = Drawing(9.2, min(0.9 + 8.0 / sum(shapes), 5.2))
    panels = figure.subplots(1, 2, width_ratios=shapes)
    for axes, (heading, plane) in zip(panels, planes.items(), strict=True):
        draw_map(axes, diagnosis, *plane)
        title(axes, heading)
    return figure


def broader_view(diagnosis: Diagnosis) -> tuple[str, tuple[int, int]]:
    """Return heading and axes of the view that fills a panel that is broader than high better."""
    return max(_planes(diagnosis).items(), key=lambda view: _shape(diagnosis, view[1]))


def _planes(diagnosis: Diagnosis) -> dict[str, tuple[int, int]]:
    position = diagnosis.rows.position
    broad = int(np.argmax(np.ptp(position[:, :2], axis=0))) if len(position) else 0
    return {"Seen from above": (0, 1), "Seen from the side": (broad, 2)}


def _shape(diagnosis: Diagnosis, plane: tuple[int, int]) -> float:
    view = _view(diagnosis, *plane)
    return view.shape() if view else 1.0


def draw_map(axes: Axes, diagnosis: Diagnosis, across: int, up: int) -> None:
    """Draw the arrows into a panel: ``across`` and ``up`` are the axes of the root frame that span it."""
    view = _view(diagnosis, across, up)
    if view is None:
        note(axes, "No two places with a gap are left to be mapped.")
        return
    _frame(axes, view)
    for arrows, colour, label in ((view.before, BEFORE, "before"), (view.after, AFTER, "after")):
        axes.quiver(
            *view.start.T,
            *arrows.T,
            color=colour,
            label=label,
            units="inches",
            width=0.018,
            minlength=1.5,
            angles="xy",
            scale_units="xy",
            scale=1.0,
        )
    axes.legend(loc="upper left", ncols=2, fontsize=SMALL, labelcolor=INK, frameon=False, borderaxespad=0.2)
    _key(axes, view)
    axes.set_xlabel(f"{'xyz'[across]} of the root frame (m)")
    axes.set_ylabel(f"{'xyz'[up]} of the root frame (m)")
    tidy(axes, grid="both")


def mapped(diagnosis: Diagnosis) -> NDArray[np.int64]:
    """Return which of the diagnosis' rows can be mapped: those that were not set aside and have a place."""
    rows = diagnosis.rows
    return np.flatnonzero(~rows.outliers & np.isfinite(rows.position).all(axis=1))


def exaggeration(diagnosis: Diagnosis, used: NDArray[np.int64], longest: float) -> float | None:
    """Return a round number of times that arrows are drawn longer than the gap; ``None`` without places or a gap.

    An arrow of the gap's 95th percentile is then at most the fraction ``longest`` of the workspace's extent, unless it
    is longer as it stands.
    """
    if not used.size:
        return None
    typical = _typical(diagnosis, used)
    extent = float(np.ptp(diagnosis.rows.position[used], axis=0).max())
    return max(units.round_down(longest * extent / typical), 1.0) if typical > 0.0 and extent > 0.0 else None


def _typical(diagnosis: Diagnosis, used: NDArray[np.int64]) -> float:
    return float(np.quantile(np.linalg.norm(diagnosis.rows.gap[used, :3], axis=1), 0.95))


def _view(diagnosis: Diagnosis, across: int, up: int) -> _View | None:
    """Return the arrows in a plane; ``None`` where all rows were set aside or are at one place, or no gap is left."""
    rows, used = diagnosis.rows, mapped(diagnosis)
    factor = exaggeration(diagnosis, used, _LONGEST)
    if factor is None:
        return None
    plane = np.ix_(used[thinned(len(used), _ARROWS)], np.array([across, up]))
    sample = units.round_down(_typical(diagnosis, used))
    return _View(rows.position[plane], rows.gap[plane] * factor, rows.remainder[plane] * factor, factor, sample)


def _frame(axes: Axes, view: _View) -> None:
    """Show all arrows undistorted, with room above them for the key."""
    middle, size = view.limits()
    width = max(size[0], view.shape() * size[1] / _FILLED)
    height = width / view.shape()
    axes.set_xlim(middle[0] - width / 2.0, middle[0] + width / 2.0)
    axes.set_ylim(middle[1] - _FILLED * height / 2.0, middle[1] + (1.0 - _FILLED / 2.0) * height)
    axes.set_aspect("equal", adjustable="box")
    axes.locator_params(axis="both", nbins=6)


def _key(axes: Axes, view: _View) -> None:
    """Show below the legend how long an arrow of a round gap is drawn."""
    below = ScaledTranslation(0.09, -0.35, axes.figure.dpi_scale_trans)
    along = blended_transform_factory(axes.transData, axes.transAxes) + below
    start = axes.get_xlim()[0]
    tip = (start + view.sample * view.factor, 1.0)
    arrow = {"arrowstyle": "-|>", "color": INK, "linewidth": 1.3, "shrinkA": 0.0, "shrinkB": 0.0}
    axes.annotate("", tip, (start, 1.0), xycoords=along, textcoords=along, arrowprops=arrow)
    times = f"{view.factor:,.0f}".replace(",", "\u2009")
    said = f"gap of {units.quantity(view.sample, 'm')}, drawn {times} times larger"
    axes.annotate(
        said, tip, (6.0, 0.0), xycoords=along, textcoords="offset points", va="center", fontsize=SMALL, color=INK
    )
