"""Take out effects that fit the errors of encoders: what steps say counts as evidence, too."""

from __future__ import annotations

from collections.abc import Callable
from operator import itemgetter

import numpy as np
from scipy.special import expit

from thermal_robot.diagnosis.parts import Refused
from thermal_robot.effects import Effect, gate
from thermal_robot.effects.law import PREFIX
from thermal_robot.inference import settings
from thermal_robot.inference.fit import Fit, less
from thermal_robot.inference.random_gap import RandomGap, random_gap


def beside_steps(
    fit: Fit, chance: RandomGap, refused: dict[str, Refused], progress: Callable[[str], None]
) -> tuple[Fit, RandomGap, dict[str, Refused]]:
    """Take out effects without which encoders show their steps, the one that hides most of them first.

    Where joints err anew in every pose, an effect with many parameters can fit a part of these errors. The fit takes
    them for normal; that they put the joint on an encoder's steps, or no longer do, is left out of its evidence. With
    the odds P of an effect by the fit, and the Bayes factors B and B' of steps with it and without it, it stays while
    P B > B'.

    Parameters
    ----------
    fit
        Fit of frames and systematic effects.
    chance
        The random part of its residual.
    refused
        Effects that were taken out before.
    progress
        Called with a few words at each stage.

    Returns
    -------
    fit, chance, refused
        Without the effects that steps speak against.
    """
    while hidden := {joint for joint, factor in chance.steps.items() if factor < 0.0}:
        rivals = []
        for name in (effect.name for effect, _ in fit.effects if _moves(fit, effect) & hidden):
            log_odds = float(np.log(max(fit.odds(name), settings.TINY)))
            if log_odds <= settings.STEPS_REACH:
                other = less(fit, name, progress)
                left = random_gap(other)
                rivals.append((left.seen - chance.seen - log_odds, name, other, left))
        best = max(rivals, key=itemgetter(0), default=None)
        if best is None or best[0] <= 0.0:
            break
        gain, name, fit, chance = best
        progress(f"steps of encoders speak against {name}")
        refused = {**refused, name: Refused(float(expit(-gain)))}
    return fit, chance, refused


def _moves(fit: Fit, effect: Effect) -> set[str]:
    """Return the joints that parameters of a known effect sit in."""
    if effect.name.startswith(PREFIX):
        return set()
    return {p.place for p in gate.checked(effect, fit.corrected) if p.kind == "joint"}
