"""The figures of a diagnosis of motion: the log simulated, what the gap follows, the hysteresis loop."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.report import units
from thermal_robot.report.drawing import (
    AFTER,
    BEFORE,
    BROAD,
    INK,
    KEY,
    MUTED,
    NARROW,
    NORMAL,
    RASTER_ABOVE,
    SMALL,
    Drawing,
    key_below,
    note,
    panels,
    plain,
    thinned,
    tidy,
    title,
)

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from thermal_robot.motion.result import MotionDiagnosis

_LEVELS = 16  # of the curve through the middle of what is drawn against a quantity
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
    """Return the stretch of a long motion in which the gap is largest, by its mean square."""
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
    """Draw the gap of each joint before and after against its velocity, its load and its position, with the middles."""
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
    """Return the velocity (N,) of one of the curves, motion by motion, SI."""
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
        look: dict[str, Any] = {"color": colour, "markersize": 1.5, "alpha": 0.25, "rasterized": True}
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
    """Medians of a quantity and of a gap in levels of the quantity that are equally wide."""
    low, high = np.quantile(along, _RANGE)
    edges = np.linspace(low, high, _LEVELS + 1)
    level = np.digitize(along, edges)
    full = [k for k in range(1, _LEVELS + 1) if np.sum(level == k) >= _FEWEST]
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
        look: dict[str, Any] = {"color": colour, "linewidth": width, "alpha": 0.8, "label": said}
        axes.plot(one["command"], best.factor * part, rasterized=len(one) > RASTER_ABOVE, **look)
    axes.set_xlabel(f"{'position' if torque else 'command'} ({position})")
    axes.set_ylabel(f"{'model' if torque else 'command'} less reading ({best.unit})")
    title(axes, f"{joint}, {_label(d, motion)}", SMALL + 1.0, pad=6.0)
    tidy(axes, grid="both")
    axes.locator_params(axis="x", nbins=5)


def plot_shares(diagnosis: MotionDiagnosis) -> Figure:
    """Draw the gap of each joint before, and in motions held out, as bars, with the noise of its reading."""
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
