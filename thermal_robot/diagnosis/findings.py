"""Which effect: status, probability, parameters of every candidate."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from thermal_robot.diagnosis.parts import Estimate, Finding, Location, Refused, Status, is_frame
from thermal_robot.effects import Effect, gate, library
from thermal_robot.effects.law import PREFIX, Discovered
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import orthonormal, whitener, without
from thermal_robot.inference.explain import Explanation
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.problem import contained

Array = NDArray[np.float64]
Shares = dict[str, tuple[float, tuple[float, float]]]


def findings(
    fit: Fit,
    shares: Shares,
    locations: dict[str, tuple[Location, ...]],
    laws: Mapping[str, float],
    refused: Mapping[str, Refused],
) -> tuple[Finding, ...]:
    """Return a finding for every candidate; those that are not testable come last.

    Parameters
    ----------
    fit
        The final fit.
    shares
        By effect: share of the gap on held-out rows, and its 95 % interval.
    locations
        By effect of the fit: its places.
    laws
        By discovered law of the fit: probability that what it follows, where, is right.
    refused
        Effects that were taken out of the fit again.
    """
    e = fit.explanation
    explained = {effect.name: b for b, (effect, _) in zip(e.best.blocks, fit.effects, strict=True)}
    rivals = _rivals(fit, explained)
    result = []
    for name in dict.fromkeys(fit.families):
        if name.startswith(PREFIX) and name not in explained:
            continue  # a law that did not last was never a candidate of anybody's
        own = fit.blocks_of(name)
        status: Status = "found" if name in explained else "not_found"
        confounded = rivals.get(name, ())
        if not confounded and name not in explained and all(_within_frames(fit, b) for b in own):
            confounded = _unknown_frames(fit)
        if confounded:
            status = "confounded"
        share, interval = shares.get(name, (0.0, (0.0, 0.0)))
        law = next(
            (effect for effect, _ in fit.effects if effect.name == name and isinstance(effect, Discovered)), None
        )
        result.append(
            Finding(
                name,
                status,
                probability=laws.get(name, e.probability(own)),
                shrinkage=share,
                shrinkage_ci95=interval,
                confounded_with=confounded,
                locations=locations.get(name, ()),
                parameters=_estimates(fit, explained[name]) if name in explained else (),
                quantity=law.follows if law else None,
                shape=law.shape if law else None,
                describes=law.describe() if law else None,
                of=(law.of or None) if law else None,
            )
        )
    result += [
        Finding(name, "not_found", r.probability, *shares.get(name, (0.0, (0.0, 0.0)))) for name, r in refused.items()
    ]
    result += [Finding(name, "not_testable", needs=needs) for name, needs in fit.needs.items()]
    return tuple(result)


def titled(found: Sequence[Finding], effects: Iterable[Effect]) -> tuple[Finding, ...]:
    """Return the findings with titles: that of the effect, or what a discovered law describes."""
    known = {effect.name: effect for effect in effects}
    return tuple(
        replace(f, title=known[f.name].title, random=known[f.name].random)
        if f.name in known
        else replace(f, title=f.describes or "")
        for f in found
    )


def by_share(found: Sequence[Finding]) -> tuple[Finding, ...]:
    """Sort by held-out share, then by probability; what is not testable comes last."""
    return tuple(
        sorted(found, key=lambda f: (f.status == "not_testable", -(f.shrinkage or 0.0), -(f.probability or 0.0)))
    )


def _unknown_frames(fit: Fit) -> tuple[str, ...]:
    """Return the names of the frame effects whose frame is unknown and therefore fitted."""
    frames = [effect for effect in library().values() if effect.frame]
    return tuple(effect.name for effect in frames if gate.missing(effect, fit.nominal))


def _within_frames(fit: Fit, block: int) -> bool:
    """Whether the columns of an effect lie in the span of those of the unknown frames."""
    item, linear = fit.explanation.linear.blocks[block], fit.explanation.linear
    if not linear.frames.size or not item.parameters:
        return False
    columns = item.columns.reshape(-1, len(item.parameters)) * item.sizes
    flat = linear.frames.reshape(-1, linear.frames.shape[2])
    left = without(columns, orthonormal(flat))
    return bool(np.linalg.norm(left) < settings.ALIAS * np.linalg.norm(columns))


def _rivals(fit: Fit, explained: dict[str, int]) -> dict[str, tuple[str, ...]]:
    """Return by effect the effects that it is confounded with.

    An effect of the fit is confounded with one outside it in two cases: it is uncertain, and the other is present in
    most combinations that lack it; or the other is its exact alias. A larger effect that contains it does not count,
    as the smaller one is preferred where it suffices.
    """
    e: Explanation = fit.explanation
    held = [fit.names_of(c) for c in e.combinations]
    containing = contained(e.problem)
    rivals: dict[str, set[str]] = {}
    for name, block in explained.items():
        absent = np.array([name not in h for h in held])
        mass = float(e.probabilities[absent].sum())
        for other in dict.fromkeys(fit.families):
            if other in explained:
                continue
            own = fit.blocks_of(other)
            both = np.array([other in h for h in held])
            instead = float(e.probabilities[absent & both].sum())
            doubtful = mass >= 1.0 - settings.SURE and instead > max(settings.RIVAL, settings.RIVAL_SHARE * mass)
            blocks = enumerate(e.linear.blocks)
            whole = [k for k, item in blocks if item.effect.name == name and not item.effect.places]
            apart = not all(any(frozenset((w, b)) in containing for b in own) for w in whole)
            if doubtful or (apart and any(_imitates(fit, block, b) for b in own)):
                rivals.setdefault(name, set()).add(other)
                rivals.setdefault(other, set()).add(name)
    return {name: tuple(sorted(others)) for name, others in rivals.items()}


def _imitates(fit: Fit, block: int, other: int) -> bool:
    """Whether another effect can reproduce the fitted contribution of this one to within the noise.

    Exact aliases are the directions that both column spaces share (principal angle zero, Björck and Golub 1973). An
    effect that merely comes close is weighed by the evidence instead.
    """
    e = fit.explanation
    matrix, slices = e.problem.matrix, e.problem.slices
    own, theirs = (whitener(matrix[s, s]) for s in (slices[block], slices[other]))
    if not own.size or not theirs.size:
        return False
    left, cosine, _ = np.linalg.svd(own.T @ matrix[slices[block], slices[other]] @ theirs, full_matrices=False)
    shared = left[:, cosine > 1.0 - settings.ALIAS]
    ends = np.cumsum([0, *(e.problem.bases[b].shape[1] for b in e.best.blocks)])
    start = ends[e.best.blocks.index(block)]
    moved = own.T @ matrix[slices[block], slices[block]] @ e.best.values[start : start + own.shape[0]]
    rest = float(moved @ moved - ((shared.T @ moved) ** 2).sum())
    noise = float(chdtri(len(moved), settings.EXACT_LEVEL)) * e.best.noise**2
    return bool(shared.shape[1]) and rest < noise < float(moved @ moved)


def _estimates(fit: Fit, block: int) -> tuple[Estimate, ...]:
    e = fit.explanation
    item = e.linear.blocks[block]
    values = dict(zip(e.best.blocks, (v for _, v in fit.effects), strict=True))[block]
    spread = np.sqrt(np.maximum(np.diag(e.values[block][1]), 0.0))
    prior = item.sizes * e.best.scales[block]
    result = []
    for parameter, value, std, size in zip(item.parameters, values, spread, prior, strict=True):
        known = bool(std < settings.DETERMINED * size)
        result.append(
            Estimate(
                parameter.name, float(value) if known else None, float(std) if known else None, parameter.unit, known
            )
        )
    return tuple(result)


def separates(found: Sequence[Finding]) -> tuple[tuple[str, ...], ...]:
    """Return the groups of effects that the data cannot tell apart.

    A group with an unknown frame is listed only if it is the only group.
    """
    groups = tuple(dict.fromkeys(tuple(sorted((f.name, *f.confounded_with))) for f in found if f.confounded_with))
    return tuple(g for g in groups if len(groups) == 1 or not any(is_frame(found, name) for name in g))
