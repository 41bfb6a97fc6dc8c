"""Unlisted causes: add one more empirical law to the fit, and describe the residual of the known effects by laws."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from thermal_robot.diagnosis.examine import Examined, examine
from thermal_robot.diagnosis.parts import Dependence, Location, Unexplained
from thermal_robot.effects import Effect, gate
from thermal_robot.effects.law import PREFIX, Discovered
from thermal_robot.inference import settings
from thermal_robot.inference.discover import Discovery, discover
from thermal_robot.inference.fit import Fit, refit
from thermal_robot.inference.laws import of_quantity


@dataclass(frozen=True, eq=False)
class Stage:
    """One step of the search for laws.

    Attributes
    ----------
    fit
        The fit with known effects and the laws so far.
    laws
        The discovered laws in that fit, in the order of their discovery.
    left
        Its residual.
    """

    fit: Fit
    laws: tuple[Discovery, ...]
    left: Examined


def one_more_law(stage: Stage, progress: Callable[[str], None]) -> Stage | None:
    """Add the best further law, or refine one that is already in the fit with more knots.

    Returns ``None`` if no law is worth its parameters.
    """
    fit, found = stage.fit, stage.laws
    number = 1 + max((int(d.law.name.removeprefix(PREFIX)) for d in found), default=0)
    progress(f"causes that nobody listed: scan {number}")
    discovery = discover(fit, number)
    if discovery is None:
        return None
    again = next((d for d in found if _same(d.law, discovery.law)), None)
    if again is not None:  # its shape was too simple
        values = again.law.values(fit.corrected)
        finer = of_quantity(again.law, np.zeros(1) if values is None else values, knots=settings.FINER_KNOTS)
        if again.law in (finer, discovery.law) or finer.shape == "levels":
            return None
        discovery = replace(discovery, law=finer)
    law = discovery.law
    begin = tuple(dict.fromkeys((*discovery.beside, law.name)))
    alone = _alone(fit, law)
    wider = refit(fit, {law.name: (law,), **alone}, begin, {law.name: discovery.rarity}, progress)
    held = {effect.name for effect, _ in wider.effects}
    singles = [variants[-1] for variants in alone.values()]
    if law.name not in held and not any(effect in singles for effect, _ in wider.effects):
        return None
    known = {d.law.name: d for d in (*found, discovery)}
    return Stage(wider, tuple(d for name, d in known.items() if name in held), examine(wider, progress))


def _alone(fit: Fit, law: Discovered) -> dict[str, tuple[Effect, ...]]:
    """Return by name the settings of known effects that compete with a law of one joint's own position.

    Such an effect has parameters for every joint. If a single joint is at fault, the parameters of the sound joints
    count against it, and the law wins although the effect is the cause. The settings returned here therefore include
    the effect in this joint alone.
    """
    if law.kind != "joint" or law.quantity != law.place:
        return {}
    own = {name: (variants, gate.at(variants[0], law.place, fit.corrected)) for name, variants in fit.variants.items()}
    return {name: (*known, single) for name, (known, single) in own.items() if single and single not in known}


def _same(law: Discovered, other: Discovered) -> bool:
    """Whether two laws follow the same quantity at the same place; harmonics of different order do not."""
    if law.shape == other.shape == "harmonic" and law.marks != other.marks:
        return False
    return (law.kind, law.place, law.quantity) == (other.kind, other.place, other.quantity)


def as_laws_say(first: Unexplained, left: Unexplained, found: Sequence[Discovery]) -> Unexplained:
    """Return the residual of the known effects with the places and quantities of the laws that explain it."""
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
