"""Take out effects that fit the errors of encoders: what steps say counts as evidence, too."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.special import expit

from thermal_robot.diagnosis.parts import Refused
from thermal_robot.effects import Effect, gate
from thermal_robot.effects.law import PREFIX
from thermal_robot.inference import settings
from thermal_robot.inference.fit import Fit, refit
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
        names, rivals = fit.names_of(fit.explanation.best), []
        held = fit.probability_of_just(names)
        for name in (effect.name for effect, _ in fit.effects if _moves(fit, effect) & hidden):
            odds = np.log(max(held, settings.TINY) / max(fit.probability_of_just(names - {name}), settings.TINY))
            if odds > settings.STEPS_REACH:
                continue
            other = refit(fit, {name: ()}, [effect for effect, _ in fit.effects if effect.name != name], progress)
            left = random_gap(other)
            rivals.append((left.seen - chance.seen - float(odds), name, other, left))
        gain, name, other, left = max(rivals, key=lambda rival: rival[0], default=(0.0, "", fit, chance))
        if gain <= 0.0:
            break
        progress(f"steps of encoders speak against {name}")
        fit, chance, refused = other, left, {**refused, name: Refused(float(expit(-gain)))}
    return fit, chance, refused


def _moves(fit: Fit, effect: Effect) -> set[str]:
    """Return the joints that parameters of a known effect sit in."""
    if effect.name.startswith(PREFIX):
        return set()
    return {p.place for p in gate.checked(effect, fit.corrected) if p.kind == "joint"}
