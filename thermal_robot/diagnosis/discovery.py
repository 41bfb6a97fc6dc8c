"""After the known effects: scatter, then what is not listed, one law after another, until noise is left."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from thermal_robot.diagnosis.parts import Dependence, Location, Unexplained
from thermal_robot.diagnosis.random_gap import RandomGap, random_gap
from thermal_robot.diagnosis.remainder import examine
from thermal_robot.diagnosis.schemes import worse_elsewhere
from thermal_robot.effects import Effect
from thermal_robot.effects.law import PREFIX, Discovered
from thermal_robot.inference import settings
from thermal_robot.inference.discover import Discovery, discover
from thermal_robot.inference.explain import Noise, explain
from thermal_robot.inference.fit import Fit, refit, row_groups
from thermal_robot.inference.generalised import generalised
from thermal_robot.inference.scan import of_quantity


@dataclass(frozen=True, eq=False)
class Discoveries:
    """A fit with the laws that were found, in the order in which they were.

    Attributes
    ----------
    fit
        The last one.
    found
        Laws that belong to its explanation.
    unexplained
        What the known effects leave: where it enters and what it follows as the laws say, if there are any.
    remaining
        What the last fit leaves.
    floor, source
        Noise per axis, m, and where that figure comes from.
    chance
        What is random in it beyond the instrument.
    """

    fit: Fit
    found: tuple[Discovery, ...]
    unexplained: Unexplained
    remaining: Unexplained
    floor: float
    source: str
    chance: RandomGap


def discoveries(fit: Fit, progress: Callable[[str], None] = lambda _: None) -> Discoveries:
    """Look for laws as long as something that is not noise is left, and each is worth its place.

    Parameters
    ----------
    fit
        Of the known effects.
    progress
        Called with a few words at each stage.
    """
    found: list[Discovery] = []
    first, floor, source = examine(fit, progress)
    chance = random_gap(fit)
    if chance.explains_size:
        return _scattered(fit, chance, progress)
    left = first
    stages = [(fit, found, left, floor, source)]
    most = settings.MOST_LAWS if fit.campaign.samples < settings.MANY_ROWS else 1
    for _ in range(most):
        number = 1 + max((int(d.law.name.removeprefix(PREFIX)) for d in found), default=0)
        if not left.flagged:
            break
        progress(f"causes that nobody listed: scan {number}")
        discovery = discover(fit, number)
        if discovery is None:
            break
        again = next((d for d in found if _same(d.law, discovery.law)), None)
        if again is not None:  # its shape was too simple
            values = again.law.values(fit.corrected)
            finer = of_quantity(again.law, np.zeros(1) if values is None else values, knots=settings.FINER_KNOTS)
            if again.law in (finer, discovery.law) or finer.shape == "levels":
                break
            discovery = replace(discovery, law=finer)
        law = discovery.law
        begin = tuple(dict.fromkeys((*discovery.beside, law.name)))
        alone = _alone(fit, law)
        wider = refit(fit, {law.name: (law,), **alone}, begin, {law.name: discovery.rarity}, progress)
        held = {effect.name for effect, _ in wider.effects}
        singles = [settings[-1] for settings in alone.values()]
        if law.name not in held and not any(effect in singles for effect, _ in wider.effects):
            break
        fit = wider
        known = {d.law.name: d for d in (*found, discovery)}
        found = [d for name, d in known.items() if name in held]
        left, floor, source = examine(fit, progress)
        stages.append((fit, found, left, floor, source))
    # the first of several laws may go astray between the places that were measured, and the others set it right
    while len(stages) > 1 and worse_elsewhere(stages[0][0], stages[-1][0]):
        stages.pop()
    fit, found, left, floor, source = stages[-1]
    chance = random_gap(fit) if found else chance
    return Discoveries(fit, tuple(found), _told(first, left, found), left, floor, source, chance)


def _scattered(fit: Fit, chance: RandomGap, progress: Callable[[str], None]) -> Discoveries:
    """Choose the systematic effects again in the covariance of the scatter, which may feign some."""
    e, campaign = fit.explanation, fit.campaign
    covariance = chance.scatter.covariance(fit.corrected.joint_sensitivity)
    linear = generalised(e.linear, covariance, chance.scatter.noise)
    noise = Noise(*(float(s) for s in chance.scatter.noise[::3]))
    again = explain(linear, noise, families=fit.families, groups=row_groups(campaign), rarity=fit.rarity)
    kept = tuple(dict.fromkeys(fit.families[b] for b in again.best.blocks))
    feigned = {name: settings.NEVER for name in dict.fromkeys(fit.families) if name not in kept}
    fit = refit(fit, {}, kept, feigned, progress)
    chance = random_gap(fit)
    covariance = chance.scatter.covariance(fit.corrected.joint_sensitivity)[:, :3, :3]
    floor = float(np.sqrt(np.trace(covariance, axis1=1, axis2=2).mean() / 3.0))
    left = Unexplained(not chance.explains_size, 0.0, chance.p_value)
    if left.flagged:
        left, _, _ = examine(fit, progress)
    return Discoveries(fit, (), left, left, floor, "scatter", chance)


def _alone(fit: Fit, law: Discovered) -> dict[str, tuple[Effect, ...]]:
    """Return by name the known effects that may do in one joint alone what a law of its own position does, so set.

    Chosen for all joints they pay for every sound one, and a law of the one that errs is simpler than they.
    """
    if law.kind != "joint" or law.quantity != law.place:
        return {}
    own = {name: (settings, settings[0].at(law.place)) for name, settings in fit.settings.items()}
    return {name: (*known, single) for name, (known, single) in own.items() if single and single not in known}


def _same(law: Discovered, other: Discovered) -> bool:
    """Whether two laws follow the same quantity at the same place; two orders of a wheel stand beside each other."""
    if law.shape == other.shape == "harmonic" and law.marks != other.marks:
        return False
    return (law.kind, law.place, law.quantity) == (other.kind, other.place, other.quantity)


def _told(first: Unexplained, left: Unexplained, found: Sequence[Discovery]) -> Unexplained:
    """Say of what the known effects leave what the laws say of it."""
    if not found:
        return left
    places: dict[tuple[str, str], float] = {}
    followed: dict[str, float] = {}
    for discovery in found:
        for place, probability in discovery.places:
            places.setdefault(place, probability)
        for quantity, _ in discovery.quantities[:1]:
            followed.setdefault(quantity, float(np.exp(-discovery.gain)))
    locations = tuple(
        Location(kind, name, min(p, 1.0)) for (kind, name), p in places.items() if p >= settings.LIKELY_PLACE
    )
    return replace(
        first,
        locations=locations,
        depends_on=tuple(Dependence(name, p) for name, p in followed.items()),
    )


def is_law(name: str) -> bool:
    """Whether an effect's name is that of a law that was discovered."""
    return name.startswith(PREFIX)
