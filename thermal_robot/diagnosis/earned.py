"""Whether an effect or a law earns its word: rows held out are predicted better with it than without it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from thermal_robot.arrays import Array
from thermal_robot.diagnosis.one_walk import Model, Walk
from thermal_robot.diagnosis.schemes import schemes
from thermal_robot.effects.law_words import is_event
from thermal_robot.inference import settings
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.rows import blocks


@dataclass(frozen=True)
class Gained:
    """What one effect brings under one scheme of holding rows out.

    Attributes
    ----------
    scheme
        ``time``, ``session``, ``temperature``, ``region`` or ``reach``.
    share
        1 − (rms with it / rms without it)² of the rows held out, noise included, in units of the instrument's noise.
    interval
        95 % interval of the share.
    """

    scheme: str
    share: float
    interval: tuple[float, float]


@dataclass(frozen=True)
class Earned:
    """What one effect of a fit brings on rows held out, all others fitted anew without it.

    Attributes
    ----------
    blocked
        Where blocks of consecutive rows are held out.
    hardest
        By the scheme of the smallest lower bound.
    helps
        Whether it is worth its word, as is asked of a law: the interval of ``blocked`` is above zero, and it does no
        harm.
    harms
        Whether rows are predicted worse with it: the share of ``blocked`` is not above zero, or under one scheme the
        whole interval is below zero. A known effect that others could nearly stand in for neither helps nor harms.
    """

    blocked: Gained
    hardest: Gained
    helps: bool
    harms: bool


def earned(fit: Fit) -> dict[str, Earned]:
    """Judge every effect and law of a fit by rows that were held out.

    The interval asks how far noise alone could have moved the gain, poses and conditions as they were. With r what is
    left of a held-out row with the effect, and r + m without it, the gain is Σ |m|² + 2 r·m. Its variance is that of
    the sums of 2 r·m over blocks of consecutive rows, and at least 4 s² Σ |m|², with s² the mean square of r. The
    quantile is Student's.

    An extrapolation to the coldest rows or to a region asks more than most true effects can give: their lower bound
    there is not above zero in one case of twenty (twice the noise, 75 rows). It therefore only refuses what does harm.
    An event says nothing of rows held out with all that it did, as a session or the warmest rows, and is asked in
    blocks of consecutive rows alone.

    Returns
    -------
    dict
        By name of the effect or law. Something that acts within one block of consecutive rows alone cannot earn its
        word, as no other rows tell of it.
    """
    block = blocks(fit.campaign)
    model = Model.of(fit.explanation, block)
    walks = [(name, Walk.over(model, tests)) for name, _, tests in schemes(fit)]
    every = range(len(model.spans))
    found: dict[str, list[Gained]] = {effect.name: [] for effect, _ in fit.effects}
    for name, walk in walks:
        if not walk.tests:
            continue
        judged = model.kept[walk.numbers]
        number = walk.numbers[judged]
        noise = model.whitening.sigma(number)
        left = walk.residuals(every)[judged] / noise
        for k, (effect, _) in enumerate(fit.effects):
            if name != "time" and is_event(effect):
                continue
            without = walk.residuals([b for b in every if b != k])[judged] / noise
            found[effect.name].append(_gained(name, left, without - left, block[number]))
    return {name: _earned(schemes) for name, schemes in found.items()}


def _gained(scheme: str, left: Array, moved: Array, block: NDArray[np.int64]) -> Gained:
    total = float(((left + moved) ** 2).sum())
    gain = total - float((left**2).sum())
    by_chance = np.bincount(block, 2.0 * (left * moved).sum(axis=1))[np.unique(block)]
    count = len(by_chance)
    if count < 2 or total <= 0.0:
        return Gained(scheme, 0.0 if total <= 0.0 else gain / total, (-np.inf, 1.0))
    variance = max(
        float(((by_chance - by_chance.mean()) ** 2).sum()) * count / (count - 1),
        float((left**2).mean()) * float(((2.0 * moved) ** 2).sum()),
    )
    half = float(stdtrit(count - 1, settings.INTERVAL[1]) * np.sqrt(variance)) / total
    return Gained(scheme, gain / total, (gain / total - half, gain / total + half))


def _earned(found: list[Gained]) -> Earned:
    blocked = found[0]
    hardest = min(found, key=lambda gained: gained.interval[0])
    harms = blocked.share <= 0.0 or any(gained.interval[1] < 0.0 for gained in found)
    return Earned(blocked, hardest, blocked.interval[0] > 0.0 and not harms, harms)
