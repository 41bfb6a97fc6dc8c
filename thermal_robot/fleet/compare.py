"""Tests of equality between campaigns of one robot.

An effect that was wrongly named has another size in the next campaign. So an effect is confirmed if two campaigns agree
on most of it: sizes within half of the larger, which allows for wear and re-adjustment.

Parameters. A campaign alone estimates the effects at work in any campaign by θ = G⁺b, with covariance G⁺. For one
effect with the others free, I θ = s, where I and s are G and b with the others projected out; then

    χ² = Σ_c s_cᵀ I_c⁺ s_c − (Σ s_c)ᵀ (Σ I_c)⁺ (Σ s_c)

has Σ rank I_c − rank Σ I_c degrees of freedom if the effect is the same in all campaigns. Directions that only one
campaign determines add to neither.

Predictions, where both campaigns measured: the cross-validation of mrcal (D. Kogan, *mrcal*: cross-validation of
calibrations): two calibrations of one robot differ by noise, whose size each states. A difference above twice that
means that a model is wrong. Base and tool differ between campaigns, so that a base twist and a shift of the target are
fitted and subtracted, in the difference and in the standard deviations.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import combinations, groupby
from pathlib import Path
from typing import Any, get_args

import numpy as np
from scipy.special import chdtrc
from threadpoolctl import threadpool_limits

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.campaign.settings import STILL
from thermal_robot.correction import CorrectedModel
from thermal_robot.diagnosis import Diagnosis, diagnose
from thermal_robot.effects import Effect
from thermal_robot.effects.apply import displacement
from thermal_robot.errors import CampaignError, require
from thermal_robot.fleet import settings
from thermal_robot.fleet.compare_joint import Change as Differs
from thermal_robot.fleet.compare_joint import Joint, joint
from thermal_robot.fleet.compare_sums import (
    Candidate,
    ModelAsFit,
    Ranges,
    Sums,
    candidates,
    identifiable,
    is_model,
    observed,
    poses,
    sums,
)
from thermal_robot.fleet.comparison import Change, Comparison, Parameter, Predicted, Status
from thermal_robot.fleet.comparison import Effect as Compared
from thermal_robot.inference import settings as inference
from thermal_robot.inference.algebra import equations_of, orthonormal, without
from thermal_robot.inference.fit import Fit
from thermal_robot.observations import Observations
from thermal_robot.prediction import Spread, by_parameters, sensitivity
from thermal_robot.robot import Robot, joint_range

CALL = "compare()"


def compare(
    *campaigns: Campaign | Diagnosis | CorrectedModel | str | Path,
    names: Sequence[str] = (),
    only: Iterable[str] | None = None,
    without: Iterable[str] = (),
    effects: Sequence[Effect] = (),
    progress: Callable[[str], None] = lambda _: None,
) -> Comparison:
    """Test which effects and parameters campaigns of one robot share, and which changed between them.

    Parameters that an unknown frame absorbs, such as the first joint's zero, are projected out. One joint fit of all
    campaigns then decides by marginal likelihood whether each effect is shared or differs, place by place. An effect on
    whose size no two campaigns agree is contradicted.

    Parameters
    ----------
    *campaigns
        Two or more, in the order in which they were measured: campaigns, their diagnoses, corrected models, or paths of
        campaigns and of model files (``.json``). A model carries no information on effects outside it.
    names
        Names of the campaigns in the result; by default their own.
    only, without, effects
        As for :func:`~thermal_robot.diagnose`, of campaigns that are not diagnosed yet.
    progress
        Called with a few words at each stage.

    Returns
    -------
    Comparison
        Prints as text, writes as JSON, shows itself in Jupyter.

    Raises
    ------
    CampaignError
        Fewer than two campaigns; campaigns of different robots; one that is not usable; a model that does not say how
        sure it is.
    EffectError, EstimationError
        As :func:`~thermal_robot.diagnose`.
    """
    expected = "campaigns, their diagnoses, models, or paths of campaigns and models"
    for campaign in campaigns:
        require(CALL, campaign, (Campaign, Diagnosis, CorrectedModel, str, os.PathLike), expected)
    if len(campaigns) < 2:
        raise CampaignError(
            CALL, "nothing to compare with", found=f"{len(campaigns)}", expected="two campaigns or more"
        )
    options = {"only": only, "without": without, "effects": effects}
    stages = [f"campaign {number} of {len(campaigns)}: " for number in range(1, len(campaigns) + 1)]
    found = [_opened(*each, progress, options) for each in zip(campaigns, stages, strict=True)]
    called = _called(found, names)
    found = [
        replace(d, campaign=name) if isinstance(d, ModelAsFit) else d for d, name in zip(found, called, strict=True)
    ]
    fits = [_usable(diagnosis, name) for diagnosis, name in zip(found, called, strict=True)]
    _require_same_robot([one.model.robot for one in found], called)
    with threadpool_limits(1):
        return _compared(found, fits, called, progress)


def _opened(
    given: Any, stage: str, progress: Callable[[str], None], options: Mapping[str, Any]
) -> Diagnosis | ModelAsFit:
    """Turn an argument of compare() into a diagnosis or a wrapped model; campaigns and their paths are diagnosed."""
    if is_model(given):
        return ModelAsFit.of(CorrectedModel.load(given, options["effects"]), Path(given).name)
    if isinstance(given, CorrectedModel):
        return ModelAsFit.of(given, given.robot.name)
    if isinstance(given, Diagnosis):
        return given
    return diagnose(given, progress=lambda words: progress(stage + words), **options)


def _called(found: Sequence[Diagnosis | ModelAsFit], names: Sequence[str]) -> tuple[str, ...]:
    """Return a name for each campaign: those given, else their own; equal ones get their number appended."""
    require(f"{CALL}, names", names, (list, tuple), "a name for each campaign")
    if names and len(names) != len(found):
        raise CampaignError(
            f"{CALL}, names", "one is needed for each campaign", found=f"{len(names)}", expected=f"{len(found)}"
        )
    own = [str(name) for name in names] or [diagnosis.campaign for diagnosis in found]
    return tuple(f"{name} ({k})" if own.count(name) > 1 else name for k, name in enumerate(own, 1))


def _usable(diagnosis: Diagnosis | ModelAsFit, name: str) -> Fit | ModelAsFit:
    if isinstance(diagnosis, ModelAsFit):
        return diagnosis
    if not diagnosis.usable:
        raise CampaignError(name, "cannot be compared", found=diagnosis.reason, expected="a campaign that is usable")
    if diagnosis.fit is None:
        raise CampaignError(name, "this diagnosis was made without its fit", expected="one made by diagnose()")
    return diagnosis.fit


def _compared(
    found: Sequence[Diagnosis | ModelAsFit],
    fits: Sequence[Fit | ModelAsFit],
    names: tuple[str, ...],
    progress: Callable[[str], None],
) -> Comparison:
    progress("what each campaign says")
    listed: Sequence[Candidate] = candidates(found, fits, names)
    statistics = [sums(d, fit, listed, c) for c, (d, fit) in enumerate(zip(found, fits, strict=True))]
    listed, statistics, not_told = _kept(listed, statistics)
    progress("what is shared, what differs")
    together = joint(listed, statistics)
    progress("predictions")
    order = get_args(Status)
    effects = sorted(_effects(listed, together, statistics, names), key=lambda e: (order.index(e.status), e.name))
    pairs = combinations(zip(found, names, strict=True), 2)
    return Comparison(
        campaigns=names,
        samples=tuple(d.samples for d in found),
        robot=found[0].model.robot.name,
        tool_frame=found[0].model.robot.tool_frame,
        effects=tuple(effects),
        changes=_changes(listed, together, names),
        predicted=tuple(_predicted(a, b, (first, second)) for (a, first), (b, second) in pairs),
        not_told=not_told,
        looked_at=together.looked_at,
        diagnoses=tuple(found),
    )


def _kept(
    listed: Sequence[Candidate], statistics: Sequence[Sums]
) -> tuple[Sequence[Candidate], list[Sums], tuple[str, ...]]:
    """Keep the parameters that the campaigns together determine, renumbered; return the names of the others, too."""
    kept = identifiable(statistics)
    start, left, result = 0, [], []
    for item in listed:
        own = [k for k in range(len(item.compared)) if start + k in kept]
        left += [f"{item.name}: {p.name}" for k, p in enumerate(item.compared) if k not in own]
        at = tuple(kept.index(start + k) for k in own)
        result.append(replace(item, compared=tuple(item.compared[k] for k in own), sizes=item.sizes[own], at=at))
        start += len(item.compared)
    return result, [one.some(kept) for one in statistics], tuple(left)


def _effects(
    listed: Sequence[Candidate], together: Joint, statistics: Sequence[Sums], names: Sequence[str]
) -> list[Compared]:
    """Compare each effect between campaigns by status, chi-square test and parameters, given all effects not absent."""
    status = [_judged(n, item, together, statistics, names) for n, item in enumerate(listed)]
    result = []
    for number, item in enumerate(listed):
        beside = [i for i, (word, _) in zip(listed, status, strict=True) if word != "absent" or i is item]
        kept = sorted(k for i in beside for k in i.at)
        some, own = [one.some(kept) for one in statistics], [kept.index(k) for k in item.at]
        chi2, degrees, p_value = _equal(some, own) if own else (0.0, 0, 1.0)
        word, reason = status[number]
        result.append(
            Compared(
                name=item.name,
                title=item.title,
                status=word,
                reason=reason,
                probability=together.probability[number],
                named=tuple(name for name, yes in zip(names, item.named, strict=True) if yes),
                chi2=chi2,
                degrees=degrees,
                p_value=p_value,
                parameters=() if word == "absent" else _parameters(item, some, own, names),
            )
        )
    return result


def _changes(listed: Sequence[Candidate], together: Joint, names: Sequence[str]) -> tuple[Change, ...]:
    """Collect the differences between campaigns, largest chi-square first; those of one effect and place are merged."""
    by_place = sorted(together.changes, key=lambda c: (c.part.effect, c.part.place))
    found = (list(some) for _, some in groupby(by_place, key=lambda c: (c.part.effect, c.part.place)))
    changes = (_change(listed[some[0].part.effect], some, together, names) for some in found)
    return tuple(sorted(changes, key=lambda c: -c.chi2))


def _change(item: Candidate, some: Sequence[Differs], together: Joint, names: Sequence[str]) -> Change:
    kinds: dict[Any, list[int]] = {}  # campaigns in groups that have one value
    for c in range(len(names)):
        kinds.setdefault(tuple(c in differs.part.where for differs in some), []).append(c)
    groups = list(kinds.values())
    steps = len(groups) == 2 and max(groups[0]) < min(groups[1])
    own = [item.at.index(k) for k in sorted({k for differs in some for k in differs.part.parameters})]
    single = together.values[:, item.at[own[0]]] * item.sizes[own[0]] if len(own) == 1 else np.zeros(0)
    best = max(some, key=lambda differs: differs.chi2)
    kind, place = best.part.place
    return Change(
        effect=item.name,
        title=item.title,
        kind=kind,
        place=place,
        parameters=tuple(item.compared[k].name for k in own),
        groups=tuple(tuple(names[c] for c in group) for group in groups),
        since=names[min(groups[1])] if steps else "",
        values=tuple(single.tolist()),
        unit=item.compared[own[0]].unit if len(own) == 1 else "",
        chi2=sum(differs.chi2 for differs in some),
        degrees=sum(differs.degrees for differs in some),
        p_value=min(1.0, best.p_value * together.looked_at),
        probability=best.probability,
    )


def _judged(
    number: int, item: Candidate, found: Joint, statistics: Sequence[Sums], names: Sequence[str]
) -> tuple[Status, str]:
    """Status of an effect, and the reason where it is contradicted or not compared."""
    tell = [c for c, one in enumerate(statistics) if one.informs(item.at)]
    at_work = any(part.effect == number for part in found.parts)
    if not any(item.named) and (len(tell) < 2 or not at_work):
        return "absent", ""
    if len(tell) < 2:
        alone = f"{names[tell[0]]} alone can tell it" if tell else "no campaign tells it beside the frames"
        return "not_compared", alone
    if not at_work:
        return "not_needed", "the campaigns together do not need it"
    if not any(change.part.effect == number for change in found.changes):
        return "shared", ""
    whole, agreed, needed = 0.0, 0.0, set()
    for own in item.places.values():
        metric = np.sum([statistics[c].some(own).matrix for c in tell], axis=0)
        values = {c: found.values[c, own] for c in tell}
        size = {c: _length(value, metric) for c, value in values.items()}
        needed |= {c for c in tell if size[c] > 0.0}
        whole += max(size.values()) ** 2
        agreed += max(size.values()) ** 2 * _agree(values, size, metric)
    if whole == 0.0 or agreed / whole >= settings.MOST or (len(tell) == 2 and len(needed) == 1):
        return "changed", ""  # of two campaigns one alone needs it: a fault that began or was mended
    return "contradicts", _why([names[c] for c in sorted(needed)], [names[c] for c in tell if c not in needed])


def _agree(values: dict[int, Array], size: dict[int, float], metric: Array) -> bool:
    """Whether any two campaigns have nearly the same effect at one place: they differ by half of the larger at most.

    Lengths are in the metric of the information; two that are equal because neither has the effect do not count.
    """
    for a, b in combinations(values, 2):
        left = _length(values[a] - values[b], metric)
        if size[a] > 0.0 if left == 0.0 else left <= settings.AGREE * max(size[a], size[b]):
            return True
    return False


def _length(vector: Array, metric: Array) -> float:
    return float(np.sqrt(max(float(vector @ metric @ vector), 0.0)))


def _why(needed: Sequence[str], others: Sequence[str]) -> str:
    excluded = f"and {_listed(others)} {'excludes' if len(others) == 1 else 'exclude'} it" if others else ""
    if len(needed) == 1:
        return f"{needed[0]} alone needs it, {excluded}"
    if others:
        return f"{_listed(needed)} need it in different sizes, {excluded}"
    return f"{_listed(needed)} each need another size, with none in common"


def _listed(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def _parameters(
    item: Candidate, statistics: Sequence[Sums], own: list[int], names: Sequence[str]
) -> tuple[Parameter, ...]:
    """Estimate an effect's parameters by each campaign alone (pseudo-inverse); ``own`` are indices in ``statistics``.

    A value is ``None`` where a campaign does not see it fully, or to no better than one expected size.
    """
    values, stds = np.full((2, len(statistics), len(own)), np.nan)
    for c, one in enumerate(statistics):
        covariance, seen = one.inverse
        spread = np.sqrt(np.maximum(np.diag(covariance)[own], 0.0))
        known = (seen[own] > settings.SEEN) & (spread < settings.TOLD)
        values[c, known] = ((covariance @ one.vector)[own] * item.sizes)[known]
        stds[c, known] = (spread * item.sizes)[known]
    found = []
    for k, p in enumerate(item.compared):
        plain = [tuple(None if np.isnan(v) else float(v) for v in column[:, k]) for column in (values, stds)]
        tests = _differ(values[:, k], stds[:, k], names)
        found.append(Parameter(p.name, p.kind, p.place, p.unit, plain[0], plain[1], **tests))
    return tuple(found)


def _differ(values: Array, stds: Array, names: Sequence[str]) -> dict[str, Any]:
    """Compare one parameter: the two campaigns most deviations apart, and the chi-square test that all are equal."""
    known = np.flatnonzero(np.isfinite(values)).tolist()
    if len(known) < 2:
        return {}
    spread = {(a, b): float(np.hypot(stds[a], stds[b])) for a, b in combinations(known, 2)}
    a, b = max(spread, key=lambda pair: abs(values[pair[1]] - values[pair[0]]) / spread[pair])
    weight = stds[known] ** -2.0
    mean = float(weight @ values[known] / weight.sum())
    chi2, degrees = float(weight @ (values[known] - mean) ** 2), len(known) - 1
    return {
        "between": (names[a], names[b]),
        "difference": float(values[b] - values[a]),
        "std": spread[a, b],
        "chi2": chi2,
        "degrees": degrees,
        "p_value": float(chdtrc(degrees, chi2)),
    }


def _equal(statistics: Sequence[Sums], own: Sequence[int]) -> tuple[float, int, float]:
    """Chi-square test of equality of some parameters in all campaigns: χ², degrees of freedom, p-value."""
    others = [k for k in range(len(statistics[0].vector)) if k not in set(own)]
    chi2, degrees, longest = 0.0, 0, 0.0
    together, score = np.zeros((len(own),) * 2), np.zeros(len(own))
    for one in statistics:
        inverse, _ = one.some(others).inverse
        cross = one.matrix[np.ix_(own, others)] @ inverse
        left = one.matrix[np.ix_(own, own)] - cross @ one.matrix[np.ix_(others, own)]
        what = one.vector[list(own)] - cross @ one.vector[others]
        length = float(np.diag(one.matrix)[list(own)].max(initial=0.0))
        quadratic, rank = _quadratic(left, what, length)
        chi2, degrees, longest = chi2 + quadratic, degrees + rank, max(longest, length)
        together, score = together + left, score + what
    quadratic, rank = _quadratic(together, score, longest)
    chi2, degrees = max(chi2 - quadratic, 0.0), degrees - rank
    return chi2, degrees, float(chdtrc(degrees, chi2)) if degrees > 0 else 1.0


def _quadratic(matrix: Array, vector: Array, longest: float) -> tuple[float, int]:
    """Quadratic form vᵀ M⁺ v of a vector v and a matrix M, and M's rank; eigenvalues of rounding size count as zero."""
    value, axes = np.linalg.eigh(0.5 * (matrix + matrix.T))
    seen = value > max(inference.INFORMATION_FLOOR, inference.PROJECTED_FLOOR * longest)
    along = axes[:, seen].T @ vector
    return float((along**2 / value[seen]).sum()), int(seen.sum())


def _predicted(a: Diagnosis | ModelAsFit, b: Diagnosis | ModelAsFit, names: tuple[str, str]) -> Predicted:
    """Cross-validate two campaigns' models: rms difference of predictions at common poses, and stated deviation.

    Frames are projected out. Where nothing can be predicted the result has no poses and a note.
    """
    nothing = Predicted(names, 0, 0.0, 0.0, 0.0, True)
    if a.model.simulated or b.model.simulated:
        return replace(nothing, note="predictions of a simulator stand in the place of the model's own")
    spreads = [spread for spread in (a.model.spread, b.model.spread) if spread is not None]
    if len(spreads) < 2:
        return replace(nothing, note="a model does not state how far its predictions may be off")
    joints = a.model.robot.joint_names
    common = _common(joints, *(spread.ranges for spread in spreads))
    low, high = np.array([common[name] for name in joints]).T
    rows = [_some(found.rows.q) for found in (a, b) if not isinstance(found, ModelAsFit)]
    q = np.concatenate(rows) if rows else np.zeros((0, len(low)))
    if not rows and (low <= high).all():  # neither has its rows
        q = poses(a.model, common)
    q = q[((q >= low - STILL) & (q <= high + STILL)).all(axis=1)]
    if len(q) < settings.TRIED:
        return replace(nothing, note="the two did not measure a common part of the workspace")
    at = [observed(found.model, q, common) for found in (a, b)]
    gauge = _gauge(a.model, b.model, at[0])
    gap = _left(_points(a.model, at[0]) - _points(b.model, at[1]), gauge)
    variance = sum(_variance(d.model, s, one, gauge) for d, s, one in zip((a, b), spreads, at, strict=True))
    distance, stated = np.sqrt((gap**2).sum(axis=1)), np.sqrt(np.asarray(variance).sum(axis=1))
    rms, deviation = float(np.sqrt((distance**2).mean())), float(np.sqrt((stated**2).mean()))
    far = float((distance > settings.TWICE * stated).mean())
    return Predicted(names, len(q), rms, deviation, far, rms <= settings.TWICE * deviation)


def _some(q: Array) -> Array:
    """Return at most 400 evenly spaced rows of joint positions (N, n)."""
    count = min(len(q), settings.POSES)
    return np.asarray(q[np.linspace(0, len(q) - 1, count).astype(int)])


def _common(joints: Sequence[str], first: Ranges, second: Ranges) -> Ranges:
    """Intersect the measured ranges of two campaigns by joint and column; one that only one campaign has is its own.

    Low is above high where ranges do not overlap.
    """
    found = {}
    for name in dict.fromkeys((*joints, *first, *second)):
        low, high = np.array([ranges[name] for ranges in (first, second) if name in ranges]).T
        ends = float(low.max()), float(high.min())
        held = name in joints and ends[1] < ends[0] <= ends[1] + STILL
        found[name] = ends[::-1] if held else ends
    return found


def _points(model: CorrectedModel, at: Observations) -> Array:
    """Predict the target's position (N, 3), m, in the root frame by a corrected model."""
    _, instrument = displacement(at, model.effects)
    point = at.predicted_position + (0.0 if instrument is None else instrument)
    return np.asarray((point - model.frames.base[:3, 3]) @ model.frames.base[:3, :3])


def _gauge(a: CorrectedModel, b: CorrectedModel, at: Observations) -> Array:
    """Orthonormal basis (3 N, g) of the target's displacements by frames (base, tool) unknown in either campaign."""
    columns = np.zeros((len(at.q), 3, 0))
    if not (a.settings.base_known and b.settings.base_known):
        columns = np.concatenate([columns, at.base_sensitivity[:, :3, :]], axis=2)
    if not (a.settings.tool_known and b.settings.tool_known):
        columns = np.concatenate([columns, at.tool_sensitivity[:, :3, :3]], axis=2)
    return orthonormal(equations_of(columns)) if columns.shape[2] else equations_of(columns)


def _left(values: Array, gauge: Array) -> Array:
    """Project the span of an orthonormal basis ``gauge`` (3 N, g) out of columns (N, 3) or (N, 3, K)."""
    return without(values.reshape(gauge.shape[0], -1), gauge).reshape(values.shape)


def _variance(model: CorrectedModel, spread: Spread, at: Observations, gauge: Array) -> Array:
    """Predictive variance (N, 3), m², per axis of the root frame: of the parameters without the gauge, and beyond."""
    turned = model.frames.base[:3, :3]
    moved = sensitivity(at, [effect for effect, _ in model.effects])
    moved = _left(np.einsum("ji,njk->nik", turned, moved), gauge)
    return by_parameters(moved, spread.covariance) + (turned.T**2) @ spread.beyond**2


def _require_same_robot(robots: Sequence[Robot], names: Sequence[str]) -> None:
    """Refuse to compare campaigns whose joints differ, or whose same joints put the tool frame elsewhere."""
    first, (low, high) = robots[0], np.nan_to_num(joint_range(robots[0]), neginf=-1.0, posinf=1.0)
    q = np.random.default_rng(0).uniform(low, high, (settings.TRIED, first.n))
    for robot, name in zip(robots[1:], names[1:], strict=True):
        if robot.joint_names != first.joint_names:
            problem = f"is of another robot than {names[0]}: their joints differ"
            joints = ", ".join(robot.joint_names), ", ".join(first.joint_names)
            raise CampaignError(name, problem, found=joints[0], expected=joints[1])
        apart = float(np.abs(robot.forward(q) - first.forward(q)).max())
        if apart > settings.SAME_PLACE:
            raise CampaignError(
                name,
                f"is described by another nominal model than {names[0]}: the same joint positions put "
                f"{robot.tool_frame} up to {apart * 1e3:.3g} mm away from {first.tool_frame}",
                expected="the same URDF and tool frame for all campaigns",
            )
