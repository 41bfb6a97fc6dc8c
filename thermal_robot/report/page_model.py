"""The page's section on the model: fitted frames, and parameters that are known together only."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape
from typing import TYPE_CHECKING

import numpy as np

from thermal_robot.report.html_parts import paragraph, row, table, wide

if TYPE_CHECKING:
    from thermal_robot.diagnosis.result import Diagnosis

_STRONG = 0.5  # of a correlation: below it a third parameter changes little by what is known of another
_MOST = 10
_FRAMES = {"base": "root frame of the robot, as the instrument sees it", "tool": "target, in the tool frame"}


def model_section(diagnosis: Diagnosis) -> Iterator[str]:
    """Yield fitted frames and strongest correlations; nothing without a fit."""
    if not diagnosis.usable or diagnosis.fit is None:
        return
    yield f"<section><h2>The model</h2>{frames_table(diagnosis)}"
    yield (correlations_table(diagnosis) if diagnosis.model.spread is not None else "") + "</section>"


def frames_table(diagnosis: Diagnosis) -> str:
    """Show where the robot stands and where the target sits: mm, and roll, pitch and yaw in degrees."""
    heads = "frame", "x (mm)", "y (mm)", "z (mm)", "roll (°)", "pitch (°)", "yaw (°)"
    rows = []
    for name, pose in diagnosis.frames.iterrows():
        told = [_fixed(1e3 * v, 3) for v in pose[["x", "y", "z"]]]
        told += [_fixed(np.degrees(v), 4) if np.isfinite(v) else "" for v in pose[["roll", "pitch", "yaw"]]]
        rows.append(row((_FRAMES[str(name)], *told)))
    return wide(table(heads, rows), "Fitted frames")


def _fixed(value: float, digits: int) -> str:
    """Write a figure with so many decimals; what rounds to zero has no sign."""
    return f"{round(value, digits) + 0.0:.{digits}f}".replace("-", "−")


def correlations_table(diagnosis: Diagnosis) -> str:
    """Show the strongest correlations between the parameters, at most ten; in words how many are not shown."""
    covariance = diagnosis.covariance
    if len(covariance) < 2:
        return ""
    std = np.sqrt(covariance.to_numpy().diagonal())
    correlation = covariance.to_numpy() / np.outer(std, std)
    first, second = np.triu_indices(len(std), 1)
    size = np.abs(correlation[first, second])
    order = np.argsort(-size, kind="stable")
    strong = [k for k in order if size[k] > _STRONG]
    if not strong:
        return paragraph(f"No two parameters have a correlation beyond ±{_STRONG}.")
    rows = []
    for k in strong[:_MOST]:
        pair = (escape(_called(covariance.index[i])) for i in (first[k], second[k]))
        rows.append(row((*pair, _fixed(correlation[first[k], second[k]], 2)), words=2))
    heads = "parameter", "known only together with", "correlation"
    hidden = len(strong) - min(len(strong), _MOST)
    more = f" and {hidden} beyond ±{_STRONG}" if hidden else ""
    rest = paragraph(f"Not shown: {len(size) - len(strong)} correlations within ±{_STRONG}{more}.")
    return wide(table(heads, rows, words=2), "Strongest correlations of the parameters") + rest


def _called(name: tuple[str, str]) -> str:
    return f"{name[1]} ({name[0]})"
