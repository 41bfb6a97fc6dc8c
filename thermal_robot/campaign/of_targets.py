"""Rows with several targets of one pose: which of them tell a pose, what is refused, what is doubtful."""

from __future__ import annotations

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.campaign import names
from thermal_robot.campaign.recognise import Columns
from thermal_robot.campaign.settings import Settings
from thermal_robot.campaign.table import Table
from thermal_robot.campaign.targets import FEWEST, Posed, posed, telling
from thermal_robot.errors import CampaignError

ASTRAY = 10.0
"""Times the usual deviation from which on targets of a row are said not to keep their places: noise comes to five."""
LOOSE = 2.0
"""Times the stated noise from which on targets are said to move against each other."""


def of_targets(table: Table, columns: Columns, settings: Settings) -> tuple[Table, Posed, list[str]]:
    """Return the rows that tell a pose, what they tell, and what is left out or doubtful, in sentences.

    Raises
    ------
    CampaignError
        Targets beside a simulator's; a place of which one or two figures lack; targets on
        a line in all rows, or one that is never seen beside the others.
    """
    _refuse_simulated(table, columns)
    points = np.stack([_points(table, number) for number in columns.targets], axis=1) * settings.units.length_scale
    kept = telling(points)
    if not kept.any():
        raise CampaignError(
            table.file,
            "no row tells a pose",
            column="x." + str(columns.targets[0]),
            found="fewer targets in each, or targets on a line",
            expected=f"{FEWEST} targets or more that are not on a line; or one target, as x y z",
        )
    told = posed(columns.targets, points[kept])
    if told is None:
        raise CampaignError(
            table.file,
            "a target is never seen together with three others: its place cannot be found",
            column=names.axes_of(_unlinked(points[kept], columns.targets))[0],
            expected="rows that show it beside them",
        )
    warnings = []
    if settings.tool_known:
        warnings.append('where several targets sit on the tool is fitted: tool = "known" counts as "unknown"')
    if not kept.all():
        several = f"fewer than {FEWEST} targets, or targets on a line"
        warnings.append(f"{table.told(~kept)} left out: {several} tell no pose")
    taken = table.take(kept)
    return taken, told, [*warnings, *_doubts(taken, told, settings)]


def _refuse_simulated(table: Table, columns: Columns) -> None:
    if columns.has_simulated_position:
        raise CampaignError(
            table.file,
            "sim.x, sim.y, sim.z predict one target",
            column=names.axes_of(columns.targets[0])[0],
            found=f"{len(columns.targets)} targets",
            expected="one target, as x y z; or no columns sim.*",
        )


def _points(table: Table, number: int) -> Array:
    """(N, 3) of one target, in the file's unit; NaN where it was not seen."""
    axes = names.axes_of(number)
    found = np.column_stack([table.numbers(column, gaps=True) for column in axes])
    gaps = np.isnan(found)
    half = gaps.any(axis=1) & ~gaps.all(axis=1)
    if half.any():
        row = int(np.argmax(half))
        raise CampaignError(
            table.file,
            "a value is missing",
            row=int(table.rows[row]),
            column=axes[int(np.argmax(gaps[row]))],
            found="an empty cell",
            expected=f"a number, or {axes[0]}, {axes[1]} and {axes[2]} empty where the target was not seen",
        )
    return found


def _unlinked(points: Array, numbers: tuple[int, ...]) -> int:
    """Return the target that is seen in the fewest of the rows."""
    return numbers[int(np.argmin(np.isfinite(points[:, :, 0]).sum(axis=0)))]


def _doubts(table: Table, told: Posed, settings: Settings) -> list[str]:
    sigma, unit, scale = told.targets.sigma, settings.units.length, settings.units.length_scale
    found = []
    astray = told.deviation > ASTRAY * max(sigma, settings.noise_position or 0.0)
    if astray.any():
        most = float(told.deviation.max()) / scale
        found.append(
            f"the targets do not keep their places on the tool in {table.told(astray)}, by up to {most:.3g} "
            f"{unit}: is one of them exchanged for another, or has one moved?"
        )
    if settings.noise_position and sigma > LOOSE * settings.noise_position:
        found.append(
            f"the targets move against each other by {sigma / scale:.3g} {unit} per axis, which is more than the "
            f"stated noise of {settings.noise_position / scale:.3g} {unit}"
        )
    return found
