"""Rows that were not executed as written: what was measured in them is the pose of another command.

A robot that waits at a limit, a program that is a line behind, an instrument that repeats its last reading: such rows
say nothing of the robot, and nothing that is wrong with a robot looks like them. They are told and left out before
anything is fitted. Where so many are behind that the table was paired wrong, that is a fault of the data.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from thermal_robot.campaign import Campaign
from thermal_robot.diagnosis.data_faults import settings as faults
from thermal_robot.diagnosis.data_faults.readings import Readings
from thermal_robot.diagnosis.data_faults.struck import misfit, spread
from thermal_robot.inference import settings
from thermal_robot.inference.frames import Placed
from thermal_robot.inference.rows import in_order

Rows = NDArray[np.int64]
Flags = NDArray[np.bool_]


def not_executed(campaign: Campaign) -> tuple[Campaign, tuple[str, ...]]:
    """Leave out rows whose measured pose is that of another row's command, with a sentence for each run of them."""
    if campaign.samples <= faults.DRAWN:
        return campaign, ()
    order = in_order(campaign)
    readings = Readings.of(campaign).take(order)
    frames = readings.take(spread(np.arange(len(order)))).align(coarse=True)
    near = max(float(np.median(readings.distance(frames))), faults.LEAST * misfit(readings))
    far = readings.distance(frames) > faults.STRAY * near
    if not far.any():
        return campaign, ()
    out, notes = np.zeros(len(order), dtype=bool), []
    found = [*_still(readings, far, near), *_behind(readings, far, near, frames)]
    for rows, words in sorted(found, key=lambda run: -len(run[0])):
        if not out[rows].any():
            out[rows] = True
            numbers = campaign.rows[order[rows]]
            named = f"row {numbers[0]} was" if len(rows) == 1 else f"rows {numbers[0]} to {numbers[-1]} were"
            before = int(campaign.rows[order[max(rows[0] - 1, 0)]])
            notes.append(f"{named} not executed as written: {words.format(before)}; left out of the fit")
    return campaign.take(np.sort(order[~out])) if notes else campaign, tuple(notes)


def _still(readings: Readings, far: Flags, near: float) -> Iterator[tuple[Rows, str]]:
    """Yield the runs in which the measured place stays that of the row before, or any, while the commands go on."""
    k, rows = 0, len(far)
    while k < rows - 1:
        away = np.linalg.norm(readings.position[k + 1 :] - readings.position[k], axis=1)
        stays = int(np.argmax(np.append(away > faults.SAME_PLACE * near, True)))
        run = np.arange(k if far[k] else k + 1, k + 1 + stays)
        if stays and far[run].all() and (not far[k] or len(run) >= settings.RUN):
            words = "one place was measured in all" if far[k] else "the robot stood still in the pose of row {}"
            yield run, words
        k += stays + 1


def _behind(readings: Readings, far: Flags, near: float, frames: Placed) -> Iterator[tuple[Rows, str]]:
    """Yield the runs, of few of the rows, in which the measured pose belongs to a command some rows away."""
    for by in (sign * k for k in range(1, faults.MOST_SHIFT + 1) for sign in (-1, 1)):
        own = np.clip(np.arange(len(far)) + by, 0, len(far) - 1)
        shifted = replace(readings, q=readings.q[own])
        fits = far & (shifted.distance(frames) <= faults.STRAY * near)
        ends = np.flatnonzero(np.diff(fits, prepend=False, append=False)).reshape(-1, 2)
        for first, last in ends:
            if settings.RUN <= last - first <= max(faults.MOST_BEHIND * len(far), settings.RUN):
                other = f"{abs(by)} row{'' if abs(by) == 1 else 's'} {'before' if by < 0 else 'later'}"
                yield np.arange(first, last), f"measured was the pose that is commanded {other}"
