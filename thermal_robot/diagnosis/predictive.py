"""How far predictions of fresh rows are off: by the parameters' covariance, and by what rows held out say beside it.

The prediction is linear in the errors of frames and parameters, e = J (θ̂ − θ) + δ + n. The first has the variance
J C Jᵀ with C the posterior covariance of all of them together. What neither frames nor effects tell, δ, and the
instrument's noise n are measured on rows held out, as the size t for which 95 % of them lie within 1.96 √(J C Jᵀ + t²)
(split conformal prediction: Lei et al., *J. Am. Stat. Assoc.* 113, 2018): a normal law is not assumed of them.

Where the rows have a smooth discrepancy in common, it pulls θ̂ along, so that between the rows measured δ and J (θ̂ − θ)
cancel in part, and rows held out see what is left. Outside what was measured nothing cancels: there C is the sandwich
of :mod:`thermal_robot.diagnosis.deviations`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.diagnosis import settings as diagnosis_settings
from thermal_robot.diagnosis.cross_validation import Model, Walk
from thermal_robot.effects import Effect, gate
from thermal_robot.effects.fading import Fading
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import whitener
from thermal_robot.inference.columns import frame_columns
from thermal_robot.inference.discrepancy import Spectrum
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.problem import whitened
from thermal_robot.inference.rows import blocks, each
from thermal_robot.prediction import Spread, by_parameters, moves, sensitivity


def uncertainty(fit: Fit, needs: tuple[str, ...], floor: float) -> Spread:
    """Return what makes predictions of a fit uncertain; ``needs`` are the columns that its model reads.

    ``floor`` is one sigma per axis of the noise where the campaign states none, m.
    """
    campaign, model = fit.campaign, Model.of(fit.explanation, blocks(fit.campaign))
    covariance, wider = _covariances(fit, model)
    left, rows = _held_out(fit, model)
    told = by_parameters(sensitivity(fit.corrected, [effect for effect, _ in fit.effects])[rows], covariance)
    quiet, share = _quiet(campaign, rows)
    total = _size(left[quiet], told[quiet], ~fit.explanation.outliers[rows[quiet]])
    noise = np.full(3, share * (campaign.noise_position or floor))
    values = {name: campaign.q[:, j] for j, name in enumerate(campaign.robot.joint_names)}
    values.update({name: campaign.covariates[name] for name in needs if name in campaign.covariates})
    ranges = {name: (float(v.min()), float(v.max())) for name, v in values.items()}
    beyond = np.sqrt(np.maximum(total**2 - noise**2, 0.0))
    noise = np.sqrt(np.maximum(total**2 - beyond**2, 0.0)) / share
    e = fit.explanation
    expected = [e.linear.blocks[b].sizes * e.best.scales[b] for b in e.best.blocks]
    prior, session = np.concatenate([*expected, np.zeros(0)]), campaign.labels.get("session")
    levels = {} if session is None else {"session": tuple(np.unique(session).tolist())}
    return Spread(covariance, beyond, noise, ranges, wider, prior, levels, _between(fit, session))


def _between(fit: Fit, session: NDArray[np.str_] | None) -> Array | None:
    """(3,) one sigma per axis by which sessions truly differ, measurement frame, m; ``None`` for one session."""
    kept = ~fit.explanation.outliers
    left = fit.corrected.gap[kept, :3] @ fit.corrected.frames.base[:3, :3].T
    runs = [] if session is None else [left[session[kept] == run] for run in np.unique(session[kept])]
    runs = [run for run in runs if len(run) > 1]
    if len(runs) < 2:
        return None
    chance = np.mean([run.var(axis=0, ddof=1) / len(run) for run in runs], axis=0)
    return np.asarray(np.sqrt(np.maximum(np.var([run.mean(axis=0) for run in runs], axis=0, ddof=1) - chance, 0.0)))


def registered(fit: Fit, held: Sequence[tuple[Effect, Array]]) -> tuple[tuple[Effect, Array], ...]:
    """Return effects that, where they fade, leave what registration alone does; as they are where others do not fade.

    The frames take over of a column what they do as they are fitted without it, by the products of all columns.
    """
    fading = [(effect, values) for effect, values in held if isinstance(effect, Fading) and effect.found]
    if len(fading) < len(held):
        return tuple(held)
    model, names = Model.of(fit.explanation, blocks(fit.campaign)), frame_columns(fit.corrected)[1]
    gram, flat = model.whole[0], model.flat
    places = [k if name == "base" else 6 + k - names.index("tool") for k, name in enumerate(names)]
    twists = np.zeros((12, gram.shape[1] - 1 - flat))
    known = whitener(gram[:flat, :flat], diagnosis_settings.LEAST_SEEN)
    twists[places] = known @ (known.T @ gram[:flat, flat:-1])
    found: list[tuple[Effect, Array]] = []
    for (effect, values), own in zip(fading, model.spans, strict=True):
        kept = {p.name: twists[:, k] for p, k in zip(gate.checked(effect, fit.nominal), own - flat, strict=True)}
        every = gate.checked(replace(effect, places=(), excluded=()), fit.nominal)
        rests = np.concatenate([kept.get(p.name, np.zeros(12)) for p in every]).tolist()
        found.append((replace(effect, means=(), rests=tuple(rests)), values))
    return tuple(found)


def _quiet(campaign: Campaign, rows: NDArray[np.int64]) -> tuple[NDArray[np.bool_], float]:
    """(H,) the less noisy half of some rows, which shows best what is no noise, and its share of the noise of all.

    Where all rows are alike it is all of them.
    """
    if campaign.relative_noise is None:
        return np.ones(len(rows), dtype=bool), 1.0
    relative = campaign.relative_noise[rows, 0]
    quiet = relative <= np.median(relative)
    return quiet, float(np.sqrt((relative[quiet] ** 2).mean()))


def _covariances(fit: Fit, model: Model) -> tuple[Array, Array | None]:
    """(K, K) covariance of frames and parameters together, without what turns the target and does not move it.

    The second is what a smooth discrepancy in the rows makes of it; ``None`` where there is none.
    """
    e, flat, variance = fit.explanation, model.flat, fit.explanation.best.noise**2
    tight = np.concatenate([np.full(flat, diagnosis_settings.LOOSE**-2.0), model.tight])
    gram = model.whole[0][:-1, :-1] / variance
    unit = (gram.diagonal() + tight) ** -0.5
    prior, size = np.diag(tight * unit**2), np.outer(unit, unit)
    inner = _symmetric(np.linalg.inv(gram * size + prior))
    moving = np.concatenate([moves(frame_columns(fit.corrected)[1]), np.ones(len(model.tight), dtype=bool)])
    own, form = np.ix_(moving, moving), e.discrepancy.form
    if form is None or form.anew:
        return np.asarray((size * inner)[own]), None
    stack = whitened(model.linear, replace(e.whitening, smooth=None))[:, :-1] * (unit * e.discrepancy.noise / variance)
    spectrum = Spectrum.of(form.over(e.whitening.relative), e.whitening.weights, e.whitening.noise)
    alike = spectrum.spread(e.discrepancy.tau, stack)
    return np.asarray((size * inner)[own]), np.asarray((size * _symmetric(inner @ (alike + prior) @ inner))[own])


def _symmetric(matrix: Array) -> Array:
    """Return the matrix without what rounding makes it miss its transpose by."""
    return (matrix + matrix.T) / 2.0


def _held_out(fit: Fit, model: Model) -> tuple[Array, NDArray[np.int64]]:
    """(H, 3) what is left of rows held out, of all where none can be, measurement frame, m, and the number of each."""
    walk, base = Walk.over(model, each(model.block)), fit.corrected.frames.base[:3, :3]
    if not walk.tests:
        return fit.corrected.gap[:, :3] @ base.T, np.arange(fit.campaign.samples)
    return walk.residuals(range(len(model.spans)))[:, :3] @ base.T, walk.numbers


def _size(left: Array, told: Array, kept: NDArray[np.bool_]) -> Array:
    """(3,) size per axis of what is left beside what is told, so that 95 % of all are within 1.96 of both together.

    The axes differ as their rms does; rows set aside count in the share, and not in that.
    """
    size = np.log(np.mean(left[kept] ** 2, axis=0) + settings.TINY) / 2.0
    # a rms of K numbers is known to 1/√2K: axes differ by what exceeds that (James and Stein)
    apart, chance = size - size.mean(), 1.0 / max(2 * int(kept.sum()), 1)
    size = np.exp(size.mean() + apart * max(1.0 - 2.0 * chance / max(float((apart**2).sum()), settings.TINY), 0.0))
    beside = np.sqrt(np.maximum((left / settings.SIGMAS_95) ** 2 - told, 0.0)) / size
    inside = settings.INTERVAL[1] - settings.INTERVAL[0]
    level = min(inside * (1.0 + 1.0 / len(left)), 1.0)
    return np.asarray(size * np.quantile(beside, level))
