"""Common style of the figures: colours, axes, thinning of points."""

from __future__ import annotations

import os
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter
from numpy.typing import NDArray

from thermal_robot.files import whole

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.legend import Legend


# Okabe and Ito's colours where they differ in brightness, too: orange is light and blue dark on a grey print.
INK, MUTED, FAINT, PAPER = "#22282e", "#6b7681", "#dde2e7", "#fffffe"
BEFORE, AFTER, THIRD = "#e69f00", "#1f6fb5", "#00916a"
SMALL, NORMAL, LARGE = 8.0, 9.0, 11.0
RASTER_ABOVE = 2000
NARROW, BROAD = 4.9, 9.2
"""Widths of a figure, inches: of one panel, whose small letters are 8 pixels high where it fills a telephone; and of
columns beside each other, which a telephone shows below each other."""
_DRAWN = 6000
KEY: dict[str, Any] = {"fontsize": SMALL, "labelcolor": INK, "frameon": False}
"""Look of a legend."""


class Drawing(Figure):
    """Matplotlib figure without display or pyplot, with a notebook representation."""

    def __init__(self, width: float, height: float) -> None:
        super().__init__(figsize=(width, height), layout="constrained", facecolor=PAPER)

    def savefig(self, fname: Any, **options: Any) -> None:
        """Draw into a file by an atomic replace, or into a stream; options are Matplotlib's."""
        if not isinstance(fname, (str, os.PathLike)):
            super().savefig(fname, **options)
            return
        file = Path(fname)
        named = file if file.suffix or "format" in options else file.with_suffix(".png")  # as Matplotlib does
        with whole(named) as place:
            super().savefig(place, **options)

    def _repr_png_(self) -> bytes:
        stream = BytesIO()
        self.savefig(stream, format="png", dpi=110)
        return stream.getvalue()


def plain(text: str) -> str:
    """Escape dollar signs, so that a name is not rendered as a formula."""
    return text.replace("$", r"\$")


def tidy(axes: Axes, grid: Literal["x", "y", "both", ""] = "y") -> None:
    """Apply the common style to axes; ``grid`` is ``x``, ``y``, ``both`` or empty."""
    axes.set_facecolor("none")
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set(color=MUTED, linewidth=0.8)
    axes.tick_params(axis="both", which="both", color=MUTED, labelcolor=INK, labelsize=SMALL, width=0.8)
    axes.set_axisbelow(True)
    if grid:
        axes.grid(visible=True, axis=grid, color=FAINT, linewidth=0.7)
    for label in (axes.xaxis.label, axes.yaxis.label):
        label.set(size=NORMAL, color=INK)


def panels(count: int, across: int, width: float, above: float, each: float, **shared: Any) -> tuple[Drawing, Any]:
    """Return a figure with ``count`` panels, ``across`` of them beside each other; places left over stay empty.

    ``width``, the height ``above`` the panels and that of ``each`` line of them are in inches.
    """
    down = max(-(-count // across), 1)
    figure = Drawing(width, above + each * down)
    drawn = figure.subplots(down, across, squeeze=False, **shared).ravel()
    for empty in drawn[count:]:
        empty.axis("off")
    return figure, drawn


def key_below(figure: Figure, axes: Axes, columns: int = 2, **look: Any) -> Legend:
    """Write the legend of a panel below all panels of a figure."""
    handles, labels = axes.get_legend_handles_labels()
    return figure.legend(handles, labels, loc="outside lower center", ncols=columns, **KEY, **look)


def title(axes: Axes, text: str, size: float = LARGE, pad: float = 10.0) -> None:
    """Write the heading of a panel, with letters of ``size`` points, ``pad`` points above it."""
    axes.set_title(plain(text), loc="left", fontsize=size, color=INK, fontweight="bold", pad=pad)


def note(axes: Axes, text: str) -> None:
    """Say in an empty panel why it is empty."""
    axes.axis("off")
    middle: dict[str, Any] = {"ha": "center", "va": "center", "transform": axes.transAxes}
    axes.text(0.5, 0.5, plain(text), color=MUTED, fontsize=NORMAL, **middle)


def log_axis(axes: Axes, low: float, high: float) -> None:
    """Make the x axis logarithmic, with plain tick labels: 1, 2, 5, 10."""
    axes.set_xscale("log")
    axes.set_xlim(low, high)
    subs = (1.0, 2.0, 5.0) if high / low < 2000.0 else (1.0,)
    axes.xaxis.set_major_locator(LogLocator(base=10.0, subs=subs))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())


def thinned(count: int, most: int = _DRAWN) -> NDArray[np.int64]:
    """Return the indices of the points to draw, in order: all of few, a fixed random sample of many."""
    if count <= most:
        return np.arange(count)
    return np.sort(np.random.default_rng(0).permutation(count)[:most])
