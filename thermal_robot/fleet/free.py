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

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from thermal_robot.fleet import settings
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.problem import contained

Array = NDArray[np.float64]
Pairs = frozenset[frozenset[int]]


@dataclass(frozen=True)
class Free:
    """A parameter, free of its prior: name, SI value, one sigma, unit."""

    name: str
    value: float
    std: float
    unit: str


def free(fit: Fit) -> dict[str, tuple[Free, ...]]:
    """Return by effect its parameters as the data alone tell them, beside the other effects that are or may be at work.

    Parameters
    ----------
    fit
        The fit of a campaign.

    Returns
    -------
    dict
        Of every effect that was tried, in the setting that is first looked for, in all its places. Of its parameters
        those alone of which the data know more than the expected size says.
    """
    inside, likely = contained(fit.explanation.problem), _likely(fit)
    return {name: _alone(fit, name, inside, likely) for name in dict.fromkeys(fit.families)}


def _likely(fit: Fit) -> dict[str, int]:
    """Return by name the effects that were not found but may be at work: the most probable setting of each."""
    e = fit.explanation
    found = {fit.families[b] for b in e.best.blocks}
    others = [name for name in dict.fromkeys(fit.families) if name not in found]
    may_be = [name for name in others if fit.probability(name) >= settings.MAY_BE]
    return {name: max(fit.blocks_of(name), key=lambda b: e.probability([b])) for name in may_be}


def _alone(fit: Fit, name: str, inside: Pairs, likely: Mapping[str, int]) -> tuple[Free, ...]:
    e, own = fit.explanation, fit.blocks_of(name)[0]
    others = [b for b in e.best.blocks if fit.families[b] != name]
    others += [b for other, b in likely.items() if other != name and frozenset((b, own)) not in inside]
    problem = e.problem.some([own, *others])
    tight = np.zeros_like(problem.matrix)
    for k, (number, at) in enumerate(zip([own, *others], problem.slices, strict=True)):
        sizes = e.linear.blocks[number].sizes
        prior = np.full(len(sizes), 1.0 if k else settings.UNHELD)
        prior = e.held(number) / sizes if k and number in e.best.blocks else prior
        tight[at, at] = problem.bases[k].T @ (prior[:, None] ** -2.0 * problem.bases[k])
    covariance = np.linalg.inv(problem.matrix / e.best.noise**2 + tight)
    found = covariance @ problem.vector / e.best.noise**2
    at, basis, item = problem.slices[0], problem.bases[0], e.linear.blocks[own]
    values = basis @ found[at]
    spread = np.sqrt(np.einsum("pi,ij,pj->p", basis, covariance[at, at], basis))
    seen = np.einsum("pi,pi->p", basis, basis) > settings.SEEN
    listed = zip(item.bare, item.sizes, values, spread, seen & (spread < 1.0), strict=True)
    return tuple(Free(p.name, float(v * size), float(s * size), p.unit) for p, size, v, s, told in listed if told)
