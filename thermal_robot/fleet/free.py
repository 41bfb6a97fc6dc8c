"""What an effect would be in a campaign if it were at work in all its places, whether it was found there or not.

A fleet cannot be judged by the parameters of the robots in which an effect was found: those are the large ones, and an
effect too small to be found in any robot may be at work in all. So every campaign tells every parameter of every effect
that it can test, beside the effects that were found, as the data alone say it: with G the products of the columns, the
frames projected out, s the noise, and Λ the priors of the others,

    θ = (G/s² + Λ⁻¹)⁻¹ b/s²,

Λ⁻¹ next to nothing for the effect in question, and no parameter held positive. Such estimates scatter about the truth,
and their mean over a fleet does, too.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from thermal_robot.fleet import settings
from thermal_robot.inference.fit import Fit

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Free:
    """A parameter, free of its prior: name, SI value, one sigma, unit."""

    name: str
    value: float
    std: float
    unit: str


def free(fit: Fit, name: str) -> tuple[Free, ...]:
    """Return the parameters of an effect as the data alone tell them, beside the other effects that were found.

    Parameters
    ----------
    fit
        The fit of a campaign.
    name
        The effect; in the setting that is first looked for, in all its places.

    Returns
    -------
    tuple of Free
        Those alone of which the data know more than the expected size says; empty for an effect that was not tried.
    """
    blocks = fit.blocks_of(name)
    if not blocks:
        return ()
    e, own = fit.explanation, blocks[0]
    others = [b for b in e.best.blocks if fit.families[b] != name]
    problem = e.problem.some([own, *others])
    tight = np.zeros_like(problem.matrix)
    for k, (number, at) in enumerate(zip([own, *others], problem.slices, strict=True)):
        sizes = e.linear.blocks[number].sizes
        prior = np.full(len(sizes), settings.UNHELD) if not k else e.held(number) / sizes
        tight[at, at] = problem.bases[k].T @ (prior[:, None] ** -2.0 * problem.bases[k])
    covariance = np.linalg.inv(problem.matrix / e.best.noise**2 + tight)
    found = covariance @ problem.vector / e.best.noise**2
    at, basis, item = problem.slices[0], problem.bases[0], e.linear.blocks[own]
    values = basis @ found[at]
    spread = np.sqrt(np.einsum("pi,ij,pj->p", basis, covariance[at, at], basis))
    seen = np.einsum("pi,pi->p", basis, basis) > settings.SEEN
    parameters = zip(item.parameters, item.sizes, values, spread, seen, strict=True)
    return tuple(
        Free(p.name, float(v * size), float(s * size), p.unit) for p, size, v, s, is_seen in parameters if is_seen and s < 1.0
    )
