"""Deviations of parameters where what remains is no noise: what it does to them, by the discrepancy and by groups.

The posterior takes what remains for noise that is independent from row to row. What no effect describes is not: it is
alike for neighbours in joint space, or in time, and many rows then say no more than a few. Two figures tell how far the
parameters may be off for that.

* The smooth discrepancy that was found beside the effects: V = s²(1 + τ²K) is the covariance of the rows. Effects are
  fitted as if there were none, θ̂ = A Xᵀy/σ² with A = (XᵀX/σ² + Λ⁻¹)⁻¹. Such a θ̂ is off by

      A (XᵀVX/σ⁴ + Λ⁻¹) A,

  which is A itself where V = σ² (the sandwich of Huber, *Proc. 5th Berkeley Symposium* 1, 1967).
* The jackknife over G groups, regions of joint space and blocks of time, with θ_g fitted without group g,

      (G − 1)/G Σ_g (θ_g − θ̄)(θ_g − θ̄)ᵀ

  (Efron and Stein, *Annals of Statistics* 9, 1981; for clusters, Cameron and Miller, *Journal of Human Resources* 50,
  2015). It knows of no form, but not of what is smooth over many groups.

Along each principal axis of a block's posterior covariance, in units of the prior deviations, the largest of the
variances takes the place of the posterior's: 1/λ − 1, what the data say beside the prior, becomes less in proportion.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.diagnosis.cross_validation import Model
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import orthonormal, without
from thermal_robot.inference.discrepancy import Spectrum
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.problem import Linear, whitened
from thermal_robot.inference.rows import blocks, each, neighbourhoods

Rows = NDArray[np.bool_]


def as_remainder_says(fit: Fit) -> Fit:
    """Widen the covariances of a fit to what its remainder may do to its parameters; values stay."""
    e, campaign = fit.explanation, fit.campaign
    if not e.best.blocks:
        return fit
    model = Model.of(e, blocks(campaign))
    said = _said(fit, model)
    wider = dict(e.values)
    for b, span in zip(e.best.blocks, model.spans, strict=True):
        values, covariance = e.values[b]
        prior = e.linear.blocks[b].sizes * e.best.scales[b]
        unit, own = np.outer(prior, prior), np.ix_(span - model.flat, span - model.flat)
        wider[b] = values, unit * _widened(covariance / unit, [s[own] / unit for s in said])
    return replace(fit, explanation=replace(e, values=wider))


def exceeding(fit: Fit, linear: Linear, information: Array, axes: Array) -> Array:
    """(K,) factor, 1 or more, by which the variance of parameters exceeds that of independent rows.

    ``information`` (K,) is what independent rows would say, along its principal ``axes`` (K, K), and is to be divided
    by the factor; the K parameters of ``linear`` are held to one unit each.
    """
    e, campaign = fit.explanation, fit.campaign
    scales = (1.0,) * len(linear.blocks)
    model = Model(linear, scales, e.whitening, e.best.noise**2, ~e.outliers, blocks(campaign))
    return _times(1.0 / (1.0 + information), axes, _said(fit, model))


def _said(fit: Fit, model: Model) -> list[Array]:
    """Return the covariances (P, P) of the parameters that are not the posterior's, zero where one cannot be told."""
    groups = (model.block, neighbourhoods(fit.campaign, settings.BLOCKS))
    return [*(_jackknife(model, each(labels)) for labels in groups), _beside_discrepancy(fit, model)]


def _jackknife(model: Model, groups: Sequence[Rows]) -> Array:
    """(P, P) covariance of the parameters by what they are without each group; zero where there are too few."""
    known = [group for group in groups if model.determines(~group)]
    if len(known) < 2:
        return np.zeros((len(model.tight),) * 2)
    fits = np.stack(model.fits([~group for group in known], range(len(model.spans))))
    apart = fits[:, model.flat : -1] - fits[:, model.flat : -1].mean(axis=0)
    return np.asarray((len(known) - 1) / len(known) * apart.T @ apart)


def _beside_discrepancy(fit: Fit, model: Model) -> Array:
    """(P, P) covariance of parameters that are fitted as if there were no smooth discrepancy; zero where there is none.

    One that is anew in every pose or visit is part of the rows' covariance in the fit.
    """
    e = fit.explanation
    form = e.discrepancy.form
    if form is None or form.anew:
        return np.zeros((len(model.tight),) * 2)
    spectrum = Spectrum.of(form.over(e.whitening.relative), e.whitening.weights, e.whitening.noise)
    unit, variance = model.tight**-0.5, e.best.noise**2
    stack = whitened(model.linear, replace(e.whitening, smooth=None))[:, :-1]
    columns = without(stack[:, model.flat :], orthonormal(stack[:, : model.flat])) * unit
    gram, alike = columns.T @ columns, spectrum.spread(e.discrepancy.tau, columns) * e.discrepancy.noise**2
    inner = np.linalg.inv(gram / variance + np.eye(len(gram)))
    return np.asarray(np.outer(unit, unit) * (inner @ (alike / variance**2 + np.eye(len(gram))) @ inner))


def _widened(covariance: Array, said: Sequence[Array]) -> Array:
    """(P, P) covariance in units of the prior deviations, along none of its axes smaller than any of those said."""
    variance, axes = np.linalg.eigh(covariance)
    variance = np.maximum(variance, settings.TINY)
    times = _times(variance, axes, said)
    wide = np.where(variance < 1.0, 1.0 / (1.0 + (1.0 / variance - 1.0) / times), variance)
    return np.asarray((axes * wide) @ axes.T)


def _times(variance: Array, axes: Array, said: Sequence[Array]) -> Array:
    """(P,) how many times a variance along its axes the largest of those said is, at least once."""
    most = np.max([np.einsum("ki,kl,li->i", axes, own, axes) for own in said], axis=0)
    return np.asarray(np.maximum(most / variance, 1.0))
