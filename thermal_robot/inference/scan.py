"""Scan of places and quantities: which law, entering where, explains a remainder best."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from thermal_robot.effects.law import Discovered
from thermal_robot.effects.quantities import GRAVITY, quantities
from thermal_robot.effects.shapes import SHAPES
from thermal_robot.inference import settings
from thermal_robot.inference.columns import block
from thermal_robot.inference.laws import CLOCK, harmonics, laws, shapes
from thermal_robot.inference.target import Target
from thermal_robot.observations import Observations

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Scanned:
    """One candidate: the law, and the log evidence that it gains over noise (Bayes information criterion)."""

    law: Discovered
    gain: float


def scan(observations: Observations, targets: Sequence[Target]) -> tuple[list[list[Scanned]], int]:
    """Return, for every target, all candidates, best first; and how many were tried.

    A law at a segment has six components, so that only the quantities that gain most elsewhere are tried there.
    """
    found: list[list[Scanned]] = [[] for _ in targets]
    first = laws(observations, ("joint", "base", "tool"))
    _measure(observations, first, targets, found)
    telling: dict[str, float] = {}
    for own in found:
        for item in own:
            telling[item.law.quantity] = max(telling.get(item.law.quantity, -np.inf), item.gain)
    names = sorted(telling, key=lambda name: -telling[name])[: settings.LINK_QUANTITIES]
    second = laws(observations, ("link",), names)
    _measure(observations, second, targets, found)
    for own in found:
        own.sort(key=lambda item: -item.gain)
    return found, len(first) + len(second)


def shaped(observations: Observations, target: Target, law: Discovered) -> Scanned:
    """Return a law in the shape that gains most log evidence."""
    values = quantities(observations).get(law.quantity)
    jumps = law.quantity in (*CLOCK, *GRAVITY, *observations.robot.joint_names)
    orders = harmonics(observations, law.place) if law.kind == "joint" else settings.HARMONICS
    candidates = [law] if values is None else shapes(law, values, jumps, orders)

    def measured(candidate: Discovered) -> Scanned:
        return Scanned(candidate, target.worth(block(observations, candidate).columns).gain)

    best = max(map(measured, candidates), key=lambda item: item.gain)
    return best if SHAPES[best.law.shape].mark != "gradual" else _refined(best, measured)


def _refined(best: Scanned, measured: Callable[[Discovered], Scanned]) -> Scanned:
    """Move marks and widths in ever smaller steps while that gains."""
    step, law = settings.MARK_STEP, best.law
    for _ in range(settings.MARK_ROUNDS):
        law, (mark, *width) = best.law, best.law.marks
        near = [replace(law, marks=(mark + s * step * law.span, *width)) for s in (1, -1)]
        if SHAPES[law.shape].width:
            near += [
                replace(law, marks=(mark, width[0] * f))
                for f in (1.0 + settings.WIDTH_STEP * step, 1.0 / (1.0 + settings.WIDTH_STEP * step))
            ]
        better = max(map(measured, near), key=lambda item: item.gain)
        if better.gain > best.gain:
            best = better
        else:
            step /= 2.0
    return best


def _measure(
    observations: Observations,
    candidates: Sequence[Discovered],
    targets: Sequence[Target],
    found: list[list[Scanned]],
) -> None:
    for law in candidates:
        columns = block(observations, law).columns
        for target, own in zip(targets, found, strict=True):
            own.append(Scanned(law, target.worth(columns).gain))
