"""From a diagnosis to what its updates hold of it."""

from __future__ import annotations

import numpy as np

from thermal_robot.diagnosis.growing import settings
from thermal_robot.diagnosis.growing.choice import Choice, Judge, Point, together, without_columns
from thermal_robot.diagnosis.growing.grown import Grown
from thermal_robot.diagnosis.growing.settled import Begin, Single
from thermal_robot.effects import gate
from thermal_robot.inference.fit import Fit


def chosen(fit: Fit) -> Choice:
    """Return what a diagnosis chose: the effects of its fit in their settings, and those that came near.

    Where a discrepancy was found beside them, rows keep the weight that they had: it took part in weighing them, and is
    told from all rows together.
    """
    e, campaign = fit.explanation, fit.campaign
    blocks = tuple(
        without_columns(e.linear.blocks[b], gate.delivered(effect, fit.nominal), e.linear.measures)
        for b, (effect, _) in zip(e.best.blocks, fit.effects, strict=True)
    )
    further = sorted({b for rival in rivals(fit) for b in rival} - {*e.best.blocks})
    listed = ((e.linear.blocks[b], e.linear.blocks[b].effect) for b in further)
    beyond = e.whitening.noise * e.best.noise
    return Choice(
        blocks,
        tuple(without_columns(item, gate.delivered(own, fit.nominal), e.linear.measures) for item, own in listed),
        e.linear.measures,
        campaign.noise_position,
        campaign.noise_orientation,
        None if e.discrepancy.form is None else Judge(_point(fit), beyond, campaign.samples),
    )


def can_grow(fit: Fit) -> bool:
    """Tell whether rows count by themselves: whether nothing of what remains is drawn anew in every pose or visit."""
    return fit.explanation.whitening.smooth is None


def rivals(fit: Fit) -> list[tuple[int, ...]]:
    """Return the combinations of blocks that came nearest to the chosen one, most probable first."""
    e = fit.explanation
    own = max(
        (p for c, p in zip(e.combinations, e.probabilities, strict=True) if c.blocks == e.best.blocks), default=1.0
    )
    found = [
        c.blocks
        for c, p in zip(e.combinations, e.probabilities, strict=True)
        if c.blocks != e.best.blocks and settings.LEAST_RIVAL * own <= p
    ]
    return list(dict.fromkeys(found))[: settings.RIVALS]


def begun(fit: Fit) -> Grown:
    """Return the fit of a diagnosis at rest, ready to take in more rows."""
    e = fit.explanation
    flat = e.linear.frames.shape[2]
    equations = e.problem.equations + flat
    begin = Begin(
        _point(fit),
        np.zeros(flat + sum(len(values) for _, values in fit.effects)),
        e.whitening.noise,
        e.whitening.held,
        (e.best.effective + flat) / max(equations, 1),
    )
    rows = Single(fit.campaign, e.whitening.weights, e.outliers)
    return Grown.of(chosen(fit), (rows,), begin)


def _point(fit: Fit) -> Point:
    return Point(fit.corrected.frames, together([values for _, values in fit.effects]))
