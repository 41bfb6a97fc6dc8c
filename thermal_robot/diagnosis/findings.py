"""Status, posterior probability and estimates of every candidate effect."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.diagnosis.values import Estimate, Finding, Location, Refused, is_frame
from thermal_robot.effects import FRAMES, Effect, Parameter, gate, named, random_effects
from thermal_robot.effects.law import PREFIX, Discovered
from thermal_robot.effects.law_words import called, event, in_joints, sizes, usually
from thermal_robot.effects.quantities import unit
from thermal_robot.effects.random_effect import RandomEffect
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import equations_of, orthonormal, without
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.inside import divided, identified
from thermal_robot.inference.scatter import Kept, RandomGap

if TYPE_CHECKING:
    import pandas as pd

Shares = Mapping[str, tuple[float, tuple[float, float]]]
_NO_SHARE = (0.0, (0.0, 0.0))


@dataclass(frozen=True)
class Inside:
    """Estimates of the part of a fitted effect (``container``) that a smaller effect describes, or of its rest.

    ``unseen`` are parameters that the data do not tell from those before them, or from the frames.
    """

    container: str
    parameters: tuple[Estimate, ...]
    unseen: tuple[str, ...]


def divided_effects(fit: Fit) -> dict[str, Inside]:
    """Estimates of the smaller effects, by name, that are reported inside a larger fitted effect, and of its rest."""
    found = {}
    for effect, _ in fit.effects:
        for part in divided(fit, effect.name):
            told = _estimates(part.parameters, part.values, part.spread, part.prior)
            found[part.effect] = Inside(effect.name, told, tuple(p.name for p in part.unseen))
    return found


def estimates(fit: Fit, block: int) -> tuple[Estimate, ...]:
    """Estimates of one block of the best combination in its own parameters."""
    own = fit.explanation.linear.blocks[block]
    return _estimates(own.parameters, own.effect.told(fitted_values(fit, block)), *_deviations(fit, block))


def fitted_values(fit: Fit, block: int) -> Array:
    """Refined values (P,) of one block of the best combination, SI."""
    return fit.effects[fit.explanation.best.blocks.index(block)][1]


def _deviations(fit: Fit, block: int) -> tuple[Array, Array]:
    """Posterior and prior standard deviations, (P,) each, of one block of the best combination, SI."""
    e = fit.explanation
    return np.sqrt(np.maximum(np.diag(e.values[block][1]), 0.0)), e.linear.blocks[block].sizes * e.best.scales[block]


def _estimates(parameters: Iterable[Parameter], values: Array, spread: Array, prior: Array) -> tuple[Estimate, ...]:
    known = identified(spread, prior)
    return tuple(
        Estimate(p.name, float(v) if k else None, float(s) if k else None, p.unit, bool(k))
        for p, v, s, k in zip(parameters, values, spread, known, strict=True)
    )


def covariance(fit: Fit, joint: Array) -> pd.DataFrame:
    """Covariance matrix of the identified parameters, by (effect, parameter), in products of SI units.

    Deviations are those of :func:`estimates`, inflated for the residual
    (:func:`~thermal_robot.diagnosis.uncertainty.inflated_for_structure`); correlations those of the ``joint`` (K, K)
    posterior of all frames and parameters, those of the effects last, frames marginalised.
    """
    import pandas as pd

    e = fit.explanation
    fitted = list(zip(e.best.blocks, fit.effects, strict=True))
    names = [(effect.name, p.name) for b, (effect, _) in fitted for p in e.linear.blocks[b].parameters]
    std, prior = np.hstack([np.empty((2, 0)), *(_deviations(fit, b) for b in e.best.blocks)])
    kept = np.flatnonzero(identified(std, prior))
    last = kept + len(joint) - len(std)
    own = joint[np.ix_(last, last)]
    size = std[kept] / np.sqrt(own.diagonal())
    index = pd.MultiIndex.from_tuples([names[k] for k in kept], names=("effect", "parameter"))
    return pd.DataFrame(own * np.outer(size, size), index=index, columns=index)


def random_findings(fit: Fit, chance: RandomGap) -> tuple[Finding, ...]:
    """Return the finding of every random effect; its shrinkage is 0, since a correction predicts a mean.

    Scatter between poses (encoder steps) and scatter between visits (repeatability) are told apart by repeated poses.
    Without repeats, scatter between visits is not testable, and scatter between poses is confounded with it unless the
    steps of the encoder are seen.
    """
    return tuple(_of_random(fit, chance, effect) for effect in random_effects())


def _of_random(fit: Fit, chance: RandomGap, effect: RandomEffect) -> Finding:
    scatter, kind = chance.scatter, effect.component
    if effect.needs and kind not in scatter.kinds:
        return Finding(effect.name, "not_testable", needs=effect.needs)
    own = [k for k in chance.kept if k.component.kind == kind]
    probability = scatter.probability.get(kind, 0.0)
    found, likely = Finding(effect.name, "not_found", probability, *_NO_SHARE), probability >= settings.SCATTER_SURE
    if not likely or not own:
        # what follows a law is not this effect
        return replace(found, probability=0.0) if likely and scatter.chosen(kind) else found
    probability *= chance.stepped if kind == "pose" else 1.0
    others = tuple(e.name for e in random_effects() if e.component not in scatter.kinds)
    likely = probability >= settings.SCATTER_SURE
    if not likely and not (others and probability >= settings.PRIOR_PROBABILITY):
        return replace(found, probability=probability)
    names, lever = fit.campaign.robot.joint_names, fit.corrected.joint_sensitivity[:, :3]
    moved = np.array([k.component.sigma**2 * (lever[:, :, k.component.joint] ** 2).mean() for k in own])
    order = np.argsort(-moved)
    return replace(
        found,
        status="found" if likely else "confounded",
        probability=probability,
        confounded_with=() if likely else others,
        locations=tuple(Location("joint", names[own[k].component.joint], float(moved[k] / moved.sum())) for k in order),
        parameters=tuple(_scatter(fit, own[k], effect) for k in order),
    )


def _scatter(fit: Fit, kept: Kept, effect: RandomEffect) -> Estimate:
    c, joint = kept.component, fit.campaign.robot.joint_names[kept.component.joint]
    width = effect.factor * (c.upper - c.lower) / (2.0 * settings.SIGMAS_95)
    value = kept.step if c.kind == "pose" else effect.factor * c.sigma
    return Estimate(f"{effect.label}, {joint}", value, width, unit(fit.campaign.robot, joint), True)


def unknown_frames(fit: Fit) -> tuple[str, ...]:
    """Names of the frame effects whose frame is unknown, and hence fitted."""
    return tuple(name for name in FRAMES if gate.missing(named(name), fit.nominal))


def within_frames(fit: Fit, block: int) -> bool:
    """Whether the columns of an effect lie in the span of the columns of the unknown frames."""
    item, linear = fit.explanation.linear.blocks[block], fit.explanation.linear
    if not linear.frames.size or not item.parameters:
        return False
    columns = equations_of(item.columns) * item.sizes
    left = without(columns, orthonormal(equations_of(linear.frames)))
    return bool(np.linalg.norm(left) < settings.ALIAS * np.linalg.norm(columns))


def confounding(fit: Fit, explained: Mapping[str, int]) -> dict[str, tuple[str, ...]]:
    """Confounded effects by posterior probability: for each effect of the fit (with its block) its alternatives.

    An alternative is a known effect outside the fit. The models with it in place of the effect, and otherwise
    unchanged, have a posterior probability above ``IN_ITS_PLACE``.
    """
    best, found = frozenset(explained), dict[tuple[str, str], float]()
    for combination, p in zip(fit.explanation.combinations, fit.explanation.probabilities, strict=True):
        names = fit.names_of(combination)
        if len(new := names - best) == 1:
            for pair in product(best - names, new):
                found[pair] = found.get(pair, 0.0) + float(p)
    told: dict[str, set[str]] = {}
    for (name, other), p in found.items():
        if p > settings.IN_ITS_PLACE and not other.startswith(PREFIX):
            told.setdefault(name, set()).add(other)
            told.setdefault(other, set()).add(name)
    return {name: tuple(sorted(others)) for name, others in told.items()}


def findings(
    fit: Fit,
    shares: Shares,
    locations: Mapping[str, tuple[Location, ...]],
    laws: Mapping[str, float],
    refused: Mapping[str, Refused],
) -> tuple[Finding, ...]:
    """Return the findings of all candidates, untestable ones last.

    ``shares``: share of the gap on held-out rows with its 95 % interval, by effect; ``laws``: probability of the place
    and quantity of each discovered law.
    """
    explained = {effect.name: b for b, (effect, _) in zip(fit.explanation.best.blocks, fit.effects, strict=True)}
    apart, inside = confounding(fit, explained), divided_effects(fit)
    found = []
    for name in dict.fromkeys(fit.families):
        if name in explained:
            block, probability = explained[name], laws.get(name, fit.probability(name))
            one = Finding(name, "found", probability, parameters=estimates(fit, block), **_of_effect(fit, block))
        elif name.startswith(PREFIX):
            continue  # a law that did not last was never a candidate of anybody's
        else:
            one = Finding(name, "not_found", fit.probability(name))
        share, interval = shares.get(name, _NO_SHARE)
        one = replace(one, shrinkage=share, shrinkage_ci95=interval, locations=locations.get(name, ()))
        if part := inside.get(name):
            one = replace(one, parameters=part.parameters, unseen=part.unseen)
        if part and part.parameters and name not in explained:
            contained = fit.probability(part.container)
            one = replace(one, status="contained", probability=contained, confounded_with=(part.container,))
        elif others := apart.get(name) or _hidden(fit, name, explained):
            one = replace(one, status="confounded", confounded_with=others)
        found.append(one)
    out = (Finding(name, "not_found", r.probability, *shares.get(name, _NO_SHARE)) for name, r in refused.items())
    return (*found, *out, *(Finding(name, "not_testable", needs=needs) for name, needs in fit.needs.items()))


def _of_effect(fit: Fit, block: int) -> dict[str, Any]:
    """Fields of a finding that only discovered laws, or effects with several parameters for each joint, have."""
    e, values = fit.explanation, fitted_values(fit, block)
    law, _ = fit.effects[e.best.blocks.index(block)]
    parameters, spread = e.linear.blocks[block].parameters, e.values[block][1]
    if not isinstance(law, Discovered):
        # a joint with one parameter errs by that; of several the sum counts, which is better determined
        several = len({parameter.place for parameter in parameters}) < len(parameters)
        return {"size": in_joints(parameters, values, spread)} if several else {}
    size = sizes(law, fit.nominal, values, spread)
    short, whole = event(law, fit.nominal, size)
    return {
        "quantity": law.follows,
        "shape": law.shape,
        "describes": whole or law.describe(),
        "of": law.of or None,
        "title": short or called(law),
        "size": size,
        "usually": usually(law, fit.campaign.robot.joint_names) or None,
    }


def _hidden(fit: Fit, name: str, explained: Mapping[str, int]) -> tuple[str, ...]:
    """Unknown frames whose span contains an effect outside the fit; empty where it is not contained."""
    inside = name not in explained and all(within_frames(fit, b) for b in fit.blocks_of(name))
    return unknown_frames(fit) if inside else ()


def titled(found: Sequence[Finding], effects: Iterable[Effect], model: bool = False) -> tuple[Finding, ...]:
    """Return the findings with titles in plain words; ``model``: as worded where rows are another model's output."""
    known = {effect.name: effect for effect in effects}
    return tuple(
        replace(f, title=known[f.name].in_model if model else known[f.name].title, random=known[f.name].random)
        if f.name in known
        else replace(f, title=f.title or f.describes or "")
        for f in found
    )


def by_share(found: Sequence[Finding]) -> tuple[Finding, ...]:
    """Sort findings by held-out share, then by probability; untestable ones last."""
    return tuple(
        sorted(found, key=lambda f: (f.status == "not_testable", -(f.shrinkage or 0.0), -(f.probability or 0.0)))
    )


def separates(found: Sequence[Finding]) -> tuple[tuple[str, ...], ...]:
    """List groups of confounded effects; a group with an unknown frame only if there is no other group."""
    confounded = [tuple(sorted((f.name, *f.confounded_with))) for f in found if f.status == "confounded"]
    groups = tuple(dict.fromkeys(confounded))
    return tuple(g for g in groups if len(groups) == 1 or not any(is_frame(found, name) for name in g))
