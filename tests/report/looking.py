"""What is seen in a figure: its lines, its labels, and where its texts stand."""

from itertools import combinations

import numpy as np
from matplotlib.colors import to_hex
from matplotlib.text import Text


def lines_of(axes):
    """Lines that hold something."""
    return [line for line in axes.get_lines() if len(line.get_xdata())]


def labels(axes):
    """Texts of a panel's legend."""
    return [t.get_text() for t in axes.get_legend().get_texts()]


def tick_labels(axes):
    """Names along the y axis, in the order in which they were given."""
    return [t.get_text() for t in axes.get_yticklabels()]


def written(axes):
    """Texts inside a panel."""
    return [t.get_text() for t in axes.texts]


def line(axes, label):
    """(2, n) points of the line with a label."""
    found = next(one for one in axes.get_lines() if one.get_label() == label)
    return np.array([found.get_xdata(), found.get_ydata()], dtype=float)


def bars(axes, colour):
    """Widths of the horizontal bars of a colour, from top to bottom."""
    return [p.get_width() for p in axes.patches if to_hex(p.get_facecolor()) == colour]


def texts(figure):
    """Every text that is drawn, with its box in pixels; the figure is laid out for it."""
    figure.draw_without_rendering()
    found = [figure._suptitle, *figure.texts, *(t for legend in figure.legends for t in legend.get_texts())]
    for axes in figure.axes:
        found += [axes._left_title, *axes.texts]
        if axes.get_legend() is not None:
            found += axes.get_legend().get_texts()
        if axes.axison:
            found += [axes.xaxis.label, axes.yaxis.label]
            found += [tick.label1 for axis in (axes.xaxis, axes.yaxis) for tick in axis._update_ticks()]
    renderer = figure._get_renderer()
    shown = [t for t in dict.fromkeys(found) if isinstance(t, Text) and t.get_visible() and t.get_text().strip()]
    return [(t.get_text(), t.get_window_extent(renderer)) for t in shown]


def outside(figure, said):
    """Those of the texts that leave the figure."""
    edge = figure.bbox
    return [
        text for text, box in said if box.x0 < -1.0 or box.y0 < -1.0 or box.x1 > edge.x1 + 1.0 or box.y1 > edge.y1 + 1.0
    ]


def overlapping(said, allowed=0.5):
    """Pairs of the texts that cover each other by more than so many pixels in both directions."""
    return [
        (one, other)
        for (one, a), (other, b) in combinations(said, 2)
        if min(a.x1, b.x1) - max(a.x0, b.x0) > allowed and min(a.y1, b.y1) - max(a.y0, b.y0) > allowed
    ]
