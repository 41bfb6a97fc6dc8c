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
    """Rows (n,), in order of measurement, that repeat one commanded pose; ``path`` is empty for a pose at rest.

    ``label`` is the campaign's pose label, or "row k" with the lowest file row k where the campaign has no such labels.
    """

    label: str
    path: str
    rows: Rows


def repeats(campaign: Campaign) -> tuple[list[Repeats], int]:
    """Group rows into poses that were measured at least twice, in order of occurrence; also count the ungrouped rows.

    Rows with the same ``pose`` label form a group; without that column, rows with the same joint commands. Rows of
    different paths, or of a path and a pose at rest, are never grouped.
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
    """Group the repeats of one pose by direction of approach: rows of a group agree in the sign of each joint's motion.

    Rows in which a joint's direction is unknown are left out. ``None`` where these are half of the rows or more
    (directions were not recorded, and repeats of the pose followed each other), or no joint has a direction.
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
    """Whether the approach columns named are derived from the order of the rows, or equal to such derived ones."""
    names, sessions = campaign.robot.joint_names, campaign.labels.get("session")
    ordered = arrivals(campaign.q, names, campaign.covariates, sessions)
    same = (name in ordered and np.array_equal(campaign.covariates[name], ordered[name]) for name in columns)
    return set(columns) <= set(campaign.derived) or all(same)


def _came(campaign: Campaign) -> NDArray[np.bool_]:
    """Mask (N,) of rows whose joint command differs from that of the row measured before; true for the first row."""
    order, came = in_order(campaign), np.ones(campaign.samples, dtype=bool)
    came[order[1:]] = np.abs(np.diff(campaign.q[order], axis=0)).max(axis=1) > SAME_COMMAND
    return came


def times(campaign: Campaign, rows: Rows) -> list[Rows]:
    """Group the repeats of one pose by measuring time, first to last, for the drift criteria.

    The times are sessions, where two or more of them have repeats of the pose. Otherwise the span of ``time`` or
    ``order`` over these rows is divided into equal parts, of :data:`PER_TIME` cycles on average, :data:`MOST_TIMES` at
    most. Groups of one row are dropped; the list is empty where fewer than two groups are left.
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
