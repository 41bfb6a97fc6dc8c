"""What cancels: parts of a correction that are many times larger than what they do together."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.effects.effect import in_words
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import equations_of, orthonormal, without
from thermal_robot.inference.fit import Fit


@dataclass(frozen=True)
class Cancelling:
    """Two effects of which a part of one undoes a part of the other.

    Attributes
    ----------
    effects
        Their names.
    sites
        Kind and place of the two parts.
    times
        What the smaller part does, over what both do together: rms over the rows, unknown frames projected out, in
        units of the noise.
    """

    effects: tuple[str, str]
    sites: tuple[tuple[str, str], tuple[str, str]]
    times: float

    @property
    def words(self) -> str:
        """Who cancels whom, where, by how much."""
        (one, other), (here, there) = self.effects, (in_words(*site) for site in self.sites)
        where = f"at {here}" if here == there else f"at {here} and {there}"
        return f"{one} and {other} {where} cancel each other: each does {self.times:.0f} times what both do together"


def cancelling(fit: Fit) -> tuple[Cancelling, ...]:
    """Return pairs of effects with parts, each all that one effect does at one place, that cancel; the worst first.

    Such parts have no meaning one by one, and where nothing was measured they do not cancel.
    """
    parts: dict[tuple[str, str, str], Array] = {}
    for name, of, moved in _moved(fit):
        for site in dict.fromkeys(of):
            parts[(name, *site)] = moved[:, [k for k, own in enumerate(of) if own == site]].sum(axis=1)
    found: dict[tuple[str, str], Cancelling] = {}
    for one, other in combinations(parts, 2):
        together = float(np.linalg.norm(parts[one] + parts[other]))
        each = min(float(np.linalg.norm(parts[key])) for key in (one, other))
        times, names = each / max(together, settings.TINY), (one[0], other[0])
        if one[0] != other[0] and times > settings.CANCELLING_PAIR:
            pair = Cancelling(names, (one[1:], other[1:]), times)
            found[names] = max(pair, found.get(names, pair), key=lambda c: c.times)
    return tuple(sorted(found.values(), key=lambda c: -c.times))


def cancelling_within(fit: Fit) -> Iterator[tuple[str, float]]:
    """Yield effects whose parameters cancel each other: name, and largest single contribution over the sum.

    Such parameters have no meaning one by one. Over part of a turn, for example, harmonics of low order are nearly
    collinear.
    """
    for name, _, moved in _moved(fit):
        whole = float(np.linalg.norm(moved.sum(axis=1)))
        times = float(np.linalg.norm(moved, axis=0).max(initial=0.0)) / max(whole, settings.TINY)
        if times > settings.CANCELLING:
            yield name, times


def _moved(fit: Fit) -> Iterator[tuple[str, list[tuple[str, str]], Array]]:
    """Yield each effect's name, kind and place of its P parameters, and (E, P) what each does to the target.

    In units of the noise, with the unknown frames projected out.
    """
    e = fit.explanation
    noise = np.broadcast_to(e.whitening.sigma() * e.best.noise, e.linear.gap.shape).reshape(-1, 1)
    basis = orthonormal(equations_of(e.linear.frames) / noise)
    for b, (effect, values) in zip(e.best.blocks, fit.effects, strict=True):
        item = e.linear.blocks[b]
        moved = equations_of(item.columns) * values / noise
        yield effect.name, [(p.kind, p.place) for p in item.parameters], without(moved, basis)
