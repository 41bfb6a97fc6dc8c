"""Constants of effects that are no linear parameters, such as a lag: moved until the evidence gains nothing more."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.effects import Effect, gate
from thermal_robot.inference import settings
from thermal_robot.inference.columns import Block, block
from thermal_robot.inference.evidence import Combination, Gram
from thermal_robot.inference.explain import Explanation, log_odds
from thermal_robot.inference.problem import Linear, Products, Whitening, parameter_values
from thermal_robot.inference.robust import tail_weight
from thermal_robot.inference.search import Search
from thermal_robot.observations import Observations


def refined(explanation: Explanation, observations: Observations, factor: float) -> list[tuple[Effect, Array]]:
    """Move the constants of chosen effects to where the evidence is largest, by coordinate search.

    Of one effect after another settings nearby are tried. Where none is better by 0.1 nat they move closer, the
    logarithm of ``factor`` (above 1) halved, until a parabola through them promises no more. Rows set aside are heard
    with the weight of their distance, as a constant that is off puts aside just the rows that tell of it. Returns
    the effects with their (P,) values.
    """
    kept = Products(explanation.linear, heard(explanation))
    blocks = [explanation.linear.blocks[b].held for b in explanation.best.blocks]
    values = [explanation.values[b][0] for b in explanation.best.blocks]
    moved = constants_moved(kept, observations, blocks, factor)
    if moved != blocks:
        linear, problem, found = _evaluated(kept, moved)
        values = [mean for mean, _ in parameter_values(linear, problem, found).values()]
    return [(item.effect, mean) for item, mean in zip(moved, values, strict=True)]


def constants_moved(kept: Products, observations: Observations, blocks: Sequence[Block], factor: float) -> list[Block]:
    """Return the blocks with the constants of each moved in turn."""
    moved = list(blocks)
    for place, item in enumerate(blocks):
        if _movable(item, factor):
            moved[place] = _moved(kept, observations, moved, place, factor)
    return moved


def _movable(item: Block, factor: float) -> bool:
    """Whether the block's effect has constants to move, or is shared in other ways."""
    return len(gate.nearby(item.effect, factor)) > 1


def weighed(kept: Products, blocks: Sequence[Block]) -> float:
    """Return the log evidence of these effects with the prior odds of each."""
    priors = log_odds() * sum(1.0 + item.effect.apart for item in blocks)
    return _evaluated(kept, blocks)[2].log_evidence + priors


def heard(explanation: Explanation) -> Whitening:
    """Return the whitening in which rows set aside have a weight; what rows have in common is known of the others.

    What is anew in every pose counts for nothing: a constant that is a little off leaves just that.
    """
    whitening, aside, form = explanation.whitening, explanation.outliers, explanation.discrepancy.form
    if form is not None and form.anew:
        whitening = replace(whitening, smooth=None)
    if whitening.smooth is not None or not aside.any():
        return whitening
    noise = whitening.sigma() * explanation.best.noise
    distance2 = ((explanation.remainder / noise) ** 2).sum(axis=1)
    return replace(whitening, weights=np.where(aside, tail_weight(distance2, noise.shape[1]), whitening.weights))


def _moved(kept: Products, observations: Observations, blocks: Sequence[Block], place: int, factor: float) -> Block:
    """Return the block at one place with the setting of its effect that nothing nearby betters."""
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
    """Evaluate these blocks together and no others."""
    linear, problem = kept.problem(blocks)
    return linear, problem, Search(problem, [0.0] * len(blocks)).evaluate(range(len(blocks)))
