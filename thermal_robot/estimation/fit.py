"""The whole estimation: frames, then effects jointly, then the exact model of the explanation by Gauss-Newton."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from thermal_robot.campaign import Campaign
from thermal_robot.effects import Effect
from thermal_robot.estimation.columns import block, displacement, frame_columns
from thermal_robot.estimation.explain import Explanation, Noise, explain
from thermal_robot.estimation.groups import neighbourhoods, spells
from thermal_robot.estimation.linear import Linear
from thermal_robot.estimation.register import moved, register
from thermal_robot.observations import Frames, Observations, observe

Array = NDArray[np.float64]

_STEPS = 12
_REVISIONS = 3


@dataclass(frozen=True, eq=False)
class Fit:
    """What was fitted, at the two places that a diagnosis compares.

    Attributes
    ----------
    campaign
        The data.
    nominal
        Observations of the nominal robot with its unknown frames fitted and nothing else.
    before
        Linear problem there.
    corrected
        Observations of the corrected model.
    explanation
        Effects, outliers, noise; linearised at the corrected model.
    effects
        Each effect of the explanation with its (P,) values.
    families
        Name of the effect that each block of the explanation belongs to.
    needs
        Effects that cannot be tested, and what they would need.
    """

    campaign: Campaign
    nominal: Observations
    before: Linear
    corrected: Observations
    explanation: Explanation
    effects: tuple[tuple[Effect, Array], ...]
    families: tuple[str, ...]
    needs: dict[str, tuple[str, ...]]


def fit(campaign: Campaign, effects: Sequence[Effect]) -> Fit:
    """Fit frames, choose effects, refit the choice exactly.

    Parameters
    ----------
    campaign
        With measurements.
    effects
        Candidates.

    Returns
    -------
    Fit
        Converged: another Gauss-Newton step would move nothing that can be measured.
    """
    noise = Noise(campaign.noise_position, campaign.noise_orientation)
    nominal = observe(campaign, register(campaign))
    needs = {e.name: missing for e in effects if (missing := e.missing(nominal))}
    candidates = [v for e in effects if e.name not in needs for v in e.variants(nominal)]
    families = tuple(v.name for v in candidates)
    linear = _linear(nominal, candidates)
    groups = row_groups(campaign)
    explanation = explain(linear, noise, families=families, groups=groups)
    nominal = observe(campaign, register(campaign, ~explanation.outliers))
    before = Linear(nominal.gap, frame_columns(nominal)[0], ())
    observations, values = nominal, [np.zeros(len(b.parameters)) for b in linear.blocks]
    for _ in range(_REVISIONS):
        chosen = explanation.best.blocks
        observations, frames, values = _gauss_newton(nominal, observations.frames, explanation, values)
        blocks = tuple(block(observations, c) for c in candidates)
        gap = observations.gap + sum(
            (blocks[b].columns @ values[b] for b in chosen), np.zeros_like(observations.gap)
        )
        explanation = explain(
            Linear(gap, frame_columns(observations)[0], blocks),
            noise,
            families=families,
            start=chosen,
            outliers=explanation.outliers,
            groups=groups,
        )
        if explanation.best.blocks == chosen:
            break
    observations, _, values = _gauss_newton(nominal, observations.frames, explanation, values)
    found = tuple((candidates[b], values[b]) for b in explanation.best.blocks)
    return Fit(campaign, nominal, before, observations, explanation, found, families, needs)


def row_groups(campaign: Campaign) -> tuple[NDArray[np.int64], ...]:
    """Return the groupings within which a remainder may be alike: spells of time and neighbourhoods of poses."""
    count = max(campaign.samples // 5, 2) if campaign.samples < 300 else 60
    return spells(campaign, count), neighbourhoods(campaign, count)


def _linear(observations: Observations, candidates: Sequence[Effect]) -> Linear:
    blocks = tuple(block(observations, c) for c in candidates)
    return Linear(observations.gap, frame_columns(observations)[0], blocks)


def _gauss_newton(
    nominal: Observations, frames: Frames, explanation: Explanation, values: list[Array]
) -> tuple[Observations, Frames, list[Array]]:
    """Refit frames and the explanation's parameters with the exact model, the priors held at their scales."""
    campaign, whitening = nominal.campaign, explanation.whitening
    chosen = explanation.best.blocks
    candidates = [explanation.linear.blocks[b] for b in chosen]
    prior = np.concatenate([b.sizes * explanation.best.scales[k] for k, b in zip(chosen, candidates, strict=True)] or [[]])
    state = np.concatenate([explanation.values[k][0] for k in chosen] or [np.zeros(0)])
    noise = whitening.noise * explanation.best.noise
    used = np.flatnonzero(whitening.weights > 0)
    root = (np.sqrt(whitening.weights[used])[:, None] / noise).ravel()
    observations = nominal
    for _ in range(_STEPS):
        split = np.split(state, np.cumsum([len(b.parameters) for b in candidates])[:-1]) if candidates else []
        pairs = [(b.effect, v) for b, v in zip(candidates, split, strict=True)]
        observations = _corrected(campaign, frames, nominal, pairs)
        flat, names = frame_columns(observations)
        columns = [block(observations, b.effect).columns for b in candidates]
        design = np.concatenate([flat, *columns], axis=2)[used].reshape(len(root), -1) * root[:, None]
        step, size = _ridge_step(design, observations.gap[used].ravel() * root, state, prior)
        frames = moved(frames, step[: len(names)], names)
        state = state + step[len(names) :]
        if size < 1e-6:
            break
    split = np.split(state, np.cumsum([len(b.parameters) for b in candidates])[:-1]) if candidates else []
    pairs = [(b.effect, v) for b, v in zip(candidates, split, strict=True)]
    for b, v in zip(chosen, split, strict=True):
        values[b] = v
    return _corrected(campaign, frames, nominal, pairs), frames, values


def _ridge_step(design: Array, gap: Array, state: Array, prior: Array) -> tuple[Array, float]:
    """Return the step that minimises |gap − design step|² + |(state + step)/prior|², and its length in noise.

    The first columns have no prior. Directions that nothing determines are not moved.
    """
    flat = design.shape[1] - len(prior)
    matrix, vector = design.T @ design, design.T @ gap
    matrix[np.arange(flat, len(matrix)), np.arange(flat, len(matrix))] += 1.0 / prior**2
    vector[flat:] -= state / prior**2
    length = np.sqrt(np.diag(matrix)) + 1e-300
    value, basis = np.linalg.eigh(matrix / np.outer(length, length))
    seen = value > 1e-13 * value.max(initial=0.0)
    step = basis[:, seen] @ ((basis[:, seen].T @ (vector / length)) / value[seen])
    return step / length, float(np.abs(step).max(initial=0.0))


def _corrected(
    campaign: Campaign, frames: Frames, nominal: Observations, pairs: Sequence[tuple[Effect, Array]]
) -> Observations:
    moved_by, instrument = displacement(observe(campaign, frames), pairs)
    return observe(campaign, frames, displacement=moved_by, instrument=instrument)
