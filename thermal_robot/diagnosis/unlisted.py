"""Unlisted causes: add one more empirical law to the fit, and describe the residual of the known effects by laws."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from thermal_robot.diagnosis.parts import Dependence, Location, Unexplained
from thermal_robot.effects.law import PREFIX, Discovered
from thermal_robot.effects.law_words import is_event
from thermal_robot.inference import settings
from thermal_robot.inference.discover import Discovery, candidates, worthwhile
from thermal_robot.inference.events import events
from thermal_robot.inference.explain import Discrepancy
from thermal_robot.inference.fit import Fit, refit


def one_more_law(
    fit: Fit, number: int, progress: Callable[[str], None], happened: Sequence[Discovered] | None = None
) -> Fit | None:
    """Let laws that nobody wrote down compete with all known effects for a place in the fit.

    Returns ``None`` if no law is worth its place. Events that ``happened`` are among the laws; they are looked for
    where absent.
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

    Where no law does, and the discrepancy errs anew at one place in every pose or visit, that is the place, and nothing
    that was recorded is followed.
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
