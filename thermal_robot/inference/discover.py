"""Unlisted causes: laws of places and quantities that compete with the known effects in one comparison."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from thermal_robot.effects.law import PREFIX, Discovered
from thermal_robot.inference import settings
from thermal_robot.inference.columns import block
from thermal_robot.inference.evidence import Combination, Search
from thermal_robot.inference.explain import log_odds, log_priors, settings_of_one
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.laws import CLOCK
from thermal_robot.inference.problem import Linear, Whitening, contained, gram
from thermal_robot.inference.scan import Scanned, scan, shaped
from thermal_robot.inference.thin import Thin

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Discovery:
    """The law that the data speak for, with its rivals.

    Attributes
    ----------
    law
        What it is.
    beside
        Names of the known effects that stay beside it.
    rarity
        Log prior odds of having been picked out of all the laws that were tried; below zero.
    gain
        Log evidence over the best combination without a law.
    places
        (kind, name) with the posterior probability of each.
    quantities
        The same of each quantity.
    """

    law: Discovered
    beside: tuple[str, ...]
    rarity: float
    gain: float
    places: tuple[tuple[tuple[str, str], float], ...]
    quantities: tuple[tuple[str, float], ...]


def discover(fit: Fit, number: int) -> Discovery | None:
    """Scan every place and quantity for a law; ``None`` where none is worth its place.

    Two remainders are scanned: that of the explanation, and that of the frames alone. Known effects may have absorbed
    part of an unlisted cause, which then shows in the second only. The best candidates compete with the known effects
    in one comparison, so that effects that merely stood in for a law are dropped again.

    Parameters
    ----------
    fit
        An explanation that leaves a remainder.
    number
        Of the law: it is called ``discovered.<number>``.
    """
    e, thin = fit.explanation, Thin.of(fit)
    after = thin.target(e.best.blocks)
    before = thin.target(b for b in e.best.blocks if fit.families[b].startswith(PREFIX))
    found, tried = scan(thin.observations, [after, before])
    candidates: list[Scanned] = []
    for target, own in zip((after, before), found, strict=True):
        for item in _with_joints(own):
            best = shaped(thin.observations, target, item.law)
            if best.gain > 0.0:
                candidates.append(best)
    laws = list(dict.fromkeys(c.law for c in sorted(candidates, key=lambda c: -c.gain)))
    # the first of each remainder, in turn
    chosen = _in_turn([[c.law for c in _of(candidates, own)] for own in found], laws)[: settings.COMPARED_LAWS]
    if not chosen:
        return None
    return _compare(fit, thin, [replace(law, name=f"{PREFIX}{number}") for law in chosen], tried)


def _with_joints(own: Sequence[Scanned]) -> list[Scanned]:
    """Return the best candidates; where one is at a segment, also the law of the joint behind it, which is simpler."""
    first = list(own[: settings.SHAPED])
    simpler = {(i.law.place, i.law.quantity) for i in first if i.law.kind == "link"}
    return first + [
        i for i in own[settings.SHAPED :] if i.law.kind == "joint" and (i.law.place, i.law.quantity) in simpler
    ]


def _of(candidates: Sequence[Scanned], own: Sequence[Scanned]) -> list[Scanned]:
    places = {(i.law.kind, i.law.place, i.law.quantity) for i in _with_joints(own)}
    mine = [c for c in candidates if (c.law.kind, c.law.place, c.law.quantity) in places]
    return sorted(mine, key=lambda c: -c.gain)


def _in_turn(lists: Sequence[Sequence[Discovered]], everything: Sequence[Discovered]) -> list[Discovered]:
    longest = max((len(own) for own in lists), default=0)
    turns = [own[k] for k in range(longest) for own in lists if k < len(own)]
    return list(dict.fromkeys([*turns, *everything]))


def _compare(fit: Fit, thin: Thin, laws: Sequence[Discovered], tried: int) -> Discovery | None:
    """Search over known effects and one law at a time; effects that are no longer needed beside the law are dropped."""
    e = fit.explanation
    known = len(e.linear.blocks)
    problem = gram(_with(thin, laws), _all_rows(fit, thin))
    rarity = -float(np.log(tried))
    families = [*fit.families, *(law.name for law in laws)]
    prior = log_priors(fit.families, fit.rarity)
    # a change that is one in time and in another quantity happened in time
    prior += [log_odds() + rarity + (settings.IN_TIME if law.quantity in CLOCK else 0.0) for law in laws]
    search = Search(problem, prior, contained(problem) | settings_of_one(families))
    plain = search.evaluate(e.best.blocks)
    best = plain
    for k in range(known, known + len(laws)):
        start = search.evaluate((*e.best.blocks, k), plain)
        best = max(best, start, search.evaluate((k,), start), key=lambda c: c.log_evidence)
    best = _climb(search, best, known)
    inside = [k for k in best.blocks if k >= known]
    if not inside:
        return None
    without = _climb(search, plain, known, barred=frozenset(range(known, known + len(laws))))
    gain = best.log_evidence - without.log_evidence
    if gain < settings.LEAST_GAIN:
        return None
    places, followed = _pooled(fit, search, laws)
    return Discovery(
        laws[inside[0] - known],
        tuple(dict.fromkeys(fit.families[b] for b in best.blocks if b < known)),
        rarity,
        float(gain),
        places,
        followed,
    )


def _pooled(
    fit: Fit, search: Search, laws: Sequence[Discovered]
) -> tuple[tuple[tuple[tuple[str, str], float], ...], tuple[tuple[str, float], ...]]:
    """Return the places and the quantities of laws with their posterior probabilities, most probable first."""
    known = len(fit.explanation.linear.blocks)
    places: dict[tuple[str, str], float] = {}
    followed: dict[str, float] = {}
    for combination, w in zip(*search.probabilities(), strict=True):
        for law in (laws[k - known] for k in combination.blocks if k >= known):
            place = where(fit, law)
            places[place] = places.get(place, 0.0) + float(w)
            followed[law.quantity] = followed.get(law.quantity, 0.0) + float(w)
    return (
        tuple(sorted(places.items(), key=lambda item: -item[1])),
        tuple(sorted(followed.items(), key=lambda item: -item[1])),
    )


def instead(fit: Fit, name: str) -> tuple[Discovered, float] | None:
    """Return the law that could best take a known effect's place, and its gain in log evidence over that effect.

    Where an unlisted cause is at work already, one more place costs a law only the choice of that place.
    """
    e = fit.explanation
    rest = tuple(b for b in e.best.blocks if fit.families[b] != name)
    thin = Thin.of(fit)
    target = thin.target(rest)
    found, _ = scan(thin.observations, [target])
    laws = [shaped(thin.observations, target, item.law).law for item in _with_joints(found[0])[: settings.RIVAL_LAWS]]
    if not laws:
        return None
    known = len(e.linear.blocks)
    problem = gram(_with(thin, laws), thin.whitening)
    places = fit.campaign.robot.n + len(fit.campaign.robot.segments)
    prior = [*log_priors(fit.families, fit.rarity), *[-float(np.log(places))] * len(laws)]
    search = Search(problem, prior)
    now = search.evaluate(e.best.blocks).log_evidence
    gains = [search.evaluate((*rest, known + k)).log_evidence - now for k in range(len(laws))]
    best = int(np.argmax(gains))
    return laws[best], gains[best]


def _climb(search: Search, best: Combination, known: int, barred: frozenset[int] = frozenset()) -> Combination:
    """Add or drop one block, or exchange one law for another, while the evidence grows."""
    count = len(search.gram.slices)
    while True:
        around = [(*best.blocks, b) for b in range(count) if b not in best.blocks and b not in barred]
        around += [tuple(b for b in best.blocks if b != out) for out in best.blocks]
        laws = [b for b in best.blocks if b >= known]
        around += [
            (*(b for b in best.blocks if b != out), new) for out in laws for new in range(known, count) if new != out
        ]
        tried = [search.evaluate(blocks, best) for blocks in around if search.allowed(blocks)]
        better = max(tried, key=lambda c: c.log_evidence, default=best)
        if better.log_evidence <= best.log_evidence + settings.BETTER:
            return best
        best = better


def _with(thin: Thin, laws: Sequence[Discovered]) -> Linear:
    """Return the problem with further blocks for laws."""
    linear = thin.linear
    return Linear(linear.gap, linear.frames, (*linear.blocks, *(block(thin.observations, law) for law in laws)))


def _all_rows(fit: Fit, thin: Thin) -> Whitening:
    """Weigh every row, those set aside by their distance: under another explanation they may be sound."""
    stated = (fit.campaign.noise_position, fit.campaign.noise_orientation)
    noise = thin.whitening.noise.copy()
    for part, sigma in enumerate(stated[: len(noise) // 3]):
        if sigma is not None:
            noise[3 * part : 3 * part + 3] = np.minimum(noise[3 * part : 3 * part + 3], settings.STATED_REACH * sigma)
    distance2 = ((thin.remainder / thin.whitening.noise) ** 2).sum(axis=1) / thin.linear.measures
    weights = np.where(thin.changed, 1.0, np.minimum(1.0, settings.FAR / np.maximum(distance2, settings.TINY)))
    return Whitening(weights, noise, thin.whitening.held)


def where(fit: Fit, law: Discovered) -> tuple[str, str]:
    """Return a law's place as a diagnosis names it: a segment by the link that carries it."""
    if law.kind != "link":
        return law.kind, law.place
    return "link", next(s.parent_link for s in fit.campaign.robot.segments if s.name == law.place)
