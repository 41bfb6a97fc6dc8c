"""The fit of effects that somebody named: no choice among them, all are at work, whatever the data say for each.

The frames are found, the effects' parameters fitted in one linear problem with the noise and the scales of the priors
at their most probable values and rows far off set aside, then everything by the exact model; from there again, until
the same rows are set aside. The pieces are those of the whole fit (:mod:`thermal_robot.inference.fit`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.effects import Effect, gate
from thermal_robot.errors import EffectError
from thermal_robot.inference import settings
from thermal_robot.inference.columns import Block, block, frame_columns, unknown_frames
from thermal_robot.inference.explain import Discrepancy, Explanation, left_of
from thermal_robot.inference.fit import Fit, require_enough
from thermal_robot.inference.frames import found_frames, frames_known, moved, refined_frames
from thermal_robot.inference.gauss_newton import gauss_newton
from thermal_robot.inference.problem import Linear, Products, Whitening, frame_step, gram, parameter_values
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
    start = observe(campaign, frames)
    variants = {effect.name: _settings(effect, start) for effect in effects}
    inside = {e.name for e in effects if e.told_inside and variants.keys() & set(e.contained_in)}
    progress("effects together")
    fitted = [own for name, own in variants.items() if name not in inside]
    explanation = _explained(start, [own[0] for own in fitted], [])
    chosen = _best_settings(explanation, start, fitted)
    if chosen != [own[0] for own in fitted]:
        explanation = _explained(start, chosen, [])
    explanation, observations, held = _exact(start, explanation, progress)
    kept = campaign if not explanation.outliers.any() else campaign.take(~explanation.outliers)
    nominal = start if frames_known(campaign) else observe(campaign, refined_frames(kept, frames, robust=False))
    before = Linear(nominal.gap, frame_columns(nominal)[0], ())
    families = tuple(effect.name for effect, _ in held)
    return Fit(campaign, nominal, before, observations, explanation, tuple(held), families, {}, variants)


def _settings(effect: Effect, observations: Observations) -> tuple[Effect, ...]:
    """Return the settings of an effect in all its places, the one that is first looked for first."""
    needs = gate.missing(effect, observations)
    if needs:
        raise EffectError(
            f"effect {effect.name!r} cannot be fitted to {observations.campaign.name}, which lacks {', '.join(needs)}"
        )
    return gate.variants(effect, observations)


def _exact(
    start: Observations, explanation: Explanation, progress: Callable[[str], None]
) -> tuple[Explanation, Observations, Held]:
    """Refit by the exact model and explain there, until the rows set aside and the noise stay."""
    observations, held = start, [(b.effect, np.zeros(len(b.sizes))) for b in explanation.linear.blocks]
    for revision in range(1, settings.REVISIONS + 1):
        progress(f"exact fit, revision {revision}")
        observations, held = _refitted(observations, explanation, held)
        again = _explained(observations, [effect for effect, _ in held], held, explanation)
        # values are held to their expected sizes by as much as there is noise: of what was not linear there is less now
        stays = _noise(explanation) < settings.NOISE_SLACK * _noise(again)
        stays = stays and bool((again.outliers == explanation.outliers).all())
        explanation = again
        if stays:
            break
    return explanation, observations, held


def _refitted(observations: Observations, explanation: Explanation, held: Held) -> tuple[Observations, Held]:
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


def _noise(explanation: Explanation) -> float:
    """Return what is left per axis, m."""
    return float(explanation.whitening.noise[0] * explanation.best.noise)


def _cost(explanation: Explanation, observations: Observations, held: Held) -> float:
    """Return what is left over the noise and what values are over their prior sizes, squared and summed."""
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
    campaign = observations.campaign
    noise, use = Noise.of(campaign), np.ones(campaign.samples, dtype=bool)
    blocks = tuple(block(observations, effect).held for effect in effects)
    linear = at_exact_model(observations, blocks, held)
    # effects that are far off, and gross errors, are settled first, beside a noise that is free
    whitening = before.whitening if before else replace(first_whitening(linear, noise, use), held=0.0)
    aside, seen, known = before.outliers if before else ~use, 0, before is not None
    while True:
        found = _at(linear, whitening, aside, before)
        seen += 1
        whitening, later = reweigh(found.remainder, noise, use, _leverage(found), linear.measures)
        if (known and (later == aside).all()) or seen > settings.FIRST_ROUNDS:
            return found
        aside, before, known = later, found, True


def _leverage(found: Explanation) -> float:
    """Return the share of the equations that effects and frames take up."""
    flat = found.linear.frames.shape[2]
    share = (found.best.effective + flat) / max(found.problem.equations + flat, 1)
    return float(min(share, settings.MOST_LEVERAGE))


def _at(
    linear: Linear, whitening: Whitening, aside: NDArray[np.bool_], before: Explanation | None = None
) -> Explanation:
    """Return the explanation by all blocks at given weights, the search for scales begun at those before."""
    problem = gram(linear, whitening)
    whole = range(len(linear.blocks))
    best = Search(problem, [0.0] * len(linear.blocks)).evaluate(whole, before.best if before else None)
    values = parameter_values(linear, problem, best)
    remainder = left_of(linear, whitening, values)
    return Explanation(
        linear,
        whitening,
        problem,
        best,
        (best,),
        np.ones(1),
        values,
        remainder,
        np.zeros_like(remainder),
        aside,
        Discrepancy(None, 0.0, 0.0, {}, best.noise),
        (),
    )


def _best_settings(
    explanation: Explanation, observations: Observations, settings_of: Sequence[tuple[Effect, ...]]
) -> list[Effect]:
    """Return the most probable setting of each effect, one after another, their constants moved."""
    if all(len(own) == 1 and len(gate.nearby(own[0], settings.REFINEMENT)) == 1 for own in settings_of):
        return [own[0] for own in settings_of]
    kept = Products(explanation.linear, explanation.whitening)
    chosen: list[Block] = list(explanation.linear.blocks)
    for k, own in enumerate(settings_of):
        rivals = [block(observations, setting).held for setting in own]
        scores = [weighed(kept, [*chosen[:k], rival, *chosen[k + 1 :]]) for rival in rivals]
        chosen[k] = rivals[int(np.argmax(scores))]
    return [item.effect for item in constants_moved(kept, observations, chosen, settings.REFINEMENT)]
