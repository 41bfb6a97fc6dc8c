"""What the data cannot tell apart: effects that could stand for one another, and those that unknown frames hold."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product

import numpy as np

from thermal_robot.effects import gate, library
from thermal_robot.effects.law import PREFIX
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import equations_of, orthonormal, without
from thermal_robot.inference.fit import Fit


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
    """Return by effect the effects that it is confounded with.

    An effect of the fit is confounded with a known one outside it where that one, fitted anew in its place, is nearly
    as probable: by more than ``IN_ITS_PLACE`` it is at work and the effect is not, and nothing else joins it.

    Parameters
    ----------
    fit
        The fit.
    explained
        By effect of the fit: its block.
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
