"""What cancels: parts of a correction that are many times larger than what they do together."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from thermal_robot.diagnosis.one_walk import Model, Walk
from thermal_robot.diagnosis.parts import Refused
from thermal_robot.diagnosis.schemes import schemes
from thermal_robot.effects.effect import in_words
from thermal_robot.effects.law import PREFIX
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import orthonormal, without
from thermal_robot.inference.fit import Fit, less
from thermal_robot.inference.rows import blocks

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Cancelling:
    """Two effects of which a part of one undoes a part of the other.

    Attributes
    ----------
    effects
        Their names.
    places
        Where the two parts are, in words.
    times
        What the smaller part does, over what both do together: rms over the rows, unknown frames projected out, in
        units of the noise.
    """

    effects: tuple[str, str]
    places: tuple[str, str]
    times: float

    @property
    def words(self) -> str:
        """Who cancels whom, where, by how much."""
        (one, other), (here, there) = self.effects, self.places
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
            pair = Cancelling(names, (in_words(*one[1:]), in_words(*other[1:])), times)
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
    noise = np.tile(e.whitening.noise * e.best.noise, len(e.linear.gap))[:, None]
    basis = orthonormal(e.linear.frames.reshape(len(noise), e.linear.frames.shape[2]) / noise)
    for b, (effect, values) in zip(e.best.blocks, fit.effects, strict=True):
        item = e.linear.blocks[b]
        moved = item.columns.reshape(len(noise), -1) * values / noise
        yield effect.name, [(p.kind, p.place) for p in item.parameters], without(moved, basis)


def one_of_each(fit: Fit, progress: Callable[[str], None]) -> tuple[Fit, dict[str, Refused]]:
    """Keep one effect of each pair that cancels, the worst pair first.

    The explanation is chosen again without each of the two, and that one is kept which predicts rows held out better;
    both stay where rows held out are predicted clearly worse without either.

    Returns
    -------
    fit
        With what is left.
    refused
        By name of a known effect that was left out: its probability, by the evidence of the two explanations.
    """
    refused: dict[str, Refused] = {}
    kept: set[tuple[str, str]] = set()
    while pair := next((c for c in cancelling(fit) if c.effects not in kept), None):
        progress(f"{pair.effects[0]} and {pair.effects[1]} cancel each other")
        others = {name: less(fit, name, progress) for name in pair.effects}
        left = {name: goes_astray(other) for name, other in others.items()}
        out = min(left, key=lambda name: left[name])
        if left[out] > settings.WORSE_ELSEWHERE * goes_astray(fit):
            kept.add(pair.effects)
            continue
        best = {name: other.explanation.best.log_evidence for name, other in others.items()}
        (instead,) = set(pair.effects) - {out}
        progress(f"{out} is left out")
        if not out.startswith(PREFIX):
            refused[out] = Refused(float(expit(best[instead] - best[out])), reason=f"{pair.words}; {out} is left out")
        fit = others[out]
    return fit, refused


def goes_astray(fit: Fit) -> float:
    """Rms distance (m) that a fit leaves on rows held out in blocks of time, and in regions of joint space.

    Rows that were set aside count, too: what cancels where it was fitted may be what puts them far off.
    """
    model = Model.of(fit.explanation, blocks(fit.campaign))
    model = replace(model, kept=np.ones(fit.campaign.samples, dtype=bool))
    total, rows = 0.0, 0
    for name, _, tests in schemes(fit):
        walk = Walk.over(model, tests)
        if name in ("time", "region") and walk.tests:
            total += walk.squares(range(len(model.spans))).total
            rows += walk.rows
    return float(np.sqrt(total / max(rows, 1)))
