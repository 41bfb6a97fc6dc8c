"""One verb: campaigns of one robot go in, what they share and what changed comes out.

Names. A wrong name fits one campaign, and takes another size in the next. So an effect keeps its name if two campaigns
agree on most of it: the same size within half of the larger, which wear and re-adjustment leave alike.

Parameters. A campaign alone says θ = G⁺b with covariance G⁺ of all effects that are at work in any campaign together.
Of one effect with the others free, it says I θ = s, where I and s are what is left of G and b once the others are
projected out; then

    χ² = Σ_c s_cᵀ I_c⁺ s_c − (Σ s_c)ᵀ (Σ I_c)⁺ (Σ s_c)

has Σ rank I_c − rank Σ I_c degrees of freedom if the effect is the same in all campaigns. What only one of them
determines adds to neither.

Predictions, where both campaigns measured: the cross-validation of mrcal (D. Kogan, *mrcal*: cross-validation of
calibrations): two solutions of the same thing differ by noise, whose size each states. Where they differ by more than
twice that, a model is wrong. Base and tool of each campaign are its own, so that a base twist and a shift of the target
that make the two alike mean nothing and are fitted away, in the difference and in the deviations.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from itertools import combinations, groupby
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import chdtrc
from threadpoolctl import threadpool_limits

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.campaign.settings import STILL
from thermal_robot.correction import CorrectedModel
from thermal_robot.diagnosis import Diagnosis, diagnose
from thermal_robot.effects import Effect
from thermal_robot.effects import Parameter as Told
from thermal_robot.effects.apply import displacement
from thermal_robot.errors import CampaignError, require
from thermal_robot.fleet import compare_settings
from thermal_robot.fleet.compare_joint import Change as Differs
from thermal_robot.fleet.compare_joint import Joint, joint
from thermal_robot.fleet.compare_sums import (
    Candidate,
    Known,
    Sums,
    candidates,
    is_model,
    known,
    observed,
    poses,
    sums,
    sums_of_model,
    told,
)
from thermal_robot.fleet.comparison import Change, Comparison, Parameter, Predicted, Status
from thermal_robot.fleet.comparison import Effect as Compared
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import equations_of, orthonormal
from thermal_robot.inference.fit import Fit
from thermal_robot.observations import Observations
from thermal_robot.prediction import sensitivity
from thermal_robot.robot import Robot, joint_range

CALL = "compare()"
_ORDER = ("shared", "changed", "contradicts", "not_needed", "not_compared", "absent")
Owners = Sequence[tuple[int, int]]


def compare(
    *campaigns: Campaign | Diagnosis | CorrectedModel | str | Path,
    names: Sequence[str] = (),
    only: Iterable[str] | None = None,
    without: Iterable[str] = (),
    effects: Sequence[Effect] = (),
    progress: Callable[[str], None] = lambda _: None,
) -> Comparison:
    """Say what campaigns of one robot share, and what changed between them.

    What an unknown frame takes up, such as the first joint's zero, means nothing between campaigns: it is projected out
    before anything is compared. One joint fit of all campaigns then weighs by evidence whether each effect is the same
    in all of them or differs, place by place. An effect on whose size no two campaigns agree loses its name.

    Parameters
    ----------
    *campaigns
        Two or more, in the order in which they were measured: campaigns, their diagnoses, corrected models, or paths of
        campaigns and of model files (``.json``). A model says nothing of effects that it does not hold.
    names
        What they are called; by default their own names.
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

    Examples
    --------
    >>> import thermal_robot as tr
    >>> robot = tr.load_robot("builtin:rv_m2", "tool0")
    >>> monday = tr.simulate(robot, rows=40, noise=2e-5, seed=1)
    >>> friday = tr.simulate(robot, {"joint_offset": {"joint_3": 1e-3}}, rows=40, noise=2e-5, seed=2)
    >>> found = tr.compare(monday, friday, names=["monday", "friday"])
    >>> [(change.effect, change.place, change.since) for change in found.changes]
    [('joint_offset', 'joint_3', 'friday')]
    """
    expected = "campaigns, their diagnoses, models, or paths of campaigns and models"
    for campaign in campaigns:
        require(CALL, campaign, (Campaign, Diagnosis, CorrectedModel, str, os.PathLike), expected)
    if len(campaigns) < 2:
        raise CampaignError(
            CALL, "nothing to compare with", found=f"{len(campaigns)}", expected="two campaigns or more"
        )
    found: list[Diagnosis | Known] = []
    for number, campaign in enumerate(campaigns):
        told_on = _after(f"campaign {number + 1} of {len(campaigns)}: ", progress)
        opened = _opened(campaign, effects)
        if not isinstance(opened, (Diagnosis, Known)):
            opened = diagnose(opened, only=only, without=without, effects=effects, progress=told_on)
        found.append(opened)
    called = _called(found, names)
    found = [replace(d, campaign=name) if isinstance(d, Known) else d for d, name in zip(found, called, strict=True)]
    fits = _usable(found, called)
    _require_same_robot([one.model.robot for one in found], called)
    with threadpool_limits(1):
        return _compared(found, fits, called, progress)


def _opened(given: Any, effects: Sequence[Effect]) -> Any:
    """Return a model as something to compare, and anything else as it is."""
    if is_model(given):
        return known(CorrectedModel.load(given, effects), Path(given).name)
    return known(given, given.robot.name) if isinstance(given, CorrectedModel) else given


def _after(stage: str, progress: Callable[[str], None]) -> Callable[[str], None]:
    return lambda words: progress(stage + words)


def _called(found: Sequence[Diagnosis | Known], names: Sequence[str]) -> tuple[str, ...]:
    """Return a name for each campaign, none twice."""
    require(f"{CALL}, names", names, (list, tuple), "a name for each campaign")
    if names and len(names) != len(found):
        raise CampaignError(
            f"{CALL}, names", "one is needed for each campaign", found=f"{len(names)}", expected=f"{len(found)}"
        )
    own = [str(name) for name in names] or [diagnosis.campaign for diagnosis in found]
    if len(set(own)) == len(own):
        return tuple(own)
    return tuple(f"{name} ({k + 1})" if own.count(name) > 1 else name for k, name in enumerate(own))


def _usable(found: Sequence[Diagnosis | Known], names: Sequence[str]) -> list[Fit | Known]:
    fits: list[Fit | Known] = []
    for diagnosis, name in zip(found, names, strict=True):
        if isinstance(diagnosis, Known):
            fits.append(diagnosis)
            continue
        if not diagnosis.usable:
            raise CampaignError(
                name, "cannot be compared", found=diagnosis.reason, expected="a campaign that is usable"
            )
        if diagnosis.fit is None:
            raise CampaignError(name, "this diagnosis was made without its fit", expected="one made by diagnose()")
        fits.append(diagnosis.fit)
    return fits


def _compared(
    found: Sequence[Diagnosis | Known],
    fits: Sequence[Fit | Known],
    names: tuple[str, ...],
    progress: Callable[[str], None],
) -> Comparison:
    progress("what each campaign says")
    listed = candidates(found, fits, names)
    every = [(effect, k) for effect, item in enumerate(listed) for k in range(len(item.told))]
    said = [_said(d, fit, listed, c) for c, (d, fit) in enumerate(zip(found, fits, strict=True))]
    kept = told(said)
    owners, said = [every[k] for k in kept], [one.some(kept) for one in said]
    progress("what is shared, what differs")
    together = joint(listed, owners, said)
    progress("predictions")
    effects = sorted(_effects(listed, owners, together, said, names), key=lambda e: (_ORDER.index(e.status), e.name))
    return Comparison(
        campaigns=names,
        samples=tuple(d.samples for d in found),
        robot=found[0].robot,
        tool_frame=found[0].tool_frame,
        effects=tuple(effects),
        changes=_changes(listed, owners, together, names),
        predicted=_predicted(found, names),
        not_told=tuple(
            f"{listed[effect].name}: {listed[effect].told[k].name}"
            for number, (effect, k) in enumerate(every)
            if number not in set(kept)
        ),
        looked_at=together.looked_at,
        diagnoses=tuple(found),
    )


def _said(found: Diagnosis | Known, fit: Fit | Known, listed: Sequence[Candidate], number: int) -> Sums:
    if isinstance(found, Diagnosis) and isinstance(fit, Fit):
        return sums(found, fit, listed, number)
    assert isinstance(found, Known)
    return sums_of_model(found, listed, number)


def _effects(
    listed: Sequence[Candidate], owners: Owners, together: Joint, said: Sequence[Sums], names: Sequence[str]
) -> list[Compared]:
    """Return what is compared of each effect, beside those at work or named."""
    status = {n: _judged(n, item, owners, together, said, names) for n, item in enumerate(listed)}
    beside = {n for n in status if status[n][0] != "absent"}
    result = []
    for number, item in enumerate(listed):
        kept = [k for k, (effect, _) in enumerate(owners) if effect in beside | {number}]
        some, own = [one.some(kept) for one in said], [k for k, at in enumerate(kept) if owners[at][0] == number]
        which = [owners[kept[k]][1] for k in own]
        chi2, degrees, p_value = _equal(some, own) if own else (0.0, 0, 1.0)
        one_by_one = _parameters([item.told[p] for p in which], item.sizes[which], some, own, names)
        named = tuple(name for name, yes in zip(names, item.named, strict=True) if yes)
        result.append(
            Compared(
                item.name,
                item.title,
                *status[number],
                together.probability[number],
                named,
                chi2,
                degrees,
                p_value,
                one_by_one if number in beside else (),
            )
        )
    return result


def _changes(listed: Sequence[Candidate], owners: Owners, together: Joint, names: Sequence[str]) -> tuple[Change, ...]:
    """Return what differs: parts of one effect at one place are one change."""
    result = []
    by_place = sorted(together.changes, key=lambda c: (c.part.effect, c.part.place))
    for (effect, (kind, place)), some in groupby(by_place, key=lambda c: (c.part.effect, c.part.place)):
        differing: list[Differs] = list(some)
        item, groups = listed[effect], _groups([c.part.where for c in differing], len(names))
        own = sorted({k for c in differing for k in c.part.parameters})
        told_here, best = [item.told[owners[k][1]] for k in own], max(differing, key=lambda c: c.chi2)
        single = together.values[:, own[0]] * item.sizes[owners[own[0]][1]] if len(own) == 1 else np.zeros(0)
        result.append(
            Change(
                item.name,
                item.title,
                kind,
                place,
                tuple(p.name for p in told_here),
                tuple(tuple(names[c] for c in group) for group in groups),
                _since(groups, names),
                tuple(single.tolist()),
                told_here[0].unit if len(own) == 1 else "",
                sum(c.chi2 for c in differing),
                sum(c.degrees for c in differing),
                min(1.0, best.p_value * together.looked_at),
                best.probability,
            )
        )
    return tuple(sorted(result, key=lambda c: -c.chi2))


def _groups(where: Sequence[Sequence[int]], campaigns: int) -> list[list[int]]:
    """Return the campaigns in groups that have one value."""
    kinds: dict[Any, list[int]] = {}
    for c in range(campaigns):
        kinds.setdefault(tuple(c in own for own in where), []).append(c)
    return list(kinds.values())


def _since(groups: Sequence[Sequence[int]], names: Sequence[str]) -> str:
    """Return the campaign from which on there is a new value; empty where groups are not one before and one after."""
    if len(groups) != 2 or max(groups[0]) > min(groups[1]):
        return ""
    return names[min(groups[1])]


def _judged(
    number: int,
    item: Candidate,
    owners: Sequence[tuple[int, int]],
    found: Joint,
    said: Sequence[Sums],
    names: Sequence[str],
) -> tuple[Status, str]:
    """Return the status of an effect, and the reason where it loses its name or is not compared."""
    own = [k for k, (effect, _) in enumerate(owners) if effect == number]
    tell = [c for c, one in enumerate(said) if np.diag(one.matrix)[own].max(initial=0.0) > settings.INFORMATION_FLOOR]
    if len(tell) < 2:
        if not any(item.named):
            return "absent", ""
        return (
            "not_compared",
            f"{names[tell[0]]} alone can tell it" if tell else "no campaign tells it beside the frames",
        )
    if not any(part.effect == number for part in found.parts):
        if not any(item.named):
            return "absent", ""
        return "not_needed", "the campaigns together do not need it"
    changed = any(change.part.effect == number for change in found.changes)
    if not changed:
        return "shared", ""
    sizes = _strengths(own, item, owners, found, said, tell)
    if _agreed(sizes) >= compare_settings.MOST:
        return "changed", ""
    needed = [c for c in tell if max(size[c] for size, _ in sizes) > 0.0]
    if len(tell) == 2 and len(needed) == 1:
        return "changed", ""  # a fault that began or was mended: two campaigns cannot say more
    return "contradicts", _why([names[c] for c in needed], [names[c] for c in tell if c not in needed])


def _strengths(
    own: Sequence[int],
    item: Candidate,
    owners: Sequence[tuple[int, int]],
    found: Joint,
    said: Sequence[Sums],
    tell: Sequence[int],
) -> list[tuple[dict[int, float], dict[tuple[int, int], float]]]:
    """Return for each place the size in each campaign, and that of the difference between any two, in deviations."""
    result = []
    for place in dict.fromkeys((p.kind, p.place) for p in item.told):
        inside = [k for k in own if (item.told[owners[k][1]].kind, item.told[owners[k][1]].place) == place]
        metric = np.sum([said[c].matrix[np.ix_(inside, inside)] for c in tell], axis=0) if inside else np.zeros((0, 0))
        values = {c: found.values[c, inside] for c in tell}
        size = {c: _length(values[c], metric) for c in tell}
        apart = {(a, b): _length(values[a] - values[b], metric) for a, b in combinations(tell, 2)}
        result.append((size, apart))
    return result


def _length(vector: Array, metric: Array) -> float:
    return float(np.sqrt(max(float(vector @ metric @ vector), 0.0)))


def _agreed(sizes: Sequence[tuple[dict[int, float], dict[tuple[int, int], float]]]) -> float:
    """Return the share of the strength on which two campaigns agree."""
    whole, agreed = 0.0, 0.0
    for size, apart in sizes:
        strength = max(size.values()) ** 2
        alike = any(0.0 < left <= compare_settings.AGREE * max(size[a], size[b]) for (a, b), left in apart.items())
        same = any(left == 0.0 and size[a] > 0.0 for (a, _), left in apart.items())
        whole, agreed = whole + strength, agreed + strength * (alike or same)
    return agreed / whole if whole else 1.0


def _why(needed: Sequence[str], others: Sequence[str]) -> str:
    if len(needed) == 1:
        verb = "excludes" if len(others) == 1 else "exclude"
        return f"{needed[0]} alone needs it, and {_listed(others)} {verb} it"
    if others:
        verb = "excludes" if len(others) == 1 else "exclude"
        return f"{_listed(needed)} need it in different sizes, and {_listed(others)} {verb} it"
    return f"{_listed(needed)} each need another size, with none in common"


def _listed(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def _parameters(
    told: Sequence[Told], sizes: Array, said: Sequence[Sums], numbers: Sequence[int], names: Sequence[str]
) -> tuple[Parameter, ...]:
    """Return parameters as each campaign alone has them; ``numbers`` says where they stand in ``said``."""
    values, stds = np.full((len(said), len(told)), np.nan), np.full((len(said), len(told)), np.nan)
    for c, one in enumerate(said):
        covariance, seen = one.inverse
        spread = np.sqrt(np.maximum(np.diag(covariance)[list(numbers)], 0.0))
        known = (seen[list(numbers)] > compare_settings.SEEN) & (spread < compare_settings.TOLD)
        values[c, known] = (covariance @ one.vector)[list(numbers)][known] * sizes[known]
        stds[c, known] = spread[known] * sizes[known]
    return tuple(_parameter(p, values[:, k], stds[:, k], names) for k, p in enumerate(told))


def _parameter(told: Told, values: Array, stds: Array, names: Sequence[str]) -> Parameter:
    known = np.flatnonzero(np.isfinite(values)).tolist()
    plain = [tuple(None if np.isnan(v) else float(v) for v in column) for column in (values, stds)]
    own = Parameter(told.name, told.kind, told.place, told.unit, plain[0], plain[1])
    if len(known) < 2:
        return own
    pairs = list(combinations(known, 2))
    spread = [float(np.hypot(stds[a], stds[b])) for a, b in pairs]
    most = max(range(len(pairs)), key=lambda k: abs(values[pairs[k][1]] - values[pairs[k][0]]) / spread[k])
    a, b = pairs[most]
    weight = stds[known] ** -2.0
    mean = float(weight @ values[known] / weight.sum())
    chi2, degrees = float(weight @ (values[known] - mean) ** 2), len(known) - 1
    return Parameter(
        told.name,
        told.kind,
        told.place,
        told.unit,
        plain[0],
        plain[1],
        (names[a], names[b]),
        float(values[b] - values[a]),
        spread[most],
        chi2,
        degrees,
        float(chdtrc(degrees, chi2)),
    )


def _equal(said: Sequence[Sums], numbers: Sequence[int]) -> tuple[float, int, float]:
    """Return χ², degrees of freedom and probability by chance of some parameters being the same in all campaigns."""
    own = list(numbers)
    others = [k for k in range(len(said[0].vector)) if k not in set(own)]
    chi2, degrees = 0.0, 0
    together, score = np.zeros((len(own),) * 2), np.zeros(len(own))
    for one in said:
        inverse, _ = one.some(others).inverse
        cross = one.matrix[np.ix_(own, others)] @ inverse
        left = one.matrix[np.ix_(own, own)] - cross @ one.matrix[np.ix_(others, own)]
        what = one.vector[own] - cross @ one.vector[others]
        quadratic, rank = _quadratic(left, what, float(np.diag(one.matrix)[own].max(initial=0.0)))
        chi2, degrees, together, score = chi2 + quadratic, degrees + rank, together + left, score + what
    quadratic, rank = _quadratic(together, score, float(max(np.diag(one.matrix)[own].max(initial=0.0) for one in said)))
    chi2, degrees = max(chi2 - quadratic, 0.0), degrees - rank
    return chi2, degrees, float(chdtrc(degrees, chi2)) if degrees > 0 else 1.0


def _quadratic(matrix: Array, vector: Array, longest: float) -> tuple[float, int]:
    """Return vᵀ M⁺ v and the rank of M; what is left of columns of this square by rounding is none."""
    value, axes = np.linalg.eigh(0.5 * (matrix + matrix.T))
    seen = value > max(settings.INFORMATION_FLOOR, settings.PROJECTED_FLOOR * longest)
    along = axes[:, seen].T @ vector
    return float((along**2 / value[seen]).sum()), int(seen.sum())


def _predicted(found: Sequence[Diagnosis | Known], names: Sequence[str]) -> tuple[Predicted, ...]:
    """Cross-validate the models of every two campaigns."""
    pairs = combinations(range(len(found)), 2)
    return tuple(_pair(found[a], found[b], (names[a], names[b])) for a, b in pairs)


def _pair(a: Diagnosis | Known, b: Diagnosis | Known, names: tuple[str, str]) -> Predicted:
    nothing = Predicted(names, 0, 0.0, 0.0, 0.0, True)
    if a.model.simulated or b.model.simulated:
        return replace(nothing, note="predictions of a simulator stand in the place of the model's own")
    if a.model.spread is None or b.model.spread is None:
        return replace(nothing, note="a model does not state how far its predictions may be off")
    common = _common(a.model, b.model)
    low, high = np.array([common[name] for name in a.model.robot.joint_names]).T
    rows = [_some(found.rows.q) for found in (a, b) if not isinstance(found, Known)]
    q = np.concatenate(rows) if rows else np.zeros((0, len(low)))
    if not rows and (low <= high).all():  # neither has its rows
        q = poses(a.model.robot, common)
    q = q[((q >= low - STILL) & (q <= high + STILL)).all(axis=1)]
    if len(q) < compare_settings.TRIED:
        return replace(nothing, note="the two did not measure a common part of the workspace")
    at = [observed(found.model, q, common) for found in (a, b)]
    gauge = _gauge(a.model, b.model, at[0])
    gap = _left(_points(a.model, at[0]) - _points(b.model, at[1]), gauge)
    variance = sum(_variance(found.model, one, gauge) for found, one in zip((a, b), at, strict=True))
    distance, stated = np.sqrt((gap**2).sum(axis=1)), np.sqrt(np.asarray(variance).sum(axis=1))
    rms, deviation = float(np.sqrt((distance**2).mean())), float(np.sqrt((stated**2).mean()))
    far = float((distance > compare_settings.TWICE * stated).mean())
    return Predicted(names, len(q), rms, deviation, far, rms <= compare_settings.TWICE * deviation)


def _some(q: Array) -> Array:
    """Return rows spread evenly over all."""
    count = min(len(q), compare_settings.POSES)
    return np.asarray(q[np.linspace(0, len(q) - 1, count).astype(int)])


def _common(a: CorrectedModel, b: CorrectedModel) -> dict[str, tuple[float, float]]:
    """Return the range that both measured of each joint and column; where one alone has the column, its own."""
    first, second = (model.spread.ranges if model.spread else {} for model in (a, b))
    found = {}
    for name in (*a.robot.joint_names, *dict.fromkeys((*first, *second))):
        ends = [ranges[name] for ranges in (first, second) if name in ranges]
        low, high = max(low for low, _ in ends), min(high for _, high in ends)
        held = name in a.robot.joint_names and high < low <= high + STILL
        found[name] = (high, low) if held else (low, high)
    return found


def _points(model: CorrectedModel, at: Observations) -> Array:
    """(N, 3) the predicted target in the root frame, m."""
    _, instrument = displacement(at, model.effects)
    point = at.predicted_position + (0.0 if instrument is None else instrument)
    return np.asarray((point - model.frames.base[:3, 3]) @ model.frames.base[:3, :3])


def _gauge(a: CorrectedModel, b: CorrectedModel, at: Observations) -> Array:
    """(3 N, g) orthonormal columns of what aligning the unknown frames of either does."""
    parts = []
    if not (a.settings.base_known and b.settings.base_known):
        parts.append(at.base_sensitivity[:, :3, :])
    if not (a.settings.tool_known and b.settings.tool_known):
        parts.append(at.tool_sensitivity[:, :3, :3])
    if not parts:
        return np.zeros((3 * len(at.q), 0))
    columns = np.concatenate(parts, axis=2)
    return orthonormal(equations_of(columns))


def _left(values: Array, gauge: Array) -> Array:
    """Return columns (N, 3) or (N, 3, K) without what the gauge does."""
    flat = values.reshape(gauge.shape[0], -1)
    return np.asarray(flat - gauge @ (gauge.T @ flat)).reshape(values.shape)


def _variance(model: CorrectedModel, at: Observations, gauge: Array) -> Array:
    """(N, 3) stated variance per axis of the prediction, root frame, m²."""
    spread = model.spread
    assert spread is not None
    turned = model.frames.base[:3, :3]
    moved = sensitivity(at, [effect for effect, _ in model.effects])
    moved = _left(np.einsum("ji,njk->nik", turned, moved), gauge)
    told = ((moved @ spread.covariance) * moved).sum(axis=2)
    beyond = (turned.T**2) @ spread.beyond**2
    return np.asarray(np.maximum(told, 0.0) + beyond)


def _require_same_robot(robots: Sequence[Robot], names: Sequence[str]) -> None:
    """Refuse to compare campaigns whose joints differ, or whose same joints put the tool frame elsewhere."""
    first = robots[0]
    low, high = (
        np.where(np.isfinite(end), end, sign) for end, sign in zip(joint_range(first), (-1.0, 1.0), strict=True)
    )
    q = np.random.default_rng(0).uniform(low, high, (compare_settings.TRIED, first.n))
    for robot, name in zip(robots[1:], names[1:], strict=True):
        if robot.joint_names != first.joint_names:
            raise CampaignError(
                name,
                f"is of another robot than {names[0]}: their joints differ",
                found=", ".join(robot.joint_names),
                expected=", ".join(first.joint_names),
            )
        apart = float(np.abs(robot.forward(q) - first.forward(q)).max())
        if apart > compare_settings.SAME_PLACE:
            raise CampaignError(
                name,
                f"is described by another nominal model than {names[0]}: the same joint positions put "
                f"{robot.tool_frame} up to {apart * 1e3:.3g} mm away from {first.tool_frame}",
                expected="the same URDF and tool frame for all campaigns",
            )
