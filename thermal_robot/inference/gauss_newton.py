"""The exact model of an explanation: Levenberg-Marquardt over frames and parameters, priors held at their scales."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.effects import Effect
from thermal_robot.effects.apply import displacement
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import whitener
from thermal_robot.inference.columns import block, frame_columns
from thermal_robot.inference.explain import Explanation
from thermal_robot.inference.frames import moved
from thermal_robot.inference.problem import Linear, whitened
from thermal_robot.observations import Frames, Observations, observe


def gauss_newton(
    campaign: Campaign,
    frames: Frames,
    explanation: Explanation,
    held: Sequence[tuple[Effect, Array]],
    settled: float,
    since: Sequence[tuple[Effect, Array]] | None = None,
) -> tuple[Observations, list[tuple[Effect, Array]]]:
    """Refit frames and parameters with the exact model by Gauss-Newton, the priors held at their scales.

    It begins at the (P,) values of a linear fit (``held``); where it then ends worse than ``since``, about which the
    explanation was linearised, it begins there. It ends at a step of ``settled`` standard deviations.
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
    """Return the corrected model and its effects after so many steps downhill at most, and what they cost."""
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
        gap = whitened(Linear(observations.gap, np.zeros((*observations.gap.shape, 0)), ()), beside)
        return float((gap**2).sum() + ((state / prior) ** 2).sum())

    observations = corrected_observations(campaign, frames, pairs(state))
    cost = left(observations, state)
    for _ in range(steps):
        flat, names = frame_columns(observations)
        items = tuple(block(observations, effect) for effect in effects)
        stack = whitened(Linear(observations.gap, flat, items), beside)
        for damping in settings.DAMPINGS:
            step, size = _step_inside(stack[:, :-1], stack[:, -1], state, prior, least, damping)
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


def _step_inside(
    design: Array, gap: Array, state: Array, prior: Array, least: Array, damping: float
) -> tuple[Array, float]:
    """Return the damped ridge step after which nothing is below its least, 0 or −∞: what would be is held at zero."""
    flat, held = design.shape[1] - len(prior), np.zeros(len(prior), dtype=bool)
    while True:
        step, size = _ridge_step(design, gap, state, np.where(held, settings.LEAST_HELD * prior, prior), damping)
        below = ~held & (state + step[flat:] < least)
        if not below.any():
            return step, size
        held |= below


def _ridge_step(design: Array, gap: Array, state: Array, prior: Array, damping: float) -> tuple[Array, float]:
    """Return the step that minimises |gap − design step|² + |(state + step)/prior|², and what it moves, in noise.

    The first columns have no prior. Directions that nothing determines are not moved. A step along directions that do
    nearly the same moves little, however long it is.
    """
    flat = design.shape[1] - len(prior)
    matrix, vector = design.T @ design, design.T @ gap
    matrix[np.arange(flat, len(matrix)), np.arange(flat, len(matrix))] += 1.0 / prior**2
    vector[flat:] -= state / prior**2
    matrix.ravel()[:: len(matrix) + 1] *= 1.0 + damping  # Levenberg and Marquardt
    root = whitener(matrix, settings.STEP_FLOOR)
    along = root.T @ vector
    return np.asarray(root @ along), float(np.linalg.norm(along))


def corrected_observations(campaign: Campaign, frames: Frames, pairs: Sequence[tuple[Effect, Array]]) -> Observations:
    """Observe with the effects at work; their responses are read from the nominal robot, as prediction reads them."""
    moved_by, instrument = displacement(observe(campaign, frames), pairs)
    return observe(campaign, frames, displacement=moved_by, instrument=instrument)
