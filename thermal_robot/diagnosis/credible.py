"""What is in doubt however well it fits: effects that cancel, and sizes that no robot reaches. Rows held out decide."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from scipy.special import expit

from thermal_robot.arrays import Array
from thermal_robot.diagnosis import settings as own
from thermal_robot.diagnosis.held_out import schemes
from thermal_robot.diagnosis.one_walk import Model, Walk
from thermal_robot.diagnosis.parts import Refused
from thermal_robot.effects import gate
from thermal_robot.effects.effect import UNSOURCED, Effect, in_words
from thermal_robot.effects.law import PREFIX
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import equations_of, orthonormal, without
from thermal_robot.inference.columns import Block
from thermal_robot.inference.fit import Fit, less, refit
from thermal_robot.inference.rows import blocks


@dataclass(frozen=True)
class Cancelling:
    """Two effects of which a part of one undoes a part of the other.

    ``sites``: kind and place of both parts. ``times``: what the smaller part does, over what both do together: rms over
    the rows, unknown frames projected out, in units of the noise.
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
    """Yield effects whose parameters cancel, as low harmonics over part of a turn: name, largest part over the sum."""
    for name, _, moved in _moved(fit):
        whole = float(np.linalg.norm(moved.sum(axis=1)))
        times = float(np.linalg.norm(moved, axis=0).max(initial=0.0)) / max(whole, settings.TINY)
        if times > settings.CANCELLING:
            yield name, times


def _moved(fit: Fit) -> Iterator[tuple[str, list[tuple[str, str]], Array]]:
    """Yield each effect's name, kind and place of its P parameters, and (E, P) their moves in noise, without frames."""
    e = fit.explanation
    noise = np.broadcast_to(e.whitening.sigma() * e.best.noise, e.linear.gap.shape).reshape(-1, 1)
    basis = orthonormal(equations_of(e.linear.frames) / noise)
    for b, (effect, values) in zip(e.best.blocks, fit.effects, strict=True):
        item = e.linear.blocks[b]
        moved = equations_of(item.columns) * values / noise
        yield effect.name, [(p.kind, p.place) for p in item.parameters], without(moved, basis)


@dataclass(frozen=True)
class Doubt:
    """Parts of effects of which one should not be in the explanation; ``words`` say why, without a full stop.

    ``parts``: effect, and joint or link (empty: all of it). ``times``: by how much they are in doubt, as a ratio. One
    that is ``impossible`` is beyond what is physically possible: it is told, and nothing more.
    """

    parts: tuple[tuple[str, str], ...]
    words: str
    times: float
    impossible: bool = False


def outsized(fit: Fit) -> tuple[Doubt, ...]:
    """Return each parameter that surely cannot be, or is far outside a size that stands on sources, the worst first."""
    found = []
    for effect, values, item, sure in surely(fit):
        known = settings.OUTSIDE if effect.size_spread < UNSOURCED else np.inf
        for k in np.flatnonzero((sure > known) | (sure * item.sizes > item.most)):
            own, times = item.parameters[k], float(np.abs(values[k]) / item.sizes[k])
            impossible = bool(sure[k] <= known and sure[k] * item.sizes[k] > item.most[k])
            never = "is physically possible" if impossible else "any robot is known to reach"
            words = f"{effect.title}: {own.name} is {times:.0f} times its expected size, more than {never}"
            found.append(Doubt((_part(effect.name, own.kind, own.place),), words, times, impossible))
    return tuple(sorted(found, key=lambda doubt: (not doubt.impossible, -doubt.times)))


def surely(fit: Fit) -> Iterator[tuple[Effect, Array, Block, Array]]:
    """Yield each effect, its values, its columns, and how many expected sizes each value is at least, at 95 %."""
    e = fit.explanation
    for b, (effect, values) in zip(e.best.blocks, fit.effects, strict=True):
        item, deviation = e.linear.blocks[b], np.sqrt(np.diag(e.values[b][1]))
        yield effect, values, item, np.maximum(np.abs(values) - settings.SIGMAS_95 * deviation, 0.0) / item.sizes


def _part(name: str, kind: str, place: str) -> tuple[str, str]:
    return name, place if kind in ("joint", "link") else ""


def _doubts(fit: Fit) -> Iterator[Doubt]:
    for pair in cancelling(fit):
        parts = (_part(name, *site) for name, site in zip(pair.effects, pair.sites, strict=True))
        yield Doubt(tuple(parts), pair.words, pair.times)
    yield from (doubt for doubt in outsized(fit) if not doubt.impossible)


def credible(fit: Fit, progress: Callable[[str], None]) -> tuple[Fit, dict[str, Refused]]:
    """Leave out one of two parts of effects that cancel, and parts of a size that no robot reaches, the worst first.

    A part is what an effect does in one joint or link. The explanation is chosen again without each part in doubt, and
    that one is left out without which rows held out are predicted best; none is where they are then predicted clearly
    worse. Where rows are very many, only the worst doubt is weighed; of more still, the whole effect. Refused, by name:
    the probability of a known effect all of which was left out, by the evidence of the two explanations that keep one
    of a pair.
    """
    refused: dict[str, Refused] = {}
    weighed: set[tuple[tuple[str, str], ...]] = set()
    whole = fit.campaign.samples > settings.RIPPLE_ROWS
    most = settings.MOST_DOUBTS if fit.campaign.samples <= settings.ENOUGH_ROWS else 1
    while len(weighed) < most and (doubt := next((d for d in _doubts(fit) if d.parts not in weighed), None)):
        weighed.add(doubt.parts)
        progress(doubt.words)
        others = {part: less(fit, part[0], progress, "" if whole else part[1]) for part in doubt.parts}
        left = {part: goes_astray(other) for part, other in others.items()}
        out = min(left, key=lambda part: left[part])
        if left[out] > settings.WORSE_ELSEWHERE * goes_astray(fit):
            continue
        best = {part: other.explanation.best.log_evidence for part, other in others.items()}
        chance = max((float(expit(best[instead] - best[out])) for instead in best if instead != out), default=0.0)
        fit, (name, place) = others[out], out
        place = place if name in fit.variants else ""
        called = f"{name} of {place}" if place else name
        progress(f"{called} is left out")
        if not name.startswith(PREFIX):
            refused[called] = Refused(chance, reason=f"{doubt.words}; {called} is left out", place=place)
    return fit, refused


def goes_astray(fit: Fit) -> float:
    """Rms distance (m) that a fit leaves on rows held out in blocks of time, and in regions of joint space.

    Rows that were set aside count, too: what cancels where it was fitted may be what puts them far off.
    """
    model = Model.of(fit.explanation, blocks(fit.campaign))
    model = replace(model, kept=np.ones(fit.campaign.samples, dtype=bool))
    total, rows = 0.0, 0
    for tests in (tests for name, _, tests in schemes(fit) if name in ("time", "region")):
        walk = Walk.over(model, tests)
        if walk.tests:
            total += walk.squares(range(len(model.spans))).total
            rows += walk.rows
    return float(np.sqrt(total / max(rows, 1)))


def in_full(fit: Fit, progress: Callable[[str], None]) -> Fit:
    """Let fuller settings compete where a parameter is surely larger than 99 % of robots have.

    Over part of its range two smooth shapes are nearly alike: where what a robot does is neither, their difference
    follows it with amplitudes that no robot has. A setting of more shapes, none of which may be large, then explains
    the same, and as much of the rows held out.

    The choice beside them stays unless rows held out are then predicted clearly worse; of more rows than ripple is
    looked for in, which would take minutes, nothing is asked.
    """
    if fit.campaign.samples > settings.RIPPLE_ROWS:
        return fit
    for effect in _uncommon(fit):
        fuller = gate.in_full(effect)
        if fuller is None:
            continue
        progress(f"{effect.title} in full")
        begin = [fuller if other is effect else other for other, _ in fit.effects]
        others = refit(fit, {effect.name: (*fit.variants[effect.name], fuller)}, begin, progress)
        if goes_astray(others) <= settings.WORSE_ELSEWHERE * goes_astray(fit):
            return others
    return fit


def _uncommon(fit: Fit) -> list[Effect]:
    """Return the effects of which a parameter is surely beyond the size that nearly all robots have."""
    return [
        effect
        for effect, _, _, sure in surely(fit)
        if effect.name in fit.variants and (sure > np.exp(own.NEARLY_ALL * effect.size_spread)).any()
    ]
