"""Whether an effect or a law earns its word: rows held out are predicted better with it than without it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, stdtrit

from thermal_robot.arrays import Array
from thermal_robot.diagnosis.held_out import schemes
from thermal_robot.diagnosis.one_walk import Model, Walk
from thermal_robot.diagnosis.parts import Refused
from thermal_robot.effects.law import PREFIX
from thermal_robot.effects.law_words import is_event
from thermal_robot.inference import settings
from thermal_robot.inference.discover import discovered
from thermal_robot.inference.explain import log_odds
from thermal_robot.inference.fit import Fit, less, refit
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


def pruned(fit: Fit, progress: Callable[[str], None]) -> tuple[Fit, dict[str, Refused]]:
    """Backward elimination by cross-validation: take terms out one after another, until all that stay obey one rule.

    An effect or a law stays where it is nine times as probable as nothing in its place, predicts rows held out no worse
    (a law, but an event: better, by the interval of its gain), and something of it is determined. Of those that do not,
    the one goes first that brings rows held out least. Refused, by name: its probability, and its share where rows held
    out speak against it.
    """
    refused: dict[str, Refused] = {}
    exact = True
    while True:
        out = _failing(fit, progress) if fit.effects else None
        if out is None and exact:
            return fit, refused
        if out is None:
            fit, exact = refit(fit, {}, (), progress), True
            continue
        name, why = out
        if not name.startswith(PREFIX):
            refused[name] = why
        fit, exact = less(fit, name), False


def _failing(fit: Fit, progress: Callable[[str], None]) -> tuple[str, Refused] | None:
    """Return the term that goes first, of those that do not obey the rule, and what speaks against it."""
    table, odds, sure = earned(fit), in_place(fit), determined(fit)
    laws = {law.name for law, _ in fit.effects if law.name.startswith(PREFIX) and not is_event(law)}
    poor = {name for name, e in table.items() if e.harms or (name in laws and not e.helps)}
    out = poor | {name for name in table if odds[name] < settings.NAMING_ODDS or name not in sure}
    if not out:
        return None
    worst = min(out, key=lambda name: table[name].blocked.share)
    why = "rows held out refuse" if worst in poor else "in question:" if worst in sure else "nothing determines"
    progress(f"{why} {worst}")
    if worst in poor:
        return worst, _refused(fit, table[worst])
    # of one that nothing determines no more is known than before the data
    return worst, Refused(min(fit.probability(worst), 1.0 if worst in sure else settings.PRIOR_PROBABILITY))


def in_place(fit: Fit) -> dict[str, float]:
    """Return by name the odds of each effect and law against nothing in its place; of a law also against its rivals.

    What others could do in its place does not count: two of which one is at work are told as confounded. A law says
    what it follows, and where: it is no surer than that.
    """
    odds = {name: fit.odds(name) for name in fit.names_of(fit.explanation.best)}
    told = {d.law.name: d.probability for d in discovered(fit)}
    return {name: min(own, settings.NAMING_ODDS**2 * told.get(name, 1.0)) for name, own in odds.items()}


def determined(fit: Fit) -> set[str]:
    """Return the effects and laws of a fit of which the data determine something.

    Along one principal axis of its posterior at least, less than half of the prior's standard deviation is left.
    """
    e, found = fit.explanation, set()
    for b in e.best.blocks:
        prior = e.linear.blocks[b].sizes * e.best.scales[b]
        least = np.linalg.eigvalsh(e.values[b][1] / np.outer(prior, prior))[0]
        if least < settings.DETERMINED**2:
            found.add(fit.families[b])
    return found


def _refused(fit: Fit, judged: Earned) -> Refused:
    """Return what rows held out say of an effect: its probability, from its prior and their likelihood, and its share.

    The probability is at most the prior's: blocks of rows that speak for an effect do not outweigh what refuses it.
    """
    equations = fit.explanation.problem.equations
    against = min(judged.blocked.share, 0.0)
    said = judged.blocked if judged.blocked.share <= 0.0 else judged.hardest
    return Refused(float(expit(log_odds() - 0.5 * equations * np.log1p(-against))), said.share)
