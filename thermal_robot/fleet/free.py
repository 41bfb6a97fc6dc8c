"""What an effect would be in a campaign if it were at work in all its places, whether it was found there or not.

A fleet cannot be judged by the parameters of the robots in which an effect was found: those are the large ones, and an
effect too small to be found in any robot may be at work in all. So every campaign tells every parameter of every effect
that it can test, beside the effects that were found and those that may be at work, as the data alone say it: with G the
products of the columns, the frames projected out, s the noise, and Λ the priors of the others,

    θ = (G/s² + Λ⁻¹)⁻¹ b/s²,

Λ⁻¹ next to nothing for the effect in question, and no parameter held positive. Such estimates scatter about the truth,
and their mean over a fleet does, too. What is not found but may be at work has its prior of expected size: left out,
it would be told as something else's, in all robots alike.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from thermal_robot.effects import choose, gate
from thermal_robot.fleet import settings
from thermal_robot.inference.columns import Block, block
from thermal_robot.inference.evidence import Gram
from thermal_robot.inference.explain import Explanation
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.problem import Linear, contained, gram


@dataclass(frozen=True)
class Free:
    """A parameter, free of its prior: name, SI value, one sigma, unit."""

    name: str
    value: float
    std: float
    unit: str


def free(fit: Fit, names: Iterable[str] = ()) -> dict[str, tuple[Free, ...]]:
    """Return by effect its parameters as the data alone tell them, beside the other effects that are or may be at work.

    Parameters
    ----------
    fit
        The fit of a campaign.
    names
        Of effects of the library that were tried, but taken out again: they are told, too.

    Returns
    -------
    dict
        Of every effect that was tried, in the setting that is first looked for, in all its places. Of its parameters
        those alone of which the data know more than the expected size says.
    """
    e, likely = fit.explanation, _likely(fit)
    own = {name: _everywhere(fit, name) for name in dict.fromkeys(fit.families)}
    further = _further(fit, [name for name in names if name not in own])
    linear, problem = e.linear, e.problem
    if further:
        own |= {item.effect.name: len(linear.blocks) + k for k, item in enumerate(further)}
        linear = Linear(linear.gap, linear.frames, (*linear.blocks, *further))
        problem = gram(linear, e.whitening)
    inside = contained(problem)
    told = {}
    for name, number in own.items():
        others = [b for b in e.best.blocks if fit.families[b] != name]
        others += [b for other, b in likely.items() if other != name and frozenset((b, number)) not in inside]
        told[name] = _alone(e, linear, problem, [number, *others])
    return told


def _everywhere(fit: Fit, name: str) -> int:
    """Return the block of an effect in all its places; where none is among those that were compared, the first."""
    blocks = fit.blocks_of(name)
    return next((b for b in blocks if not fit.explanation.linear.blocks[b].effect.places), blocks[0])


def _further(fit: Fit, names: Iterable[str]) -> list[Block]:
    """Return the columns of effects that are no longer part of the problem, in the setting that is first looked for."""
    known = {effect.name: effect for effect in choose()}
    settings_of = (gate.variants(known[name], fit.nominal) for name in names if name in known)
    return [block(fit.corrected, variants[0]) for variants in settings_of if variants]


def _likely(fit: Fit) -> dict[str, int]:
    """Return by name the effects that were not found but may be at work: the most probable setting of each."""
    e = fit.explanation
    found = {fit.families[b] for b in e.best.blocks}
    others = [name for name in dict.fromkeys(fit.families) if name not in found]
    may_be = [name for name in others if fit.probability(name) >= settings.MAY_BE]
    return {name: max(fit.blocks_of(name), key=lambda b: e.probability([b])) for name in may_be}


def _alone(e: Explanation, linear: Linear, problem: Gram, blocks: Sequence[int]) -> tuple[Free, ...]:
    """Return the parameters of the first of some blocks, free of its prior, the others held to theirs."""
    problem = problem.some(blocks)
    tight = np.zeros_like(problem.matrix)
    for k, (number, at) in enumerate(zip(blocks, problem.slices, strict=True)):
        sizes = linear.blocks[number].sizes
        prior = np.full(len(sizes), 1.0 if k else settings.UNHELD)
        prior = e.held(number) / sizes if k and number in e.best.blocks else prior
        tight[at, at] = problem.bases[k].T @ (prior[:, None] ** -2.0 * problem.bases[k])
    covariance = np.linalg.inv(problem.matrix / e.best.noise**2 + tight)
    found = covariance @ problem.vector / e.best.noise**2
    at, basis, item = problem.slices[0], problem.bases[0], linear.blocks[blocks[0]]
    values = basis @ found[at]
    spread = np.sqrt(np.einsum("pi,ij,pj->p", basis, covariance[at, at], basis))
    seen = np.einsum("pi,pi->p", basis, basis) > settings.SEEN
    listed = zip(item.bare, item.sizes, values, spread, seen & (spread < 1.0), strict=True)
    return tuple(Free(p.name, float(v * size), float(s * size), p.unit) for p, size, v, s, told in listed if told)
