"""One verb: campaigns of one robot go in, what they share and what changed comes out."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from thermal_robot.campaign import Campaign
from thermal_robot.correction import CorrectedModel
from thermal_robot.diagnosis import Diagnosis, diagnose
from thermal_robot.effects import Effect
from thermal_robot.errors import CampaignError, require
from thermal_robot.fleet.compare_effects import Candidate, candidates
from thermal_robot.fleet.compare_joint import Change as Differs
from thermal_robot.fleet.compare_joint import Joint, joint
from thermal_robot.fleet.compare_model import Known, is_model, known
from thermal_robot.fleet.compare_model_sums import sums_of_model
from thermal_robot.fleet.compare_names import judged
from thermal_robot.fleet.compare_parameters import equal, parameters
from thermal_robot.fleet.compare_poses import predicted
from thermal_robot.fleet.compare_sums import Sums, sums, told
from thermal_robot.fleet.comparison import Change, Comparison
from thermal_robot.fleet.comparison import Effect as Compared
from thermal_robot.fleet.same_robot import require_same_robot
from thermal_robot.inference.fit import Fit

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
    require_same_robot([one.model.robot for one in found], called)
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
        predicted=predicted(found, names),
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
    status = {n: judged(n, item, owners, together, said, names) for n, item in enumerate(listed)}
    beside = {n for n in status if status[n][0] != "absent"}
    result = []
    for number, item in enumerate(listed):
        kept = [k for k, (effect, _) in enumerate(owners) if effect in beside | {number}]
        some, own = [one.some(kept) for one in said], [k for k, at in enumerate(kept) if owners[at][0] == number]
        which = [owners[kept[k]][1] for k in own]
        chi2, degrees, p_value = equal(some, own) if own else (0.0, 0, 1.0)
        one_by_one = parameters([item.told[p] for p in which], item.sizes[which], some, own, names)
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
