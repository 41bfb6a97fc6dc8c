"""Model selection at the exact fit: choose effects, refine their constants, refit, and choose once again.

A third choice would be among refined copies of the first two: on real robots it finds more effects, fewer of which hold
out of sample.

The exact fit is by Levenberg-Marquardt over frames and parameters, at fixed prior scales. Nonlinear constants, such as
a lag, are refined by coordinate search on the evidence.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.effects import Effect, gate
from thermal_robot.effects.apply import displacement
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import whitener
from thermal_robot.inference.columns import Block, block, frame_columns, hidden_joints
from thermal_robot.inference.evidence import Combination, Gram
from thermal_robot.inference.explain import Explanation, explain, log_odds
from thermal_robot.inference.kernels import discrepancy_kernels
from thermal_robot.inference.problem import Linear, Products, Whitening, parameter_values, products, whitened_columns
from thermal_robot.inference.registration import moved
from thermal_robot.inference.search import Search
from thermal_robot.inference.weights import Noise, huber_weight
from thermal_robot.observations import Frames, Observations, observe


def gauss_newton(
    campaign: Campaign,
    frames: Frames,
    explanation: Explanation,
    held: Sequence[tuple[Effect, Array]],
    settled: float,
    since: Sequence[tuple[Effect, Array]] | None = None,
) -> tuple[Observations, list[tuple[Effect, Array]]]:
    """Refit frames and parameters of the nonlinear model by Gauss-Newton, with fixed prior scales.

    Starts at the (P,) values of a linear fit (``held``); if the result is worse than ``since``, the linearisation
    point, it starts there instead. Ends at a step of ``settled`` standard deviations.
    """
    observations, found, cost = _descended(campaign, frames, explanation, held, settled, settings.FIT_STEPS)
    if since is not None:
        known = {(effect.name, effect.places, len(values)): values for effect, values in since}
        begun = [(e, known.get((e.name, e.places, len(values)), np.zeros(len(values)))) for e, values in held]
        if _descended(campaign, frames, explanation, begun, settled, 0)[2] < cost:
            observations, found, _ = _descended(campaign, frames, explanation, begun, settled, settings.FIT_STEPS)
    return observations, found


def _descended(
    campaign: Campaign,
    frames: Frames,
    explanation: Explanation,
    held: Sequence[tuple[Effect, Array]],
    settled: float,
    steps: int,
) -> tuple[Observations, list[tuple[Effect, Array]], float]:
    """Levenberg-Marquardt descent of at most ``steps`` steps; return corrected model, effects with values, and cost.

    The cost is the sum of squares of the whitened gap and of the values over their prior deviations.
    """
    whitening, best = explanation.whitening, explanation.best
    effects = [effect for effect, _ in held]
    chosen = [explanation.block_of(effect) for effect in effects]
    sizes, sides = [explanation.held(b) for b in chosen], [explanation.linear.blocks[b].positive for b in chosen]
    least = np.where(np.concatenate([*sides, np.zeros(0, dtype=bool)]), 0.0, -np.inf)
    ends = np.cumsum([len(size) for size in sizes])[:-1]
    prior = np.concatenate([*sizes, np.zeros(0)])
    state = np.concatenate([*(values for _, values in held), np.zeros(0)])
    beside = replace(whitening, noise=whitening.noise * best.noise)

    def pairs(state: Array) -> list[tuple[Effect, Array]]:
        return list(zip(effects, np.split(state, ends), strict=True)) if effects else []

    def left(observations: Observations, state: Array) -> float:
        gap = whitened_columns(observations.gap[:, :, None], beside)
        return float((gap**2).sum() + ((state / prior) ** 2).sum())

    observations = corrected_observations(campaign, frames, pairs(state))
    cost = left(observations, state)
    for _ in range(steps):
        flat, names = frame_columns(observations)
        items = tuple(block(observations, effect) for effect in effects)
        full = products(Linear(observations.gap, flat, items), beside)
        for damping in settings.DAMPINGS:
            step, size = _step_inside(full, state, prior, least, damping)
            tried = moved(frames, step[: len(names)], names), np.maximum(state + step[len(names) :], least)
            there = corrected_observations(campaign, tried[0], pairs(tried[1]))
            if (after := left(there, tried[1])) <= cost or size < settled:
                break
        else:
            break
        (frames, state), observations, cost = tried, there, after
        if size < settled:
            break
    return observations, pairs(state), cost


def _step_inside(products: Array, state: Array, prior: Array, least: Array, damping: float) -> tuple[Array, float]:
    """Damped ridge step from ``state`` with lower bounds ``least``, 0 or −∞: what would cross one is held at 0."""
    flat, held = len(products) - 1 - len(prior), np.zeros(len(prior), dtype=bool)
    while True:
        step, size = _ridge_step(products, state, np.where(held, settings.LEAST_HELD * prior, prior), damping)
        below = ~held & (state + step[flat:] < least)
        if not below.any():
            return step, size
        held |= below


def _ridge_step(products: Array, state: Array, prior: Array, damping: float) -> tuple[Array, float]:
    """Ridge step that minimises |gap − design step|² + |(state + step)/prior|², and its length in posterior deviations.

    ``products`` is the Gram matrix of the design's columns and the gap, the last. The first columns have no prior.
    Undetermined directions are not moved.
    """
    matrix, vector = products[:-1, :-1].copy(), products[:-1, -1].copy()
    flat = len(matrix) - len(prior)
    matrix[np.arange(flat, len(matrix)), np.arange(flat, len(matrix))] += 1.0 / prior**2
    vector[flat:] -= state / prior**2
    matrix.ravel()[:: len(matrix) + 1] *= 1.0 + damping  # Levenberg and Marquardt
    root = whitener(matrix, settings.STEP_FLOOR)
    along = root.T @ vector
    return np.asarray(root @ along), float(np.linalg.norm(along))


def corrected_observations(campaign: Campaign, frames: Frames, pairs: Sequence[tuple[Effect, Array]]) -> Observations:
    """Observe the robot displaced by effects with values (P,); their responses are those at the nominal robot."""
    moved_by, instrument = displacement(observe(campaign, frames), pairs)
    return observe(campaign, frames, displacement=moved_by, instrument=instrument)


def refined(explanation: Explanation, observations: Observations, factor: float) -> list[tuple[Effect, Array]]:
    """Maximise the evidence over the constants of the chosen effects by coordinate search.

    For each effect in turn, neighbouring settings are tried; if none gains 0.1 nat, the logarithm of ``factor`` (above
    1) is halved, until a parabola through them predicts no gain. Outliers are down-weighted instead of left out, as a
    wrong constant makes outliers of the very rows that determine it. Returns the effects with their (P,) values.
    """
    kept = Products(explanation.linear, downweighted(explanation))
    blocks = [explanation.linear.blocks[b].held for b in explanation.best.blocks]
    values = [explanation.values[b][0] for b in explanation.best.blocks]
    moved = refined_blocks(kept, observations, blocks, factor)
    if moved != blocks:
        linear, problem, found = _evaluated(kept, moved)
        values = [mean for mean, _ in parameter_values(linear, problem, found).values()]
    return [(item.effect, mean) for item, mean in zip(moved, values, strict=True)]


def refined_blocks(kept: Products, observations: Observations, blocks: Sequence[Block], factor: float) -> list[Block]:
    """One sweep of coordinate search: maximise the evidence over the nonlinear constants of each block in turn."""
    moved = list(blocks)
    for place, item in enumerate(blocks):
        if _has_constants(item, factor):
            moved[place] = _refined_block(kept, observations, moved, place, factor)
    return moved


def _has_constants(item: Block, factor: float) -> bool:
    """Whether the effect of a block proposes settings near its own, so that it has nonlinear constants to refine."""
    return len(gate.nearby(item.effect, factor)) > 1


def weighed(kept: Products, blocks: Sequence[Block]) -> float:
    """Log evidence of a combination of effects plus log prior odds; a constant of its own counts as an effect."""
    priors = log_odds() * sum(1.0 + item.effect.apart for item in blocks)
    return _evaluated(kept, blocks)[2].log_evidence + priors


def downweighted(explanation: Explanation) -> Whitening:
    """Whitening in which outliers have Huber weights instead of zero; as it is where it has a smooth discrepancy.

    A per-pose discrepancy is removed from it first, as it would absorb the residual of a slightly wrong constant.
    """
    whitening, aside, kernel = explanation.whitening, explanation.outliers, explanation.discrepancy.kernel
    if kernel is not None and kernel.grouped:
        whitening = replace(whitening, smooth=None)
    if whitening.smooth is not None or not aside.any():
        return whitening
    noise = whitening.sigma() * explanation.best.noise
    distance2 = ((explanation.remainder / noise) ** 2).sum(axis=1)
    return replace(
        whitening,
        weights=np.where(aside, huber_weight(distance2, whitening.figures(noise.shape[1])), whitening.weights),
    )


def _refined_block(
    kept: Products, observations: Observations, blocks: Sequence[Block], place: int, factor: float
) -> Block:
    """Hill climbing of the evidence over the nonlinear constants of one effect, the others fixed; return its block."""
    item, before, after = blocks[place], blocks[:place], blocks[place + 1 :]
    seen: dict[Effect, float] = {}

    def evidence(own: Block) -> float:
        if own.effect not in seen:
            seen[own.effect] = _evaluated(kept, [*before, own, *after])[2].log_evidence
        return seen[own.effect]

    for _ in range(settings.REFINED_TRIES):
        near = [block(observations, e) for e in gate.nearby(item.effect, factor) if e != item.effect]
        near = [n for n in near if len(n.sizes) == len(item.sizes)]
        if not near:
            break
        more = [evidence(n) - evidence(item) for n in near]
        # one that stands apart is as rare as an effect, however close it is
        gains = [own + log_odds() * (n.effect.apart - item.effect.apart) for n, own in zip(near, more, strict=True)]
        best = int(np.argmax(gains))
        if gains[best] > settings.REFINED_GAIN:
            item = near[best].held
            continue
        apart = gate.nearby(item.effect, 1.0)  # settings that do not come closer
        if all(own > -settings.REFINED_FLAT for n, own in zip(near, more, strict=True) if n.effect not in apart):
            break
        factor = float(np.sqrt(factor))
    return item


def _evaluated(kept: Products, blocks: Sequence[Block]) -> tuple[Linear, Gram, Combination]:
    """Evidence of the combination of all these blocks, without prior odds; its linear problem and normal equations."""
    linear, problem = kept.problem(blocks)
    return linear, problem, Search(problem, [0.0] * len(blocks)).evaluate(range(len(blocks)))


@dataclass(frozen=True, eq=False)
class ExactSelection:
    """Selected effects ``held`` with their values (P,), and the explanation linearised at their exact model.

    ``families`` names the effect that each block of the explanation belongs to.
    """

    observations: Observations
    explanation: Explanation
    held: tuple[tuple[Effect, Array], ...]
    families: tuple[str, ...]


def select_exactly(
    start: Observations,
    variants: dict[str, tuple[Effect, ...]],
    progress: Callable[[str], None],
    *,
    held: Sequence[tuple[Effect, Array]] = (),
    before: Explanation | None = None,
    starts: Sequence[Sequence[Effect]] = (),
) -> ExactSelection:
    """Model selection, repeated once at the exact fit of what it selects, with refined constants.

    Starts at ``start``, the exact model of the effects ``held`` with their values, and at the weights of the
    explanation ``before``. The first search starts from each of the ``starts``, by default from the effects held.
    """
    campaign, observations, held = start.campaign, start, list(held)
    begun = list(dict.fromkeys(effect for one in starts for effect in one))
    whole = dict(variants)
    whole.update({e.name: tuple(dict.fromkeys((*whole[e.name], e))) for e in begun})
    variants = dict(whole)
    for effect, _ in held:
        if effect.name in variants:
            rivals = _alternatives(effect, start, whole[effect.name])
            variants[effect.name] = tuple(dict.fromkeys((*variants[effect.name], effect, *rivals)))
    noise = Noise.of(campaign)
    for again in (False, True):
        progress("selection at the exact fit" if again else "combinations of effects")
        listed = [effect for effect, _ in held if effect.name in variants]
        blocks = tuple(_testable_blocks(variants, observations, (*begun, *listed)))
        candidates, families = [b.effect for b in blocks], tuple(b.effect.name for b in blocks)
        chosen = [candidates.index(effect) for effect in listed]
        seeds = [chosen] if again or not starts else [[candidates.index(e) for e in one] for one in starts]
        linear = at_exact_model(observations, blocks, held)
        explanation = explain(
            linear, noise, families=families, starts=seeds, before=before, kernels=discrepancy_kernels(observations)
        )
        since = held
        held = [(candidates[b], explanation.values[b][0]) for b in explanation.best.blocks]
        finer = held if again else refined(explanation, observations, settings.REFINEMENT)
        stays = [e for e, _ in finer] == [e for e, _ in held] and set(explanation.best.blocks) == set(chosen)
        held, last = finer, again or (before is not None and stays)
        least = settings.SETTLED if last else settings.SETTLED_BETWEEN
        observations, held = gauss_newton(campaign, observations.frames, explanation, held, least, since)
        if last:
            break
        before = explanation = replace(explanation, searched=None)  # the next search takes as much memory
        for effect, _ in held:
            b = explanation.block_of(effect)
            leading = _leading(effect, blocks[b], explanation.values[b][0])
            others = _alternatives(effect, start, whole[effect.name])
            near = gate.nearby(effect, settings.REFINEMENT)
            variants[effect.name] = tuple(dict.fromkeys((*near, *leading, *others)))
    return ExactSelection(observations, explanation, tuple(held), families)


def at_exact_model(observations: Observations, blocks: Sequence[Block], held: Sequence[tuple[Effect, Array]]) -> Linear:
    """Linear problem at the exact model; the displacement by its own effects is added back to the gap."""
    moved = (block(observations, effect).columns @ values for effect, values in held)
    gap = observations.gap + sum(moved, np.zeros_like(observations.gap))
    return Linear(gap, frame_columns(observations)[0], tuple(blocks))


def _leading(chosen: Effect, item: Block, values: Array) -> Iterator[Effect]:
    """Yield an all-places setting restricted to the two, three and more places with the largest fitted displacement."""
    if chosen.places or chosen.share is not None:
        return
    every = gate.places_of(item.parameters)
    of = np.array([parameter.place for parameter in item.parameters])
    columns = item.columns
    moved = [float(np.linalg.norm(columns[:, :, of == place] @ values[of == place])) for place in every]
    most = sorted(every, key=lambda place: -moved[every.index(place)])
    for count in range(2, min(len(every), settings.LEADING_PLACES + 1)):
        yield replace(chosen, places=tuple(place for place in every if place in most[:count]))


def _alternatives(chosen: Effect, observations: Observations, settings_of: Sequence[Effect]) -> Iterator[Effect]:
    """Yield the alternatives of a setting that compete with it while its constants are refined.

    These are: one place more, less or exchanged, single places, all places, and other settings of its places. Of a law,
    all laws compared with it.
    """
    if chosen.share is not None:
        yield from settings_of
        return
    every = [alone.places[0] for alone in gate.alone(replace(chosen, places=()), observations)]
    own = set(chosen.places)
    fewer = [own - {place} for place in chosen.places] if len(own) > 1 else []
    more = [kept | {place} for kept in (own, *fewer) for place in every if own and place not in own]
    for places in (*more, *fewer):
        yield replace(chosen, places=tuple(place for place in every if place in places))
    yield replace(chosen, places=())
    yield from gate.alone(replace(chosen, places=()), observations)
    for setting in (setting for setting in settings_of if not setting.places):
        if set(chosen.places) <= set(gate.places_of(gate.checked(setting, observations))):
            yield replace(setting, places=chosen.places)
        yield from (alone for place in chosen.places if (alone := gate.at(setting, place, observations)) is not None)


def _testable_blocks(
    variants: dict[str, tuple[Effect, ...]], observations: Observations, kept: Sequence[Effect]
) -> Iterator[Block]:
    """Yield the blocks of all settings but those that the data or the unknown frames leave undetermined.

    Left out are constant effects in a joint that the frames absorb, or on a link outside the moving chain, and settings
    of several places of which one moves nothing. Those ``kept`` stay in any case.
    """
    hidden, segments = {*hidden_joints(observations)}, observations.robot.segments
    # before the first joint a segment is the base, behind the last one the tool
    hidden |= {s.parent_link for s in segments} - {s.parent_link for s in segments[1:] if s.movable}
    every = [setting for own in variants.values() for setting in own]
    for setting in every:
        if setting in kept or not (hidden & set(setting.places) and constant(setting, observations)):
            item = block(observations, setting)
            if setting in kept or _all_places_visible(item):
                yield item


def _all_places_visible(item: Block) -> bool:
    """Whether every place of a setting in several places has a column above rounding, relative to the longest."""
    places = item.effect.places if len(item.effect.places) > 1 else ()
    if not places:
        return True
    length = np.linalg.norm(item.columns, axis=(0, 1)) * item.sizes
    of = np.array([parameter.place for parameter in item.parameters])
    return all(length[of == place].max(initial=0.0) > settings.ALIAS * length.max() for place in places)


def constant(effect: Effect, observations: Observations) -> bool:
    """Whether an effect is constant: all its responses are the same in every row."""
    responses = [r for p in gate.checked(effect, observations) for r in p.responses]
    return all(r.values.ndim == (0 if r.channel == "joint" else 1) for r in responses)
