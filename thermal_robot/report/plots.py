"""Figures of results: histogram of the gap, effects, places, map, residual, comparisons, motion.

Colours, axes and the Matplotlib figure behind them stand in :mod:`thermal_robot.report.drawing`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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
    BROAD,
    FAINT,
    INK,
    KEY,
    LARGE,
    MUTED,
    NARROW,
    NORMAL,
    PAPER,
    RASTER_ABOVE,
    SMALL,
    THIRD,
    Drawing,
    key_below,
    log_axis,
    note,
    panels,
    plain,
    thinned,
    tidy,
    title,
)
from thermal_robot.report.words import bound, by_status

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from thermal_robot.diagnosis.result import Diagnosis
    from thermal_robot.diagnosis.values import Explained, Finding, Place
    from thermal_robot.fleet.wear_result import Wear, Worn
    from thermal_robot.motion.result import MotionDiagnosis

Look = dict[str, Any]
"""Options of Matplotlib."""
_SAID: Look = {"fontsize": SMALL, "color": INK, "va": "center"}
_BELOW_KEY = 0.68  # of a panel's height for the bars; the key stands above
_ROOM = 1.08  # beside the outermost bins, as a factor


def plot_how_far(diagnosis: Diagnosis) -> Figure:
    """Draw histograms of the distance measured to predicted: before and after correction, and after on held-out rows.

    Returns
    -------
    Figure
        One panel for the position; a second one for the orientation where it was measured. Rows that were set
        aside are not counted.
    """
    pose = diagnosis.gap.orientation_before is not None and diagnosis.rows.gap.shape[1] >= 6
    figure = Drawing(NARROW, 6.6 if pose else 3.6)
    drawn = figure.subplots(2 if pose else 1, 1, squeeze=False)[:, 0]
    for axes, turned, what in zip(drawn, (False, True), ("Position", "Orientation"), strict=False):
        _draw_how_far(axes, diagnosis, turned)
        title(axes, f"{what}: measured against predicted")
    return figure


def _draw_how_far(axes: Axes, diagnosis: Diagnosis, turned: bool = False) -> None:
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
    # a few rows that happen to fit perfectly must not stretch the axis over decades
    low, high = float(np.quantile(everything, 0.01)) / 1.6, float(everything.max()) * 1.25
    if floor > 0.0:
        low, high = min(low, floor / 1.3), max(high, floor * 1.3)
    bins = np.geomspace(low, high, int(np.clip(2.2 * np.sqrt(len(before)), 14, 60)))
    # the outline before is the broader one, so that it is seen where the one after covers it
    _draw_shape(axes, before, bins, 0.5, f"before: rms {said[0]}", color=BEFORE, linewidth=3.0)
    _draw_shape(axes, after, bins, 0.6, f"after: rms {said[1]}", color=AFTER, linewidth=1.5)
    if held_out.size:
        label = f"after, on rows held out: rms {said[2]}"
        _draw_shape(axes, held_out, bins, 0.0, label, color=THIRD, linewidth=1.5, linestyle=(0, (4, 2)))
    if floor > 0.0:
        look: Look = {"color": INK, "linewidth": 1.2, "linestyle": ":", "label": f"noise floor: rms {said[3]}"}
        axes.plot([floor] * 2, [0.0, _BELOW_KEY], transform=axes.get_xaxis_transform(), **look)
    # room beside the outermost bins, so that none looks cut off
    log_axis(axes, low / _ROOM, high * _ROOM)
    axes.set_ylabel("rows")
    axes.set_ylim(0.0, axes.get_ylim()[1] / _BELOW_KEY)
    axes.locator_params(axis="y", integer=True, nbins=5)
    box: Look = {"frameon": True, "facecolor": PAPER, "edgecolor": "none", "framealpha": 0.9}
    axes.legend(loc="upper left", handlelength=1.6, labelspacing=0.25, **KEY | box)
    tidy(axes)


def _draw_shape(axes: Axes, values: Array, bins: Array, opacity: float, label: str, **line: Any) -> None:
    """Draw a histogram from its first filled bin to its last: the outline, and the area with an opacity above 0."""
    counts, _ = np.histogram(np.clip(values, bins[0], bins[-1]), bins)
    filled = np.flatnonzero(counts)
    counts, edges = counts[filled[0] : filled[-1] + 1], bins[filled[0] : filled[-1] + 2]
    if opacity > 0.0:
        axes.stairs(counts, edges, color=line["color"], alpha=opacity, fill=True, linewidth=0, label=label)
    axes.stairs(counts, edges, label=None if opacity > 0.0 else label, **line)


_LOOK: dict[str, Look] = {
    "found": {"color": AFTER, "edgecolor": AFTER},
    "confounded": {"color": "none", "edgecolor": AFTER, "hatch": "////"},
    "contained": {"color": FAINT, "edgecolor": AFTER},
    "not_found": {"color": FAINT, "edgecolor": MUTED},
}
_FURTHEST_BELOW_ZERO, _FURTHEST = -0.25, 1.5


def plot_which(diagnosis: Diagnosis) -> Figure:
    """Draw the share of the gap's mean square that each effect explains on held-out rows (95 %), and its probability.

    Returns
    -------
    Figure
        Filled: found; hatched: cannot be told apart from another; pale: in question, then not found.
    """
    figure = Drawing(NARROW, 1.5 + 0.27 * max(len(diagnosis.effects), 3))
    axes = figure.subplots()
    _draw_which(axes, diagnosis)
    title(axes, "Share and probability of each effect")
    return figure


def _draw_which(axes: Axes, diagnosis: Diagnosis) -> None:
    """Draw the shares with 95 % intervals, and the probabilities, of all candidate effects into a panel."""
    ordered = by_status(diagnosis)
    if not ordered:
        note(axes, "No effect was tried.")
        return
    inks = [INK if f.status in ("found", "confounded") else MUTED for f in ordered]
    beside: Look = {**_SAID, "transform": axes.get_yaxis_transform()}
    for line, (finding, ink) in enumerate(zip(ordered, inks, strict=True)):
        if finding.status == "not_testable":
            axes.text(1.0, line, "not testable", **_SAID | {"color": MUTED}, style="italic")
        else:
            _draw_share(axes, line, finding)
            axes.text(1.02, line, units.probability(finding.probability), **beside | {"color": ink})
    axes.text(1.02, -0.95, "probability", **beside | {"color": MUTED})
    bounds = [bound for f in ordered if f.status != "not_testable" for bound in f.shrinkage_ci95 or ()]
    low, high = min([-0.02, *bounds]), max([1.0, *bounds])
    axes.set_yticks(range(len(ordered)), [plain(f.name) for f in ordered])
    axes.set_ylim(len(ordered) - 0.4, -1.3)
    axes.set_xlim(100.0 * max(low, _FURTHEST_BELOW_ZERO) - 1.0, 100.0 * min(high, _FURTHEST) + 2.0)
    axes.axvline(0.0, color=MUTED, linewidth=0.8)
    axes.set_xlabel("share of the gap's mean square\non rows held out, 95 % interval (%)")
    tidy(axes, grid="x")
    axes.tick_params(axis="y", length=0)
    for label, ink in zip(axes.get_yticklabels(), inks, strict=True):
        label.set_color(ink)


def _draw_share(axes: Axes, line: int, finding: Finding) -> None:
    share = 100.0 * (finding.shrinkage or 0.0)
    axes.barh(line, share, height=0.62, linewidth=0.9, **_LOOK[finding.status])
    if finding.shrinkage_ci95 is not None:
        bounds = [100.0 * b for b in finding.shrinkage_ci95]
        axes.plot(bounds, [line, line], color=INK, linewidth=1.1)
        axes.plot(bounds, [line, line], linestyle="none", marker="|", markersize=6, color=INK)


_Group = tuple[str, Mapping[str, float], str]
_MOST_QUANTITIES = 8
_LONG_NAME = 26
_BETWEEN = 0.6  # lines


def plot_where(diagnosis: Diagnosis) -> Figure:
    """Draw the shares of the gap's mean square by joint, link and place beyond, by axis, and by recorded quantity."""
    chain, other = _chain(diagnosis), _other(diagnosis)
    right = _lines(other)
    left = _lines(chain) if _placed(chain) else min(right, 4.0)
    names = [len(name) for _, shares, _ in (*chain, *other) for name in shares]
    # panels as high as their bars, so that a bar is equally thick everywhere; below each other where names are long
    if max(names, default=0) > _LONG_NAME:
        figure = Drawing(NARROW, 1.9 + 0.24 * (left + right))
        drawn = figure.subplots(2, 1, height_ratios=(left, right))
    else:
        lines, rest = max(left, right), max(abs(left - right), 0.01)
        figure = Drawing(BROAD, 1.2 + 0.24 * lines)
        grid = figure.add_gridspec(2, 2, height_ratios=(lines - rest, rest))
        places = [grid[:, k] if n == lines else grid[0, k] for k, n in enumerate((left, right))]
        drawn = np.array([figure.add_subplot(place) for place in places])
    _draw_where(drawn[0], diagnosis)
    title(drawn[0], "Where along the chain")
    _draw_groups(drawn[1], other)
    title(drawn[1], "By axis and by quantity")
    return figure


def _draw_where(axes: Axes, diagnosis: Diagnosis) -> None:
    """Draw joints and links into a panel, the root above, the tool below, then what lies beyond them."""
    if _placed(_chain(diagnosis)):
        _draw_groups(axes, _chain(diagnosis))
    else:
        note(axes, "No effect was found,\nso none is placed along the chain.")


def _placed(chain: Sequence[_Group]) -> bool:
    return any(share > 0.0 for _, shares, _ in chain for share in shares.values())


def _chain(diagnosis: Diagnosis) -> list[_Group]:
    where = diagnosis.where
    names = dict.fromkeys((*diagnosis.joint_names, *where.joints)) if where.joints else {}
    groups = (
        ("joints, from root to tool", {name: where.joints.get(name, 0.0) for name in names}, AFTER),
        ("links, from root to tool", where.links, THIRD),
        ("beyond joints and links", where.beyond, BEFORE),
    )
    return [group for group in groups if group[1]]


def _other(diagnosis: Diagnosis) -> list[_Group]:
    quantities = sorted(diagnosis.where.covariates.items(), key=lambda item: -item[1])[:_MOST_QUANTITIES]
    groups = [
        ("axes of the root frame", diagnosis.where.axes, MUTED),
        ("quantities, each alone", dict(quantities), AFTER),
    ]
    return groups if quantities else groups[:1]


def _lines(groups: Sequence[_Group]) -> float:
    return sum(len(shares) + 1.0 + _BETWEEN for _, shares, _ in groups)


def _draw_groups(axes: Axes, groups: Sequence[_Group]) -> None:
    """Draw groups of bars below each other; the axis ends a little beyond the longest."""
    ticks: dict[float, str] = {}
    line = 0.0
    largest = max((100.0 * s for _, shares, _ in groups for s in shares.values()), default=0.0)
    end = min(max(1.18 * largest, 10.0), 118.0)
    for heading, shares, colour in groups:
        axes.text(0.01 * end, line, heading, **_SAID | {"color": MUTED}, style="italic")
        for name, share in shares.items():
            line += 1.0
            axes.barh(line, end, height=0.66, color=FAINT, alpha=0.35, linewidth=0)
            axes.barh(line, 100.0 * max(share, 0.0), height=0.66, color=colour, linewidth=0)
            if share >= 5e-4:
                axes.text(100.0 * share + 0.01 * end, line, units.percent(share), **_SAID)
            ticks[line] = plain(name)
        line += 1.0 + _BETWEEN
    axes.set_yticks(list(ticks), list(ticks.values()))
    axes.set_ylim(line - _BETWEEN - 0.4, -0.8)
    axes.set_xlim(0.0, end)
    axes.set_xlabel("share of the gap's mean square (%)")
    tidy(axes, grid="")
    axes.tick_params(axis="y", length=0)


_ARROWS = 250
_LONGEST = 0.18  # of the workspace's extent, for an arrow of the gap's 95th percentile
_FILLED = 0.84  # of a panel's height; the key stands above
_SHAPES = (0.85, 1.35)  # width to height of a panel


def plot_map(diagnosis: Diagnosis) -> Figure:
    """Draw the gap before and after at the positions of the tool, from above and from the side.

    Returns
    -------
    Figure
        Arrows are exaggerated; the labels say by how much. Rows that were set aside are left out.
    """
    planes = _planes(diagnosis)
    shapes = [_shape(diagnosis, plane) for plane in planes.values()]
    figure = Drawing(BROAD, min(0.9 + 8.0 / sum(shapes), 5.2))
    for axes, (heading, plane) in zip(figure.subplots(1, 2, width_ratios=shapes), planes.items(), strict=True):
        _draw_map(axes, diagnosis, plane)
        title(axes, heading)
    return figure


def _planes(diagnosis: Diagnosis) -> dict[str, tuple[int, int]]:
    """Axes of the root frame across and up in each view."""
    position = diagnosis.rows.position
    broad = int(np.argmax(np.ptp(position[:, :2], axis=0))) if len(position) else 0
    return {"Seen from above": (0, 1), "Seen from the side": (broad, 2)}


def _arrows(diagnosis: Diagnosis, plane: tuple[int, int]) -> tuple[Array, Array, Array, float]:
    """Start points and exaggerated gaps (N, 2), before and after, in a plane, m, and the magnification.

    There are none where all rows were set aside or are at one place, or no gap is left.
    """
    rows, used = diagnosis.rows, mapped(diagnosis)
    factor = exaggeration(diagnosis, used, _LONGEST)
    chosen = np.ix_(used[thinned(len(used), _ARROWS)] if factor else used[:0], np.array(plane))
    times = factor or 1.0
    return rows.position[chosen], rows.gap[chosen] * times, rows.remainder[chosen] * times, times


def _extent(start: Array, before: Array, after: Array) -> tuple[Array, Array, float]:
    """Centre (2,) and size (2,) of the box about all arrows, m, with a margin, and the panel's width to height."""
    ends = np.vstack([start, start + before, start + after])
    low, high = ends.min(axis=0), ends.max(axis=0)
    size = 1.06 * np.maximum(high - low, 1e-6)
    return (low + high) / 2.0, size, float(np.clip(_FILLED * size[0] / size[1], *_SHAPES))


def _shape(diagnosis: Diagnosis, plane: tuple[int, int]) -> float:
    *arrows, _ = _arrows(diagnosis, plane)
    return _extent(*arrows)[2] if len(arrows[0]) else 1.0


def _draw_map(axes: Axes, diagnosis: Diagnosis, plane: tuple[int, int]) -> None:
    start, before, after, factor = _arrows(diagnosis, plane)
    if not len(start):
        note(axes, "No two places with a gap are left to be mapped.")
        return
    # all arrows undistorted, with room above them for the key
    middle, size, shape = _extent(start, before, after)
    width = max(size[0], shape * size[1] / _FILLED)
    height = width / shape
    axes.set_xlim(middle[0] - width / 2.0, middle[0] + width / 2.0)
    axes.set_ylim(middle[1] - _FILLED * height / 2.0, middle[1] + (1.0 - _FILLED / 2.0) * height)
    axes.set_aspect("equal", adjustable="box")
    axes.locator_params(axis="both", nbins=6)
    true: Look = {"units": "inches", "angles": "xy", "scale_units": "xy", "scale": 1.0, "width": 0.018}
    for arrows, colour, label in ((before, BEFORE, "before"), (after, AFTER, "after")):
        axes.quiver(*start.T, *arrows.T, color=colour, label=label, minlength=1.5, **true)
    axes.legend(loc="upper left", ncols=2, borderaxespad=0.2, **KEY)
    _draw_scale(axes, units.round_down(_typical(diagnosis, mapped(diagnosis))), factor)
    axes.set_xlabel(f"{'xyz'[plane[0]]} of the root frame (m)")
    axes.set_ylabel(f"{'xyz'[plane[1]]} of the root frame (m)")
    tidy(axes, grid="both")


def _draw_scale(axes: Axes, sample: float, factor: float) -> None:
    """Draw below the legend an arrow that says how long a gap of ``sample``, m, is drawn: ``factor`` times larger."""
    below = ScaledTranslation(0.09, -0.35, axes.figure.dpi_scale_trans)
    along = blended_transform_factory(axes.transData, axes.transAxes) + below
    start = axes.get_xlim()[0]
    tip = (start + sample * factor, 1.0)
    arrow: Look = {"arrowstyle": "-|>", "color": INK, "linewidth": 1.3, "shrinkA": 0.0, "shrinkB": 0.0}
    axes.annotate("", tip, (start, 1.0), xycoords=along, textcoords=along, arrowprops=arrow)
    times = f"{factor:,.0f}".replace(",", "\u2009")
    said = f"gap of {units.quantity(sample, 'm')}, drawn {times} times larger"
    axes.annotate(said, tip, (6.0, 0.0), xycoords=along, textcoords="offset points", **_SAID)


def mapped(diagnosis: Diagnosis) -> NDArray[np.int64]:
    """Return the indices of the diagnosis' rows that can be mapped: not set aside, with a finite position."""
    rows = diagnosis.rows
    return np.flatnonzero(~rows.outliers & np.isfinite(rows.position).all(axis=1))


def exaggeration(diagnosis: Diagnosis, used: NDArray[np.int64], longest: float) -> float | None:
    """Round magnification of the arrows; ``None`` without positions or a gap.

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


_MIDDLES = 60
_LEVELS = 12
_FEW_CROSSES = 25
_EDGE = 0.88  # of a panel's height: a cross that is held there stays whole
_WITHOUT_UNIT = {"speed": "share of the maximum", "approach": "−1, 0, 1", "order": "number"}
"""What stands in a unit's place on the axis of a quantity that has none."""


def plot_remainder(diagnosis: Diagnosis) -> Figure:
    """Draw the x, y and z of the residual after correction, in the root frame.

    Returns
    -------
    Figure
        Left against the row in the file, right against the quantity that the remainder follows most, if any. The
        line is the running median, the band two sigma of the noise; crosses are rows that were set aside, at the
        edge where they lie beyond it.
    """
    rows, noise = diagnosis.rows, diagnosis.gap.noise_floor / np.sqrt(3.0)
    columns = [("row in the file", rows.rows.astype(float)), *_followed(diagnosis)]
    figure = Drawing(NARROW if len(columns) == 1 else BROAD, 4.6)
    grid = figure.subplots(3, len(columns), squeeze=False, sharey=True, sharex="col")
    # rows that were set aside do not decide how far the axes go
    largest = max(np.abs(rows.remainder[~rows.outliers, :3]).max(initial=0.0), 2.4 * noise, 1e-12)
    best = units.scale("m", largest)
    for k, axis in enumerate("xyz"):
        for (_, along), axes in zip(columns, grid[k], strict=True):
            values = rows.remainder[:, k] * best.factor
            _draw_remainder(axes, along, values, rows.outliers, 1.15 * largest * best.factor)
            band = 2.0 * noise * best.factor
            axes.axhspan(-band, band, color=FAINT, linewidth=0, zorder=0, label="±2 σ of the noise")
            tidy(axes, grid="")
            axes.set_ylabel(f"{axis} ({best.unit})")
            axes.tick_params(labelleft=True)
    for (name, _), axes in zip(columns, grid[2], strict=True):
        axes.set_xlabel(plain(name))
    title(grid[0][0], "Remainder, row by row")
    for axes in grid[0][1:]:
        title(axes, f"Against {diagnosis.unexplained.depends_on[0].covariate}")
    key_below(figure, grid[0][0])
    return figure


def _followed(diagnosis: Diagnosis) -> list[tuple[str, Array]]:
    """Label and values of the quantity that the residual follows most; empty if not recorded."""
    if not diagnosis.unexplained.depends_on:
        return []
    name, rows = diagnosis.unexplained.depends_on[0].covariate, diagnosis.rows
    unit = rows.units.get(name) or _WITHOUT_UNIT.get(name.partition(".")[0], "")
    label = f"{name} ({unit})" if unit else name
    if name in rows.covariates:
        return [(label, np.asarray(rows.covariates[name], dtype=float))]
    if name == "order":  # not recorded: the rows as they stand in the file
        return [("order of the rows", np.arange(len(rows.rows), dtype=float))]
    if name in diagnosis.joint_names:
        return [(label, rows.q[:, diagnosis.joint_names.index(name)])]
    return []


def _draw_remainder(axes: Axes, along: Array, values: Array, aside: NDArray[np.bool_], limit: float) -> None:
    known = np.isfinite(along) & np.isfinite(values)
    used, marked = np.flatnonzero(known & ~aside), np.flatnonzero(known & aside)
    drawn = used[thinned(len(used))]
    many, few = len(used) > RASTER_ABOVE, len(marked) <= _FEW_CROSSES
    dots: Look = {"marker": "o", "markersize": 1.6 if many else 3.0, "markeredgewidth": 0, "color": MUTED}
    shown: Look = {"alpha": 0.35 if many else 0.7, "rasterized": many, "label": "remainder"}
    axes.plot(along[drawn], values[drawn], linestyle="none", **dots, **shown)
    _draw_middles(axes, along[used], values[used])
    held = np.clip(values[marked], -_EDGE * limit, _EDGE * limit)
    crosses: Look = {"marker": "x", "markersize": 6.0 if few else 3.0, "markeredgewidth": 1.8 if few else 0.9}
    axes.plot(along[marked], held, linestyle="none", **crosses, color=BEFORE, label="set aside")
    axes.set_ylim(-limit, limit)
    axes.axhline(0.0, color=MUTED, linewidth=0.7)


def _draw_middles(axes: Axes, along: Array, values: Array) -> None:
    """Draw running medians: a line over equal numbers of rows, or a dash at each value of a discrete quantity."""
    levels = np.unique(along)
    if len(levels) <= _LEVELS:  # between two directions of approach there is nothing that a line could tell
        middle = [np.median(values[along == level]) for level in levels]
        dash: Look = {"linestyle": "none", "marker": "_", "markersize": 22.0, "markeredgewidth": 2.2}
        axes.plot(levels, middle, color=AFTER, label="median at each value", **dash)
        return
    order = np.argsort(along, kind="stable")
    parts = np.array_split(order, int(np.clip(1.4 * np.sqrt(len(order)), 1, _MIDDLES)))
    where, middle = ([np.median(of[part]) for part in parts] for of in (along, values))
    axes.plot(where, middle, color=AFTER, linewidth=1.8, label="running median")


_ACROSS = 3
_HIGH = 0.99
_UNSEEN = 5.0
_APART = 0.16
_MANY = 400
_POINTS = 1500
_STEPS = [1, 2, 5, 10]


def explain_figure(explained: Explained) -> Figure:
    """Draw partial residuals of one effect, one panel a place, the largest share first.

    Returns
    -------
    Figure
        Grey: the error at the place as measured, with everything else that was found taken off. Blue: with this effect
        taken off, too. The line is the fitted law. Rows in which the place hardly moves the target are left out,
        and the axes end where a hundredth of the points lies beyond. "Less its mean": a constant that the unknown
        frames take up as well says nothing.
    """
    places = explained.places
    across = 2 if len(places) == 4 else min(max(len(places), 1), _ACROSS)
    figure, drawn = panels(len(places), across, (NARROW, 7.6, 9.6)[across - 1], 0.95, 2.55)
    error = "error less its mean" if any(place.centred for place in places) else "error"
    for place, axes in zip(places, drawn, strict=False):
        low, high = _limits(places, place.unit)
        unit = place.unit.split(" ")[0]
        scale = units.scale(unit, max(abs(low), abs(high)))
        _draw_place(axes, place, scale.factor)
        axes.set_ylim(low * scale.factor, high * scale.factor)
        title(axes, f"{place.words}: {units.percent(place.share, 0)}", NORMAL, pad=6.0)
        axes.set_ylabel(f"{error} ({scale.unit}{place.unit.removeprefix(unit)})")
    more = f"; {explained.left_out} smaller places are not shown" if explained.left_out else ""
    figure.suptitle(plain(f"What {explained.effect} explains{more}"), x=0.01, ha="left", fontsize=11.0, color=INK)
    if places:
        points = drawn[0].get_lines()[0].get_markersize()
        shown = key_below(figure, drawn[0], 3, markerscale=5.0 / points)
        for handle in filter(None, shown.legend_handles):
            handle.set_alpha(1.0)
    return figure


def _seen(place: Place) -> NDArray[np.bool_]:
    """Mask (n,) of rows whose noise at the place (one sigma) is at most five times the median."""
    return np.asarray(place.spread <= _UNSEEN * np.median(place.spread))


def _limits(places: Sequence[Place], unit: str) -> tuple[float, float]:
    """Return the common axis limits of the error in all panels of a unit, robust to a few noisy rows."""
    reached = [np.zeros(1)]
    for place in (place for place in places if place.unit == unit):
        points = np.concatenate([place.before[_seen(place)], place.after[_seen(place)]])
        reached += [np.quantile(points, [1.0 - _HIGH, _HIGH]) if points.size else np.zeros(0), place.line[1]]
    low, high = float(np.concatenate(reached).min()), float(np.concatenate(reached).max())
    room = max(0.08 * (high - low), 1e-12)
    return low - room, high + room


def _draw_place(axes: Axes, place: Place, factor: float) -> None:
    rows = np.flatnonzero(_seen(place))
    rows = rows[thinned(len(rows), _POINTS)]
    many, levels = len(rows) > _MANY, np.unique(place.values)
    step = 0.0  # how far the few values of a quantity lie apart; 0 where it has many
    if place.levels:
        step = float(np.diff(levels).min()) if len(levels) > 1 else 1.0
    beside = np.random.default_rng(0).uniform(-0.5, 0.5, len(rows)) * 0.7 * _APART * step
    dots: Look = {"linestyle": "none", "marker": "o", "markersize": 1.8 if many else 3.2, "markeredgewidth": 0}
    shown: Look = {"alpha": 0.35 if many else 0.6, "rasterized": many}
    for error, side, colour, label in (
        (place.before, -1.0, MUTED, "as measured"),
        (place.after, 1.0, AFTER, "with this effect taken off"),
    ):
        along = place.values[rows] + beside + side * 0.6 * _APART * step
        axes.plot(along, error[rows] * factor, color=colour, label=label, **dots, **shown)
    axes.axhline(0.0, color=MUTED, linewidth=0.7)
    along, law = place.line
    if place.levels:  # a piece of its own at each value
        along = (along[:, None] + 0.34 * step * np.array([-1.0, 1.0, np.nan])).ravel()
        law = np.repeat(law, 3)
    axes.plot(along, law * factor, color=BEFORE, linewidth=2.0, label="fitted law")
    axes.xaxis.set_major_locator(FixedLocator(levels.tolist()) if place.levels else MaxNLocator(5, steps=_STEPS))
    axes.yaxis.set_major_locator(MaxNLocator(5, steps=_STEPS))
    axes.margins(x=0.04)
    unit = f" ({place.quantity_unit})" if place.quantity_unit else ""
    axes.set_xlabel(plain(f"{place.quantity}{unit}"))
    tidy(axes, grid="both")
    axes.set_facecolor(PAPER)


def overview(diagnosis: Diagnosis, *, headline: bool = True) -> Figure:
    """Draw gap, effects, places and map, under the sentence of the verdict if ``headline``."""
    places = len(diagnosis.joint_names) + len(diagnosis.where.links) + len(diagnosis.where.beyond)
    figure = Drawing(12.5, 5.4 + 0.2 * max(len(diagnosis.effects), places, 12))
    (how_far, which), (where, map_) = figure.subplots(2, 2)
    _draw_how_far(how_far, diagnosis)
    title(how_far, "How far")
    _draw_which(which, diagnosis)
    title(which, "Which")
    _draw_where(where, diagnosis)
    title(where, "Where")
    # the view that fills a panel that is broader than high better
    heading, plane = max(_planes(diagnosis).items(), key=lambda view: _shape(diagnosis, view[1]))
    _draw_map(map_, diagnosis, plane)
    title(map_, f"The gap, {heading[0].lower()}{heading[1:]}")
    if headline:
        said = plain(fill(bound(diagnosis.summary), 115))
        figure.suptitle(said, x=0.01, ha="left", fontsize=LARGE + 1, color=INK, fontweight="bold")
    return figure


_MOST_DIFFERENCES = 24
_LEADING = 12


def plot_differences(comparison: Mapping[str, Any]) -> Figure:
    """Draw the 24 largest differences of parameters between campaigns, in standard deviations, as bars."""
    known = [p for effect in comparison["effects"] for p in effect["parameters"] if p["std"]]
    told = sorted(((p["name"], p["difference"] / p["std"]) for p in known), key=lambda one: -abs(one[1]))
    told = told[:_MOST_DIFFERENCES]
    figure = Drawing(NARROW, 1.2 + 0.26 * max(len(told), 1))
    axes = figure.subplots()
    colours = [AFTER if abs(size) > 3.0 else BEFORE for _, size in told]
    axes.barh(range(len(told)), [size for _, size in told], color=colours, height=0.62)
    axes.axvline(0.0, color=INK, linewidth=0.8)
    axes.set_xlabel("difference in standard deviations\n(dark beyond three)")
    _name_bars(axes, [name for name, _ in told], "Parameters that differ most")
    return figure


def plot_fleet(summary: Mapping[str, Any]) -> Figure:
    """Draw the number of robots in which each effect was found, of those in which it is testable."""
    counts = [effect for effect in summary["effects"] if effect["found"]][:_LEADING]
    figure = Drawing(NARROW, 1.2 + 0.3 * len(counts))
    axes = figure.subplots()
    places = range(len(counts))
    axes.barh(places, [c["testable"] for c in counts], color="none", edgecolor=BEFORE, height=0.62)
    axes.barh(places, [c["found"] for c in counts], color=AFTER, height=0.62)
    axes.set_xlabel("robots: found (filled), could be tested (frame)")
    for place, c in enumerate(counts):
        axes.annotate(f"{c['found']}", (c["found"], place), (4, 0), textcoords="offset points", **_SAID)
    _name_bars(axes, [c["effect"].replace("_", " ") for c in counts], "Effects by how often they were found")
    return figure


def _name_bars(axes: Axes, names: Sequence[str], heading: str) -> None:
    """Label horizontal bars, the first above."""
    axes.set_yticks(range(len(names)), [plain(name) for name in names])
    axes.invert_yaxis()
    tidy(axes, grid="x")
    title(axes, heading)


_COLUMNS, _MOST = 2, 12
CONTROL = 3.0
"""Standard deviations between the centre of a control chart and its limits, as Shewhart has them."""
_FARTHEST = 4.0  # times what is drawn: of a given limit farther away it is said where it lies


def plot_wear(wear: Wear) -> Figure:
    """Draw a Shewhart control chart of up to twelve parameters over time: values, deviations, limits, fitted line.

    Returns
    -------
    Figure
        Grey: where campaigns of a parameter that stays where it began lie; values beyond are orange. A line as its
        kind has it, orange where it rings; an upright band where a jump lies with 95 %; given limits dashed.
    """
    shown = [worn for worn in wear.parameters if worn.comparable][:_MOST]
    figure, drawn = panels(len(shown), _COLUMNS, BROAD, 0.6, 2.2, sharex=True)
    for axes, worn in zip(drawn, shown, strict=False):
        _draw_worn(axes, wear, worn)
    for axes in drawn[max(len(shown) - _COLUMNS, 0) : len(shown)]:
        axes.set_xlabel(f"days since {wear.campaigns[0].date}" if wear.dated else "campaign")
        axes.tick_params(labelbottom=True)
        axes.xaxis.set_major_locator(MaxNLocator(6, steps=_STEPS, integer=True))
    if not shown:
        note(drawn[0], "No parameter can be compared.")
    return figure


def _draw_worn(axes: Axes, wear: Wear, worn: Worn) -> None:
    """Draw the control chart of one parameter."""
    seen = [k for k, value in enumerate(worn.values) if value is not None]
    times = np.array([visit.time for visit in wear.campaigns]) + (0.0 if wear.dated else 1.0)
    values, stds = (np.array([each[k] for k in seen], dtype=float) for each in (worn.values, worn.stds))
    scale = units.scale(worn.unit, float(np.max(np.abs(values) + stds)))
    jump = worn.jump
    if jump is not None and worn.alarm:
        axes.axvspan(times[jump.earliest], times[jump.latest], color=BEFORE, alpha=0.15, linewidth=0)
    centre, half = scale.factor * worn.fitted[0], scale.factor * CONTROL * wear.scatter * stds
    axes.fill_between(times[seen], centre - half, centre + half, color=FAINT, linewidth=0)
    axes.axhline(centre, color=MUTED, linewidth=0.8)
    along, fitted = _as_told(times, worn)
    look: Look = {"color": BEFORE, "linewidth": 2.0} if worn.alarm else {"color": MUTED, "linewidth": 1.2}
    axes.plot(along, scale.factor * fitted, **look)
    beyond = np.abs(scale.factor * values - centre) > half
    for which, colour in ((~beyond, AFTER), (beyond, BEFORE)):
        dots: Look = {"fmt": "o", "markersize": 4.0, "color": colour, "ecolor": colour, "elinewidth": 1.0}
        dots |= {"markeredgecolor": INK, "markeredgewidth": 0.5, "zorder": 3.0}
        at = np.array(seen)[which]
        axes.errorbar(times[at], scale.factor * values[which], scale.factor * stds[which], **dots)
    far = _draw_limits(axes, worn, scale)
    tidy(axes)
    axes.set_ylabel(scale.unit or "1", fontsize=SMALL)
    said = f"ALARM: {worn.kind}" if worn.alarm else f"moved: {units.probability(worn.moved)}"
    weight: Look = {"color": INK, "fontweight": "bold"} if worn.alarm else {"color": MUTED, "fontweight": "normal"}
    axes.set_title(plain(f"{worn.parameter}\n{said}{far}"), loc="left", fontsize=SMALL, **weight)


def _as_told(times: Array, worn: Worn) -> tuple[Array, Array]:
    """Return times and fitted values of a parameter's line; a jump stands upright midway between two campaigns."""
    fitted, jump = np.array(worn.fitted), worn.jump
    if jump is None:
        return times, fitted
    beside = slice(jump.after, jump.after + 2)
    upright = np.insert(times, jump.after + 1, [times[beside].mean()] * 2)
    return upright, np.insert(fitted, jump.after + 1, fitted[beside])


def _draw_limits(axes: Axes, worn: Worn, scale: units.Scale) -> str:
    """Draw the limit of the absolute value on the side of the values; say where it is if it lies far away."""
    if worn.crossing is None:
        return ""
    low, high = axes.get_ylim()
    side = 1.0 if worn.fitted[-1] >= 0.0 else -1.0
    place = side * scale.factor * worn.crossing.limit
    if min(abs(place - low), abs(place - high)) > _FARTHEST * (high - low):
        return f"; limit {units.quantity(side * worn.crossing.limit, worn.unit)}, far away"
    axes.axhline(place, color=INK, linestyle="--", linewidth=1.0)
    room = 0.06 * (max(high, place) - min(low, place))
    axes.set_ylim(min(low, place - room), max(high, place + room))
    over, across = (4, "bottom") if side < 0.0 else (-3, "top")
    axes.annotate("limit", (1.0, place), (-2, over), xycoords=axes.get_yaxis_transform(), textcoords="offset points",
                  ha="right", **_SAID | {"va": across})  # fmt: skip
    return ""


_CLASSES = 16  # of the curve through the middle of what is drawn against a quantity
_WINDOW = 12.0  # s of a motion that are drawn: swings of half a second can still be told apart
_FEWEST = 5  # readings in a level, for its middle to be drawn
_WAY = 0.2  # of the longest way of a joint in any motion: a motion in which it moves less has no loop to be seen
_RANGE = (0.005, 0.995)  # quantiles of what is drawn against a quantity: a few far readings do not stretch the axis


def plot_motions(diagnosis: MotionDiagnosis) -> Figure:
    """Draw the motion with the largest gap of each joint: command, measured, simulated before and after, and the gaps.

    Returns
    -------
    Figure
        Two panels a joint, position above gap; two joints beside each other.
    """
    joints = list(diagnosis.joints)
    columns = 2 if len(joints) > 1 else 1
    lines = max(-(-len(joints) // columns), 1)
    figure = Drawing(BROAD if columns > 1 else NARROW, 3.9 * lines)
    grid = figure.subplots(2 * lines, columns, squeeze=False, height_ratios=(1.7, 1.0) * lines)
    pairs = grid.reshape(lines, 2, columns).swapaxes(1, 2).reshape(-1, 2)
    for (above, below), joint in zip(pairs, joints, strict=False):
        _draw_motion(above, below, diagnosis, joint)
    for empty in pairs[len(joints) :].ravel():
        empty.axis("off")
    if not joints:
        note(grid[0, 0], "No joint was usable.")
    return figure


def _draw_motion(above: Axes, below: Axes, d: MotionDiagnosis, joint: str) -> None:
    curves = d.curves[joint]
    square = (curves["measured"] - curves["nominal"]).pow(2).groupby(curves["motion"]).mean()
    motion = int(square.index[int(square.argmax())])
    one = _window(curves[curves["motion"] == motion])
    unit, torque = d.unit_of(joint), d.unit == "N·m"
    best = units.scale(unit, float(np.abs(one["measured"] - one["nominal"]).max()))
    wide = unit if unit in ("m", "rad") else best.unit
    if not torque:
        above.plot(one["time"], one["command"], color=MUTED, linewidth=1.0, label="command")
    same = not torque and np.allclose(one["command"], one["nominal"])
    if not same:
        above.plot(one["time"], one["nominal"], color=BEFORE, linewidth=1.4, label="simulated before")
    above.plot(one["time"], one["simulated"], color=AFTER, linewidth=2.2, alpha=0.75, label="simulated after")
    above.plot(one["time"], one["measured"], color=INK, linewidth=0.9, label="measured")
    for name, colour, said in (("nominal", BEFORE, "gap before"), ("simulated", AFTER, "gap after")):
        below.plot(one["time"], best.factor * (one["measured"] - one[name]), color=colour, linewidth=1.1, label=said)
    for line in (*above.lines, *below.lines):
        line.set_rasterized(len(one) > RASTER_ABOVE)
    title(above, f"{joint}, motion {_label(d, motion)}", NORMAL, pad=30.0)
    above.set_ylabel(f"{'torque' if torque else 'position'} ({wide})")
    below.set_ylabel(f"gap ({best.unit})")
    below.set_xlabel("time (s)")
    for axes in (above, below):
        tidy(axes)
        axes.margins(x=0.01)
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 0.98), ncols=2, handlelength=1.4, labelspacing=0.2, **KEY)


def _window(one: pd.DataFrame) -> pd.DataFrame:
    """Return the twelve seconds of a longer motion in which the sum of the squared gap is largest."""
    time, square = np.asarray(one["time"]), np.asarray(one["measured"] - one["nominal"]) ** 2
    if time[-1] - time[0] <= _WINDOW:
        return one
    sums = np.concatenate([[0.0], np.cumsum(square)])
    ends = np.searchsorted(time, time + _WINDOW)
    starts = np.flatnonzero(time + _WINDOW <= time[-1])
    begin = starts[int(np.argmax(sums[ends[starts]] - sums[starts]))]
    return one.iloc[begin : ends[begin]]


def _label(d: MotionDiagnosis, motion: int) -> str:
    name = d.log.motions[motion].name if motion < len(d.log.motions) else ""
    return name or str(motion + 1)


def plot_gap_against(diagnosis: MotionDiagnosis) -> Figure:
    """Draw each joint's gap before and after against velocity, load and position, with medians in bins."""
    figure, drawn = panels(3 * len(diagnosis.joints), 3, BROAD, 0.8, 2.35, sharey="row")
    for line, joint in zip(drawn.reshape(-1, 3), diagnosis.joints, strict=True):
        curves = diagnosis.curves[joint]
        unit = diagnosis.unit_of(joint)
        position, turn = ("m", "m/s") if unit in ("m", "N") else ("rad", "rad/s")
        gaps = [np.asarray(curves["measured"] - curves[name]) for name in ("nominal", "simulated")]
        best = units.scale(unit, float(np.quantile(np.abs(gaps[0]), 0.95)))
        of = velocity(curves, "command" if diagnosis.unit == "N·m" else "simulated")
        follows = (
            (of, f"velocity ({turn})"),
            (np.asarray(curves["load"]), f"load ({'N' if position == 'm' else 'N·m'})"),
            (np.asarray(curves["command"]), f"position ({position})"),
        )
        for axes, (along, what) in zip(line, follows, strict=True):
            _draw_against(axes, along, [best.factor * gap for gap in gaps])
            axes.set_xlabel(what)
            axes.set_ylabel(f"gap ({best.unit})")
            axes.tick_params(labelleft=True)
            title(axes, joint)
    key_below(figure, drawn[0])
    return figure


def velocity(curves: pd.DataFrame, of: str = "command") -> Array:
    """Differentiate one of the curves by time, motion by motion, by finite differences: velocity (N,), SI."""
    found = np.zeros(len(curves))
    number, time, values = (np.asarray(curves[name]) for name in ("motion", "time", of))
    for motion in np.unique(number):
        own = np.flatnonzero(number == motion)
        if len(own) > 1:
            found[own] = np.gradient(values[own], np.maximum.accumulate(time[own]) + 1e-9 * np.arange(len(own)))
    return found


def _draw_against(axes: Axes, along: Array, gaps: list[Array]) -> None:
    chosen = thinned(len(along))
    fine = np.isfinite(along).all() and float(np.ptp(along)) > 0.0
    for gap, colour, said in zip(gaps, (BEFORE, AFTER), ("before", "after"), strict=True):
        look: Look = {"color": colour, "markersize": 1.5, "alpha": 0.25, "rasterized": True}
        axes.plot(along[chosen], gap[chosen], linestyle="none", marker=".", **look)
        middles = _middles(along, gap) if fine else [np.zeros(0)] * 2
        axes.plot(*middles, color=colour, linewidth=1.8, marker="o", markersize=2.5, label=said)
    low, high = np.quantile(np.concatenate(gaps), _RANGE)
    room = 0.15 * max(high - low, 1e-12)
    axes.set_ylim(low - room, high + room)
    if fine:
        left, right = np.quantile(along, _RANGE)
        axes.set_xlim(left - 0.05 * (right - left), right + 0.05 * (right - left))
    axes.axhline(0.0, color=MUTED, linewidth=0.7)
    tidy(axes)
    axes.locator_params(axis="x", nbins=5)


def _middles(along: Array, gap: Array) -> list[Array]:
    """Medians of a quantity and of a gap in sixteen equally wide bins of the quantity that hold five readings."""
    low, high = np.quantile(along, _RANGE)
    edges = np.linspace(low, high, _CLASSES + 1)
    level = np.digitize(along, edges)
    full = [k for k in range(1, _CLASSES + 1) if np.sum(level == k) >= _FEWEST]
    return [np.array([np.median(of[level == k]) for k in full]) for of in (along, gap)]


def plot_hysteresis(diagnosis: MotionDiagnosis) -> Figure:
    """Draw command minus position against the command in each joint's slowest motion: friction and play open a loop."""
    count = len(diagnosis.joints)
    figure, drawn = panels(count, min(3, count), BROAD if count > 1 else NARROW, 0.8, 2.9)
    for axes, joint in zip(drawn, diagnosis.joints, strict=False):
        _draw_loop(axes, diagnosis, joint)
    key_below(figure, drawn[0])
    return figure


def slowest(curves: pd.DataFrame) -> int:
    """Return which motion commands the least rms velocity, of those that move the joint through its range."""
    way = curves.groupby("motion")["command"].agg(np.ptp)
    speed = curves.assign(square=velocity(curves) ** 2).groupby("motion")["square"].mean()
    return int(speed[way >= _WAY * way.max()].idxmin())


def _draw_loop(axes: Axes, d: MotionDiagnosis, joint: str) -> None:
    curves = d.curves[joint]
    motion = slowest(curves)
    one = curves[curves["motion"] == motion]
    unit = d.unit_of(joint)
    position = "m" if unit in ("m", "N") else "rad"
    torque = d.unit == "N·m"
    pair = [one["nominal" if torque else "command"] - one[name] for name in ("measured", "simulated")]
    best = units.scale(unit, float(np.abs(pair[0]).max()))
    for part, colour, width, said in zip(pair, (INK, AFTER), (0.9, 1.6), ("measured", "simulated after"), strict=True):
        look: Look = {"color": colour, "linewidth": width, "alpha": 0.8, "label": said}
        axes.plot(one["command"], best.factor * part, rasterized=len(one) > RASTER_ABOVE, **look)
    axes.set_xlabel(f"{'position' if torque else 'command'} ({position})")
    axes.set_ylabel(f"{'model' if torque else 'command'} less reading ({best.unit})")
    title(axes, f"{joint}, {_label(d, motion)}", SMALL + 1.0, pad=6.0)
    tidy(axes, grid="both")
    axes.locator_params(axis="x", nbins=5)


def plot_shares(diagnosis: MotionDiagnosis) -> Figure:
    """Draw the rms gap of each joint before, and after in held-out motions, as bars, with the noise of a reading."""
    joints = list(diagnosis.joints)
    figure = Drawing(NARROW, 1.4 + 0.62 * len(joints))
    axes = figure.subplots()
    scales = [units.scale(diagnosis.unit_of(j), max(one.before for one in diagnosis.joints.values())) for j in joints]
    look = (("before", BEFORE, "before"), ("held_out", AFTER, "after, motions held out"))
    for k, (joint, best) in enumerate(zip(joints, scales, strict=True)):
        one = diagnosis.joints[joint]
        for offset, (name, colour, said) in zip((-0.18, 0.18), look, strict=True):
            label = None if k else said
            axes.barh(k + offset, best.factor * getattr(one, name), height=0.32, color=colour, label=label)
        axes.plot([best.factor * one.noise] * 2, [k - 0.36, k + 0.36], color=INK, linewidth=1.2, linestyle=":",
                  label=None if k else "noise of the reading")  # fmt: skip
    axes.set_yticks(range(len(joints)), [plain(joint) for joint in joints])
    axes.set_ylim(len(joints) - 0.4, -0.6)
    axes.set_xlabel(f"rms gap ({', '.join(dict.fromkeys(best.unit for best in scales))})")
    figure.legend(loc="outside upper left", ncols=2, **KEY)
    tidy(axes, grid="x")
    return figure
