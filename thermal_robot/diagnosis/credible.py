"""What is in doubt however well it fits: effects that cancel, and sizes that no robot reaches. Rows held out decide."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import expit

from thermal_robot.diagnosis.cancelling import cancelling
from thermal_robot.diagnosis.one_walk import Model, Walk
from thermal_robot.diagnosis.parts import Refused
from thermal_robot.diagnosis.schemes import schemes
from thermal_robot.effects.effect import UNSOURCED
from thermal_robot.effects.law import PREFIX
from thermal_robot.inference import settings
from thermal_robot.inference.fit import Fit, less
from thermal_robot.inference.rows import blocks


@dataclass(frozen=True)
class Doubt:
    """Effects of which one should not be in the explanation.

    Attributes
    ----------
    effects
        Their names.
    words
        Why, in a sentence without a full stop.
    times
        By how much they are in doubt, as a ratio.
    """

    effects: tuple[str, ...]
    words: str
    times: float


def outsized(fit: Fit) -> tuple[Doubt, ...]:
    """Return each parameter that is surely far outside a size that stands on sources, the farthest first."""
    e, found = fit.explanation, []
    for b, (effect, values) in zip(e.best.blocks, fit.effects, strict=True):
        item, deviation = e.linear.blocks[b], np.sqrt(np.diag(e.values[b][1]))
        sure = np.maximum(np.abs(values) - settings.SIGMAS_95 * deviation, 0.0) / item.sizes
        if effect.size_spread >= UNSOURCED:
            continue
        for k in np.flatnonzero(sure > settings.OUTSIDE):
            times = float(np.abs(values[k]) / item.sizes[k])
            words = (
                f"{effect.title}: {item.parameters[k].name} is {times:.0f} times its expected size, which no robot is "
                "known to reach"
            )
            found.append(Doubt((effect.name,), words, times))
    return tuple(sorted(found, key=lambda doubt: -doubt.times))


def _doubts(fit: Fit) -> Iterator[Doubt]:
    for pair in cancelling(fit):
        yield Doubt(pair.effects, pair.words, pair.times)
    yield from outsized(fit)


def credible(fit: Fit, progress: Callable[[str], None]) -> tuple[Fit, dict[str, Refused]]:
    """Leave out one effect of each pair that cancels, and effects of a size that no robot reaches, the worst first.

    The explanation is chosen again without each effect in doubt, and that one is left out without which rows held out
    are predicted best; none is where they are then predicted clearly worse.

    Returns
    -------
    fit
        With what is left.
    refused
        By name of a known effect that was left out: its probability, by the evidence of the two explanations that keep
        one of a pair; of a size that is impossible, zero.
    """
    refused: dict[str, Refused] = {}
    kept: set[tuple[str, ...]] = set()
    while doubt := next((d for d in _doubts(fit) if d.effects not in kept), None):
        progress(doubt.words)
        others = {name: less(fit, name, progress) for name in doubt.effects}
        left = {name: goes_astray(other) for name, other in others.items()}
        out = min(left, key=lambda name: left[name])
        if left[out] > settings.WORSE_ELSEWHERE * goes_astray(fit):
            kept.add(doubt.effects)
            continue
        best = {name: other.explanation.best.log_evidence for name, other in others.items()}
        chance = max((float(expit(best[instead] - best[out])) for instead in best if instead != out), default=0.0)
        progress(f"{out} is left out")
        if not out.startswith(PREFIX):
            refused[out] = Refused(chance, reason=f"{doubt.words}; {out} is left out")
        fit = others[out]
    return fit, refused


def goes_astray(fit: Fit) -> float:
    """Rms distance (m) that a fit leaves on rows held out in blocks of time, and in regions of joint space.

    Rows that were set aside count, too: what cancels where it was fitted may be what puts them far off.
    """
    model = Model.of(fit.explanation, blocks(fit.campaign))
    model = replace(model, kept=np.ones(fit.campaign.samples, dtype=bool))
    total, rows = 0.0, 0
    for name, _, tests in schemes(fit):
        walk = Walk.over(model, tests)
        if name in ("time", "region") and walk.tests:
            total += walk.squares(range(len(model.spans))).total
            rows += walk.rows
    return float(np.sqrt(total / max(rows, 1)))
