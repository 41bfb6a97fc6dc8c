"""Unlisted causes: the laws that are worth comparing with the known effects, and what the comparison says of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from thermal_robot.effects.law import PREFIX, Discovered
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import equations_of, orthonormal, without
from thermal_robot.inference.columns import block
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.scan import Scanned, Seats, Thin, scan, shaped
from thermal_robot.inference.settle import constant
from thermal_robot.inference.target import Target


@dataclass(frozen=True, eq=False)
class Discovery:
    """A law of a fit with its probability, and rival places and quantities with theirs, the most probable first."""

    law: Discovered
    probability: float
    places: tuple[tuple[tuple[str, str], float], ...]
    quantities: tuple[tuple[str, float], ...]


def candidates(fit: Fit, number: int, happened: Sequence[Discovered]) -> tuple[Discovered, ...]:
    """Laws that may be worth their place, best first, the events that may have happened before all others.

    Scanned are the remainders of the explanation and, unless one effect leaves but noise, of the laws alone and without
    each effect: known effects may have absorbed an unlisted cause. A law is called ``discovered.<number>``.
    """
    thin = Thin.of(fit)
    remainders = list(dict.fromkeys(_remainders(fit)))
    targets = [thin.target(blocks) for blocks in remainders]
    if fit.explanation.outliers.any():
        targets += [thin.target(blocks, sound=True) for blocks in remainders[:2]]
    found, _ = scan(thin.observations, targets, [effect for own in fit.variants.values() for effect in own[:1]])
    offered = [_offered(thin, target, own) for target, own in zip(targets, found, strict=True)]
    chosen = list(happened[: settings.LIKELY_EVENTS])
    for k in range(max(map(len, offered), default=0)):  # the first of each remainder, in turn
        chosen += [own[k] for own in offered if k < len(own)]
    named = dict.fromkeys(replace(law, name=f"{PREFIX}{number}") for law in chosen)
    return tuple(islice((law for law in named if not listed(thin, law)), settings.COMPARED_LAWS))


def listed(thin: Thin, law: Discovered) -> bool:
    """Whether a known effect in that joint, with a zero that is off, does exactly what a law does: then it is none."""
    if law.kind != "joint":
        return False
    own = [item for item in thin.linear.blocks if item.effect.places == (law.place,)]
    free = [item.columns for item in own if constant(item.effect, thin.observations)] + [thin.linear.frames]
    columns = equations_of(block(thin.observations, law).columns)
    length = np.linalg.norm(columns, axis=0).max()
    for item in own:
        basis = orthonormal(equations_of(np.concatenate([item.columns, *free], axis=2)))
        if np.linalg.norm(without(columns, basis), axis=0).max() < settings.ALIAS * length:
            return True
    return False


def _remainders(fit: Fit) -> Iterator[tuple[int, ...]]:
    """Yield the blocks of the explanation that are taken out of each remainder that is scanned."""
    best = fit.explanation.best.blocks
    laws = tuple(b for b in best if fit.families[b].startswith(PREFIX))
    effects = [b for b in best if b not in laws]
    yield best
    if len(effects) > 1 or fit.explanation.discrepancy.probability > settings.SMOOTH_PRIOR:
        yield laws
    if 2 < len(effects) <= settings.LEFT_OUT or (len(effects) == 2 and laws):
        yield from (tuple(b for b in best if b != out) for out in effects)


def _offered(thin: Thin, target: Target, own: Sequence[Scanned]) -> list[Discovered]:
    """Return a remainder's best laws, at a segment also in the joint behind it, with how many it was picked among."""
    first = [(item, shaped(thin.observations, target, item.law)) for item in _with_joints(own)]
    joints = thin.observations.robot.joint_names
    at_links = [(item, s) for item, s in first if s.law.kind == "link" and s.law.place in joints]
    if at_links:
        simpler = [replace(s.law, kind="joint") for _, s in at_links]
        gains = Seats(thin.observations, [target]).gains(simpler)[0]
        first += [
            (item, replace(s, law=law, gain=float(gain)))
            for (item, s), law, gain in zip(at_links, simpler, gains, strict=True)
        ]
    worth = [(s.gain - float(np.log(item.tried * s.tried)), item, s) for item, s in first]
    worth.sort(key=lambda entry: -entry[0])
    return [replace(s.law, tried=float(item.tried * s.tried)) for gain, item, s in worth if gain > -settings.RUNG_REACH]


def _with_joints(own: Sequence[Scanned]) -> list[Scanned]:
    """Return the best candidates; where one is at a segment, also the law of the joint behind it, which is simpler."""
    first = list(own[: settings.SHAPED])
    simpler = {(i.law.place, i.law.follows) for i in first if i.law.kind == "link"}
    return first + [
        i for i in own[settings.SHAPED :] if i.law.kind == "joint" and (i.law.place, i.law.follows) in simpler
    ]


def discovered(fit: Fit) -> tuple[Discovery, ...]:
    """Return the laws of a fit with the probabilities of their places and quantities among all that were compared."""
    e = fit.explanation
    laws = {b: item.effect for b, item in enumerate(e.linear.blocks) if isinstance(item.effect, Discovered)}
    found = []
    for b in e.best.blocks:
        if b in laws:
            rivals = {k: law for k, law in laws.items() if law.name == laws[b].name}
            places: dict[tuple[str, str], float] = {}
            followed: dict[str, float] = {}
            same = 0.0
            for combination, w in zip(e.combinations, e.probabilities, strict=True):
                for law in (rivals[k] for k in combination.blocks if k in rivals):
                    place = where(fit, law)
                    places[place] = places.get(place, 0.0) + float(w)
                    followed[law.follows] = followed.get(law.follows, 0.0) + float(w)
                    same += float(w) * ((place, law.follows) == (where(fit, laws[b]), laws[b].follows))
            found.append(Discovery(laws[b], min(same, 1.0), _sorted(places), _sorted(followed)))
    return tuple(found)


def _sorted(found: dict) -> tuple:  # type: ignore[type-arg]
    return tuple(sorted(found.items(), key=lambda item: -item[1]))


def where(fit: Fit, law: Discovered) -> tuple[str, str]:
    """Return a law's place as a diagnosis names it: a segment by the link that carries it."""
    if law.kind != "link":
        return law.kind, law.place
    return "link", next(s.parent_link for s in fit.campaign.robot.segments if s.name == law.place)
