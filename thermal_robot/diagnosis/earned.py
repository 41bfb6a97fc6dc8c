"""Whether an effect or a law earns its word: rows held out are predicted better with it than without it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, stdtrit

from thermal_robot.arrays import Array
from thermal_robot.diagnosis.held_out import held_out, schemes
from thermal_robot.diagnosis.one_walk import Model, Walk
from thermal_robot.diagnosis.parts import Refused
from thermal_robot.effects.law import PREFIX
from thermal_robot.effects.law_words import is_event
from thermal_robot.inference import settings
from thermal_robot.inference.discover import discovered
from thermal_robot.inference.explain import log_odds
from thermal_robot.inference.fit import Fit, less
from thermal_robot.inference.rows import blocks


@dataclass(frozen=True)
class Gained:
    """What one effect brings under one scheme of holding rows out (time, session, temperature, region, reach).

    ``share`` is 1 − (rms with it / rms without it)² of the rows held out, noise included, with its 95 % ``interval``.
    """

    scheme: str
    share: float
    interval: tuple[float, float]


@dataclass(frozen=True)
class Earned:
    """What one effect of a fit brings on rows held out, all others fitted anew without it.

    ``blocked``: blocks of consecutive rows held out; ``hardest``: the scheme of the smallest lower bound. It ``helps``
    where the interval of ``blocked`` is above zero and it does no harm, as is asked of a law; it ``harms`` where the
    share of ``blocked`` is not above zero, or under one scheme the whole interval is below. A known effect that others
    could nearly stand in for does neither.
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
    quantile is Student's. Something that acts within one block alone cannot earn its word, as no other rows tell of it.

    An extrapolation to the coldest rows or to a region asks more than most true effects can give: their lower bound
    there is not above zero in one case of twenty (twice the noise, 75 rows). It therefore only refuses what does harm.
    An event says nothing of rows held out with all that it did, as a session or the warmest rows, and is asked in
    blocks of consecutive rows alone.
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


def worth_their_word(fit: Fit, progress: Callable[[str], None]) -> tuple[Fit, dict[str, Refused]]:
    """Take effects and laws out of a fit one after another, the worst first, until all that stay earn their word.

    A law stays if it predicts rows held out better (:func:`~thermal_robot.diagnosis.earned.earned`) and the interval of
    its share is above zero, which is not asked of an event, as that shows in few blocks of rows. A known effect stays
    unless it predicts them worse, or is less than nine times as probable as nothing in its place. Refused, by name: its
    probability by its prior and the rows held out alone, and its share there; of one in question, its probability.
    """
    refused: dict[str, Refused] = {}
    while True:
        judged = {name: e for name, e in earned(fit).items() if e.harms or (name.startswith(PREFIX) and not e.helps)}
        laws = {law.name for law, _ in fit.effects if law.name.startswith(PREFIX) and not is_event(law)}
        if not judged and laws:
            shares = held_out(fit).shares
            judged = {name: e for name, e in earned(fit).items() if name in laws and shares[name][1][0] <= 0.0}
        faint = {} if judged else in_question(fit)
        if not judged and not faint:
            return fit, refused
        if judged:
            worst = min(judged, key=lambda name: judged[name].blocked.share)
            progress(f"rows held out refuse {worst}")
        else:
            worst = min(faint, key=lambda name: faint[name])
            progress(f"{worst} stays in question")
        if not worst.startswith(PREFIX):
            refused[worst] = _refused(fit, judged[worst]) if judged else Refused(fit.probability(worst))
        fit = less(fit, worst, progress)


def in_question(fit: Fit) -> dict[str, float]:
    """Return by name the effects and laws of a fit that are little more probable than nothing in their place: the odds.

    What others could do in its place does not count here: two of which one is at work are told as confounded. A law
    goes, too, that is far less probable than those that follow something else, or elsewhere.
    """
    odds = {name: fit.odds(name) for name in fit.names_of(fit.explanation.best)}
    unlikely = {d.law.name: d.probability for d in discovered(fit) if d.probability * settings.NAMING_ODDS < 1.0}
    return {name: own for name, own in odds.items() if own < settings.NAMING_ODDS} | unlikely


def _refused(fit: Fit, judged: Earned) -> Refused:
    """Return what rows held out say of an effect: its probability, from its prior and their likelihood, and its share.

    The probability is at most the prior's: blocks of rows that speak for an effect do not outweigh what refuses it.
    """
    equations = fit.explanation.problem.equations
    against = min(judged.blocked.share, 0.0)
    said = judged.blocked if judged.blocked.share <= 0.0 else judged.hardest
    return Refused(float(expit(log_odds() - 0.5 * equations * np.log1p(-against))), said.share)
