"""Forward selection of terms that nobody listed: events of rows, ripple, laws; and the choice beside scatter."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from thermal_robot.diagnosis.answer import Conclusion
from thermal_robot.diagnosis.attribution import without_laws
from thermal_robot.diagnosis.residual_tests import Examined, examine
from thermal_robot.diagnosis.values import Dependence, Location, Refused, Unexplained
from thermal_robot.effects import Effect
from thermal_robot.effects.joint_ripple import JointRipple
from thermal_robot.effects.law import PREFIX
from thermal_robot.inference import settings
from thermal_robot.inference.discover import Discovery, candidates, discovered
from thermal_robot.inference.events import events
from thermal_robot.inference.explain import Discrepancy, explain
from thermal_robot.inference.fit import Fit, refit
from thermal_robot.inference.problem import generalised
from thermal_robot.inference.random_gap import RandomGap, random_gap
from thermal_robot.inference.ripple import alike, waves
from thermal_robot.inference.robust import Noise


def grown(fit: Fit, number: int, progress: Callable[[str], None]) -> Fit | None:
    """Forward selection: let terms that nobody listed compete with all known effects; ``None`` if none pays.

    Terms are generated from what the fit leaves: events, waves of the joints, laws of any quantity at any place. One
    event or law more joins a fit at a time, as ``discovered.<number>``.
    """
    progress(f"causes that nobody listed: scan {number}")
    held = [effect for effect, _ in fit.effects]
    laws = candidates(fit, number, events(fit))
    offered: dict[str, tuple[Effect, ...]] = {f"{PREFIX}{number}": laws} if laws else {}
    bases, wave = [held], _ripple(fit)
    if wave is not None:
        others = [effect for effect in held if not isinstance(effect, JointRipple)]
        offered[wave.name] = (wave,)
        bases = [[*others, wave], others]
    if not offered:
        return None
    before = [effect for effect in bases[0] if effect.name.startswith(PREFIX)]
    starts = [*bases, *([*base, law] for base in (*bases, before) for law in laws)]
    wider = refit(fit, offered, starts, progress)
    return wider if any(effect.name in offered for effect, _ in wider.effects) else None


def _ripple(fit: Fit) -> JointRipple | None:
    """Return the ripple that a fit shows, if it is considered and another than the one that it holds."""
    if JointRipple.name not in fit.variants or fit.campaign.samples > settings.RIPPLE_ROWS:
        return None
    found = waves(fit)
    held = next((effect for effect, _ in fit.effects if isinstance(effect, JointRipple)), JointRipple())
    return None if not found.orders or alike(found, held) else found


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
    """Choose among the effects of a fit again, with the joints' scatter (``chance``) in the covariance of the noise.

    Effects and laws that the scatter had imitated are then no longer in the fit.
    """
    e = fit.explanation
    scatter, sensitivity = chance.scatter, fit.corrected.joint_sensitivity
    covariance = scatter.covariance(sensitivity, replace(e.whitening, noise=scatter.noise).sigma())
    linear = generalised(e.linear, covariance, scatter.noise)
    place, *turn = (float(s) for s in scatter.noise[::3])
    noise = Noise(place, turn[0] if turn else None)
    # what obeys the rule is asked whether it stays
    linear = replace(linear, blocks=tuple(linear.blocks[b] for b in e.best.blocks))
    families = [item.effect.name for item in linear.blocks]
    again = explain(linear, noise, families=families)
    kept = {families[b] for b in again.best.blocks}
    feigned: dict[str, tuple[Effect, ...]] = {name: () for name in dict.fromkeys(fit.families) if name not in kept}
    own = {name: [b for b, family in enumerate(families) if family == name] for name in feigned}
    chances = {n: again.probability(blocks) if blocks else fit.probability(n) for n, blocks in own.items()}
    refused = {**refused, **{name: Refused(p) for name, p in chances.items() if not name.startswith(PREFIX)}}
    fit = refit(fit, feigned, [[linear.blocks[b].effect for b in again.best.blocks]], progress)
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
