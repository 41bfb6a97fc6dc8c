"""What the headline has no room for, in whole sentences."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from thermal_robot.report import units
from thermal_robot.report.sentence import listed, scattering, sized, systematic, unnamed

_SURER = 0.05  # by which a single effect is surer than all together, so that a reader asks why
_TOLD, _MOST = 0.01, 3  # probability from which another effect is told that may be at work, too, and how many are

if TYPE_CHECKING:
    from thermal_robot.diagnosis.result import Diagnosis


def details(diagnosis: Diagnosis) -> Iterator[str]:
    """Yield a sentence for each thing that the headline leaves out and no table says."""
    if not diagnosis.usable:
        return
    causes, chance = systematic(diagnosis), scattering(diagnosis)
    if slight := [diagnosis.title(f.name) for f in unnamed(diagnosis)]:
        yield f"{'The smaller one is' if len(slight) == 1 else 'The smaller ones are'} {listed(slight)}."
    for f in causes:
        if f.confounded_with:
            rivals = " or ".join(map(diagnosis.title, f.confounded_with))
            yield f"{_begun(diagnosis.title(f.name))} cannot be told apart from {rivals}."
    if unsized := [diagnosis.title(f.name) for f in causes if not sized(f)]:
        yield f"How large it is these data do not determine: {listed(unsized)}."
    yield from _more(diagnosis)
    if causes and chance:
        names = listed([diagnosis.title(f.name) for f in chance])
        yield f"There is also scatter, which no correction removes: {names}."
    if laws := sum(f.quantity is not None for f in causes):
        which = "None of the effects that were considered" if diagnosis.narrowed else "No known effect"
        shapes = "the shape of the law that was" if laws == 1 else f"the shapes of the {laws} laws that were"
        yield f"{which} has {shapes} found."
    yield from _elsewhere(diagnosis)


def _more(diagnosis: Diagnosis) -> Iterator[str]:
    """Say what else may be at work, where each effect is surer by itself than that there is no other."""
    joint, own = diagnosis.probability, [diagnosis.finding(name).probability or 0.0 for name in diagnosis.verdict]
    if not own or min(own) - joint < _SURER:
        return
    told = {f.name: f.probability for f in diagnosis.effects if f.probability and f.status == "not_found"}
    others = sorted((name for name in told if told[name] >= _TOLD), key=lambda name: -told[name])[:_MOST]
    named = listed([f"{diagnosis.title(name)} ({units.probability(told[name])})" for name in others])
    beside = f", most probably {named}" if others else ""
    told_apart = f"That nothing else is at work is {units.percent(joint)} sure, less than each by itself"
    yield f"{told_apart}: the rest is others{beside}."


def _begun(words: str) -> str:
    return words[:1].upper() + words[1:]


def _elsewhere(diagnosis: Diagnosis) -> Iterator[str]:
    """Yield the ways of holding rows out in which the correction does harm."""
    for scheme in diagnosis.gap.schemes if diagnosis.verdict else ():
        if scheme.shrinkage < 0.0:
            before, after = units.together((scheme.rms_before, scheme.rms_after), "m")
            yield f"Held out by {scheme.name} ({scheme.held_out}), the correction does harm: {before} → {after}."
