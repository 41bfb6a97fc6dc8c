"""The whole answer in one figure."""

from __future__ import annotations

from textwrap import fill
from typing import TYPE_CHECKING

from thermal_robot.report.drawing import INK, LARGE, Drawing, plain, title
from thermal_robot.report.plots_how_far import draw_how_far
from thermal_robot.report.plots_map import broader_view, draw_map
from thermal_robot.report.plots_where import draw_where
from thermal_robot.report.plots_which import draw_which
from thermal_robot.report.words import bound

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from thermal_robot.diagnosis.result import Diagnosis


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
