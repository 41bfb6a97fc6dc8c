"""Reparametrisation of a fitted effect by smaller effects that it contains.

A large effect has more parameters than the data determine. From an ordered list of combinations of them, each is kept
that the data determine in addition to those before it, until together they span the effect; the parameters of a
contained effect have no prior. For the geometry of robots such base parameters were given by Khalil, Gautier and
Enguehard (*Robotica* 9, 1991).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.effects import Effect, Parameter, gate
from thermal_robot.inference import settings
from thermal_robot.inference.columns import Block, moved_by
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.problem import Linear, gram


@dataclass(frozen=True, eq=False)
class Portion:
    """Part of a fitted effect that a contained effect accounts for, or the rest of it.

    (k,) value, posterior (``spread``) and ``prior`` standard deviation of each parameter, in its unit; ``unseen`` are
    those that are collinear, in these data, with the ones before or with the frames.
    """

    effect: str
    parameters: tuple[Parameter, ...]
    values: Array
    spread: Array
    prior: Array
    unseen: tuple[Parameter, ...]


def divided(fit: Fit, name: str) -> tuple[Portion, ...]:
    """Divide a fitted effect into contained effects and its rest; empty where it contains none.

    All parts together move the target as the effect does, but for the unknown frames.
    """
    number = next(k for k, (effect, _) in enumerate(fit.effects) if effect.name == name)
    effect, values = fit.effects[number]
    inside, rest = _inside(fit, effect), gate.independent(effect, fit.corrected)
    if not inside and not rest:
        return ()
    e, b = fit.explanation, fit.explanation.best.blocks[number]
    item = e.linear.blocks[b]
    listed = [(e.name, p) for e in inside for p in gate.checked(e, fit.corrected)] + [(name, p) for p in rest]
    of, wanted = zip(*listed, *((name, p) for p in item.parameters), strict=True)  # whatever the list does not do
    seen, across, within = _coordinates(fit, item, wanted)
    kept = distinct(across, within)
    free, sizes = np.array([of[k] != name for k in kept]), np.array([wanted[k].size for k in kept])
    covariance = seen.T @ (e.values[b][1] / np.outer(item.sizes, item.sizes)) @ seen
    told, covariance, prior = _without_prior_of(
        seen.T @ (values / item.sizes), covariance, e.best.scales[b], across[:, kept], free
    )
    figures = sizes * np.stack([told, np.sqrt(np.maximum(np.diag(covariance), 0.0)), prior])
    found = []
    for part in dict.fromkeys((*(e.name for e in inside), name)):
        mine = [k for k, number in enumerate(kept) if of[number] == part]
        unseen = (k for k in range(len(listed)) if of[k] == part and within[k] and k not in kept)
        value, spread, before = figures[:, mine]
        parameters = tuple(wanted[kept[k]] for k in mine)
        found.append(Portion(part, parameters, value, spread, before, tuple(wanted[k] for k in unseen)))
    return tuple(found)


def _without_prior_of(
    values: Array, covariance: Array, scale: float, across: Array, free: NDArray[np.bool_]
) -> tuple[Array, Array, Array]:
    """Posterior mean (k,), covariance (k, k) and prior deviations (k,) in new coordinates, some without prior.

    The likelihood follows from the posterior N(values, covariance) and the prior N(0, scale²). In the new coordinates,
    the columns of ``across``, free ones have a wide prior, the others the old one.
    """
    tight = np.linalg.inv(covariance)
    data = across.T @ (tight - np.eye(len(tight)) / scale**2) @ across
    posterior: Array = np.asarray(np.linalg.inv(data + np.diag((scale * np.where(free, settings.UNHELD, 1.0)) ** -2.0)))
    prior = scale * np.linalg.norm(np.linalg.pinv(across), axis=1)
    return np.asarray(posterior @ (across.T @ tight @ values)), posterior, np.asarray(prior)


def _inside(fit: Fit, effect: Effect) -> list[Effect]:
    """List the effects contained in an effect and reported within it, in all their places, unless fitted themselves."""
    first, held = [known[0] for known in fit.variants.values() if known], {e.name for e, _ in fit.effects}
    return [e for e in first if e.told_inside and effect.name in e.contained_in and e.name not in held]


def _coordinates(fit: Fit, item: Block, wanted: Sequence[Parameter]) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Basis (P, D) of an effect's determined directions, parameters projected on it (D, W), and a mask of the spanned.

    All in prior sizes. A parameter is spanned where its residual is a negligible share of it or below the noise.
    """
    e, sizes = fit.explanation, np.array([p.size for p in wanted])
    asked = Block(item.effect, tuple(wanted), moved_by(fit.corrected, wanted), sizes)
    problem = gram(Linear(e.linear.gap, e.linear.frames, (item, asked)), e.whitening)
    own, others = problem.slices
    cross = problem.matrix[own, others] @ problem.bases[1].T
    across = np.asarray(np.linalg.solve(problem.matrix[own, own], cross))
    length = np.einsum("wi,ij,wj->w", problem.bases[1], problem.matrix[others, others], problem.bases[1])
    left = length - (cross * across).sum(axis=0)
    return problem.bases[0], across, left < np.maximum(settings.CONTAINED * length, settings.CONTAINED_LEFT)


def identified(spread: Array, prior: Array) -> NDArray[np.bool_]:
    """Mask of the parameters whose posterior deviation is below a fixed share of the prior one (half)."""
    return np.asarray(np.asarray(spread) < settings.DETERMINED * np.asarray(prior))


def distinct(across: Array, within: NDArray[np.bool_], least: float = settings.DISTINCT) -> list[int]:
    """Gram-Schmidt selection: numbers of the columns of ``across`` (D, W) independent of those chosen before them.

    Taken in order are columns ``within`` whose orthogonal part is longer than ``least``, D at most.
    """
    basis = np.zeros((len(across), 0))
    kept: list[int] = []
    for k in np.flatnonzero(within):
        left = across[:, k] - basis @ (basis.T @ across[:, k])
        left = left - basis @ (basis.T @ left)  # rounding
        if len(kept) < len(across) and np.linalg.norm(left) > least:
            basis = np.column_stack([basis, left / np.linalg.norm(left)])
            kept.append(int(k))
    return kept
