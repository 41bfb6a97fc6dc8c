"""Say that robot and table do not belong together; then no effect is claimed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.campaign.plausible import another_unit
from thermal_robot.diagnosis import settings as diagnosis_settings
from thermal_robot.diagnosis.answer import Conclusion
from thermal_robot.diagnosis.data_faults import data_fault, settings
from thermal_robot.diagnosis.data_faults.another_robot import another_robot
from thermal_robot.diagnosis.data_faults.readings import Readings
from thermal_robot.diagnosis.data_faults.struck import misfit
from thermal_robot.diagnosis.examine import examine
from thermal_robot.diagnosis.parts import AnotherModel, Misfit
from thermal_robot.effects import Effect
from thermal_robot.inference import settings as inference_settings
from thermal_robot.inference.fit import Fit, fit
from thermal_robot.inference.random_gap import nothing_random

_NEEDED = "a table that fits the robot"
_SETTLED = "a fit that settles"


def unfit(campaign: Campaign, progress: Callable[[str], None] = lambda _: None) -> Misfit | None:
    """Judge robot and table before any effect: the URDF's unit, faults of the table, another robot.

    A fault that leaves a gap no robot leaves is none where another robot leaves clearly less.
    """
    factor = another_unit(campaign)
    if factor is not None:
        return Misfit(model=AnotherModel(factor))
    fault = data_fault(campaign, progress)
    if fault is not None and fault.rms_after < misfit(Readings.of(campaign)):
        return Misfit(fault)
    other = another_robot(campaign, progress)
    if fault is None or (other is not None and settings.FALL * _leaves(other) < fault.rms_after):
        return other
    return Misfit(fault)


def _leaves(other: Misfit) -> float:
    """Return what another robot leaves, m: the one at hand that fits, else one of such lengths."""
    if other.model is None:
        return np.inf
    return other.model.remains if other.model.fits else other.away or 0.0


def another_motion(fitted: Fit) -> Misfit | None:
    """Tell whether a fit leaves more than any robot errs: robot and table then do not describe the same motion."""
    left = fitted.corrected.gap[~fitted.explanation.outliers]
    away = float(np.sqrt((left[:, :3] ** 2).sum(axis=1).mean()))
    turned = float(np.sqrt((left[:, 3:] ** 2).sum(axis=1).mean()))
    if away > settings.ANOTHER_MOTION * fitted.campaign.reach:
        return Misfit(away=away)
    return Misfit(turned=turned) if turned > settings.ANOTHER_TURN else None


def delivered(last: Conclusion, candidates: Sequence[Effect]) -> Conclusion:
    """Return a conclusion whose exact model is the one that was compared; else that of the frames alone, and why."""
    note = unsettled(last.fit)
    return replace(frames_alone(last.fit.campaign, candidates, _SETTLED), notes=(note,)) if note else last


def frames_alone(campaign: Campaign, candidates: Sequence[Effect], needed: str = _NEEDED) -> Conclusion:
    """Conclude from the unknown frames and nothing else: no candidate can be tested.

    Parameters
    ----------
    campaign
        With measurements.
    candidates
        Effects that were asked for.
    needed
        What they would need.
    """
    bare = replace(fit(campaign, ()), needs={effect.name: (needed,) for effect in candidates})
    left = examine(bare)
    return Conclusion(bare, (), left.unexplained, left, nothing_random(bare), {})


def unsettled(fit: Fit) -> str:
    """Say in a sentence that the exact model of a fit is not the one that was compared and held out; empty if it is.

    Combinations are compared, and rows held out, with the model linearised at the exact one. Where Gauss-Newton ends
    elsewhere, as with errors so large that nothing is linear, their figures are not those of the model that is saved.
    """
    kept = ~fit.explanation.outliers
    exact, linear = _left(fit.corrected.gap[kept]), _left(fit.explanation.remainder[kept])
    if not fit.effects or exact <= diagnosis_settings.UNSETTLED * max(linear, inference_settings.ROUNDING):
        return ""
    names = ", ".join(effect.name for effect, _ in fit.effects)
    return (
        f"the fit of {names} did not settle: its exact model leaves {exact:.3g} m where {linear:.3g} m were expected; "
        "nothing of it is told, and the model holds the frames alone"
    )


def _left(gap: Array) -> float:
    return float(np.sqrt((gap[:, :3] ** 2).sum(axis=1).mean()))
