"""The whole fit: frames, joint model selection of effects, and Gauss-Newton on the exact model.

Effects are selected (:func:`fit`, :func:`refit`, :func:`less`) or named (:func:`fit_named`). Named effects are all
kept: fitted in one linear problem with most probable noise and prior scales, then by the exact model, repeatedly until
the outliers converge.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence, Set
from dataclasses import dataclass, replace

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.campaign.settings import STILL
from thermal_robot.effects import Effect, gate
from thermal_robot.errors import EffectError, EstimationError
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import total_probability
from thermal_robot.inference.columns import block, frame_columns, unknown_frames
from thermal_robot.inference.evidence import Combination
from thermal_robot.inference.exact import (
    ExactSelection,
    at_exact_model,
    corrected_observations,
    gauss_newton,
    refined_blocks,
    select_exactly,
    weighed,
)
from thermal_robot.inference.explain import Discrepancy, Explanation, residual_of
from thermal_robot.inference.grouping import near_repeats
from thermal_robot.inference.problem import Linear, Products, frame_step, gram, parameter_values
from thermal_robot.inference.registration import found_frames, frames_known, moved, refined_frames, register
from thermal_robot.inference.search import Search
from thermal_robot.inference.variance_components import reweighted
from thermal_robot.inference.weights import Noise, first_whitening, reweigh
from thermal_robot.kinematics import log6
from thermal_robot.observables import components, of_model
from thermal_robot.observations import Frames, Observations, observe

Held = list[tuple[Effect, Array]]


@dataclass(frozen=True, eq=False)
class Fit:
    """Fit of a campaign, at the nominal and at the corrected robot.

    ``nominal`` are the observations of the nominal robot with its unknown frames fitted, ``before`` the linear problem
    there; ``corrected`` those of the corrected model, where ``explanation`` is linearised. ``effects`` have their (P,)
    values, ``families`` names the effect of each block, ``needs`` says what effects that cannot be tested lack,
    ``variants`` by name which settings were compared.
    """

    campaign: Campaign
    nominal: Observations
    before: Linear
    corrected: Observations
    explanation: Explanation
    effects: tuple[tuple[Effect, Array], ...]
    families: tuple[str, ...]
    needs: dict[str, tuple[str, ...]]
    variants: dict[str, tuple[Effect, ...]]

    def blocks_of(self, name: str) -> list[int]:
        """Return the numbers of the blocks of one effect, one for each of its settings."""
        return [b for b, family in enumerate(self.families) if family == name]

    def names_of(self, combination: Combination) -> frozenset[str]:
        """Return the names of the effects in a combination of blocks."""
        return frozenset(self.families[b] for b in combination.blocks)

    def probability(self, name: str) -> float:
        """Posterior inclusion probability of an effect, summed over its settings."""
        return self.explanation.probability(self.blocks_of(name))

    def probability_of_just(self, names: Set[str]) -> float:
        """Posterior probability of exactly this set of effects, summed over their settings."""
        e = self.explanation
        return total_probability(e.probabilities[[self.names_of(c) == names for c in e.combinations]])

    def odds(self, name: str) -> float:
        """Posterior odds of an effect of the explanation against the same explanation without it."""
        best = self.names_of(self.explanation.best)
        return self.probability_of_just(best) / max(self.probability_of_just(best - {name}), settings.TINY)


def fit(campaign: Campaign, effects: Sequence[Effect], progress: Callable[[str], None] = lambda _: None) -> Fit:
    """Fit frames, select effects and refit the selection exactly until Gauss-Newton converges.

    Raises :class:`EstimationError` if there are too few different poses for the unknown frames.
    """
    progress("unknown frames")
    require_enough(campaign)

    def selected(campaign: Campaign) -> Fit:
        nominal = observe(campaign, register(campaign))
        needs = {e.name: missing for e in effects if (missing := gate.missing(e, nominal))}
        variants = {e.name: _settings(e, nominal) for e in effects if e.name not in needs}
        held = _set_frames(nominal, variants) if of_model(campaign) else []
        begun = corrected_observations(campaign, nominal.frames, held) if held else nominal
        selection = select_exactly(begun, variants, progress, held=held)
        if held:  # what stood in for frames was linearised beside them
            selection = select_exactly(selection.observations, variants, progress, held=selection.held)
        return _fitted(campaign, selection, needs, variants)

    return _reweighted(campaign, selected, progress)


def _set_frames(nominal: Observations, variants: Mapping[str, tuple[Effect, ...]]) -> Held:
    """Register the frames that another model has set: effects that displace them, with their twists (6,).

    A turn by 90 degrees, or the length of a tool, is no small error: linearised elsewhere it hides all others.
    """
    free = replace(nominal.campaign, base_known=False, tool_known=False)
    found, own = register(free), nominal.frames
    twists = {"base": log6(np.linalg.inv(own.base) @ found.base), "tool": log6(found.tool @ np.linalg.inv(own.tool))}
    return [(each[0], twists[each[0].frame]) for each in variants.values() if each[0].frame]


def _reweighted(campaign: Campaign, solve: Callable[[Campaign], Fit], progress: Callable[[str], None]) -> Fit:
    """Repeat a fit until the noise of each kind of measurement, where none is stated, is what the fit leaves."""
    for _ in range(settings.REVISIONS):
        found = solve(campaign)
        weighed = reweighted(campaign, found.explanation)
        if weighed is campaign:
            break
        progress("noise of each kind")
        campaign = weighed
    return found


def _settings(effect: Effect, observations: Observations) -> tuple[Effect, ...]:
    """Return the settings of an effect that are compared: all its variants, and the first one in each single place."""
    known = gate.variants(effect, observations)
    return tuple(dict.fromkeys((*known, *gate.alone(known[0], observations))))


def less(known: Fit, *names: str) -> Fit:
    """Backward elimination: fit without some effects, the others selected anew in the same linear problem.

    Weights and memo are reused; the selection is fitted exactly.
    """
    explanation = known.explanation.without([b for name in names for b in known.blocks_of(name)])
    linear = [(explanation.linear.blocks[b].effect, explanation.values[b][0]) for b in explanation.best.blocks]
    corrected, held = gauss_newton(
        known.campaign, known.corrected.frames, explanation, linear, settings.SETTLED_BETWEEN, known.effects
    )
    variants = {other: own for other, own in known.variants.items() if other not in names}
    return replace(known, explanation=explanation, corrected=corrected, effects=tuple(held), variants=variants)


def refit(
    known: Fit,
    variants: Mapping[str, tuple[Effect, ...]],
    starts: Sequence[Sequence[Effect]] = (),
    progress: Callable[[str], None] = lambda _: None,
) -> Fit:
    """Repeat the model selection at the exact model of a fit, with other settings, such as discovered laws.

    ``variants`` replace those of the fit by name, or join them; none takes the effect out. The search starts from each
    of the ``starts``, by default from the effects of the fit.
    """
    whole = {name: own for name, own in {**known.variants, **variants}.items() if own}
    # rows that were set aside are judged anew beside what joins: they may be what it explains
    before = None if starts and known.explanation.outliers.any() else known.explanation
    selection = select_exactly(known.corrected, whole, progress, held=known.effects, before=before, starts=starts)
    return _fitted(known.campaign, selection, known.needs, whole)


def _fitted(
    campaign: Campaign,
    selection: ExactSelection,
    needs: dict[str, tuple[str, ...]],
    variants: dict[str, tuple[Effect, ...]],
) -> Fit:
    explanation = selection.explanation
    nominal = observe(campaign, register(campaign, ~explanation.outliers))
    before = Linear(nominal.gap, frame_columns(nominal)[0], ())
    corrected = selection.observations if selection.held else nominal
    return Fit(campaign, nominal, before, corrected, explanation, selection.held, selection.families, needs, variants)


def require_enough(campaign: Campaign) -> None:
    """Raise :class:`EstimationError` if there are too few different poses for frames, effects and a held-out fold."""
    still = np.unique(np.round(campaign.q / STILL), axis=0)  # an encoder's jitter makes no other pose
    poses = min(len(still), len(np.unique(near_repeats(campaign))))  # nor do rows of one label
    unknown = len(unknown_frames(campaign))
    fewest = -(-(unknown + settings.SPARE_EQUATIONS) // components(campaign)) + 2
    if poses < fewest:
        raise EstimationError(
            f"{poses} different poses are too few: {unknown} unknowns of the frames need at least {fewest} of them, "
            "and effects many more"
        )


def fit_named(campaign: Campaign, effects: Sequence[Effect], progress: Callable[[str], None] = lambda _: None) -> Fit:
    """Fit the unknown frames and all of these effects, without model selection.

    An effect contained in another one and reported inside it (:attr:`Effect.told_inside`) is not fitted separately: it
    is among the fit's variants, where :func:`~thermal_robot.inference.inside.divided` finds it. Constants that are no
    linear parameters start at the most probable setting in all places. Raises :class:`EffectError` where the campaign
    lacks what an effect needs, or one breaks the contract; :class:`EstimationError` where poses are too few for the
    frames, or nothing is determined.
    """
    progress("unknown frames")
    require_enough(campaign)
    return _reweighted(campaign, lambda own: _named(own, effects, progress), progress)


def _named(campaign: Campaign, effects: Sequence[Effect], progress: Callable[[str], None]) -> Fit:
    """Fit the unknown frames and all of these effects at the noise that a campaign has of each kind."""
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
    nominal = start if frames_known(campaign) else observe(campaign, refined_frames(kept, start.frames, robust=False))
    before = Linear(nominal.gap, frame_columns(nominal)[0], ())
    families = tuple(effect.name for effect, _ in held)
    return Fit(campaign, nominal, before, observations, explanation, tuple(held), families, {}, variants)


def _exact(
    start: Observations, explanation: Explanation, progress: Callable[[str], None]
) -> tuple[Explanation, Observations, Held]:
    """Alternate exact refits and explanations until outliers stay and the noise hardly falls, or for a few rounds."""
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
    """Gauss-Newton refit from the values of the linear fit; from the former values if these cost less than that."""
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
    """Penalised sum of squares: residual over the noise, and values over their prior sizes."""
    noise = explanation.whitening.sigma() * explanation.best.noise
    left = (observations.gap / noise) ** 2 * explanation.whitening.weights[:, None]
    over = [(own / explanation.held(explanation.block_of(effect))) ** 2 for effect, own in held]
    return float(left.sum() + sum(own.sum() for own in over))


def _explained(
    observations: Observations, effects: Sequence[Effect], held: Held, before: Explanation | None = None
) -> Explanation:
    """Explanation by all of these effects: noise, scales, values and outliers, iterated to convergence.

    Starts at the weights and scales of a nearby explanation ``before``, if any.
    """
    noise = Noise.of(observations.campaign)
    linear = at_exact_model(observations, [block(observations, effect).held for effect in effects], held)
    # effects that are far off, and gross errors, are settled first, beside a noise that is free
    whitening = before.whitening if before else first_whitening(linear, noise)
    aside = before.outliers if before else np.zeros(len(linear.gap), dtype=bool)
    rounds, known = 0, before is not None
    best, flat = before.best if before else None, linear.frames.shape[2]
    while True:
        problem, rounds = gram(linear, whitening), rounds + 1
        best = Search(problem, [0.0] * len(effects)).evaluate(range(len(effects)), best)
        values = parameter_values(linear, problem, best)
        left = residual_of(linear, whitening, values)
        # the share of the equations that effects and frames take up
        leverage = float(min((best.effective + flat) / max(problem.equations + flat, 1), settings.MOST_LEVERAGE))
        then, later = reweigh(left, noise, leverage, linear.measures)
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
    """Most probable setting of each effect by coordinate search, with its constants refined."""
    if all(len(own) == 1 and len(gate.nearby(own[0], settings.REFINEMENT)) == 1 for own in settings_of):
        return [own[0] for own in settings_of]
    kept = Products(explanation.linear, explanation.whitening)
    chosen = list(explanation.linear.blocks)
    for k, own in enumerate(settings_of):
        rivals = [block(observations, setting).held for setting in own]
        scores = [weighed(kept, [*chosen[:k], rival, *chosen[k + 1 :]]) for rival in rivals]
        chosen[k] = rivals[int(np.argmax(scores))]
    return [item.effect for item in refined_blocks(kept, observations, chosen, settings.REFINEMENT)]
