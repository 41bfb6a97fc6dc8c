"""Deviations of parameters where what remains is no noise: by the jackknife over groups of rows that err alike.

The posterior takes what remains for noise that is independent from row to row. What no effect describes is not: it is
alike for neighbours in joint space, or in time, and many rows then say no more than a few. The jackknife over groups
asks the data instead (Efron and Stein, *Annals of Statistics* 9, 1981; for clusters, Cameron and Miller, *Journal of
Human Resources* 50, 2015): with θ_g fitted without group g of G,

    S = (G − 1)/G Σ_g (θ_g − θ̄)(θ_g − θ̄)ᵀ.

Along each principal axis v of the posterior covariance, in units of the prior deviations, what the data say is weighed
by the ratio of the two variances: 1/λ − 1 of posterior variance λ becomes (1/λ − 1) λ/(vᵀSv), never more than it was.
The prior keeps its weight.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from thermal_robot.diagnosis.one_walk import Model
from thermal_robot.inference import settings
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.rows import blocks, each, neighbourhoods

Array = NDArray[np.float64]
Rows = NDArray[np.bool_]


def as_groups_say(fit: Fit) -> Fit:
    """Widen the covariances of a fit to what regions of joint space, and blocks of time, say of its parameters.

    Returns
    -------
    Fit
        The same values, with deviations that are the same or larger.
    """
    e, campaign = fit.explanation, fit.campaign
    model = Model.of(e, blocks(campaign))
    groups = (model.block, neighbourhoods(campaign, settings.BLOCKS))
    moved = [_moved(model, each(labels)) for labels in groups]
    wider = dict(e.values)
    for b, span in zip(e.best.blocks, model.spans, strict=True):
        values, covariance = e.values[b]
        prior = e.linear.blocks[b].sizes * e.best.scales[b]
        parts = [own[:, span - model.flat] / prior for own in moved]
        wider[b] = values, np.outer(prior, prior) * _widened(covariance / np.outer(prior, prior), parts)
    return replace(fit, explanation=replace(e, values=wider))


def _moved(model: Model, groups: Sequence[Rows]) -> Array:
    """(G, P) how far the parameters are from their mean without each group, times √((G − 1)/G)."""
    known = [group for group in groups if model.determines(~group)]
    if len(known) < 2:
        return np.zeros((1, len(model.tight)))
    fits = np.stack(model.fits([~group for group in known], range(len(model.spans))))
    values = -fits[:, model.flat : -1]
    return np.asarray(np.sqrt((len(known) - 1) / len(known)) * (values - values.mean(axis=0)))


def _widened(covariance: Array, moved: Sequence[Array]) -> Array:
    """(P, P) covariance in units of the prior deviations, no axis narrower than any of the (G, P) deviations say."""
    variance, axes = np.linalg.eigh(covariance)
    variance = np.maximum(variance, settings.TINY)
    said = np.max([((own @ axes) ** 2).sum(axis=0) for own in moved], axis=0)
    times = np.maximum(said / variance, 1.0)
    wide = np.where(variance < 1.0, 1.0 / (1.0 + (1.0 / variance - 1.0) / times), variance)
    return np.asarray((axes * wide) @ axes.T)
