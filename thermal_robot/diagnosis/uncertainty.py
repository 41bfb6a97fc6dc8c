"""Covariance of parameters and deviation of predictions where the residual is no noise: sandwich, jackknife, conformal.

What no effect describes is alike for neighbours in joint space, or in time; many rows then say no more than a few.

* With a smooth discrepancy V = s²(1 + τ²K) is the covariance of the rows. Effects are fitted as if there were none, θ̂ =
  A Xᵀy/σ² with A = (XᵀX/σ² + Λ⁻¹)⁻¹. Such a θ̂ has the covariance A (XᵀVX/σ⁴ + Λ⁻¹) A, which is A itself where V = σ²
  (the sandwich of Huber, *Proc. 5th Berkeley Symposium* 1, 1967).
* The jackknife over groups, regions of joint space and blocks of time (Efron and Stein, *Annals of Statistics* 9, 1981;
  for clusters, Cameron and Miller, *Journal of Human Resources* 50, 2015) knows of no form, but not of what is smooth
  over many groups.

Along each principal axis of a block's posterior covariance, in units of the prior deviations, the largest of the
variances takes the place of the posterior's: 1/λ − 1, what the data say beside the prior, becomes less in proportion.

A prediction is linear in the errors of frames and parameters, e = J (θ̂ − θ) + δ + n. The first has the variance
J C Jᵀ with C the posterior covariance of all of them. What neither frames nor effects tell, δ, and the instrument's
noise n are measured on rows held out, as the size t for which 95 % of them lie within 1.96 √(J C Jᵀ + t²) (split
conformal prediction: Lei et al., *J. Am. Stat. Assoc.* 113, 2018), whatever their law. Outside the rows measured a
smooth discrepancy and J (θ̂ − θ) do not cancel: there C is the sandwich.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.diagnosis import settings as diagnosis_settings
from thermal_robot.diagnosis.cross_validation import CrossValidation, Model, jackknife
from thermal_robot.effects import Effect, gate
from thermal_robot.effects.fading import Fading
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import orthonormal, whitener, without
from thermal_robot.inference.columns import frame_columns
from thermal_robot.inference.explain import Explanation
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.grouping import blocks, each, neighbourhoods
from thermal_robot.inference.kernels import DesignMatrix, Kernel, SmoothKernel
from thermal_robot.inference.problem import Linear, whitened
from thermal_robot.prediction import Spread, by_parameters, moves, sensitivity


def inflated_for_structure(fit: Fit) -> Fit:
    """Inflate parameter covariances to the jackknife's and sandwich's for structure in the residual; values stay."""
    e = fit.explanation
    if not e.best.blocks:
        return fit
    model = _model(fit)
    said, wider = _other_covariances(fit, model), dict(e.values)
    for b, span in zip(e.best.blocks, model.spans, strict=True):
        values, covariance = e.values[b]
        prior = e.linear.blocks[b].sizes * e.best.scales[b]
        unit, own = np.outer(prior, prior), np.ix_(span - model.flat, span - model.flat)
        wider[b] = values, unit * _inflated(covariance / unit, [s[own] / unit for s in said])
    return replace(fit, explanation=replace(e, values=wider))


def variance_inflation(fit: Fit, linear: Linear, information: Array, axes: Array) -> Array:
    """Variance inflation factor (K,) of parameters over independent rows, by which their information is divided.

    ``information`` (K,) stands along its principal ``axes`` (K, K); the parameters of ``linear`` are held to one unit.
    """
    model = replace(_model(fit), linear=linear, scales=(1.0,) * len(linear.blocks))
    return _inflation_factors(1.0 / (1.0 + information), axes, _other_covariances(fit, model))


def _model(fit: Fit) -> Model:
    return Model.of(fit.explanation, blocks(fit.campaign))


def _other_covariances(fit: Fit, model: Model) -> list[Array]:
    """Parameter covariances (P, P): jackknife over blocks of rows in time and in joint space, and sandwich if any."""
    found, e = [], fit.explanation
    for labels in (model.block, neighbourhoods(fit.campaign, settings.BLOCKS)):
        rows = [~group for group in each(labels) if model.determines(~group)]
        if len(rows) > 1:
            found.append(jackknife(model.fits(rows, range(len(model.spans)))[:, model.flat : -1]))
    if kernel := _smooth(e):
        stack = _independent(model)
        columns = without(stack[:, model.flat :], orthonormal(stack[:, : model.flat]))
        found.append(_sandwich(e, kernel, columns, model.prior_precision))
    return found


def _smooth(e: Explanation) -> Kernel | None:
    """Smooth discrepancy of an explanation; ``None`` without one, or if it is drawn anew in every pose or visit."""
    return None if e.discrepancy.kernel is None or e.discrepancy.kernel.grouped else e.discrepancy.kernel


def _independent(model: Model) -> Array:
    """Columns (E, K) of frames and parameters, whitened as if rows were independent."""
    return whitened(model.linear, replace(model.whitening, smooth=None))[:, :-1]


def _sandwich(e: Explanation, kernel: Kernel, columns: Array, tight: Array) -> Array:
    """Sandwich covariance (K, K) A (XᵀVX/σ⁴ + Λ⁻¹) A of whitened columns X (E, K), prior precisions Λ⁻¹ (K,).

    The discrepancy in V is at most as large, rms, as all that is left: its likelihood is of what parameters leave, and
    says nothing of directions that they take (Plumlee, *Journal of the American Statistical Association* 112, 2017).
    """
    variance = e.best.noise**2
    tau = min(e.discrepancy.tau, e.best.noise / e.discrepancy.noise)
    spectrum = SmoothKernel.of(kernel.over(e.whitening.relative), e.whitening.weights, e.whitening.noise)
    stack = DesignMatrix.from_array(columns * (e.discrepancy.noise / variance), spectrum.measures)
    along = tau * spectrum.along(stack)
    alike = stack.products() + along.T @ along
    inner = _posterior(columns.T @ columns / variance, tight)
    return _symmetric(inner @ (alike + np.diag(tight)) @ inner)


def _posterior(information: Array, tight: Array) -> Array:
    """Posterior covariance (K, K) A = (XᵀX/σ² + Λ⁻¹)⁻¹, solved with columns scaled to unit length."""
    unit = (information.diagonal() + tight) ** -0.5
    size = np.outer(unit, unit)
    inverse: Array = np.asarray(np.linalg.inv(information * size + np.diag(tight * unit**2)))
    return size * _symmetric(inverse)


def _symmetric(matrix: Array) -> Array:
    """Symmetric part of a matrix, (A + Aᵀ)/2, against rounding errors."""
    return (matrix + matrix.T) / 2.0


def _inflated(covariance: Array, said: Sequence[Array]) -> Array:
    """Covariance (P, P), in units of the prior deviations, raised along its axes to the largest of the others."""
    variance, axes = np.linalg.eigh(covariance)
    variance = np.maximum(variance, settings.TINY)
    times = _inflation_factors(variance, axes, said)
    wide = np.where(variance < 1.0, 1.0 / (1.0 + (1.0 / variance - 1.0) / times), variance)
    return np.asarray((axes * wide) @ axes.T)


def _inflation_factors(variance: Array, axes: Array, said: Sequence[Array]) -> Array:
    """Variance inflation factors (P,), at least 1, along principal axes: largest of some covariances over variance."""
    most = np.max([variance, *(np.einsum("ki,kl,li->i", axes, own, axes) for own in said)], axis=0)
    return np.asarray(most / variance)


def uncertainty(fit: Fit, needs: tuple[str, ...], floor: float) -> Spread:
    """Predictive uncertainty of a fit: covariances, residual size and range; ``needs`` are the columns that it reads.

    ``floor`` is one sigma per axis of the noise where the campaign states none, m.
    """
    campaign, e, model = fit.campaign, fit.explanation, _model(fit)
    covariance, wider = _covariances(fit, model)
    left, rows = _held_out(fit, model)
    told = by_parameters(sensitivity(fit.corrected, [effect for effect, _ in fit.effects])[rows], covariance)
    quiet, share = np.ones(len(rows), dtype=bool), 1.0
    if campaign.relative_noise is not None:  # the less noisy half shows best what is no noise
        relative = campaign.relative_noise[rows, 0]
        quiet = relative <= np.median(relative)
        share = float(np.sqrt((relative[quiet] ** 2).mean()))
    total = _conformal_size(left[quiet], told[quiet], ~e.outliers[rows[quiet]])
    noise = share * (campaign.noise_position or floor)
    beyond = np.sqrt(np.maximum(total**2 - noise**2, 0.0))
    values = {name: campaign.q[:, j] for j, name in enumerate(campaign.robot.joint_names)}
    values.update({name: campaign.covariates[name] for name in needs if name in campaign.covariates})
    session = campaign.labels.get("session")
    return Spread(
        covariance,
        beyond,
        np.sqrt(np.maximum(total**2 - beyond**2, 0.0)) / share,
        {name: (float(v.min()), float(v.max())) for name, v in values.items()},
        wider,
        np.concatenate([*(e.linear.blocks[b].sizes * e.best.scales[b] for b in e.best.blocks), np.zeros(0)]),
        {} if session is None else {"session": tuple(np.unique(session).tolist())},
        _between_sessions(fit, session),
    )


def _covariances(fit: Fit, model: Model) -> tuple[Array, Array | None]:
    """Posterior covariance (K, K) of frames and parameters that move the target; rotations alone are left out.

    The second is the sandwich; ``None`` without a smooth discrepancy.
    """
    e = fit.explanation
    tight = np.concatenate([np.full(model.flat, diagnosis_settings.LOOSE**-2.0), model.prior_precision])
    moving = np.concatenate([moves(frame_columns(fit.corrected)[1]), np.ones(len(model.prior_precision), dtype=bool)])
    own = np.ix_(moving, moving)
    kernel = _smooth(e)
    wider = None if kernel is None else _sandwich(e, kernel, _independent(model), tight)[own]
    return _posterior(model.whole[0][:-1, :-1] / e.best.noise**2, tight)[own], wider


def _held_out(fit: Fit, model: Model) -> tuple[Array, NDArray[np.int64]]:
    """Held-out residuals (H, 3), m, measurement frame, and row numbers; the fit's own if nothing can be held out."""
    validation, base = CrossValidation.over(model, each(model.block)), fit.corrected.frames.base[:3, :3]
    if not validation.tests:
        return fit.corrected.gap[:, :3] @ base.T, np.arange(fit.campaign.samples)
    return validation.residuals(range(len(model.spans)))[:, :3] @ base.T, validation.numbers


def _conformal_size(left: Array, told: Array, kept: NDArray[np.bool_]) -> Array:
    """Conformal residual size t (3,) per axis: 95 % of residuals lie within 1.96 √(t² + the parameters' variance).

    The ratio of the axes is that of their rms without outliers; outliers count in the 95 %.
    """
    size = np.log(np.mean(left[kept] ** 2, axis=0) + settings.TINY) / 2.0
    # a rms of K numbers is known to 1/√2K: axes differ by what exceeds that (James and Stein)
    apart, chance = size - size.mean(), 1.0 / max(2 * int(kept.sum()), 1)
    size = np.exp(size.mean() + apart * max(1.0 - 2.0 * chance / max(float((apart**2).sum()), settings.TINY), 0.0))
    beside = np.sqrt(np.maximum((left / settings.SIGMAS_95) ** 2 - told, 0.0)) / size
    inside = settings.INTERVAL[1] - settings.INTERVAL[0]
    return np.asarray(size * np.quantile(beside, min(inside * (1.0 + 1.0 / len(left)), 1.0)))


def _between_sessions(fit: Fit, session: NDArray[np.str_] | None) -> Array | None:
    """Between-session standard deviation (3,) per axis, m (random effects); ``None`` for fewer than two sessions."""
    kept = ~fit.explanation.outliers
    left = fit.corrected.gap[kept, :3] @ fit.corrected.frames.base[:3, :3].T
    runs = [] if session is None else [left[session[kept] == run] for run in np.unique(session[kept])]
    runs = [run for run in runs if len(run) > 1]
    if len(runs) < 2:
        return None
    chance = np.mean([run.var(axis=0, ddof=1) / len(run) for run in runs], axis=0)
    return np.asarray(np.sqrt(np.maximum(np.var([run.mean(axis=0) for run in runs], axis=0, ddof=1) - chance, 0.0)))


def registered(fit: Fit, held: Sequence[tuple[Effect, Array]]) -> tuple[tuple[Effect, Array], ...]:
    """Give fading effects the part of their columns that the fitted frames absorb, a least-squares projection.

    It remains where they have faded. Returned unchanged if any of the effects does not fade.
    """
    fading = [(effect, values) for effect, values in held if isinstance(effect, Fading) and effect.found]
    if len(fading) < len(held):
        return tuple(held)
    model, names = _model(fit), frame_columns(fit.corrected)[1]
    gram, flat = model.whole[0], model.flat
    numbers = [k for k, name in enumerate(names) if name in ("base", "tool")]
    places = [k if names[k] == "base" else 6 + k - names.index("tool") for k in numbers]
    twists = np.zeros((12, gram.shape[1] - 1 - flat))
    known = whitener(gram[:flat, :flat], diagnosis_settings.LEAST_SEEN)
    twists[places] = (known @ (known.T @ gram[:flat, flat:-1]))[numbers]
    found: list[tuple[Effect, Array]] = []
    for (effect, values), own in zip(fading, model.spans, strict=True):
        kept = {p.name: twists[:, k] for p, k in zip(gate.checked(effect, fit.nominal), own - flat, strict=True)}
        every = gate.checked(replace(effect, places=(), excluded=()), fit.nominal)
        rests = np.concatenate([kept.get(p.name, np.zeros(12)) for p in every]).tolist()
        found.append((replace(effect, means=(), rests=tuple(rests)), values))
    return tuple(found)
