"""Effects that the data want on the side where they cannot be: a sentence with the usual mistake."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from thermal_robot.diagnosis import settings
from thermal_robot.effects import Effect, gate
from thermal_robot.inference.columns import Block
from thermal_robot.inference.evidence import Combination
from thermal_robot.inference.explain import log_priors, settings_of_one
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.gram import Gram
from thermal_robot.inference.problem import Linear, contained, gram
from thermal_robot.inference.refine import heard
from thermal_robot.inference.search import Search

Array = NDArray[np.float64]
NOT_STRAIGHT = 'the robot does not go straight from the pose before to the next, write moves = "unknown" under [robot]'


def wrong_sides(fit: Fit) -> tuple[str, ...]:
    """Return a sentence for each effect that the data insist is negative where it cannot be.

    The known effects are chosen once more, at the final fit, as if every parameter could have either sign. Where that
    is far more probable than the best that keeps every side, each effect in it is told of whose parameters beyond three
    sigma are mostly negative. Rows set aside are heard, as what is denied may have put them aside.
    """
    e = fit.explanation
    kept = [b for b, item in enumerate(e.linear.blocks) if item.effect.share is None]  # laws may have either sign
    linear = Linear(e.linear.gap, e.linear.frames, tuple(e.linear.blocks[b] for b in kept))
    if not any(item.positive.any() for item in linear.blocks):
        return ()
    sided = gram(linear, replace(heard(e), smooth=None))
    either = replace(sided, positive=np.zeros_like(sided.positive))
    start = [kept.index(b) for b in e.best.blocks if b in kept]
    families = [item.effect.name for item in linear.blocks]
    found = _best(linear, families, either, start)
    negative = list(_negative(linear, either, found))
    # what keeps all sides is looked for with as much care, and beside what was found
    if not negative:
        return ()
    beside = [b for b in found.blocks if linear.blocks[b].effect.name not in {effect.name for effect, _ in negative}]
    known = max(_best(linear, families, sided, s).log_evidence for s in (start, beside))
    if found.log_evidence < known + settings.INSISTS:
        return ()
    return tuple(
        f"{effect.title}: negative ({', '.join(places)}), which cannot be: {_mistake(fit, effect)}"
        for effect, places in negative
    )


def _mistake(fit: Fit, effect: Effect) -> str:
    """Return what is usually wrong then; of columns that were not recorded, how they were derived."""
    derived = set(gate.reads(effect, fit.nominal)) & set(fit.campaign.derived)
    return NOT_STRAIGHT if derived else effect.if_negative


def _best(linear: Linear, families: list[str], problem: Gram, start: list[int]) -> Combination:
    apart = contained(problem) | settings_of_one(families)
    search = Search(problem, log_priors([item.effect for item in linear.blocks]), apart)
    return search.climb(start if search.allowed(start) else ())


def _negative(linear: Linear, problem: Gram, found: Combination) -> Iterator[tuple[Effect, tuple[str, ...]]]:
    """Yield each effect that does most of its work on the wrong side, with the places where it does."""
    ends = np.cumsum([0, *(problem.bases[b].shape[1] for b in found.blocks)])
    deviation = np.sqrt(np.diag(found.covariance))
    for b, first, last in zip(found.blocks, ends[:-1], ends[1:], strict=True):
        item: Block = linear.blocks[b]
        if not item.positive.any():
            continue
        own, numbers = slice(first, last), problem.bases[b].argmax(axis=0)  # each column is a parameter
        z = found.values[own] / deviation[own]
        work = found.values[own] ** 2 * np.diag(problem.matrix)[problem.slices[b]]
        sure = (np.abs(z) > settings.WRONG_SIDE) & item.positive[numbers]
        below = sure & (z < 0.0)
        if work[below].sum() > work[sure & (z > 0.0)].sum():
            names = (item.parameters[k].place or item.parameters[k].label for k in numbers[below])
            yield item.effect, tuple(dict.fromkeys(names))
