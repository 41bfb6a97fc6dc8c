"""Other hold-out schemes, which show whether the fit extrapolates.

Neighbouring rows are alike in time, temperature and place. Folds of consecutive rows therefore favour a fit that only
follows the course of the campaign (Roberts et al., *Ecography* 40, 2017, on blocked cross-validation). What is chosen
from all rows is said at :func:`~thermal_robot.diagnosis.held_out.held_out`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.diagnosis.one_walk import Model, Walk, deviation
from thermal_robot.diagnosis.parts import FoldScheme, HeldOut
from thermal_robot.effects.law_words import is_event
from thermal_robot.inference import settings
from thermal_robot.inference.columns import block
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.problem import Linear
from thermal_robot.inference.rows import blocks, each, neighbourhoods

Rows = NDArray[np.bool_]


def worst_folds(fit: Fit) -> tuple[FoldScheme, ...]:
    """Hold rows out by time, session, temperature, region and reach; the scheme of the largest rms after comes first.

    Its shrinkage need not be the smallest, as the gap before may be larger on its rows, too. Every figure has the noise
    of the held-out rows in it. A scheme is left out if the campaign lacks its column; a fold if its training rows do
    not determine the frames.
    """
    model = Model.of(fit.explanation, blocks(fit.campaign))
    plain = model.bare(fit.before)
    known = events_known(fit, plain, model)
    apart = {"time": (plain, model)}
    found = [_judged(*apart.get(name, known), name, words, tests) for name, words, tests in schemes(fit)]
    return tuple(sorted((f for f in found if f is not None), key=lambda f: -f.rms_after))


def events_known(fit: Fit, plain: Model, model: Model) -> tuple[Model, Model]:
    """Return the models of the frames alone and of a fit once what its events moved is taken out of the gap.

    What stands elsewhere in a session is not told by the others, nor what stood elsewhere in all rows of a region:
    whether the rest carries over to these can be asked only where that is known, as by registering anew.
    """
    e, held = fit.explanation, list(zip(fit.explanation.best.blocks, fit.effects, strict=True))
    events = [(b, effect) for b, (effect, _) in held if is_event(effect)]
    if not events:
        return plain, model
    before = fit.before.gap - sum(block(fit.nominal, effect).columns @ e.values[b][0] for b, effect in events)
    after = e.linear.gap - sum(e.linear.contribution(b, e.values[b][0]) for b, _ in events)
    rest = [k for k, (_, (effect, _)) in enumerate(held) if not is_event(effect)]
    linear = Linear(after, e.linear.frames, tuple(model.linear.blocks[k] for k in rest))
    bare = Linear(before, plain.linear.frames, ())
    scales = tuple(model.scales[k] for k in rest)
    return replace(plain, linear=bare, seen={}), replace(model, linear=linear, scales=scales, seen={})


def hardest(schemes: Sequence[FoldScheme], average: HeldOut) -> FoldScheme | None:
    """Return the least favourable scheme where it leaves clearly more than the average; ``None`` where it does not."""
    return next((s for s in schemes[:1] if s.rms_after > settings.HARDER * average.rms_after), None)


def harmed(schemes: Sequence[FoldScheme]) -> FoldScheme | None:
    """Return the way of holding out by session or region that the correction harms; ``None`` where there is none."""
    return next((s for s in schemes if s.name in ("session", "region") and s.shrinkage < 0.0), None)


def worse_elsewhere(narrow: Fit, wider: Fit) -> bool:
    """Tell whether a wider explanation overfits: whether it is worse on held-out regions of joint space."""
    kept = ~(narrow.explanation.outliers | wider.explanation.outliers)
    rows, tests = blocks(narrow.campaign), each(neighbourhoods(narrow.campaign, settings.FOLDS))
    left = []
    for fit in (narrow, wider):
        walk = Walk.over(replace(Model.of(fit.explanation, rows), kept=kept), tests)
        if not walk.tests:
            return False
        left.append(walk.squares(range(len(fit.effects))).total / walk.rows)
    return left[1] > settings.WORSE_ELSEWHERE**2 * left[0]


def schemes(fit: Fit) -> Iterator[tuple[str, str, list[Rows]]]:
    """Yield name and description of each scheme, and a mask (N,) of the rows that each of its folds holds out."""
    campaign = fit.campaign
    yield "time", "blocks of consecutive rows", each(blocks(campaign))
    session = campaign.labels.get("session")
    if session is not None and len(set(session.tolist())) > 1:
        yield "session", "one session after the other", each(np.unique(session, return_inverse=True)[1])
    temperature = _temperature(campaign)
    if temperature is not None and np.ptp(temperature) > settings.COLDEST:
        cold, warm = (np.quantile(temperature, share) for share in (1.0 / settings.FOLDS, 1.0 - 1.0 / settings.FOLDS))
        yield "temperature", "the coldest fifth, and the warmest", [temperature <= cold, temperature >= warm]
    yield "region", "neighbourhoods of joint positions", each(neighbourhoods(campaign, settings.FOLDS))
    reach = np.linalg.norm(fit.nominal.position, axis=1)
    yield "reach", "the fifth that reaches out furthest", [reach >= np.quantile(reach, 1.0 - 1.0 / settings.FOLDS)]


def _temperature(campaign: Campaign) -> Array | None:
    """(N,) temperature of the robot, or the mean of its links, °C; ``None`` if not recorded."""
    recorded = campaign.covariates
    columns = ["temperature"] if "temperature" in recorded else [c for c in recorded if c.startswith("temperature.")]
    return np.mean([recorded[c] for c in columns], axis=0) if columns else None


def _judged(plain: Model, model: Model, name: str, held_out: str, tests: list[Rows]) -> FoldScheme | None:
    walk = Walk.over(model, tests)
    if not walk.tests:
        return None
    before = Walk(plain, walk.tests).squares(())
    after = walk.squares(range(len(model.spans))) if model.spans else before
    return FoldScheme(
        name,
        held_out,
        len(walk.tests),
        walk.rows,
        float(np.sqrt(before.total / walk.rows)),
        float(np.sqrt(after.total / walk.rows)),
        1.0 - after.total / before.total if before.total > 0.0 else 0.0,
        deviation(np.sqrt(after.without / np.maximum(walk.rows_without, 1.0))),
    )
