"""Diagnosis of a final fit: gap, findings, places, held-out shrinkage, corrected model, next measurement."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import softmax

from thermal_robot.campaign import Campaign
from thermal_robot.correction.model import CorrectedModel
from thermal_robot.diagnosis import settings
from thermal_robot.diagnosis.attribution import locate
from thermal_robot.diagnosis.cross_validation import Shrinkage, hardest, harmed, worst_folds
from thermal_robot.diagnosis.data_checks import cautions
from thermal_robot.diagnosis.file_gaps import file_gaps
from thermal_robot.diagnosis.findings import by_share, findings, random_findings, separates, titled
from thermal_robot.diagnosis.gauges import unseen
from thermal_robot.diagnosis.next_measurement import wanted
from thermal_robot.diagnosis.residual_tests import ResidualAnalysis
from thermal_robot.diagnosis.result import Diagnosis
from thermal_robot.diagnosis.uncertainty import registered, uncertainty
from thermal_robot.diagnosis.values import Finding, Gap, KindGap, Misfit, Refused, Rows, Sensitivity, Unexplained
from thermal_robot.effects import Effect, gate, random_effects
from thermal_robot.effects.apply import depends_on
from thermal_robot.effects.law import PREFIX, Discovered
from thermal_robot.effects.quantities import unit
from thermal_robot.inference.algebra import rms, total_probability
from thermal_robot.inference.explain import log_priors
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.generate import Discovery
from thermal_robot.inference.scatter import RandomGap
from thermal_robot.inference.search import Search
from thermal_robot.iso9283.groups import repeats
from thermal_robot.iso9283.measure import performance
from thermal_robot.iso9283.performance import Performance
from thermal_robot.kinematics import exp3, quaternion_to_rotation, rotation_to_quaternion
from thermal_robot.observables import components, kinds_of, of_model, seen_components

_HELD_OUT = "Corrected figures are of rows held out: the model was fitted without the poses that they are told of."


def criteria(fit: Fit, shrinkage: Shrinkage) -> Performance | None:
    """ISO 9283 criteria of a campaign with repeats, in the frames of the gap; ``None`` without repeats.

    AP after the correction is cross-validated: all repeats of a pose are held out together. Every cycle counts,
    outliers too, as the standard requires.
    """
    campaign = fit.campaign
    if campaign.position is None or not repeats(campaign)[0]:
        return None
    frames, left = fit.nominal.frames, shrinkage.left
    base = frames.base[:3, :3]
    position = np.asarray(campaign.position) - left[:, :3] @ base.T
    orientation = None
    if campaign.orientation is not None:
        back = base @ exp3(-fit.corrected.in_root_axes(np.nan_to_num(left[:, 3:]))) @ base.T
        orientation = rotation_to_quaternion(back @ quaternion_to_rotation(campaign.orientation))
    found = performance(campaign, frames=frames, predicted=(position, orientation))
    return replace(found, notes=(*found.notes, _HELD_OUT))


def numbered(fit: Fit, shrinkage: Shrinkage, laws: Sequence[Discovery]) -> tuple[Fit, Shrinkage, tuple[Discovery, ...]]:
    """Renumber the discovered laws by held-out share, the largest first; laws outside the fit last."""
    held = {effect.name for effect, _ in fit.effects}
    names = [name for name in dict.fromkeys(fit.families) if name.startswith(PREFIX)]
    names.sort(key=lambda name: (name not in held, -shrinkage.shares.get(name, (0.0,))[0]))
    new = {name: f"{PREFIX}{number}" for number, name in enumerate(names, 1)}

    def named(effect: Effect) -> Effect:
        return replace(effect, name=new[effect.name]) if isinstance(effect, Discovered) else effect

    linear = fit.explanation.linear
    blocks = tuple(replace(block, effect=named(block.effect)) for block in linear.blocks)
    fit = replace(
        fit,
        explanation=replace(fit.explanation, linear=replace(linear, blocks=blocks)),
        effects=tuple((named(effect), values) for effect, values in fit.effects),
        families=tuple(new.get(name, name) for name in fit.families),
        variants={new.get(name, name): tuple(map(named, own)) for name, own in fit.variants.items()},
    )
    shares = {new.get(name, name): share for name, share in shrinkage.shares.items()}
    again = tuple(replace(found, law=replace(found.law, name=new[found.law.name])) for found in laws)
    return fit, replace(shrinkage, shares=shares), again


def prior_sensitivity(fit: Fit) -> Sensitivity:
    """Prior sensitivity: probability of the verdict with all prior sizes divided and multiplied by ``PRIOR_FACTOR``.

    The scale of each effect is estimated from the data; a verdict that still depends on the stated sizes is not decided
    by the data. Only the leading combinations are compared.
    """
    e = fit.explanation
    problem = e.problem
    prior = log_priors([b.effect for b in e.linear.blocks])
    chosen = {effect.name for effect, _ in fit.effects}
    compared = e.combinations[: settings.COMPARED]
    same = np.array([fit.names_of(combination) == chosen for combination in compared])
    found = []
    for factor in (1.0 / settings.PRIOR_FACTOR, settings.PRIOR_FACTOR):
        search = Search(replace(problem, matrix=problem.matrix * factor**2, vector=problem.vector * factor), prior)
        weight = softmax([search.evaluate(combination.blocks).log_evidence for combination in compared])
        found.append(total_probability(weight[same]))
    return Sensitivity(*found)


@dataclass(frozen=True, eq=False)
class Conclusion:
    """The final fit with its chosen effects and discovered ``laws``, and its residual.

    ``unexplained`` is the residual of the known effects alone, with the place and quantity of the laws that explain it;
    ``left`` that of the whole fit; ``chance`` its random part beyond the instrument's noise; ``refused`` effects that
    cross-validation removed; ``misfit`` the mismatch of robot and table, if any.
    """

    fit: Fit
    laws: tuple[Discovery, ...]
    unexplained: Unexplained
    left: ResidualAnalysis
    chance: RandomGap
    refused: Mapping[str, Refused]
    misfit: Misfit | None = None
    notes: tuple[str, ...] = ()


def answer(
    last: Conclusion,
    shrinkage: Shrinkage,
    candidates: Sequence[Effect],
    *,
    asked: Callable[[str], bool],
    left_out: Sequence[str],
    notes: Sequence[str],
) -> Diagnosis:
    """Build the diagnosis of the last explanation and its held-out shrinkage.

    ``asked`` returns whether the user admits an effect of this name, fixed or random; ``left_out`` are the names that
    the user excluded; ``notes`` are sentences on the rows and columns left out.
    """
    fit, shrinkage, laws = numbered(last.fit, shrinkage, last.laws)
    campaign, remaining, gap = fit.campaign, last.left.unexplained, _gap(fit, last.left, shrinkage)
    sensitivity = prior_sensitivity(fit)
    where, locations = locate(fit, {name: value for name, (value, _) in shrinkage.shares.items()})
    held = [effect.name for effect, _ in fit.effects]
    systematic = findings(fit, shrinkage.shares, locations, {d.law.name: d.probability for d in laws}, last.refused)
    chance = [f for f in random_findings(fit, last.chance) if asked(f.name)]
    every = titled((*systematic, *chance), (*candidates, *random_effects()), of_model(campaign))
    found, harms = _no_surer(by_share(every), gap)
    groups, probability = separates(found), _probability(fit, last.refused, gap)
    return Diagnosis(
        campaign=campaign.name,
        about=campaign.about,
        robot=campaign.robot.name,
        tool_frame=campaign.robot.tool_frame,
        samples=campaign.samples,
        measures=campaign.measures,
        joint_names=campaign.robot.joint_names,
        outliers=tuple(campaign.rows[fit.explanation.outliers].tolist()),
        gap=gap,
        effects=found,
        where=where,
        unexplained=last.unexplained,
        verdict=(*(f.name for f in found if f.name in held), *(f.name for f in chance if f.status == "found")),
        probability=probability,
        separates=groups,
        model=model_of(fit, None if last.misfit else last.left.floor),
        rows=_rows(fit, shrinkage),
        warnings=(*campaign.warnings, *notes, *harms, *last.notes, *_last_words(fit, last, sensitivity)),
        sensitivity=sensitivity,
        fit=fit,
        remaining=remaining,
        reach=campaign.reach,
        left_out=tuple(left_out),
        wanted=wanted(fit, found, groups, remaining, last.unexplained, probability),
        misfit=last.misfit,
        performance=None if last.misfit else criteria(fit, shrinkage),
        says=", ".join(kind.says for kind, _ in kinds_of(campaign)),
    )


def _last_words(fit: Fit, last: Conclusion, sensitivity: Sensitivity) -> tuple[str, ...]:
    """Return the warnings of the final fit, its unobservable parameters first."""
    return (*unseen(fit), *cautions(fit, last.refused, sensitivity))


def _probability(fit: Fit, refused: Mapping[str, Refused], gap: Gap) -> float:
    """Posterior probability of exactly the effects of the fit, the refused ones not at work."""
    exactly = fit.probability_of_just({effect.name for effect, _ in fit.effects})
    exactly = min([exactly, *(1.0 - out.probability for out in refused.values())])
    return exactly if gap.worse is None else min(exactly, settings.DECIDED)


def _no_surer(found: tuple[Finding, ...], gap: Gap) -> tuple[tuple[Finding, ...], list[str]]:
    """Cap all probabilities at ``DECIDED``, with a note, if the correction makes held-out sessions or regions worse."""
    if gap.worse is None:
        return found, []
    most = settings.DECIDED
    capped = (f if f.probability is None else replace(f, probability=min(f.probability, most)) for f in found)
    note = f"the correction harms rows held out by {gap.worse.name}: no probability above {most:.0%} is told"
    return tuple(capped), [note]


def _gap(fit: Fit, left: ResidualAnalysis, shrinkage: Shrinkage) -> Gap:
    before, after = (seen.gap[~fit.explanation.outliers] for seen in (fit.nominal, fit.corrected))
    turned, schemes = before.shape[1] == 6, worst_folds(fit)
    whole = Gap(
        rms_before=rms(before[:, :3]),
        rms_after=rms(after[:, :3]),
        noise_floor=left.floor * _spread_of_rows(fit.campaign),
        noise_source=left.source,
        held_out=shrinkage.overall,
        orientation_before=rms(before[:, 3:]) if turned else None,
        orientation_after=rms(after[:, 3:]) if turned else None,
        schemes=schemes,
        hardest=hardest(schemes, shrinkage.overall),
        worse=harmed(schemes),
    )
    return replace(whole, kinds=tuple(_by_kind(fit, left, whole)))


def _spread_of_rows(campaign: Campaign) -> float:
    """Rms distance that noise of one unit per axis leaves, over rows by what each sees and by its relative noise."""
    seen, relative = seen_components(campaign), campaign.relative_noise
    places = 3.0 if seen is None else seen[:, 0]
    return float(np.sqrt(np.mean(places * (1.0 if relative is None else relative[:, 0] ** 2))))


def _by_kind(fit: Fit, left: ResidualAnalysis, whole: Gap) -> Iterator[KindGap]:
    """Yield the gaps of each kind of measurement in its unit; nothing where there is one alone, read in metres."""
    campaign, looked = fit.campaign, fit.corrected.sight
    if len(looked.parts) == 1 and looked.parts[0][0].unit == "m":
        return
    relative = np.ones(campaign.samples) if campaign.relative_noise is None else campaign.relative_noise[:, 0]
    for own, seen in looked.parts:
        used, scale = seen.own(~fit.explanation.outliers), own.per_metre(seen, looked.artefacts)[:, None]
        if not used.any():
            continue
        before, after = (rms((scale * seen.own(o.gap[:, :3]))[used]) for o in (fit.nominal, fit.corrected))
        sigma = np.full(len(used), left.kinds[own.kind]) if own.kind in left.kinds else left.floor * seen.own(relative)
        floor = rms((np.sqrt(own.places) * scale * sigma[:, None])[used])
        untold = not whole.noise_known and own.kind not in campaign.noise_of_kinds
        if untold and whole.rms_after > 0.0:  # that of a kind is then told by its own remainder
            floor = after * whole.noise_floor / whole.rms_after
        yield KindGap(own.kind, own.unit, int(used.sum()), before, after, floor)


def model_of(fit: Fit, floor: float | None) -> CorrectedModel:
    """Corrected model of a fit.

    ``floor`` is one sigma per axis of the noise where the campaign states none, m; ``None`` omits the predictive
    uncertainty.
    """
    campaign = fit.campaign
    needs = tuple(dict.fromkeys(c for effect, _ in fit.effects for c in depends_on(effect, fit.nominal)))
    clock = campaign.covariates.get("order")
    model = CorrectedModel(
        robot=campaign.robot,
        settings=campaign.settings,
        frames=fit.corrected.frames,
        effects=registered(fit, [(gate.delivered(effect, fit.nominal), values) for effect, values in fit.effects]),
        measures="pose" if components(campaign) == 6 else "position",
        needs=needs,
        simulated=campaign.simulated_position is not None,
        last_order=None if clock is None else (float(clock.min()), float(clock.max())),
        spread=None if floor is None else uncertainty(fit, needs, floor),
    )
    return replace(model, files=file_gaps(fit, model))


def _rows(fit: Fit, shrinkage: Shrinkage) -> Rows:
    campaign = fit.campaign
    return Rows(
        rows=campaign.rows,
        gap=fit.nominal.gap,
        remainder=fit.corrected.gap,
        outliers=fit.explanation.outliers,
        position=fit.nominal.position,
        q=campaign.q,
        covariates=campaign.covariates,
        held_out_before=shrinkage.before,
        held_out_after=shrinkage.after,
        units={name: unit(campaign.robot, name) for name in (*campaign.covariates, *campaign.robot.joint_names)},
    )
