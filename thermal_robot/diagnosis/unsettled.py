"""A fit whose exact model leaves more than its linear one says is not delivered, whatever rows held out seem to say."""

from __future__ import annotations

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.diagnosis import settings
from thermal_robot.inference import settings as inference_settings
from thermal_robot.inference.fit import Fit


def unsettled(fit: Fit) -> str:
    """Say in a sentence that the exact model of a fit is not the one that was compared and held out; empty if it is.

    Combinations are compared, and rows held out, with the model linearised at the exact one. Where Gauss-Newton ends
    elsewhere, as with errors so large that nothing is linear, their figures are not those of the model that is saved.
    """
    kept = ~fit.explanation.outliers
    exact, linear = _left(fit.corrected.gap[kept]), _left(fit.explanation.remainder[kept])
    if not fit.effects or exact <= settings.UNSETTLED * max(linear, inference_settings.ROUNDING):
        return ""
    names = ", ".join(effect.name for effect, _ in fit.effects)
    return (
        f"the fit of {names} did not settle: its exact model leaves {exact:.3g} m where {linear:.3g} m were expected; "
        "nothing of it is told, and the model holds the frames alone"
    )


def _left(gap: Array) -> float:
    return float(np.sqrt((gap[:, :3] ** 2).sum(axis=1).mean()))
