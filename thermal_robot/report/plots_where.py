"""Where the gap comes from: along the chain, by axis, by recorded quantity."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from thermal_robot.report import units
from thermal_robot.report.drawing import (
    AFTER,
    BEFORE,
    FAINT,
    INK,
    MUTED,
    SMALL,
    THIRD,
    Drawing,
    note,
    plain,
    tidy,
    title,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from thermal_robot.diagnosis.result import Diagnosis

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
