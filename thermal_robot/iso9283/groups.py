"""Grouping of a campaign's rows for ISO 9283: repeats, paths, directions of approach, measuring times."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from thermal_robot.campaign import Campaign
from thermal_robot.campaign.names import split_name
from thermal_robot.campaign.plausible import SAME_COMMAND
from thermal_robot.campaign.turning import arrivals
from thermal_robot.inference.grouping import in_order, repeated_poses

Rows = NDArray[np.int64]

CYCLES = 30
"""Cycles that the standard asks for at each pose (ISO 9283:1998, table of 6.10)."""
PATH_CYCLES = 10
"""Cycles that it asks for along a path."""
FEWEST = 2
"""Rows that make repeats: of fewer there is no scatter."""
PER_TIME = 10
"""Cycles at each measuring time of a drift, as the standard has it; a pose with fewer than twice as many has no drift
by the clock."""
MOST_TIMES = 8
"""Measuring times at most: one an hour of the standard's eight."""


@dataclass(frozen=True, eq=False)
class Repeats:
    """Rows (n,), in the sequence of measurement, that repeat one commanded pose; its path, or none for a pose at rest.

    Without labels it is called as the row in the file that came first.
    """

    label: str
    path: str
    rows: Rows


def repeats(campaign: Campaign) -> tuple[list[Repeats], int]:
    """Poses that were measured repeatedly, in order of occurrence, and the number of single rows.

    Rows with the same ``pose`` label belong together; without that column, rows with the same commands. Points of
    different paths, and poses at rest, never do.
    """
    pose, paths = campaign.labels.get("pose"), campaign.labels.get("path")
    number = repeated_poses(campaign)
    if paths is not None:
        of_path = np.unique(paths, return_inverse=True)[1].ravel()
        number = np.unique(np.column_stack([number, of_path]), axis=0, return_inverse=True)[1].ravel()
    order = in_order(campaign)
    found: dict[int, list[int]] = {}
    for row in order:
        found.setdefault(int(number[row]), []).append(int(row))
    groups = [np.array(rows) for rows in found.values() if len(rows) >= FEWEST]
    labels = [f"row {campaign.rows[rows].min()}" if pose is None else str(pose[rows[0]]) for rows in groups]
    along = ["" if paths is None else str(paths[rows[0]]) for rows in groups]
    alone = campaign.samples - sum(len(rows) for rows in groups)
    return [Repeats(*each) for each in zip(labels, along, groups, strict=True)], alone


def directions(campaign: Campaign, rows: Rows) -> list[Rows] | None:
    """Repeats of one pose grouped by the direction of approach, the same sign in every joint.

    Rows in which a joint's direction is unknown belong to none. ``None`` where half of them do: nobody recorded
    it, and the pose was repeated in a row.
    """
    columns = [name for name in campaign.covariates if split_name(name)[0] == "approach"]
    signs = [campaign.covariates[name][rows] for name in columns]
    told = [sign for sign in signs if np.any(sign)]  # a joint that never moves has none, and tells nothing
    if not told:
        return None
    from_where = np.column_stack(told)
    known = (from_where != 0.0).all(axis=1)
    if _follow(campaign, columns):
        known &= _came(campaign)[rows]
    if 2 * known.sum() <= len(rows):
        return None
    number = np.unique(from_where[known], axis=0, return_inverse=True)[1].ravel()
    return [rows[known][number == k] for k in range(int(number.max()) + 1)]


def _follow(campaign: Campaign, columns: list[str]) -> bool:
    """Whether directions are derived from the order of the rows."""
    names, sessions = campaign.robot.joint_names, campaign.labels.get("session")
    ordered = arrivals(campaign.q, names, campaign.covariates, sessions)
    same = (name in ordered and np.array_equal(campaign.covariates[name], ordered[name]) for name in columns)
    return set(columns) <= set(campaign.derived) or all(same)


def _came(campaign: Campaign) -> NDArray[np.bool_]:
    """Mask (N,) of rows that follow another command, so that the order gives the direction."""
    order, came = in_order(campaign), np.ones(campaign.samples, dtype=bool)
    came[order[1:]] = np.abs(np.diff(campaign.q[order], axis=0)).max(axis=1) > SAME_COMMAND
    return came


def times(campaign: Campaign, rows: Rows) -> list[Rows]:
    """Repeats of one pose grouped by measuring time, first to last.

    The times are sessions, where the pose was repeated in several. Otherwise the span of ``time`` or ``order`` over
    these rows is divided into equal parts, of :data:`PER_TIME` cycles in the mean, :data:`MOST_TIMES` at most. Nothing
    where there are fewer than two times.
    """
    session = campaign.labels.get("session")
    if session is not None:
        met = dict.fromkeys(str(name) for name in session[rows] if name)
        if len(found := _enough([rows[session[rows] == name] for name in met])) > 1:
            return found
    clock, count = campaign.clock, min(len(rows) // PER_TIME, MOST_TIMES)
    if clock is None or count < 2 or not np.ptp(clock[rows]) > 0.0:
        return []
    edges = np.linspace(clock[rows].min(), clock[rows].max(), count + 1)[1:-1]
    part = np.searchsorted(edges, clock[rows], side="right")
    found = _enough([rows[part == k] for k in range(count)])
    return found if len(found) > 1 else []


def _enough(groups: list[Rows]) -> list[Rows]:
    return [rows for rows in groups if len(rows) >= FEWEST]
