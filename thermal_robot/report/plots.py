"""The figures of a diagnosis: how far the gap shrinks, which effects, where they act, what remains."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.ticker import FixedLocator, MaxNLocator
from matplotlib.transforms import ScaledTranslation, blended_transform_factory
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.report import units
from thermal_robot.report.drawing import (
    AFTER,
    BEFORE,
    FAINT,
    INK,
    LARGE,
    MUTED,
    NORMAL,
    PAPER,
    RASTER_ABOVE,
    SMALL,
    THIRD,
    Drawing,
    log_axis,
    note,
    plain,
    thinned,
    tidy,
    title,
)
from thermal_robot.report.words import bound, by_status, needs

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from thermal_robot.diagnosis.result import Diagnosis
    from thermal_robot.diagnosis.values import Explained, Finding, Place, Rows


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
        draw_how_far(panels[1], diagnosis, turned=True)
        title(panels[1], "Orientation: measured against predicted")
    return figure


def draw_how_far(axes: Axes, diagnosis: Diagnosis, turned: bool = False) -> None:
    """Draw the distances of the position into a panel, or the angles of the orientation if ``turned``."""
    rows, gap, used = diagnosis.rows, diagnosis.gap, ~diagnosis.rows.outliers
    held, floor = rows.held_out_after[np.isfinite(rows.held_out_after)], gap.noise_floor
    sizes: list[float | None] = [gap.rms_before, gap.rms_after, gap.held_out.rms_after, floor]
    what, unit, part = "distance between measured and predicted position", "m", slice(0, 3)
    if turned:
        held, floor, sizes = np.zeros(0), 0.0, [gap.orientation_before, gap.orientation_after]
        what, unit, part = "angle between measured and predicted orientation", "rad", slice(3, 6)
    best = units.scale(unit, sizes[0] or 0.0)
    before, after = (np.linalg.norm(of[used, part], axis=1) * best.factor for of in (rows.gap, rows.remainder))
    _draw_distances(axes, before, after, held * best.factor, units.together(sizes, unit), floor * best.factor)
    axes.set_xlabel(f"{what} ({best.unit})")


def _draw_distances(axes: Axes, before: Array, after: Array, held_out: Array, said: list[str], floor: float) -> None:
    everything = np.concatenate([before, after, held_out])
    everything = everything[everything > 0.0]
    if not everything.size:
        note(axes, "There is no gap to be drawn.")
        return
    bins = _bins(everything, len(before), floor)
    before, after, held_out = (np.clip(v, bins[0], bins[-1]) for v in (before, after, held_out))
    # the outline before is the broader one, so that it is seen where the one after covers it
    _draw_shape(axes, before, bins, BEFORE, f"before: rms {said[0]}", width=3.0, fill=0.5)
    _draw_shape(axes, after, bins, AFTER, f"after: rms {said[1]}", fill=0.6)
    if held_out.size:
        _draw_shape(axes, held_out, bins, THIRD, f"after, on rows held out: rms {said[2]}", style=(0, (4, 2)))
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


def _draw_shape(
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


_LOOK: dict[str, dict[str, Any]] = {
    "found": {"color": AFTER, "edgecolor": AFTER},
    "confounded": {"color": "none", "edgecolor": AFTER, "hatch": "////"},
    "contained": {"color": FAINT, "edgecolor": AFTER},
    "not_found": {"color": FAINT, "edgecolor": MUTED},
}
_FURTHEST_BELOW_ZERO, _FURTHEST = -0.25, 1.5


def plot_which(diagnosis: Diagnosis) -> Figure:
    """Draw every candidate's share of the gap on held-out rows with its 95 % interval, and its probability.

    Returns
    -------
    Figure
        Filled: found; hatched: cannot be told apart from another; pale: in question, then not found. What is not
        testable says why.
    """
    figure = Drawing(7.6, 1.3 + 0.27 * max(len(diagnosis.effects), 3))
    axes = figure.subplots()
    draw_which(axes, diagnosis)
    title(axes, "What each effect explains, and how probable it is")
    return figure


def draw_which(axes: Axes, diagnosis: Diagnosis, *, brief: bool = False) -> None:
    """Draw the candidates into a panel, ``brief`` where there is no room to say what an effect would need."""
    ordered = by_status(diagnosis)
    if not ordered:
        note(axes, "No effect was tried.")
        return
    low, high = -0.02, 1.0
    for line, finding in enumerate(ordered):
        if finding.status == "not_testable":
            said = "not testable" if brief else f"not testable: needs {needs(finding, diagnosis.joint_names)}"
            axes.text(1.0, line, plain(said), va="center", fontsize=SMALL, color=MUTED, style="italic")
            continue
        low = min(low, *(finding.shrinkage_ci95 or (0.0, 0.0)))
        high = max(high, *(finding.shrinkage_ci95 or (0.0, 0.0)))
        _draw_bar(axes, line, finding)
        axes.text(
            1.02,
            line,
            units.probability(finding.probability),
            transform=axes.get_yaxis_transform(),
            va="center",
            fontsize=SMALL,
            color=INK if finding.status in ("found", "confounded") else MUTED,
        )
    axes.text(
        1.02,
        -0.95,
        "probability",
        transform=axes.get_yaxis_transform(),
        fontsize=SMALL,
        color=MUTED,
        va="center",
    )
    axes.set_yticks(range(len(ordered)), [plain(f.name) for f in ordered])
    axes.set_ylim(len(ordered) - 0.4, -1.3)
    axes.set_xlim(100.0 * max(low, _FURTHEST_BELOW_ZERO) - 1.0, 100.0 * min(high, _FURTHEST) + 2.0)
    axes.axvline(0.0, color=MUTED, linewidth=0.8)
    axes.set_xlabel("share of the gap's mean square on rows held out, 95 % interval (%)")
    tidy(axes, grid="x")
    axes.tick_params(axis="y", length=0)
    for label, finding in zip(axes.get_yticklabels(), ordered, strict=True):
        label.set_color(INK if finding.status in ("found", "confounded") else MUTED)


def _draw_bar(axes: Axes, line: int, finding: Finding) -> None:
    share = 100.0 * (finding.shrinkage or 0.0)
    axes.barh(line, share, height=0.62, linewidth=0.9, **_LOOK[finding.status])
    if finding.shrinkage_ci95 is not None:
        low, high = (100.0 * b for b in finding.shrinkage_ci95)
        axes.plot([low, high], [line, line], color=INK, linewidth=1.1)
        axes.plot([low, high], [line, line], linestyle="none", marker="|", markersize=6, color=INK)


_Group = tuple[str, Mapping[str, float], str]
_MOST_QUANTITIES = 8
_LONG_NAME = 26
_BETWEEN = 0.6  # lines


def plot_where(diagnosis: Diagnosis) -> Figure:
    """Draw the shares of the gap's mean square: places of the arm and beyond it, axes, quantities."""
    chain, other = _chain(diagnosis), _other(diagnosis)
    right = _lines(other)
    left = _lines(chain) if _placed(chain) else min(right, 4.0)
    names = [len(name) for _, shares, _ in (*chain, *other) for name in shares]
    # panels as high as their bars, so that a bar is equally thick everywhere; below each other where names are long
    if max(names, default=0) > _LONG_NAME:
        figure = Drawing(7.6, 1.9 + 0.24 * (left + right))
        panels = figure.subplots(2, 1, height_ratios=(left, right))
    else:
        lines, rest = max(left, right), max(abs(left - right), 0.01)
        figure = Drawing(9.2, 1.2 + 0.24 * lines)
        grid = figure.add_gridspec(2, 2, height_ratios=(lines - rest, rest))
        places = [grid[:, k] if n == lines else grid[0, k] for k, n in enumerate((left, right))]
        panels = np.array([figure.add_subplot(place) for place in places])
    draw_where(panels[0], diagnosis)
    title(panels[0], "Where along the chain")
    _draw_groups(panels[1], other)
    title(panels[1], "By axis and by quantity")
    return figure


def draw_where(axes: Axes, diagnosis: Diagnosis) -> None:
    """Draw joints and links into a panel, the root above, the tool below, then what lies beyond them."""
    chain = _chain(diagnosis)
    if not _placed(chain):
        note(axes, "No effect was found,\nso none is placed along the chain.")
        return
    _draw_groups(axes, chain)


def _placed(chain: Sequence[_Group]) -> bool:
    return any(share > 0.0 for _, shares, _ in chain for share in shares.values())


def _chain(diagnosis: Diagnosis) -> list[_Group]:
    where = diagnosis.where
    names = dict.fromkeys((*diagnosis.joint_names, *where.joints)) if where.joints else {}
    joints = {name: where.joints.get(name, 0.0) for name in names}
    groups = (
        ("joints, from root to tool", joints, AFTER),
        ("links, from root to tool", where.links, THIRD),
        ("beyond joints and links", where.beyond, BEFORE),
    )
    return [group for group in groups if group[1]]


def _other(diagnosis: Diagnosis) -> list[_Group]:
    where = diagnosis.where
    quantities = dict(sorted(where.covariates.items(), key=lambda item: -item[1])[:_MOST_QUANTITIES])
    groups: list[_Group] = [("axes of the root frame", where.axes, MUTED)]
    if quantities:
        groups.append(("quantities, each alone", quantities, AFTER))
    return groups


def _lines(groups: Sequence[_Group]) -> float:
    return sum(len(shares) + 1.0 + _BETWEEN for _, shares, _ in groups)


def _draw_groups(axes: Axes, groups: Sequence[_Group]) -> None:
    """Draw groups of bars below each other; the axis ends a little beyond the longest."""
    ticks: list[float] = []
    names: list[str] = []
    line = 0.0
    largest = max((100.0 * s for _, shares, _ in groups for s in shares.values()), default=0.0)
    end = min(max(1.18 * largest, 10.0), 118.0)
    for heading, shares, colour in groups:
        axes.text(0.01 * end, line, heading, fontsize=SMALL, color=MUTED, va="center", style="italic")
        line += 1.0
        for name, share in shares.items():
            axes.barh(line, end, height=0.66, color=FAINT, alpha=0.35, linewidth=0)
            axes.barh(line, 100.0 * max(share, 0.0), height=0.66, color=colour, linewidth=0)
            if share >= 5e-4:
                beside = 100.0 * share + 0.01 * end
                axes.text(beside, line, units.percent(share), fontsize=SMALL, color=INK, va="center")
            ticks.append(line)
            names.append(name)
            line += 1.0
        line += _BETWEEN
    axes.set_yticks(ticks, [plain(n) for n in names])
    axes.set_ylim(line - _BETWEEN - 0.4, -0.8)
    axes.set_xlim(0.0, end)
    axes.set_xlabel("share of the gap's mean square (%)")
    tidy(axes, grid="")
    axes.tick_params(axis="y", length=0)


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
    shapes = [_panel_shape(diagnosis, plane) for plane in planes.values()]
    figure = Drawing(9.2, min(0.9 + 8.0 / sum(shapes), 5.2))
    panels = figure.subplots(1, 2, width_ratios=shapes)
    for axes, (heading, plane) in zip(panels, planes.items(), strict=True):
        draw_map(axes, diagnosis, *plane)
        title(axes, heading)
    return figure


def broader_view(diagnosis: Diagnosis) -> tuple[str, tuple[int, int]]:
    """Return heading and axes of the view that fills a panel that is broader than high better."""
    return max(_planes(diagnosis).items(), key=lambda view: _panel_shape(diagnosis, view[1]))


def _planes(diagnosis: Diagnosis) -> dict[str, tuple[int, int]]:
    position = diagnosis.rows.position
    broad = int(np.argmax(np.ptp(position[:, :2], axis=0))) if len(position) else 0
    return {"Seen from above": (0, 1), "Seen from the side": (broad, 2)}


def _panel_shape(diagnosis: Diagnosis, plane: tuple[int, int]) -> float:
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
            _draw_remainder(axes, along, rows.remainder[:, k] * best.factor, rows.outliers, limit)
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


def _draw_remainder(axes: Axes, along: Array, values: Array, aside: NDArray[np.bool_], limit: float) -> None:
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


_ACROSS = 3
_HIGH = 0.99
_UNSEEN = 5.0
_APART = 0.16
_MANY = 400
_POINTS = 1500
_STEPS = [1, 2, 5, 10]


def explain_figure(explained: Explained) -> Figure:
    """Draw one panel a place, largest share first.

    Returns
    -------
    Figure
        Grey: the error at the place as measured, with everything else that was found taken off. Blue: with this effect
        taken off, too. The line is the fitted law. Rows in which the place hardly moves the target are left out,
        and the axes end where a hundredth of the points lies beyond. "Less its mean": a constant that the unknown
        frames take up as well says nothing.
    """
    places = explained.places
    count = max(len(places), 1)
    across = count if count <= _ACROSS else (2 if count == 4 else _ACROSS)
    down = -(-count // across)
    figure = Drawing((5.4, 7.6, 9.6)[across - 1], 0.95 + 2.55 * down)
    panels = figure.subplots(down, across, squeeze=False)
    for axes in panels.ravel()[len(places) :]:
        axes.axis("off")
    limits = _limits(explained)
    for k, (place, axes) in enumerate(zip(places, panels.ravel(), strict=False)):
        low, high = limits[place.unit]
        scale = units.scale(_si(place), max(abs(low), abs(high)))
        _draw_place(axes, place, scale.factor)
        axes.set_ylim(low * scale.factor, high * scale.factor)
        axes.set_title(_heading(place), loc="left", fontsize=NORMAL, color=INK, fontweight="bold", pad=6)
        if k % across == 0 or place.unit != places[k - 1].unit:
            axes.set_ylabel(f"{_error(explained)} ({scale.unit}{place.unit.removeprefix(_si(place))})")
        else:
            axes.tick_params(labelleft=False)
    more = f"; {explained.left_out} smaller places are not shown" if explained.left_out else ""
    figure.suptitle(plain(f"What {explained.effect} explains{more}"), x=0.01, ha="left", fontsize=11.0, color=INK)
    if places:
        handles, labels = panels[0][0].get_legend_handles_labels()
        shown = figure.legend(
            handles,
            labels,
            loc="outside lower center",
            ncols=3,
            fontsize=SMALL,
            labelcolor=INK,
            frameon=False,
            markerscale=5.0 / handles[0].get_markersize(),
        )
        for handle in shown.legend_handles:
            if handle is not None:
                handle.set_alpha(1.0)
    return figure


def _error(explained: Explained) -> str:
    """Call the error by its name: less a constant where the frames take that up at a place."""
    return "error less its mean" if any(place.centred for place in explained.places) else "error"


def _si(place: Place) -> str:
    return place.unit.split(" ")[0]


def _heading(place: Place) -> str:
    return plain(f"{place.words}: {units.percent(place.share, 0)}")


def _seen(place: Place) -> Array:
    """(n,) True for rows whose noise does not hide the error."""
    return np.asarray(place.spread <= _UNSEEN * np.median(place.spread))


def _limits(explained: Explained) -> dict[str, tuple[float, float]]:
    """By unit, where the error's axis ends in all panels: a few noisy rows must not decide it."""
    reached: dict[str, list[Array]] = {}
    for place in explained.places:
        points = np.concatenate([place.before, place.after])[np.tile(_seen(place), 2)]
        ends = np.quantile(points, [1.0 - _HIGH, _HIGH]) if points.size else np.zeros(2)
        reached.setdefault(place.unit, []).extend([ends, place.line[1], np.zeros(1)])
    limits = {}
    for unit, parts in reached.items():
        low, high = float(np.concatenate(parts).min()), float(np.concatenate(parts).max())
        room = max(0.08 * (high - low), 1e-12)
        limits[unit] = low - room, high + room
    return limits


def _spacing(place: Place) -> float:
    """Return how far the few values of a quantity lie apart; 0 where it has many."""
    if not place.levels:
        return 0.0
    step = float(np.diff(np.unique(place.values)).min(initial=np.inf))
    return step if np.isfinite(step) else 1.0


def _law(place: Place, step: float) -> tuple[Array, Array]:
    """Return the fitted law as a line, in pieces of its own at each of few values."""
    along, law = place.line
    if not place.levels:
        return along, law
    half = 0.34 * step
    pieces = np.column_stack([along - half, along + half, np.full(len(along), np.nan)])
    return pieces.ravel(), np.repeat(law, 3)


def _draw_place(axes: Axes, place: Place, factor: float) -> None:
    rows = np.flatnonzero(_seen(place))
    rows = rows[thinned(len(rows), _POINTS)]
    many = len(rows) > _MANY
    step = _spacing(place)
    beside = np.random.default_rng(0).uniform(-0.5, 0.5, len(rows)) * 0.7 * _APART * step
    for error, colour, label, side in (
        (place.before, MUTED, "as measured", -1.0),
        (place.after, AFTER, "with this effect taken off", 1.0),
    ):
        axes.plot(
            place.values[rows] + beside + side * 0.6 * _APART * step,
            error[rows] * factor,
            linestyle="none",
            marker="o",
            markersize=1.8 if many else 3.2,
            markeredgewidth=0,
            color=colour,
            alpha=0.35 if many else 0.6,
            rasterized=many,
            label=label,
        )
    axes.axhline(0.0, color=MUTED, linewidth=0.7)
    along, law = _law(place, step)
    axes.plot(along, law * factor, color=BEFORE, linewidth=2.0, label="fitted law")
    levels = FixedLocator(np.unique(place.values).tolist())
    axes.xaxis.set_major_locator(levels if place.levels else MaxNLocator(5, steps=_STEPS))
    axes.yaxis.set_major_locator(MaxNLocator(5, steps=_STEPS))
    axes.margins(x=0.04)
    unit = f" ({place.quantity_unit})" if place.quantity_unit else ""
    axes.set_xlabel(plain(f"{place.quantity}{unit}"))
    tidy(axes, grid="both")
    axes.set_facecolor(PAPER)


def overview(diagnosis: Diagnosis, *, headline: bool = True) -> Figure:
    """Draw how far, which, where, and the map of the gap, under the sentence of the verdict if ``headline``."""
    lines = max(
        len(diagnosis.effects),
        len(diagnosis.joint_names) + len(diagnosis.where.links) + len(diagnosis.where.beyond),
        12,
    )
    figure = Drawing(12.5, 5.4 + 0.2 * lines)
    (how_far, which), (where, map_) = figure.subplots(2, 2)
    draw_how_far(how_far, diagnosis)
    title(how_far, "How far")
    draw_which(which, diagnosis, brief=True)
    title(which, "Which")
    draw_where(where, diagnosis)
    title(where, "Where")
    heading, plane = broader_view(diagnosis)
    draw_map(map_, diagnosis, *plane)
    title(map_, f"The gap, {heading[0].lower()}{heading[1:]}")
    if headline:
        said = plain(fill(bound(diagnosis.summary), 115))
        figure.suptitle(said, x=0.01, ha="left", fontsize=LARGE + 1, color=INK, fontweight="bold")
    return figure
