"""One verb: a campaign goes in, a diagnosis comes out."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from thermal_robot.campaign import Campaign, read_campaign
from thermal_robot.correction import CorrectedModel
from thermal_robot.diagnosis.cautions import cautions, usable
from thermal_robot.diagnosis.discovery import Discoveries, discoveries
from thermal_robot.diagnosis.findings import findings, in_order, separates, titled
from thermal_robot.diagnosis.held_out import Shrinkage, held_out
from thermal_robot.diagnosis.parts import Finding, FoldScheme, Gap, Rows
from thermal_robot.diagnosis.random_gap import STEPS
from thermal_robot.diagnosis.result import Diagnosis, told
from thermal_robot.diagnosis.schemes import worst_folds
from thermal_robot.diagnosis.sensitivity import sensitivity
from thermal_robot.diagnosis.stand_in import stand_ins, trust
from thermal_robot.diagnosis.where import locate
from thermal_robot.effects import Effect, choose, library, random_effects
from thermal_robot.effects.quantities import unit
from thermal_robot.errors import CampaignError
from thermal_robot.inference import settings
from thermal_robot.inference.fit import Fit, fit
from thermal_robot.inference.rows import in_a_row


def diagnose(
    campaign: Campaign | str | Path,
    *,
    only: Iterable[str] = (),
    without: Iterable[str] = (),
    effects: Sequence[Effect] = (),
    progress: Callable[[str], None] = lambda _: None,
) -> Diagnosis:
    """Say where the gap between a robot and its model lies, which effects cause it, and how far it shrinks.

    Parameters
    ----------
    campaign
        A campaign, or the path of one.
    only, without
        Names of effects to consider, or to leave out.
    effects
        Effects of your own, considered beside those of the library.
    progress
        Called with a few words at each stage.

    Returns
    -------
    Diagnosis
        Prints as text, writes as JSON, shows itself in Jupyter.

    Raises
    ------
    CampaignError, RobotError
        If the campaign cannot be used.
    EffectError
        If an effect's name is not known.
    EstimationError
        If there are too few measurements for the unknown frames.
    """
    if not isinstance(campaign, Campaign):
        progress("reading the campaign")
        campaign = read_campaign(campaign)
    only, without = tuple(only), tuple(without)
    candidates = choose(only, without, effects)
    narrowed = len(candidates) < len({*library(), *(e.name for e in effects)})
    _check_priors(campaign, {e.name for e in candidates} | set(library()))
    campaign, notes = usable(campaign)
    # matrices are small: threads that wait for each other cost several times what they bring
    with threadpool_limits(1):
        looked = discoveries(fit(campaign, candidates, progress), progress)
        fitted, unexplained = looked.fit, looked.unexplained
        shrinkage = held_out(fitted, progress)
    progress("places")
    shares = {name: value for name, (value, _) in shrinkage.shares.items()}
    where, locations = locate(fitted, shares)
    doubts = stand_ins(fitted) if looked.remaining.flagged or looked.found else {}
    gap = _gap(fitted, shrinkage, looked.floor, looked.source, worst_folds(fitted))
    believed = trust({e.name: shares.get(e.name, 0.0) for e, _ in fitted.effects}, doubts, _left(looked, gap))
    systematic = findings(fitted, shrinkage.shares, locations, believed)
    chance = [f for f in _scatter(looked) if f.name not in without and (not only or f.name in only)]
    found = in_order(titled((*systematic, *chance), (*candidates, *random_effects())))
    order = [f.name for f in found if f.name in {e.name for e, _ in fitted.effects}]
    order += [f.name for f in chance if f.status == "found"]
    probability = min(_probability(fitted), *believed.values(), 1.0)
    diagnosis = Diagnosis(
        campaign=campaign.name,
        robot=campaign.robot.name,
        tool_frame=campaign.robot.tool_frame,
        samples=campaign.samples,
        measures=campaign.measures,
        joint_names=campaign.robot.joint_names,
        outliers=tuple(campaign.rows[fitted.explanation.outliers].tolist()),
        gap=gap,
        effects=found,
        where=where,
        unexplained=unexplained,
        verdict=tuple(order),
        probability=probability,
        separates=separates(found),
        model=_model(fitted),
        rows=_rows(fitted, shrinkage),
        warnings=(*campaign.warnings, *notes, *cautions(fitted, candidates if narrowed else (), doubts)),
        sensitivity=sensitivity(fitted),
        fit=fitted,
        remaining=looked.remaining,
        reach=_reach(campaign),
        narrowed=narrowed,
    )
    return told(diagnosis)


def _scatter(looked: Discoveries) -> tuple[Finding, ...]:
    """Return what is said of the random effects.

    Where an unlisted cause is at work what differs from pose to pose may be its doing: steps of an encoder are then
    only believed where they are seen.
    """
    seen = any(p < settings.LEVEL for p in looked.chance.steps.values())
    if seen or not looked.remaining.flagged:
        return looked.chance.findings
    return tuple(
        replace(
            f,
            status="not_found",
            probability=settings.BESIDE_UNLISTED * (f.probability or 0.0),
            locations=(),
            parameters=(),
            confounded_with=(),
        )
        if f.name == STEPS and f.status in ("found", "confounded")
        else f
        for f in looked.chance.findings
    )


def _left(looked: Discoveries, gap: Gap) -> float:
    """Share of the gap's mean square that is not explained; rows that were set aside and follow each other are part."""
    if not looked.remaining.flagged:
        return 0.0
    fitted = looked.fit
    aside = fitted.explanation.outliers
    changed = in_a_row(fitted.campaign, aside)
    before, after = ((o.gap[:, :3] ** 2).sum(axis=1) for o in (fitted.nominal, fitted.corrected))
    beside = float(after[changed].sum() / max(before[changed | ~aside].sum(), settings.TINY))
    return min((looked.remaining.rms / gap.rms_before) ** 2 + beside, 1.0)


def _reach(campaign: Campaign) -> float:
    """Diagonal of the volume that was measured, m."""
    return float(np.linalg.norm(np.ptp(np.asarray(campaign.position), axis=0)))


def _check_priors(campaign: Campaign, known: set[str]) -> None:
    for name in campaign.priors:
        if name not in known:
            expected = "one of " + ", ".join(sorted(known))
            raise CampaignError(campaign.name, "no effect has this name", column=f"priors.{name}", expected=expected)


def _probability(fitted: Fit) -> float:
    """Posterior probability of exactly these effects, whatever the settings of their nonlinear arguments."""
    e, chosen = fitted.explanation, {effect.name for effect, _ in fitted.effects}
    same = [{fitted.families[b] for b in c.blocks} == chosen for c in e.combinations]
    return min(float(e.probabilities[same].sum()), 1.0)


def _gap(fitted: Fit, shrinkage: Shrinkage, floor: float, source: str, schemes: tuple[FoldScheme, ...]) -> Gap:
    kept = ~fitted.explanation.outliers
    before, after = fitted.nominal.gap[kept], fitted.corrected.gap[kept]

    def rms(rows: NDArray[np.float64]) -> float:
        return float(np.sqrt((rows**2).sum(axis=1).mean()))

    turned = before.shape[1] == 6
    return Gap(
        rms(before[:, :3]),
        rms(after[:, :3]),
        float(np.sqrt(3.0) * floor),
        source,
        shrinkage.overall,
        rms(before[:, 3:]) if turned else None,
        rms(after[:, 3:]) if turned else None,
        schemes,
    )


def _model(fitted: Fit) -> CorrectedModel:
    campaign = fitted.campaign
    needs = [column for effect, _ in fitted.effects for column in effect.reads(fitted.nominal)]
    clock = campaign.covariates.get("order")
    return CorrectedModel(
        robot=campaign.robot,
        settings=campaign.settings,
        frames=fitted.corrected.frames,
        effects=fitted.effects,
        measures=campaign.measures,
        needs=tuple(dict.fromkeys(needs)),
        simulated=campaign.simulated_position is not None,
        last_order=None if clock is None else (float(clock.min()), float(clock.max())),
    )


def _rows(fitted: Fit, shrinkage: Shrinkage) -> Rows:
    campaign = fitted.campaign
    return Rows(
        rows=campaign.rows,
        gap=fitted.nominal.gap,
        remainder=fitted.corrected.gap,
        outliers=fitted.explanation.outliers,
        position=fitted.nominal.position,
        q=campaign.q,
        covariates=campaign.covariates,
        held_out_before=shrinkage.before,
        held_out_after=shrinkage.after,
        units={name: unit(campaign.robot, name) for name in (*campaign.covariates, *campaign.robot.joint_names)},
    )
