"""Rows and columns to leave out of a campaign, and warnings about its diagnosis."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from thermal_robot.campaign import Campaign
from thermal_robot.campaign.marks import copies, marks
from thermal_robot.campaign.table import told_rows
from thermal_robot.diagnosis.credible import cancelling, cancelling_within, outsized
from thermal_robot.diagnosis.parts import Refused, Sensitivity
from thermal_robot.effects import gate
from thermal_robot.inference import settings
from thermal_robot.inference.fit import Fit
from thermal_robot.percents import percent


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
    notes += [f"{one.words}: it may stand in for something else" for one in outsized(fitted)]
    for name, times in cancelling_within(fitted):
        notes.append(
            f"parameters of {name} cancel each other: single ones do up to {times:.0f} times what all do together"
        )
    for pair in cancelling(fitted):
        notes.append(f"{pair.words}; both are kept, and neither is to be believed by itself")
    for name, why in refused.items():
        if why.share is not None:
            share = percent(why.share)
            notes.append(f"rows held out are predicted no better with {name} (share {share}): not reported as found")
        if why.reason:
            notes.append(why.reason)
    notes += _fragile(sensitivity)
    return tuple(notes)


def _fragile(sensitivity: Sensitivity | None) -> Iterator[str]:
    """Say where the verdict stands and falls with the expected sizes of the effects."""
    if sensitivity is None:
        return
    for chance, times in ((sensitivity.smaller, "a third of"), (sensitivity.larger, "three times")):
        if chance < settings.FRAGILE:
            yield f"with {times} the expected sizes of all effects this verdict would be improbable ({chance:.0e})"
