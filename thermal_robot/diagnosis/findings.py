"""Which effect: status, probability, parameters of every candidate."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.diagnosis.parts import Estimate, Finding, Location, Refused, is_frame
from thermal_robot.effects import Effect, Parameter, gate, library, random_effects
from thermal_robot.effects.law import PREFIX, Discovered
from thermal_robot.effects.law_words import Size, called, event, in_joints, sizes, usually
from thermal_robot.effects.quantities import unit
from thermal_robot.effects.random_effect import RandomEffect
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import equations_of, orthonormal, without
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.inside import divided, identified
from thermal_robot.inference.random_gap import Kept, RandomGap


@dataclass(frozen=True)
class Inside:
    """Estimates of an effect's part of one that was fitted (``container``), or the rest of that.

    ``unseen`` are parameters that the data do not tell from those before them, or from the frames.
    """

    container: str
    parameters: tuple[Estimate, ...]
    unseen: tuple[str, ...]


def told_inside(fit: Fit) -> dict[str, Inside]:
    """Return by name the effects of the fit that are told in parts, and the parts."""
    found = {}
    for effect, _ in fit.effects:
        for part in divided(fit, effect.name):
            told = _estimates(part.parameters, part.values, part.spread, part.prior)
            found[part.effect] = Inside(effect.name, told, tuple(p.name for p in part.unseen))
    return found


def estimates(fit: Fit, block: int) -> tuple[Estimate, ...]:
    """Return the estimates of one block of the best combination, in its own parameters."""
    e = fit.explanation
    item = e.linear.blocks[block]
    spread = np.sqrt(np.maximum(np.diag(e.values[block][1]), 0.0))
    return _estimates(item.parameters, fitted_values(fit, block), spread, item.sizes * e.best.scales[block])


def fitted_values(fit: Fit, block: int) -> Array:
    """(P,) values of one block of the best combination, as they were refined, SI."""
    return fit.effects[fit.explanation.best.blocks.index(block)][1]


def _estimates(parameters: Iterable[Parameter], values: Array, spread: Array, prior: Array) -> tuple[Estimate, ...]:
    known = identified(spread, prior)
    return tuple(
        Estimate(p.name, float(v) if k else None, float(s) if k else None, p.unit, bool(k))
        for p, v, s, k in zip(parameters, values, spread, known, strict=True)
    )


def random_findings(fit: Fit, chance: RandomGap) -> tuple[Finding, ...]:
    """Return a finding for every random effect; none shrinks the gap, as a correction predicts a mean.

    Scatter between poses (encoder steps) and scatter between visits (repeatability) are told apart by repeated poses.
    Without repeats, scatter between visits is not testable, and scatter between poses is confounded with it unless the
    steps of the encoder are seen.
    """
    return tuple(_finding(fit, chance, effect) for effect in random_effects())


def _finding(fit: Fit, chance: RandomGap, effect: RandomEffect) -> Finding:
    scatter, kind = chance.scatter, effect.component
    own = [k for k in chance.kept if k.component.kind == kind]
    if effect.needs and kind not in scatter.kinds:
        return Finding(effect.name, "not_testable", needs=effect.needs)
    probability = scatter.probability.get(kind, 0.0)
    if probability < settings.SCATTER_SURE or not own:
        # what follows a law is not this effect
        refuted = probability >= settings.SCATTER_SURE and scatter.chosen(kind)
        return Finding(effect.name, "not_found", 0.0 if refuted else probability, 0.0, (0.0, 0.0))
    probability *= chance.stepped if kind == "pose" else 1.0
    others = tuple(e.name for e in random_effects() if e.component not in scatter.kinds)
    likely = probability >= settings.SCATTER_SURE
    if not likely and not (others and probability >= settings.PRIOR_PROBABILITY):
        return Finding(effect.name, "not_found", probability, 0.0, (0.0, 0.0))
    names, lever = fit.campaign.robot.joint_names, fit.corrected.joint_sensitivity[:, :3]
    moved = np.array([k.component.sigma**2 * (lever[:, :, k.component.joint] ** 2).mean() for k in own])
    order = np.argsort(-moved)
    return Finding(
        effect.name,
        "found" if likely else "confounded",
        probability,
        0.0,
        (0.0, 0.0),
        confounded_with=() if likely else others,
        locations=tuple(Location("joint", names[own[k].component.joint], float(moved[k] / moved.sum())) for k in order),
        parameters=tuple(_estimate(fit, own[k], effect) for k in order),
    )


def _estimate(fit: Fit, kept: Kept, effect: RandomEffect) -> Estimate:
    c, joint = kept.component, fit.campaign.robot.joint_names[kept.component.joint]
    width = effect.factor * (c.upper - c.lower) / (2.0 * settings.SIGMAS_95)
    value = kept.step if c.kind == "pose" else effect.factor * c.sigma
    return Estimate(f"{effect.label}, {joint}", value, width, unit(fit.campaign.robot, joint), True)


def unknown_frames(fit: Fit) -> tuple[str, ...]:
    """Return the names of the frame effects whose frame is unknown and therefore fitted."""
    frames = [effect for effect in library().values() if effect.frame]
    return tuple(effect.name for effect in frames if gate.missing(effect, fit.nominal))


def within_frames(fit: Fit, block: int) -> bool:
    """Whether the columns of an effect lie in the span of those of the unknown frames."""
    item, linear = fit.explanation.linear.blocks[block], fit.explanation.linear
    if not linear.frames.size or not item.parameters:
        return False
    columns = equations_of(item.columns) * item.sizes
    left = without(columns, orthonormal(equations_of(linear.frames)))
    return bool(np.linalg.norm(left) < settings.ALIAS * np.linalg.norm(columns))


def rivals(fit: Fit, explained: Mapping[str, int]) -> dict[str, tuple[str, ...]]:
    """By effect of the fit (with its block): the effects that it is confounded with.

    That is a known one outside the fit that, fitted anew in its place, is nearly as probable: by more than
    ``IN_ITS_PLACE`` it is at work and the effect is not, and nothing else joins it.
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


Shares = dict[str, tuple[float, tuple[float, float]]]


def findings(
    fit: Fit,
    shares: Shares,
    locations: dict[str, tuple[Location, ...]],
    laws: Mapping[str, float],
    refused: Mapping[str, Refused],
) -> tuple[Finding, ...]:
    """Return a finding for every candidate; those that are not testable come last.

    ``shares``: share of the gap on held-out rows with its 95 % interval, by effect; ``laws``: probability that what a
    discovered law follows, where, is right.
    """
    explained = {effect.name: b for b, (effect, _) in zip(fit.explanation.best.blocks, fit.effects, strict=True)}
    known = {effect.name: effect for effect, _ in fit.effects}
    apart, inside = rivals(fit, explained), told_inside(fit)
    result = []
    for name in dict.fromkeys(fit.families):
        if name.startswith(PREFIX) and name not in explained:
            continue  # a law that did not last was never a candidate of anybody's
        part, law = inside.get(name), known.get(name)
        share, interval = shares.get(name, (0.0, (0.0, 0.0)))
        found = Finding(
            name,
            "found" if name in explained else "not_found",
            probability=laws.get(name, fit.probability(name)),
            shrinkage=share,
            shrinkage_ci95=interval,
            locations=locations.get(name, ()),
            parameters=part.parameters if part else estimates(fit, explained[name]) if name in explained else (),
            unseen=part.unseen if part else (),
        )
        if isinstance(law, Discovered):
            found = replace(found, **_of_law(fit, law, explained[name]))
        elif law is not None and law.sized_as:
            found = replace(found, size=_in_joints(fit, law, explained[name]))
        if part and part.parameters and name not in explained:
            found = replace(found, status="contained", probability=fit.probability(part.container))
            found = replace(found, confounded_with=(part.container,))
        elif others := apart.get(name) or _hidden(fit, name, explained):
            found = replace(found, status="confounded", confounded_with=others)
        result.append(found)
    result += [
        Finding(name, "not_found", r.probability, *shares.get(name, (0.0, (0.0, 0.0)))) for name, r in refused.items()
    ]
    result += [Finding(name, "not_testable", needs=needs) for name, needs in fit.needs.items()]
    return tuple(result)


def _of_law(fit: Fit, law: Discovered, block: int) -> dict[str, Any]:
    """Return the fields of a finding that only a law has: what it follows, in which shape, how far, and in words."""
    e, values = fit.explanation, fitted_values(fit, block)
    size = sizes(law, fit.nominal, values, e.values[block][1])
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


def _in_joints(fit: Fit, effect: Effect, block: int) -> tuple[Size, ...]:
    e = fit.explanation
    return in_joints(effect.sized_as, e.linear.blocks[block].parameters, fitted_values(fit, block), e.values[block][1])


def titled(found: Sequence[Finding], effects: Iterable[Effect]) -> tuple[Finding, ...]:
    """Return the findings with titles: that of the effect, or the name of a discovered law."""
    known = {effect.name: effect for effect in effects}
    return tuple(
        replace(f, title=known[f.name].title, random=known[f.name].random)
        if f.name in known
        else replace(f, title=f.title or f.describes or "")
        for f in found
    )


def by_share(found: Sequence[Finding]) -> tuple[Finding, ...]:
    """Sort by held-out share, then by probability; what is not testable comes last."""
    return tuple(
        sorted(found, key=lambda f: (f.status == "not_testable", -(f.shrinkage or 0.0), -(f.probability or 0.0)))
    )


def _hidden(fit: Fit, name: str, explained: Mapping[str, int]) -> tuple[str, ...]:
    """Return the unknown frames that hold all that an effect outside the fit could do; empty where they do not."""
    inside = name not in explained and all(within_frames(fit, b) for b in fit.blocks_of(name))
    return unknown_frames(fit) if inside else ()


def separates(found: Sequence[Finding]) -> tuple[tuple[str, ...], ...]:
    """Return the groups of effects that the data cannot tell apart; one with an unknown frame only if it is alone."""
    groups = tuple(
        dict.fromkeys(tuple(sorted((f.name, *f.confounded_with))) for f in found if f.status == "confounded")
    )
    return tuple(g for g in groups if len(groups) == 1 or not any(is_frame(found, name) for name in g))
