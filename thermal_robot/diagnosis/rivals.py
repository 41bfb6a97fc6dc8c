"""What the data cannot tell apart: effects that could stand for one another, and those that unknown frames hold."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.special import chdtri, expit

from thermal_robot.effects import gate, library
from thermal_robot.effects.law import PREFIX
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import orthonormal, whitener, without
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.problem import contained


def unknown_frames(fit: Fit) -> tuple[str, ...]:
    """Return the names of the frame effects whose frame is unknown and therefore fitted."""
    frames = [effect for effect in library().values() if effect.frame]
    return tuple(effect.name for effect in frames if gate.missing(effect, fit.nominal))


def within_frames(fit: Fit, block: int) -> bool:
    """Whether the columns of an effect lie in the span of those of the unknown frames."""
    item, linear = fit.explanation.linear.blocks[block], fit.explanation.linear
    if not linear.frames.size or not item.parameters:
        return False
    columns = item.columns.reshape(-1, len(item.parameters)) * item.sizes
    flat = linear.frames.reshape(-1, linear.frames.shape[2])
    left = without(columns, orthonormal(flat))
    return bool(np.linalg.norm(left) < settings.ALIAS * np.linalg.norm(columns))


def rivals(fit: Fit, explained: Mapping[str, int]) -> dict[str, tuple[str, ...]]:
    """Return by effect the effects that it is confounded with.

    An effect of the fit is confounded with a known one outside it in two cases. Put in its place, all else equal and
    fitted anew, the other is within ``TELLS_APART`` of the evidence, and the effect is no surer than that. Or the other
    is its exact alias; then a larger effect that contains it does not count, as the smaller one is preferred where it
    suffices.

    Parameters
    ----------
    fit
        The fit.
    explained
        By effect of the fit: its block.
    """
    held = [fit.names_of(c) for c in fit.explanation.combinations]
    mass: dict[frozenset[str], float] = {}
    for names, p in zip(held, fit.explanation.probabilities, strict=True):
        mass[names] = mass.get(names, 0.0) + float(p)
    best, known = frozenset(explained), contained(fit.explanation.problem)
    found: dict[str, set[str]] = {}
    for name, block in explained.items():
        sure = fit.probability(name) > expit(settings.TELLS_APART)
        for other in dict.fromkeys(f for f in fit.families if f not in explained and not f.startswith(PREFIX)):
            swapped = mass.get((best - {name}) | {other}, 0.0)
            near = not sure and swapped > np.exp(-settings.TELLS_APART) * mass.get(best, 1.0)
            if near or (not _larger(fit, name, other, known) and _alike(fit, block, other)):
                found.setdefault(name, set()).add(other)
                found.setdefault(other, set()).add(name)
    return {name: tuple(sorted(others)) for name, others in found.items()}


def _larger(fit: Fit, name: str, other: str, known: frozenset[frozenset[int]]) -> bool:
    """Whether one of two effects, in all its places, contains the other."""
    blocks = fit.explanation.linear.blocks
    whole = [k for k, item in enumerate(blocks) if item.effect.name == name and not item.effect.places]
    return all(any(frozenset((w, b)) in known for b in fit.blocks_of(other)) for w in whole)


def _alike(fit: Fit, block: int, other: str) -> bool:
    return any(_imitates(fit, block, b) for b in fit.blocks_of(other))


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
