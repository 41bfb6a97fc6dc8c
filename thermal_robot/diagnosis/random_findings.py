"""Findings of the random effects: joints that scatter."""

from __future__ import annotations

import numpy as np

from thermal_robot.diagnosis.parts import Estimate, Finding, Location
from thermal_robot.effects import random_effects
from thermal_robot.effects.quantities import unit
from thermal_robot.effects.random_effect import RandomEffect
from thermal_robot.inference import settings
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.random_gap import Kept, RandomGap


def random_findings(fit: Fit, chance: RandomGap) -> tuple[Finding, ...]:
    """Return a finding for every random effect.

    None shrinks the gap, as a correction predicts a mean and leaves scatter. Scatter between poses (encoder steps) and
    scatter between visits (repeatability) are told apart by repeated poses. Without repeats, scatter between visits is
    not testable, and scatter between poses is confounded with it unless the steps of the encoder are seen.

    Parameters
    ----------
    fit
        Fit of frames and systematic effects.
    chance
        The random part of its residual.
    """
    return tuple(_finding(fit, chance, effect) for effect in random_effects())


def _finding(fit: Fit, chance: RandomGap, effect: RandomEffect) -> Finding:
    scatter, kind, own = chance.scatter, effect.component, chance.kept_of(effect.component)
    if effect.needs and kind not in scatter.kinds:
        return Finding(effect.name, "not_testable", needs=effect.needs)
    probability = scatter.probability.get(kind, 0.0)
    if probability < settings.SCATTER_SURE or not own:
        # what follows a law is not this effect
        refuted = probability >= settings.SCATTER_SURE and scatter.chosen(kind)
        return Finding(effect.name, "not_found", 0.0 if refuted else probability, 0.0, (0.0, 0.0))
    probability *= chance.stepped if kind == "pose" else 1.0
    others = tuple(e.name for e in random_effects() if e.component not in scatter.kinds)
    likely = probability >= settings.SCATTER_SURE
    if not likely and not (others and probability >= settings.PRIOR_PROBABILITY):
        return Finding(effect.name, "not_found", probability, 0.0, (0.0, 0.0))
    names, lever = fit.campaign.robot.joint_names, fit.corrected.joint_sensitivity[:, :3]
    moved = np.array([k.component.sigma**2 * (lever[:, :, k.component.joint] ** 2).mean() for k in own])
    order = np.argsort(-moved)
    return Finding(
        effect.name,
        "found" if likely else "confounded",
        probability,
        0.0,
        (0.0, 0.0),
        confounded_with=() if likely else others,
        locations=tuple(Location("joint", names[own[k].component.joint], float(moved[k] / moved.sum())) for k in order),
        parameters=tuple(_estimate(fit, own[k], effect) for k in order),
    )


def _estimate(fit: Fit, kept: Kept, effect: RandomEffect) -> Estimate:
    c, joint = kept.component, fit.campaign.robot.joint_names[kept.component.joint]
    width = effect.factor * (c.upper - c.lower) / (2.0 * settings.SIGMAS_95)
    value = kept.step if c.kind == "pose" else effect.factor * c.sigma
    return Estimate(f"{effect.label}, {joint}", value, width, unit(fit.campaign.robot, joint), True)
