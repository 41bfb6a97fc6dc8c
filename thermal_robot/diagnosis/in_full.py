"""Effects of few shapes that come out too large: whether a fuller setting, held to the sizes of its source, says more.

Over part of its range two smooth shapes are nearly alike. Where what a robot does is neither, their difference follows
it with amplitudes that no robot has, and over another part with others. A setting of more shapes, none of which may be
large, then explains the same, and as much of the rows held out.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from thermal_robot.diagnosis import settings as own
from thermal_robot.diagnosis.credible import goes_astray, surely
from thermal_robot.effects import Effect, gate
from thermal_robot.inference import settings
from thermal_robot.inference.fit import Fit, refit


def in_full(fit: Fit, progress: Callable[[str], None]) -> Fit:
    """Let fuller settings compete where a parameter is surely larger than 99 % of robots have.

    Parameters
    ----------
    fit
        Of at most as many rows as ripple is looked for in: further settings of more would take minutes.
    progress
        Called with a few words at each stage.

    Returns
    -------
    Fit
        The choice made again beside them, unless rows held out are then predicted clearly worse.
    """
    if fit.campaign.samples > settings.RIPPLE_ROWS:
        return fit
    for effect in _uncommon(fit):
        fuller = gate.in_full(effect)
        if fuller is None:
            continue
        progress(f"{effect.title} in full")
        begin = [fuller if other is effect else other for other, _ in fit.effects]
        others = refit(fit, {effect.name: (*fit.variants[effect.name], fuller)}, begin, progress)
        if goes_astray(others) <= settings.WORSE_ELSEWHERE * goes_astray(fit):
            return others
    return fit


def _uncommon(fit: Fit) -> list[Effect]:
    """Return the effects of which a parameter is surely beyond the size that nearly all robots have."""
    return [
        effect
        for effect, _, _, sure in surely(fit)
        if effect.name in fit.variants and (sure > np.exp(own.NEARLY_ALL * effect.size_spread)).any()
    ]
