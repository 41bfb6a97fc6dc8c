"""Joint fit of effects that somebody named: without selection, all are at work, whatever the data say for each.

The frames are found, the effects' parameters fitted in one linear problem with noise and prior scales at their most
probable values and rows far off set aside, then everything by the exact model; from there again, until the same rows
are set aside. The pieces are those of the whole fit (:mod:`thermal_robot.inference.fit`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.effects import Effect, gate
from thermal_robot.errors import EffectError
from thermal_robot.inference import settings
from thermal_robot.inference.columns import block, frame_columns, unknown_frames
from thermal_robot.inference.explain import Discrepancy, Explanation, left_of
from thermal_robot.inference.fit import Fit, require_enough
from thermal_robot.inference.frames import found_frames, frames_known, moved, refined_frames
from thermal_robot.inference.gauss_newton import gauss_newton
from thermal_robot.inference.problem import Linear, Products, frame_step, gram, parameter_values
from thermal_robot.inference.refine import constants_moved, weighed
from thermal_robot.inference.robust import Noise, first_whitening, reweigh
from thermal_robot.inference.search import Search
from thermal_robot.inference.settle import at_exact_model
from thermal_robot.observations import Frames, Observations, observe

Held = list[tuple[Effect, Array]]


def fit_named(campaign: Campaign, effects: Sequence[Effect], progress: Callable[[str], None] = lambda _: None) -> Fit:
    """Fit the unknown frames and all of these effects, each of another name: one combination, of probability 1.

    One that lies in another and is told inside it (:attr:`Effect.told_inside`) is not fitted beside it: it stands in
    the fit's variants, where :func:`~thermal_robot.inference.inside.divided` finds it. Constants that are no linear
    parameters start at the most probable setting in all places. Raises :class:`EffectError` where the campaign lacks
    what an effect needs, or one breaks the contract; :class:`EstimationError` where poses are too few for the frames,
    or nothing is determined.
    """
    progress("unknown frames")
    require_enough(campaign)
    frames = Frames.declared(campaign) if frames_known(campaign) else found_frames(campaign)
    start, variants = observe(campaign, frames), {}
    for effect in effects:
        if needs := gate.missing(effect, start):
            lacks = f"cannot be fitted to {campaign.name}, which lacks {', '.join(needs)}"
            raise EffectError(f"effect {effect.name!r} {lacks}")
        variants[effect.name] = gate.variants(effect, start)
    inside = {e.name for e in effects if e.told_inside and variants.keys() & set(e.contained_in)}
    progress("effects together")
    fitted = [own for name, own in variants.items() if name not in inside]
    first = [own[0] for own in fitted]
    explanation = _explained(start, first, [])
    chosen = _best_settings(explanation, start, fitted)
    if chosen != first:
        explanation = _explained(start, chosen, [])
    explanation, observations, held = _exact(start, explanation, progress)
    kept = campaign.take(~explanation.outliers) if explanation.outliers.any() else campaign
    nominal = start if frames_known(campaign) else observe(campaign, refined_frames(kept, frames, robust=False))
    before = Linear(nominal.gap, frame_columns(nominal)[0], ())
    families = tuple(effect.name for effect, _ in held)
    return Fit(campaign, nominal, before, observations, explanation, tuple(held), families, {}, variants)


def _exact(
    start: Observations, explanation: Explanation, progress: Callable[[str], None]
) -> tuple[Explanation, Observations, Held]:
    """Refit by the exact model and explain there, until the rows set aside and the noise stay."""
    observations, held = start, [(b.effect, np.zeros(len(b.sizes))) for b in explanation.linear.blocks]
    for revision in range(1, settings.REVISIONS + 1):
        progress(f"exact fit, revision {revision}")
        observations, held = _exact_model(observations, explanation, held)
        before, explanation = explanation, _explained(observations, [effect for effect, _ in held], held, explanation)
        # values are held to their expected sizes by as much as there is noise: of what was not linear there is less now
        was, noise = (e.whitening.noise[0] * e.best.noise for e in (before, explanation))
        if was < settings.NOISE_SLACK * noise and (before.outliers == explanation.outliers).all():
            break
    return explanation, observations, held


def _exact_model(observations: Observations, explanation: Explanation, held: Held) -> tuple[Observations, Held]:
    """Refit by the exact model, from the values of the linear fit; from those before where that ends worse."""
    linear, campaign = explanation.linear, observations.campaign
    values = [mean for mean, _ in explanation.values.values()]
    left = linear.gap - sum((linear.contribution(b, own) for b, own in enumerate(values)), np.zeros_like(linear.gap))
    step = frame_step(linear, explanation.whitening, left)
    frames = moved(observations.frames, step, unknown_frames(campaign))
    ahead = [(effect, own) for (effect, _), own in zip(held, values, strict=True)]
    there, found = gauss_newton(campaign, frames, explanation, ahead, settings.SETTLED_NAMED)
    if _cost(explanation, there, found) <= _cost(explanation, observations, held):
        return there, found
    return gauss_newton(campaign, observations.frames, explanation, held, settings.SETTLED_NAMED)


def _cost(explanation: Explanation, observations: Observations, held: Held) -> float:
    """Penalised sum of squares: what is left over the noise, and values over their prior sizes."""
    noise = explanation.whitening.sigma() * explanation.best.noise
    left = (observations.gap / noise) ** 2 * explanation.whitening.weights[:, None]
    over = [(own / explanation.held(explanation.block_of(effect))) ** 2 for effect, own in held]
    return float(left.sum() + sum(own.sum() for own in over))


def _explained(
    observations: Observations, effects: Sequence[Effect], held: Held, before: Explanation | None = None
) -> Explanation:
    """Explain the gap by all of these effects: noise, scales, values and rows set aside, until these stay.

    Where they were explained ``before`` nearby, it begins with the weights and scales that were found there.
    """
    noise, use = Noise.of(observations.campaign), np.ones(observations.campaign.samples, dtype=bool)
    linear = at_exact_model(observations, [block(observations, effect).held for effect in effects], held)
    # effects that are far off, and gross errors, are settled first, beside a noise that is free
    whitening = before.whitening if before else replace(first_whitening(linear, noise, use), held=0.0)
    aside, rounds, known = before.outliers if before else ~use, 0, before is not None
    best, flat = before.best if before else None, linear.frames.shape[2]
    while True:
        problem, rounds = gram(linear, whitening), rounds + 1
        best = Search(problem, [0.0] * len(effects)).evaluate(range(len(effects)), best)
        values = parameter_values(linear, problem, best)
        left = left_of(linear, whitening, values)
        # the share of the equations that effects and frames take up
        leverage = float(min((best.effective + flat) / max(problem.equations + flat, 1), settings.MOST_LEVERAGE))
        then, later = reweigh(left, noise, use, leverage, linear.measures)
        if (known and (later == aside).all()) or rounds > settings.FIRST_ROUNDS:
            none = Discrepancy(None, 0.0, 0.0, {}, best.noise)
            sure = (best,), np.ones(1)
            return Explanation(
                linear, whitening, problem, best, *sure, values, left, np.zeros_like(left), aside, none, ()
            )
        whitening, aside, known = then, later, True


def _best_settings(
    explanation: Explanation, observations: Observations, settings_of: Sequence[tuple[Effect, ...]]
) -> list[Effect]:
    """Return the most probable setting of each effect, one after another, their constants moved."""
    if all(len(own) == 1 and len(gate.nearby(own[0], settings.REFINEMENT)) == 1 for own in settings_of):
        return [own[0] for own in settings_of]
    kept = Products(explanation.linear, explanation.whitening)
    chosen = list(explanation.linear.blocks)
    for k, own in enumerate(settings_of):
        rivals = [block(observations, setting).held for setting in own]
        scores = [weighed(kept, [*chosen[:k], rival, *chosen[k + 1 :]]) for rival in rivals]
        chosen[k] = rivals[int(np.argmax(scores))]
    return [item.effect for item in constants_moved(kept, observations, chosen, settings.REFINEMENT)]
