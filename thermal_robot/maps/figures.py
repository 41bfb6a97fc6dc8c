"""Figures of a workspace map: filled contours over a plane, or a 3D scatter plot of places."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.errors import CampaignError
from thermal_robot.maps.quantities import UNITS
from thermal_robot.maps.stores import Map

if TYPE_CHECKING:
    from matplotlib.figure import Figure


TITLES = {
    **{f"std.{axis}": f"Scatter along {axis}, 1σ" for axis in "xyz"},
    **{f"shift.{axis}": f"Thermal displacement along {axis}" for axis in "xyz"},
    "polygon.area": "Area of the polygon of thermal displacements",
    "polygon.width": "Width of the polygon of thermal displacements",
    "probability": "Probability of joining",
    "probability_warm": "Probability of joining, warm",
    "capability": "Capability C_p",
    "capability_warm": "Capability C_p, warm",
    "required": "Required clearance",
    "required_warm": "Required clearance, warm",
    "margin": "Distance to the nearest joint limit, share of the range",
}
_SIZES = {"m": (1e6, "µm"), "m²": (1e12, "µm²"), "1": (1.0, ""), "": (1.0, "")}
_BETTER_LARGE = ("probability", "probability_warm", "capability", "capability_warm", "margin")
_LEVELS = 12


def larger_is_better(by: str) -> bool:
    """Whether the best value of a map column is its largest (probability, capability, margin), not its smallest."""
    return by in _BETTER_LARGE


def plot_map(found: Map, by: str = "required_warm") -> Figure:
    """Plot one column of a map over the workspace, at each place the value of the best posture.

    Filled contours with the best place marked, where the places are a grid in a plane parallel to two axes of the root
    frame; else a 3D scatter plot.

    Parameters
    ----------
    found
        The map.
    by
        Name of the column.

    Returns
    -------
    Figure
        Of matplotlib.

    Raises
    ------
    CampaignError
        A column that the map has not, or a map without any place that the robot reaches.
    """
    from matplotlib.figure import Figure

    places, values = found.values(by, largest=larger_is_better(by))
    if not len(places):
        raise CampaignError(
            "map", "nothing to draw: the robot reaches no place of it", expected="places within its reach"
        )
    factor, unit = _SIZES[UNITS.get(by, "")]
    values = factor * values
    label = TITLES.get(by, by) + (f" ({unit})" if unit else "")
    figure = Figure(figsize=(7.2, 5.6), layout="constrained")
    varies = [k for k in range(3) if np.ptp(places[:, k]) > 1e-6]
    figure.suptitle(f"{found.notes['robot']}: {label}", fontsize=12)
    if found.notes["over"] == "positions" and len(varies) == 2:
        _plane(figure, found, places, values, varies, label, largest=larger_is_better(by))
    else:
        _space(figure, places, values, label, largest=larger_is_better(by))
    return figure


def _colours(largest: bool) -> str:
    """Name of the matplotlib colour map whose yellow end means better: reversed where small values are better."""
    return "viridis" if largest else "viridis_r"


def _plane(
    figure: Figure, found: Map, places: Array, values: Array, axes: list[int], label: str, *, largest: bool
) -> None:
    """Draw filled contours of values over the grid of a plane and mark the best place; unreached places stay empty."""
    first, second = (np.linspace(*found.notes["xyz"[k]]) for k in axes)
    grid = np.full((len(second), len(first)), np.nan)
    column, row = (
        np.abs(along[:, None] - places[:, k]).argmin(axis=0) for along, k in zip((first, second), axes, strict=True)
    )
    grid[row, column] = values
    own = figure.add_subplot()
    drawn = own.contourf(first, second, grid, levels=_LEVELS, cmap=_colours(largest))
    own.contour(first, second, grid, levels=drawn.levels, colors="white", linewidths=0.4)
    best = values.argmax() if largest else values.argmin()
    own.plot(*places[best, axes], marker="*", markersize=13, color="#e69f00", markeredgecolor="black", linestyle="none")
    own.annotate(
        "best", (places[best, axes[0]], places[best, axes[1]]), xytext=(8, 6), textcoords="offset points", fontsize=10
    )
    own.set_aspect("equal")
    own.set_xlabel(f"{'xyz'[axes[0]]} (m)")
    own.set_ylabel(f"{'xyz'[axes[1]]} (m)")
    figure.colorbar(drawn, ax=own, label=label, shrink=0.9)


def _space(figure: Figure, places: Array, values: Array, label: str, *, largest: bool) -> None:
    """Draw a 3D scatter plot of the places, coloured by value; of 40 000 places and more, only every k-th."""
    step = max(len(places) // 20_000, 1)
    own = figure.add_subplot(projection="3d")
    drawn = own.scatter(*places[::step].T, c=values[::step], s=3.0, cmap=_colours(largest), depthshade=False)
    for name, axis in zip("xyz", (own.xaxis, own.yaxis, own.zaxis), strict=True):
        axis.set_label_text(f"{name} (m)")
    own.set_box_aspect(np.maximum(np.ptp(places, axis=0), 1e-3))
    figure.colorbar(drawn, ax=own, label=label, shrink=0.7, pad=0.12)
