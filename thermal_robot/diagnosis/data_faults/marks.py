"""Rows in which an instrument that had lost its target wrote a mark, not a measurement: −9999, or 0 0 0."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from thermal_robot.campaign import Campaign
from thermal_robot.diagnosis.data_faults import settings
from thermal_robot.diagnosis.data_faults.readings import Readings, Rows, rms
from thermal_robot.diagnosis.data_faults.struck import misfit, spread
from thermal_robot.diagnosis.parts import DataFault


def marks_of_missing(campaign: Campaign, readings: Readings) -> DataFault | None:
    """Return rows that hold one value many times and are far from where the others put them; ``None`` if none are.

    Parameters
    ----------
    campaign
        With measurements, in whose unit the value is told.
    readings
        Its columns.
    """
    found = [*_alike(readings, campaign.units.length_scale)]
    struck = np.any([rows for rows, _ in found], axis=0) if found else np.zeros(campaign.samples, dtype=bool)
    if not struck.any() or (~struck).sum() <= settings.DRAWN:
        return None
    distance = readings.distance(readings.take(spread(np.flatnonzero(~struck))).align())
    near = max(float(np.median(distance[~struck])), settings.LEAST * misfit(readings))
    struck &= distance > settings.STRAY * near
    if struck.sum() < settings.MARKS:
        return None
    return DataFault(
        kinds=("missing value",),
        what=", and ".join(words for rows, words in found if (rows & struck).any())
        + ": a mark of a missing value, not a measurement",
        remedy="leave these rows out",
        rms_before=rms(distance[struck]),
        rms_after=rms(distance[~struck]),
        rows=tuple(int(r) for r in campaign.rows[struck]),
    )


def _alike(readings: Readings, scale: float) -> Iterator[tuple[Rows, str]]:
    """Yield rows in which an axis has one value beyond all others', or all axes zero, at different commands."""
    for k, axis in enumerate("xyz"):
        column = readings.position[:, k]
        values, counts = np.unique(column, return_counts=True)
        for value in values[counts >= settings.MARKS]:
            rows = column == value
            if not rows.all() and _beyond(float(value), column[~rows]) and _several(readings, rows):
                yield rows, f"{axis} is {value / scale:g} in {rows.sum()} rows".replace("-", "−")
    rows = (readings.position == 0.0).all(axis=1)
    if rows.sum() >= settings.MARKS and _several(readings, rows):
        yield rows, f"x, y and z are 0 in {rows.sum()} rows"


def _beyond(value: float, others: np.ndarray) -> bool:
    """Tell whether a value is farther from the middle of most others than they are from each other."""
    low, middle, high = np.quantile(others, (0.1, 0.5, 0.9))
    return bool(abs(value - middle) > settings.BEYOND * (high - low))


def _several(readings: Readings, rows: Rows) -> bool:
    return len(np.unique(readings.q[rows], axis=0)) >= settings.MARKS
