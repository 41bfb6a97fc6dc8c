"""What is compared: the effects of all campaigns in one list of parameters, the same for each of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.diagnosis.result import Diagnosis
from thermal_robot.effects import Effect, Parameter, gate
from thermal_robot.effects.fading import OfPosition
from thermal_robot.effects.law import Discovered
from thermal_robot.effects.law_words import called
from thermal_robot.errors import EffectError
from thermal_robot.fleet import compare_settings
from thermal_robot.fleet.compare_model import Known
from thermal_robot.inference.columns import block
from thermal_robot.inference.fit import Fit


@dataclass(frozen=True, eq=False)
class Candidate:
    """An effect that is compared, in all its places.

    Attributes
    ----------
    name, title
        Of the effect; a law that was found in one campaign has that campaign's name with it.
    effect
        The effect in one setting.
    told
        Its P parameters without responses, as a comparison tells them.
    sizes
        (P,) their expected sizes.
    parameters
        Per campaign: the P parameters with their responses there; empty where the campaign lacks what it needs.
    named
        Per campaign: whether its diagnosis names the effect.
    """

    name: str
    title: str
    effect: Effect
    told: tuple[Parameter, ...]
    sizes: Array
    parameters: tuple[tuple[Parameter, ...], ...]
    named: tuple[bool, ...]

    @property
    def law(self) -> bool:
        """Whether nobody wrote it down before it was found."""
        return isinstance(self.effect, Discovered)


def candidates(
    found: Sequence[Diagnosis | Known], fits: Sequence[Fit | Known], names: Sequence[str]
) -> tuple[Candidate, ...]:
    """List the effects that are compared, those that can be set anew first.

    Every effect of a diagnosis is; every one that is probable enough in any of them; and those that somebody could set
    anew between campaigns, such as a joint's zero.

    Parameters
    ----------
    found, fits
        The diagnoses, and the fits behind them; a model file is both.
    names
        What the campaigns are called.
    """
    listed = []
    for key, effect in _settings(fits, names):
        parameters = tuple(_parameters(effect, fit) for fit in fits)
        known = next((c for c, own in enumerate(parameters) if own), None)
        if known is None:
            continue
        told = tuple(replace(p, responses=()) for p in parameters[known])
        kept = tuple(own if [p.name for p in own] == [p.name for p in told] else () for own in parameters)
        law = isinstance(effect, Discovered)
        named = tuple(_names(effect, diagnosis, fit) for diagnosis, fit in zip(found, fits, strict=True))
        title = f"{called(effect)} ({key.split(' of ')[1]})" if isinstance(effect, Discovered) else effect.title
        listed.append(Candidate(key, title, effect, told, _sizes(effect, fits[known], told), kept, named))
        if law and not any(named):
            listed.pop()
    return tuple(sorted(listed, key=lambda c: (c.law, not c.effect.told_inside, c.name)))


def _names(effect: Effect, diagnosis: Diagnosis | Known, fit: Fit | Known) -> bool:
    """Whether a diagnosis names an effect; a law it names only as it is."""
    if isinstance(effect, Discovered):
        return any(own == effect for own, _ in fit.effects)
    return effect.name in diagnosis.verdict


def _settings(fits: Sequence[Fit | Known], names: Sequence[str]) -> Iterator[tuple[str, Effect]]:
    """Yield each effect once, by its name, in all its places and in the setting that the surest fit has.

    A setting that reads more, such as a clock, goes before one that a campaign without it had to do with.
    """
    known: dict[str, tuple[tuple[int, float], Effect]] = {}
    for fit in fits:
        for effect, _ in fit.effects:
            sure = len(gate.reads(effect, fit.corrected)), fit.odds(effect.name)
            if not isinstance(effect, Discovered) and sure > known.get(effect.name, ((-1, 0.0), effect))[0]:
                known[effect.name] = sure, effect
    for fit in fits:
        for name, variants in fit.variants.items():
            first = variants[0] if variants else None
            if first is None or name in known or isinstance(first, Discovered):
                continue
            if first.told_inside or fit.probability(name) >= compare_settings.MAY_BE:
                known[name] = (0, 0.0), first
    yield from ((name, replace(effect, places=(), excluded=())) for name, (_, effect) in known.items())
    for fit, campaign in zip(fits, names, strict=True):
        yield from ((f"{e.name} of {campaign}", e) for e, _ in fit.effects if isinstance(e, Discovered))


def _parameters(effect: Effect, fit: Fit | Known) -> tuple[Parameter, ...]:
    """Return an effect's parameters in a campaign, as they are told; empty where the campaign lacks what it needs."""
    observations = fit.corrected
    try:
        effect = _there(effect, fit)
        if gate.missing(effect, observations):
            return ()
        return gate.independent(effect, observations) or gate.checked(effect, observations)
    except EffectError:
        if effect.name in fit.variants and not isinstance(effect, Discovered):
            raise
        return ()  # a law of what only another campaign recorded


def _there(effect: Effect, fit: Fit | Known) -> Effect:
    """Return an effect as it is in a campaign; a model has no record to take anything from."""
    recorded = isinstance(fit, Fit) or isinstance(effect, OfPosition)  # these have nothing of it but their range
    return gate.elsewhere(effect, fit.corrected) if recorded else effect


def _sizes(effect: Effect, fit: Fit | Known, told: Sequence[Parameter]) -> Array:
    own = block(fit.corrected, _there(effect, fit))
    alike = [p.name for p in own.bare] == [p.name for p in told]
    return own.sizes if alike else np.array([p.size for p in told])
