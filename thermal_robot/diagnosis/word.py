"""What rows held out refuse: an effect that predicts them worse, and a law that does not predict them better."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.special import expit

from thermal_robot.diagnosis.earned import Earned, earned
from thermal_robot.diagnosis.held_out import held_out
from thermal_robot.diagnosis.parts import Refused
from thermal_robot.effects.law import PREFIX
from thermal_robot.effects.law_words import is_event
from thermal_robot.inference import settings
from thermal_robot.inference.discover import discovered
from thermal_robot.inference.explain import log_odds
from thermal_robot.inference.fit import Fit, less


def worth_their_word(fit: Fit, progress: Callable[[str], None]) -> tuple[Fit, dict[str, Refused]]:
    """Take effects and laws out of a fit one after another, the worst first, until all that stay earn their word.

    A law stays if it predicts rows held out better (:func:`~thermal_robot.diagnosis.earned.earned`) and the interval of
    its share is above zero, which is not asked of an event, as that shows in few blocks of rows. A known effect stays
    unless it predicts them worse, or is less than nine times as probable as nothing in its place.

    Returns
    -------
    fit
        With what is left of it.
    refused
        By name of a known effect: its probability by its prior and the rows held out alone, and its share there; of one
        in question, its probability.
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
