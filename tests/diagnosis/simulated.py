"""Linear problems with many candidates, of which some are at work, and fresh rows of the same kind."""

from dataclasses import replace
from itertools import combinations
from math import factorial

import numpy as np

from thermal_robot.diagnosis.cross_validation import Model
from thermal_robot.inference.columns import Block
from thermal_robot.inference.explain import explain, log_odds
from thermal_robot.inference.problem import Linear
from thermal_robot.inference.weights import Noise

WIDTHS = (1, 1, 2, 3, 5, 6, 12)
FRESH = 30
"""Fresh rows for each row of the campaign: what they say is then known six times better than what is claimed."""

CERTAIN = 1e4
"""Log prior odds that no evidence outweighs."""


def drawn(rng, rows, sizes=(0.5, 60.0), most=3):
    """A campaign of so many rows and fresh ones, in one order: nine frame columns, seven candidates, noise of one.

    Two of the candidates follow the course of time. Up to ``most`` are at work, each of a rms in ``sizes``.
    """
    total = rows * (1 + FRESH)
    time = np.sort(rng.uniform(size=total))
    frames = rng.uniform(-1.0, 1.0, (total, 3, 9))
    blocks = [rng.uniform(-1.0, 1.0, (total, 3, width)) for width in WIDTHS]
    for k in (1, 3):
        course = np.sin(time[:, None] * rng.uniform(1.0, 9.0, WIDTHS[k]) + rng.uniform(0.0, 6.0, WIDTHS[k]))
        blocks[k] *= course[:, None, :]
    gap = rng.normal(size=(total, 3)) + 30.0 * frames @ rng.normal(size=9)
    present = rng.permutation(len(WIDTHS))[: rng.integers(1, most + 1)]
    for b in present:
        moved = blocks[b] @ rng.normal(size=WIDTHS[b])
        gap += moved * np.exp(rng.uniform(*np.log(sizes))) / np.sqrt((moved**2).mean())
    own = np.isin(np.arange(total), rng.permutation(total)[:rows])
    kept, fresh = (
        Linear(gap[r], frames[r], tuple(Block(None, (), b[r], np.full(b.shape[2], 3.0)) for b in blocks))
        for r in (own, ~own)
    )
    return kept, fresh, set(present.tolist())


def explained(linear, stated=True):
    return explain(linear, Noise(1.0 if stated else None), log_prior=[log_odds()] * len(linear.blocks))


def on_fresh(explanation, block, fresh):
    """What the model shrinks fresh rows by, and each effect's Shapley share, with fits to all rows of the campaign."""
    model = Model.of(explanation, block)
    every, count = np.ones(len(block), dtype=bool), len(model.spans)
    held = [fresh.blocks[b].columns for b in explanation.best.blocks]
    stack = np.concatenate([fresh.frames, *held, fresh.gap[:, :, None]], axis=2)
    left = {}
    for size in range(count + 1):
        for chosen in combinations(range(count), size):
            moved = stack[:, :3, model.columns(chosen)] @ model.fits([every], chosen)[0]
            left[chosen] = float((moved**2).sum())
    shares = []
    for player in range(count):
        value = 0.0
        for chosen in (c for c in left if player not in c):
            weight = factorial(len(chosen)) * factorial(count - 1 - len(chosen)) / factorial(count)
            value += weight * (left[chosen] - left[tuple(sorted((*chosen, player)))])
        shares.append(value / left[()])
    return 1.0 - left[tuple(range(count))] / left[()], shares


def forced(known, item):
    """The same fit, said to hold one block more and no discrepancy: no evidence speaks against what a prior knows."""
    e = known.explanation
    linear = replace(e.linear, blocks=(*(e.linear.blocks[b] for b in e.best.blocks), item))
    families = tuple(b.effect.name for b in linear.blocks)
    every, noise = range(len(families)), Noise.of(known.campaign)
    said = explain(linear, noise, families=families, starts=[every], before=e, log_prior=[CERTAIN] * len(families))
    assert said.best.blocks == tuple(every)
    effects = tuple((b.effect, said.values[k][0]) for k, b in enumerate(linear.blocks))
    return replace(known, explanation=said, effects=effects, families=families)
