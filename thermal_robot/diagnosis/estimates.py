"""The parameters of a fit as they are told: value and deviation of those that the data identify, also inside others."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.diagnosis.parts import Estimate
from thermal_robot.effects import Parameter
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.inside import divided, identified


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
