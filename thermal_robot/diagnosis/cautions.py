"""Rows and columns to leave out of a campaign, and warnings about its diagnosis."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from thermal_robot.campaign import Campaign
from thermal_robot.effects import Effect
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import orthonormal, without
from thermal_robot.inference.fit import Fit


def usable(campaign: Campaign) -> tuple[Campaign, tuple[str, ...]]:
    """Leave out copied rows, and an orientation that the simulator does not predict; return the reasons."""
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
    # a real repetition may well measure the same digits, but not in the same second and conditions
    recorded = [values[:, None] for values in campaign.covariates.values()]
    table = np.hstack([campaign.q, np.asarray(campaign.position), *recorded])
    first = np.sort(np.unique(table, axis=0, return_index=True)[1])
    copies = campaign.samples - len(first)
    if copies:
        notes.append(f"{copies} rows repeat another one to the last digit: these copies are left out")
        campaign = campaign.take(first)
    return campaign, tuple(notes)


def contradicted(campaign: Campaign) -> list[str]:
    """Return warnings where encoder readings are far from the commands: the log is wrong, not the robot."""
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
    fitted: Fit, considered: Sequence[Effect], refused: Mapping[str, float] = MappingProxyType({})
) -> tuple[str, ...]:
    """Return warnings about the diagnosis, one sentence each.

    Parameters
    ----------
    fitted
        The final fit.
    considered
        The effects that were considered, if the user left some out; empty otherwise.
    refused
        By effect that rows held out refused: what adding it brings there, as a share of their mean square.
    """
    notes = []
    campaign, e = fitted.campaign, fitted.explanation
    remains = float(e.whitening.noise[0] * e.best.noise)
    if campaign.noise_position is not None and remains < settings.STATED_TOO_LARGE * campaign.noise_position:
        times = campaign.noise_position / remains
        notes.append(f"the stated noise of position is {times:.1f} times what remains: it is stated too large")
    for name, times in _cancelling(fitted):
        notes.append(
            f"parameters of {name} cancel each other: single ones do up to {times:.0f} times what all do together"
        )
    for name, share in refused.items():
        notes.append(f"rows held out are predicted no better with {name} (share {share:.1%}): not reported as found")
    if considered:
        notes.append("only these effects were considered: " + ", ".join(effect.name for effect in considered))
    return tuple(notes)


def _cancelling(fitted: Fit) -> Iterator[tuple[str, float]]:
    """Yield effects whose parameters cancel each other: name, and largest single contribution over the sum.

    Such parameters have no meaning one by one. Over part of a turn, for example, harmonics of low order are nearly
    collinear. Contributions are taken with the unknown frames projected out.
    """
    e = fitted.explanation
    frames = e.linear.frames.reshape(e.linear.gap.size, e.linear.frames.shape[2])
    basis = orthonormal(frames)
    for b, (effect, values) in zip(e.best.blocks, fitted.effects, strict=True):
        moved = e.linear.blocks[b].columns.reshape(len(frames), -1) * values
        moved = without(moved, basis)
        whole = float(np.linalg.norm(moved.sum(axis=1)))
        times = float(np.linalg.norm(moved, axis=0).max(initial=0.0)) / max(whole, settings.TINY)
        if times > settings.CANCELLING:
            yield effect.name, times
