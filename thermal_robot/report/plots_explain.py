"""What one effect explains, place by place: the error against what drives it, before and after."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.ticker import FixedLocator, MaxNLocator

from thermal_robot.arrays import Array
from thermal_robot.report import units
from thermal_robot.report.drawing import AFTER, BEFORE, INK, MUTED, NORMAL, PAPER, SMALL, Drawing, plain, thinned, tidy

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from thermal_robot.diagnosis.explained import Explained, Place

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
        _draw(axes, place, scale.factor)
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


def _step(place: Place) -> float:
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


def _draw(axes: Axes, place: Place, factor: float) -> None:
    rows = np.flatnonzero(_seen(place))
    rows = rows[thinned(len(rows), _POINTS)]
    many = len(rows) > _MANY
    step = _step(place)
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
