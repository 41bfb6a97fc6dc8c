"""Backward elimination and further terms beside the effects that were chosen: laws, events of rows, ripple.

Effects are chosen again where joints scatter or encoders step, as either can be mistaken for a systematic effect.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from operator import itemgetter

import numpy as np
from scipy.special import expit

from thermal_robot.diagnosis.answer import Conclusion
from thermal_robot.diagnosis.examine import Examined, examine
from thermal_robot.diagnosis.parts import Dependence, Location, Refused, Unexplained
from thermal_robot.diagnosis.where import without_laws
from thermal_robot.effects import Effect, gate
from thermal_robot.effects.joint_ripple import JointRipple
from thermal_robot.effects.law import PREFIX, Discovered
from thermal_robot.effects.law_words import is_event
from thermal_robot.inference import settings
from thermal_robot.inference.discover import Discovery, candidates, discovered, worthwhile
from thermal_robot.inference.events import events
from thermal_robot.inference.explain import Discrepancy, explain
from thermal_robot.inference.fit import Fit, less, refit
from thermal_robot.inference.problem import generalised
from thermal_robot.inference.random_gap import RandomGap, random_gap
from thermal_robot.inference.ripple import alike, waves
from thermal_robot.inference.robust import Noise


def one_more_law(
    fit: Fit, number: int, progress: Callable[[str], None], happened: Sequence[Discovered] | None = None
) -> Fit | None:
    """Let laws that nobody wrote down compete with all known effects; ``None`` if none is worth its place.

    Events that ``happened`` are among them, and are looked for where absent.
    """
    progress(f"causes that nobody listed: scan {number}")
    laws = candidates(fit, number, happened)
    begin = worthwhile(fit, laws) if laws else None
    if begin is None:
        return None
    name = f"{PREFIX}{number}"
    wider = refit(fit, {name: laws}, begin, progress)
    return wider if any(effect.name == name for effect, _ in wider.effects) else None


def eventful(fit: Fit, progress: Callable[[str], None]) -> Fit:
    """Let events join a fit as long as there are any, before what they do is taken for something else.

    Rows that were set aside, and effects that stood in for an event, are judged anew beside it. A law of another kind
    that says more than the event does leaves the fit as it is: it has its turn later.
    """
    progress("events: from row to row, from session to session")
    for number in range(1, settings.MOST_LAWS + 1):
        happened = events(fit)
        wider = one_more_law(fit, number, progress, happened) if happened else None
        if wider is None or not any(is_event(law) and law.name == f"{PREFIX}{number}" for law, _ in wider.effects):
            return fit
        fit = wider
    return fit


def as_laws_say(left: Unexplained, found: Sequence[Discovery], discrepancy: Discrepancy) -> Unexplained:
    """Return the residual of the known effects with the places and quantities of the laws that explain it.

    Where none does, and the discrepancy errs anew at one place in every pose or visit, that is the place.
    """
    form = discrepancy.form
    if not found and left.flagged and form is not None and form.anew and form.place[0]:
        return replace(left, locations=(Location(*form.place, discrepancy.forms[form.name]),), depends_on=())
    if not found:
        return left
    places: dict[tuple[str, str], float] = {}
    followed: dict[str, float] = {}
    for discovery in found:
        for place, probability in discovery.places:
            places.setdefault(place, probability)
        for quantity, probability in discovery.quantities[:1]:
            followed.setdefault(quantity, max(1.0 - probability, 0.0))
    locations = tuple(
        Location(kind, name, min(p, 1.0)) for (kind, name), p in places.items() if p >= settings.LIKELY_PLACE
    )
    return replace(
        left,
        flagged=True,
        locations=locations,
        depends_on=tuple(Dependence(name, p) for name, p in followed.items()),
    )


def beside_scatter(
    fit: Fit, chance: RandomGap, refused: Mapping[str, Refused], progress: Callable[[str], None]
) -> Conclusion:
    """Choose the systematic effects again, with the joints' scatter (``chance``) in the covariance of the noise.

    Effects and laws that the scatter had imitated are then no longer in the fit.
    """
    e = fit.explanation
    scatter, sensitivity = chance.scatter, fit.corrected.joint_sensitivity
    covariance = scatter.covariance(sensitivity, replace(e.whitening, noise=scatter.noise).sigma())
    linear = generalised(e.linear, covariance, scatter.noise)
    place, *turn = (float(s) for s in scatter.noise[::3])
    noise = Noise(place, turn[0] if turn else None)
    # of many rows each choice takes minutes: then only what was chosen is asked whether it stays
    asked = range(len(linear.blocks)) if fit.campaign.samples <= settings.MANY_ROWS else e.best.blocks
    linear = replace(linear, blocks=tuple(linear.blocks[b] for b in asked))
    families = [item.effect.name for item in linear.blocks]
    again = explain(linear, noise, families=families)
    kept = {families[b] for b in again.best.blocks}
    feigned: dict[str, tuple[Effect, ...]] = {name: () for name in dict.fromkeys(fit.families) if name not in kept}
    own = {name: [b for b, family in enumerate(families) if family == name] for name in feigned}
    chances = {n: again.probability(blocks) if blocks else fit.probability(n) for n, blocks in own.items()}
    refused = {**refused, **{name: Refused(probability) for name, probability in chances.items()}}
    fit = refit(fit, feigned, [linear.blocks[b].effect for b in again.best.blocks], progress)
    chance = random_gap(fit)
    sigma = replace(fit.explanation.whitening, noise=chance.scatter.noise).sigma()
    covariance = chance.scatter.covariance(fit.corrected.joint_sensitivity, sigma)[:, :3, :3]
    floor = float(np.sqrt(np.trace(covariance, axis1=1, axis2=2).mean() / 3.0))
    left = Unexplained(not chance.explains_size, 0.0, chance.p_value)
    if left.flagged:
        left = examine(fit, progress).unexplained
    laws = discovered(fit)
    unexplained = as_laws_say(without_laws(fit, left), laws, fit.explanation.discrepancy)
    return Conclusion(fit, laws, unexplained, Examined(left, floor, "scatter"), chance, refused)


def beside_steps(
    fit: Fit, chance: RandomGap, refused: dict[str, Refused], progress: Callable[[str], None]
) -> tuple[Fit, RandomGap, dict[str, Refused]]:
    """Take out effects without which encoders show their steps, the one that hides most of them first.

    Where joints err anew in every pose, an effect with many parameters can fit a part of these errors. The fit takes
    them for normal; that they put the joint on an encoder's steps, or no longer do, is left out of its evidence. With
    the odds P of an effect by the fit, and the Bayes factors B and B' of steps with it and without it, it stays while
    P B > B'.
    """
    while hidden := {joint for joint, factor in chance.steps.items() if factor < 0.0}:
        rivals = []
        for name in (effect.name for effect, _ in fit.effects if _moves(fit, effect) & hidden):
            log_odds = float(np.log(max(fit.odds(name), settings.TINY)))
            if log_odds <= settings.STEPS_REACH:
                other = less(fit, name, progress)
                left = random_gap(other)
                rivals.append((left.seen - chance.seen - log_odds, name, other, left))
        best = max(rivals, key=itemgetter(0), default=None)
        if best is None or best[0] <= 0.0:
            break
        gain, name, fit, chance = best
        progress(f"steps of encoders speak against {name}")
        refused = {**refused, name: Refused(float(expit(-gain)))}
    return fit, chance, refused


def _moves(fit: Fit, effect: Effect) -> set[str]:
    """Return the joints that parameters of a known effect sit in."""
    if effect.name.startswith(PREFIX):
        return set()
    return {p.place for p in gate.checked(effect, fit.corrected) if p.kind == "joint"}


def rippled(fit: Fit, progress: Callable[[str], None]) -> Fit:
    """Let waves of the joints join a fit, and leave it again, until they stay.

    What was fitted without them may have stood in for them, and hides others: the choice is made again beside the
    waves, and these are looked for again beside the choice; once where rows are very many, and not at all where each
    choice would take minutes, or ripple was not to be considered.
    """
    name = JointRipple.name
    if name not in fit.variants or fit.campaign.samples > settings.RIPPLE_ROWS:
        return fit
    many = fit.campaign.samples > settings.ENOUGH_ROWS
    for _ in range(1 if many else settings.RIPPLE_ROUNDS):
        progress("ripple of the gears")
        held = next((e for e, _ in fit.effects if isinstance(e, JointRipple)), JointRipple())
        found = waves(fit)
        if alike(found, held):
            break
        others = [effect for effect, _ in fit.effects if effect.name != name]
        fit = refit(fit, {name: (found,)}, [*others, *((found,) if found.orders else ())], progress)
    return fit
