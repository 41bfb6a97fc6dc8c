"""Choose the systematic effects again where joints scatter, as scatter can be mistaken for a systematic effect."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from thermal_robot.diagnosis.answer import Conclusion
from thermal_robot.diagnosis.examine import Examined, examine
from thermal_robot.diagnosis.parts import Refused, Unexplained
from thermal_robot.diagnosis.unlisted import as_laws_say
from thermal_robot.diagnosis.where import without_laws
from thermal_robot.effects import Effect
from thermal_robot.inference import settings
from thermal_robot.inference.discover import discovered
from thermal_robot.inference.explain import explain
from thermal_robot.inference.fit import Fit, refit
from thermal_robot.inference.generalised import generalised
from thermal_robot.inference.random_gap import RandomGap, random_gap
from thermal_robot.inference.robust import Noise


def beside_scatter(
    fit: Fit, chance: RandomGap, refused: Mapping[str, Refused], progress: Callable[[str], None]
) -> Conclusion:
    """Choose the systematic effects again, with the joints' scatter in the covariance of the noise.

    Parameters
    ----------
    fit
        Fit whose effects were chosen with the instrument's noise alone.
    chance
        The scatter, which accounts for the residual of that fit.
    refused
        Effects that rows held out refused.
    progress
        Called with a few words at each stage.

    Returns
    -------
    Conclusion
        Effects and laws that the scatter had imitated are no longer in the fit.
    """
    e = fit.explanation
    scatter, sensitivity = chance.scatter, fit.corrected.joint_sensitivity
    covariance = scatter.covariance(sensitivity, replace(e.whitening, noise=scatter.noise).sigma())
    linear = generalised(e.linear, covariance, scatter.noise)
    place, *turn = (float(s) for s in scatter.noise[::3])
    noise = Noise(place, turn[0] if turn else None)
    # of many rows each choice takes minutes: then only what was chosen is asked whether it stays
    asked = range(len(linear.blocks)) if fit.campaign.samples <= settings.MANY_ROWS else e.best.blocks
    linear = replace(linear, blocks=tuple(linear.blocks[b] for b in asked))
    families = [item.effect.name for item in linear.blocks]
    again = explain(linear, noise, families=families)
    kept = {families[b] for b in again.best.blocks}
    feigned: dict[str, tuple[Effect, ...]] = {name: () for name in dict.fromkeys(fit.families) if name not in kept}
    own = {name: [b for b, family in enumerate(families) if family == name] for name in feigned}
    chances = {n: again.probability(blocks) if blocks else fit.probability(n) for n, blocks in own.items()}
    refused = {**refused, **{name: Refused(probability) for name, probability in chances.items()}}
    fit = refit(fit, feigned, [linear.blocks[b].effect for b in again.best.blocks], progress)
    chance = random_gap(fit)
    sigma = replace(fit.explanation.whitening, noise=chance.scatter.noise).sigma()
    covariance = chance.scatter.covariance(fit.corrected.joint_sensitivity, sigma)[:, :3, :3]
    floor = float(np.sqrt(np.trace(covariance, axis1=1, axis2=2).mean() / 3.0))
    left = Unexplained(not chance.explains_size, 0.0, chance.p_value)
    if left.flagged:
        left = examine(fit, progress).unexplained
    laws = discovered(fit)
    unexplained = as_laws_say(without_laws(fit, left), laws, fit.explanation.discrepancy)
    return Conclusion(fit, laws, unexplained, Examined(left, floor, "scatter"), chance, refused)
