"""Rows and columns to leave out of a campaign, and warnings about its diagnosis.

Rows were not executed as written where the pose of another command was measured: a robot that waits at a limit, a
program that is a line behind, an instrument that repeats its last reading. They say nothing of the robot, and nothing
that is wrong with a robot looks like them: they are told and left out before anything is fitted. Where so many are
behind that the table was paired wrong, that is a fault of the data.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from thermal_robot.campaign import Campaign
from thermal_robot.campaign.plausible import copies, marks
from thermal_robot.campaign.table import told_rows
from thermal_robot.diagnosis.data_faults import settings as faults
from thermal_robot.diagnosis.data_faults.find import misfit, spread
from thermal_robot.diagnosis.data_faults.readings import Readings
from thermal_robot.diagnosis.values import Refused, Sensitivity
from thermal_robot.effects import gate
from thermal_robot.inference import settings
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.frames import Placed
from thermal_robot.inference.rows import in_order
from thermal_robot.percents import percent

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


def usable(campaign: Campaign) -> tuple[Campaign, tuple[str, ...]]:
    """Leave out rows that measured nothing, and an orientation that the simulator does not predict; say so."""
    notes = []
    if (
        campaign.orientation is not None
        and campaign.simulated_position is not None
        and campaign.simulated_orientation is None
    ):
        # nothing says how the target is turned there
        notes.append("orientation was measured, but sim.* predicts positions only: orientation is left out")
        campaign = replace(campaign, orientation=None, noise_orientation=None)
    notes += contradicted(campaign)
    again, (lost, _) = copies(campaign), marks(campaign)
    if again.any():
        rows = told_rows(campaign.rows[again])
        notes.append(f"{rows} repeat another one to the last digit: these copies are left out")
    if lost.any():
        rows = told_rows(campaign.rows[lost])
        what = "a mark of a missing value, or a robot that stood still"
        notes.append(f"{rows} measured one place or figure to the last digit, {what}: they are left out")
    if (again | lost).any():
        campaign = campaign.take(~(again | lost))
    return campaign, tuple(notes)


def contradicted(campaign: Campaign) -> list[str]:
    """Return warnings where encoder readings contradict the commands: the log is wrong, not the robot."""
    found = []
    for j, name in enumerate(campaign.robot.joint_names):
        read = campaign.covariates.get(f"encoder.{name}")
        if read is None:
            continue
        away = read - campaign.q[:, j]
        middle = float(np.median(away))
        wrong = np.flatnonzero(np.abs(away - middle) > settings.CONTRADICTED)
        if len(wrong):
            first = int(campaign.rows[wrong[0]])
            found.append(
                f"encoder.{name} contradicts the commands in {len(wrong)} of {campaign.samples} rows, first in "
                f"row {first}, by up to {np.abs(away - middle).max():.2g}: that is a fault of the log, not of the robot"
            )
        elif abs(middle) > settings.CONTRADICTED:
            found.append(f"encoder.{name} is {middle:.3g} from the commands throughout: another zero, or another unit")
    return found


def cautions(
    fitted: Fit,
    refused: Mapping[str, Refused] = MappingProxyType({}),
    sensitivity: Sensitivity | None = None,
) -> tuple[str, ...]:
    """Warnings about the diagnosis by its final fit, refused effects and sensitivity to priors; one sentence each."""
    notes = []
    campaign, e = fitted.campaign, fitted.explanation
    remains = float(e.whitening.noise[0] * e.best.noise)
    if campaign.noise_position is not None and remains < settings.STATED_TOO_LARGE * campaign.noise_position:
        times = campaign.noise_position / remains
        notes.append(f"the stated noise of position is {times:.1f} times what remains: it is stated too large")
    read = {column for effect, _ in fitted.effects for column in gate.reads(effect, fitted.nominal)}
    if read & set(campaign.derived):
        notes.append(
            "directions of approach were not recorded: they follow from the order of the rows, as of a robot that goes "
            'straight from pose to pose; if it does not, write moves = "unknown" under [robot]'
        )
    for name, why in refused.items():
        if why.share is not None:
            share = f" (share {percent(why.share)})" if why.share < 0.0 else ""
            notes.append(f"rows held out are predicted no better with {name}{share}: not reported as found")
    notes += _fragile(sensitivity)
    return tuple(notes)


def _fragile(sensitivity: Sensitivity | None) -> Iterator[str]:
    """Say where the verdict stands and falls with the expected sizes of the effects."""
    if sensitivity is None:
        return
    for chance, times in ((sensitivity.smaller, "a third of"), (sensitivity.larger, "three times")):
        if chance < settings.FRAGILE:
            yield f"with {times} the expected sizes of all effects this verdict would be improbable ({chance:.0e})"
