"""Rows that measured nothing of their own: marks of a lost beam, old readings, and copies of other rows.

Instruments write −9999, 999, 0 0 0 or their last reading where they see no target. Such a figure stands in several rows
to the last digit, and it does not follow the robot: under any rigid base and tool a measured coordinate is linear in
the nominal position and rotation of the tool frame (13 figures), whatever the unit and the axes of the instrument.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from thermal_robot.campaign.campaign import Campaign, FloatArray
from thermal_robot.campaign.names import CLOCK, axes_of
from thermal_robot.campaign.names import POSITION as XYZ
from thermal_robot.campaign.table import told_rows
from thermal_robot.kinematics import tool_poses

Mask = NDArray[np.bool_]

FEWEST_ROWS = 10
"""Rows from which figures that all end alike were rounded, and are no accident."""
ASTRAY_PLACE, ASTRAY_FIGURE = 3.0, 10.0
"""Times the others' median distance from the regression beyond which rows with one place, or one figure of a place,
hold a mark: three figures that are equal by chance are rare, one of a rounded table is not."""
SAME_COMMAND = 1e-3
"""rad or m within which commands of one pose count as the same: a controller that reports where it stopped repeats a
pose to better than that, and a pose of its own is farther away."""
ROUNDING = 1e-6
"""Share of a coordinate's spread that counts as no distance: the last digits of exact figures."""
ROUNDS = 30
"""Of reweighted least squares, after which the least absolute deviations have settled to a per cent."""
STEADIEST = 1e-6
"""m per axis: no arm repeats to better, so that equal figures that are finer were copied and not measured."""
RARE = 0.05
"""Expected number of repeats that agree by chance above which equal rows are repeats that the figures cannot tell."""


def marks(campaign: Campaign) -> tuple[Mask, list[str]]:
    """Find the figures that stand for a place that was not seen.

    Returns
    -------
    rows
        (N,) those that hold one.
    sentences
        One for each figure, with its rows.
    """
    rows, sentences = np.zeros(campaign.samples, dtype=bool), []
    for names, points in _places(campaign):
        for found, sentence in _of_points(campaign, names, points):
            rows |= found
            sentences.append(sentence)
    return rows, sentences


def _places(campaign: Campaign) -> Iterator[tuple[tuple[str, ...], FloatArray]]:
    """Yield the columns of each target, and its places (N, 3), m; NaN where it was not seen."""
    if campaign.samples < FEWEST_ROWS or campaign.position is None:
        return
    if campaign.targets is None:
        yield XYZ, campaign.position
    else:
        for k, number in enumerate(campaign.targets.numbers):
            yield axes_of(number), campaign.targets.points[:, k]


def _of_points(campaign: Campaign, names: tuple[str, ...], points: FloatArray) -> Iterator[tuple[Mask, str]]:
    q, scale = campaign.q, campaign.units.length_scale
    seen = np.asarray(np.isfinite(points).all(axis=1))
    places, figures = _equal(q, points, seen), [_equal(q, points[:, k], seen) for k in range(3)]
    # places that most rows share were meant: a ball in its socket
    if not any((places, *figures)) or 2 * sum(int(rows.sum()) for rows in places) > seen.sum():
        return
    away = _away(campaign, points, seen)
    for rows in places:
        if _astray(np.linalg.norm(away, axis=1), rows, seen, ASTRAY_PLACE):
            seen = seen & ~rows
            told = [_figure(value / scale) for value in points[rows][0]]
            one = len(set(told)) == 1
            same = f"{' = '.join(names)} = {told[0]}" if one else f"({', '.join(names)}) = ({', '.join(told)})"
            yield rows, f"{same} in {told_rows(campaign.rows[rows])}: was the beam lost?"
    for k, name in enumerate(names):
        for rows in (group & seen for group in figures[k]):
            if _moved(q, rows) and _astray(away[:, k], rows, seen, ASTRAY_FIGURE):
                told_by = f"{_figure(points[rows, k][0] / scale)} in {told_rows(campaign.rows[rows])}"
                yield rows, f"{name} is {told_by}: a mark of a missing value?"


def _equal(q: FloatArray, values: FloatArray, seen: Mask) -> list[Mask]:
    """Return the rows of each value that stands with several commands, the most frequent first."""
    _, group, counts = np.unique(values[seen], axis=0, return_inverse=True, return_counts=True)
    groups = np.full(len(seen), -1)
    groups[seen] = group.reshape(-1)
    several = [groups == g for g in np.argsort(-counts, kind="stable") if counts[g] > 1]
    return [rows for rows in several if _moved(q, rows)]


def _moved(q: FloatArray, rows: Mask) -> bool:
    """Tell whether rows have different commands."""
    return bool(rows.sum() > 1 and np.ptp(q[rows], axis=0).max() > SAME_COMMAND)


def _astray(away: FloatArray, rows: Mask, seen: Mask, times: float) -> bool:
    """Tell whether rows are farther from the regression than the others, and a minority."""
    others = seen & ~rows
    return bool(rows.sum() < others.sum() and np.median(away[rows]) > times * np.median(away[others]))


def _away(campaign: Campaign, points: FloatArray, seen: Mask) -> FloatArray:
    """(N, 3) distance of each coordinate from its regression on the nominal poses (least absolute deviations)."""
    poses = tool_poses(campaign.robot, campaign.q)
    known = [np.ones((len(poses), 1)), poses[:, :3, 3], poses[:, :3, :3].reshape(-1, 9)]
    different = len(np.unique(np.round(campaign.q[seen] / SAME_COMMAND), axis=0))
    # with fewer poses so many unknowns would follow the marks themselves
    design = np.hstack(known if different >= 3 * 13 else known[:2])
    away = np.full(points.shape, np.nan)
    for k in range(3):
        values, given = points[seen, k], design[seen]
        distance = np.abs(values - np.median(values))  # so that a mark far away does not bend the first fit
        least = max(ROUNDING * float(np.median(distance)), 1e-12)
        distance = np.maximum(distance, np.median(distance))
        for _ in range(ROUNDS):
            weight = 1.0 / np.sqrt(np.maximum(distance, least))
            fitted = given @ np.linalg.lstsq(given * weight[:, None], values * weight, rcond=None)[0]
            distance = np.abs(values - fitted)
        away[seen, k] = np.maximum(distance, least)
    return away


def copies(campaign: Campaign) -> Mask:
    """(N,) the rows that say what an earlier one says in every column, and are no repeats.

    A repeat may well measure the same digits, but not at the same time. Where none is recorded, equal rows are repeats
    if the figures are so coarse that some would agree by chance.
    """
    return np.asarray(_originals(campaign) != np.arange(campaign.samples))


def doubled(campaign: Campaign) -> Iterator[str]:
    """Yield a sentence that names the rows that are copies of another."""
    if campaign.position is None:
        return
    original = _originals(campaign)
    again = original != np.arange(campaign.samples)
    rows = campaign.rows[again]
    if len(rows) == 1:
        yield f"rows {campaign.rows[original[again][0]]} and {rows[0]} are the same in every column: a copy, no repeat"
    elif len(rows):
        first = campaign.rows[np.unique(original[again])]
        yield f"{told_rows(rows)} are the same in every column as {told_rows(first)}: copies, no repeats"


def _originals(campaign: Campaign) -> NDArray[np.int64]:
    """(N,) the first row that says the same as each; the row itself where none does before."""
    recorded = [values[:, None] for name, values in campaign.covariates.items() if name not in campaign.derived]
    labels = [np.unique(label, return_inverse=True)[1][:, None] for label in campaign.labels.values()]
    measured = [part for part in (campaign.position, campaign.orientation) if part is not None]
    table = np.hstack([campaign.q, *measured, *recorded, *labels])
    _, first, same = np.unique(table, axis=0, return_index=True, return_inverse=True)
    timed = any(name in campaign.covariates for name in CLOCK)
    if len(first) == len(table) or (not timed and _by_chance(campaign) > RARE):
        return np.arange(len(table))
    return np.asarray(first[same.reshape(-1)])


def _by_chance(campaign: Campaign) -> float:
    """Return how many pairs of repeats are expected to agree in all figures: those may be coarser than they scatter."""
    _, pose, counts = np.unique(campaign.q, axis=0, return_inverse=True, return_counts=True)
    position, pose = np.asarray(campaign.position), pose.reshape(-1)
    middle = np.array([np.bincount(pose, axis) for axis in position.T]).T / counts[:, None]
    scatter = np.sqrt(((position - middle[pose]) ** 2).mean(axis=0))
    sigma = np.maximum(scatter, max(campaign.noise_position or 0.0, STEADIEST))
    step = step_of(position / campaign.units.length_scale) * campaign.units.length_scale
    # the difference of two repeats is normal with √2 σ; its density at 0 times the step
    alike = np.prod(np.minimum(1.0, step / (2.0 * math.sqrt(math.pi) * sigma)))
    return float(alike * (counts * (counts - 1) / 2).sum())


def step_of(values: FloatArray) -> float:
    """Return the largest power of ten, 1000 at most, of which all figures are multiples; 0 where there is none."""
    for power in range(3, -7, -1):
        parts = values * 10.0**-power
        if np.abs(parts - np.round(parts)).max() < 1e-6 * max(1.0, float(np.abs(parts).max()) * 1e-6):
            return 10.0**power
    return 0.0


def _figure(value: float) -> str:
    return f"{value + 0.0:.10g}".replace("-", "−")
