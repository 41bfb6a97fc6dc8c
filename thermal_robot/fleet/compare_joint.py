"""The joint fit: what campaigns share and what differs between them, weighed by evidence.

Every campaign says y_c = X_c θ_c + noise, its own frames projected out. An effect that is shared is one block of
columns over all campaigns; one of its places (a joint, a link), or one parameter there, that differs in some campaigns
is a block over these alone. All blocks compete by the marginal likelihood of a diagnosis
(:mod:`thermal_robot.inference.evidence`), from the campaigns' sums of products; noise and frames are each campaign's
own. What the search holds for a change must also stand by its chi-square, corrected for all that was looked at.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from thermal_robot.fleet import compare_settings
from thermal_robot.fleet.compare_effects import Candidate
from thermal_robot.fleet.compare_sums import Sums
from thermal_robot.inference import settings
from thermal_robot.inference.evidence import Combination
from thermal_robot.inference.explain import log_odds, share_of_places
from thermal_robot.inference.gram import Gram
from thermal_robot.inference.search import Search

Array = NDArray[np.float64]
Places = Mapping[tuple[str, str], Sequence[int]]


@dataclass(frozen=True)
class Part:
    """One block of the joint fit.

    Attributes
    ----------
    effect
        Number of the effect in the list of those compared.
    place
        Where: kind and name; empty for all its places.
    parameters
        Numbers of its parameters among all that are compared.
    where
        Numbers of the campaigns; all of them for what is shared.
    shared
        Whether it has one value in all campaigns.
    log_prior
        Log prior odds.
    """

    effect: int
    place: tuple[str, str]
    parameters: tuple[int, ...]
    where: tuple[int, ...]
    shared: bool
    log_prior: float


@dataclass(frozen=True, eq=False)
class Change:
    """A part that differs: its chi-square, degrees of freedom, probability by chance, and posterior probability."""

    part: Part
    chi2: float
    degrees: int
    p_value: float
    probability: float


@dataclass(frozen=True, eq=False)
class Joint:
    """The most probable joint explanation.

    Attributes
    ----------
    parts
        That are at work.
    changes
        Those of them that differ between campaigns.
    values
        (K, P) parameters of each campaign, in expected sizes.
    covariance
        (K P, K P) of them, in the same units.
    probability
        Per effect: that it is at work in any campaign.
    looked_at
        How many places were compared.
    """

    parts: tuple[Part, ...]
    changes: tuple[Change, ...]
    values: Array
    covariance: Array
    probability: tuple[float, ...]
    looked_at: int


def joint(listed: Sequence[Candidate], owners: Sequence[tuple[int, int]], said: Sequence[Sums]) -> Joint:
    """Find what campaigns share and what differs between them.

    Parameters
    ----------
    listed
        Effects that are compared.
    owners
        Per parameter that is compared: number of its effect, and of the parameter within that.
    said
        What each campaign says of these parameters.
    """
    parts = tuple(part for part in _parts(listed, owners, len(said)) if part.shared or _can_differ(part, said))
    problem = _problem(listed, owners, parts, said)
    seen = [k for k, rank in enumerate(problem.ranks) if rank]
    parts, problem = tuple(parts[k] for k in seen), problem.some(seen)
    looked_at = len({(p.effect, p.parameters) for p in parts if not p.shared})
    search = Search(problem, [p.log_prior for p in parts], _apart(parts))
    begin = [k for k, p in enumerate(parts) if p.shared and not p.place[1] and any(listed[p.effect].named)]
    best = max((search.run(start) for start in ([], begin)), key=lambda c: c.log_evidence)
    best, changes = _standing(search, parts, best, looked_at)
    values, covariance = _values(parts, problem, best, len(said), len(owners))
    probability = tuple(_probability(search, parts, effect) for effect in range(len(listed)))
    return Joint(tuple(parts[b] for b in best.blocks), changes, values, covariance, probability, looked_at)


def _parts(listed: Sequence[Candidate], owners: Sequence[tuple[int, int]], campaigns: int) -> Iterator[Part]:
    """Yield each effect as shared, in all places and in each, and each place and parameter as one that differs."""
    for number, item in enumerate(listed):
        own = [k for k, (effect, _) in enumerate(owners) if effect == number]
        told = [item.told[owners[k][1]] for k in own]
        places = {(p.kind, p.place): [k for k, q in zip(own, told, strict=True) if q.place == p.place] for p in told}
        if own:
            yield from _shared(number, own, places, campaigns)
            yield from _differing(number, own, places, campaigns)


def _shared(number: int, own: Sequence[int], places: Places, campaigns: int) -> Iterator[Part]:
    """Yield an effect with one value in all campaigns, in all its places and in each."""
    everywhere, among = tuple(range(campaigns)), len(places) if len(places) > 1 else 0
    yield Part(number, ("", ""), tuple(own), everywhere, True, log_odds() + float(np.log(share_of_places(0, among))))
    for place, inside in places.items() if among else ():
        alone = log_odds() + float(np.log(share_of_places(1, among)))
        yield Part(number, place, tuple(inside), everywhere, True, alone)


def _differing(number: int, own: Sequence[int], places: Places, campaigns: int) -> Iterator[Part]:
    """Yield an effect that differs in some campaigns: in all its places, in one, or by one parameter there."""
    odds, subsets = compare_settings.CHANGED / (1.0 - compare_settings.CHANGED), some_of(campaigns)
    choices: list[tuple[tuple[str, str], tuple[int, ...], float]] = []
    if len(places) > 1:
        choices.append((("", ""), tuple(own), compare_settings.EVERYWHERE))
    of_places = (1.0 - compare_settings.EVERYWHERE) / len(places)
    for place, inside in places.items():
        several = len(inside) > 1
        choices.append((place, tuple(inside), of_places / (2.0 if several else 1.0)))
        choices += [(place, (k,), of_places / (2.0 * len(inside))) for k in inside if several]
    for place, inside, share in choices:
        for where in subsets:
            yield Part(number, place, inside, where, False, float(np.log(odds * share / len(subsets))))


def _can_differ(part: Part, said: Sequence[Sums]) -> bool:
    """Whether campaigns on both sides tell any of its parameters: otherwise nobody knows that it changed."""
    tell = [bool(np.diag(one.matrix)[list(part.parameters)].max() > settings.INFORMATION_FLOOR) for one in said]
    return any(tell[c] for c in part.where) and any(yes for c, yes in enumerate(tell) if c not in part.where)


def some_of(campaigns: int) -> tuple[tuple[int, ...], ...]:
    """Return the sets of campaigns that may differ from the others: all, or of many those named in ``FEW``."""
    every = range(campaigns)
    if campaigns <= compare_settings.FEW:
        return tuple(s for size in range(1, campaigns) for s in combinations(every, size))
    steps = [tuple(range(k)) for k in range(1, campaigns)] + [tuple(range(k, campaigns)) for k in range(1, campaigns)]
    return tuple(dict.fromkeys([*((k,) for k in every), *steps]))


def _apart(parts: Sequence[Part]) -> frozenset[frozenset[int]]:
    """Return the pairs that exclude each other: shared settings of one effect, and the same differing in two ways.

    One parameter may differ in a set of campaigns and in another, but not both alone and with its place in one.
    """
    pairs = set()
    for (i, a), (j, b) in combinations(enumerate(parts), 2):
        if a.effect != b.effect or a.shared != b.shared:
            continue
        apart = set(a.parameters).isdisjoint(b.parameters)
        if not apart and (a.shared or not set(a.where).isdisjoint(b.where)):
            pairs.add(frozenset((i, j)))
    return frozenset(pairs)


def _problem(
    listed: Sequence[Candidate], owners: Sequence[tuple[int, int]], parts: Sequence[Part], said: Sequence[Sums]
) -> Gram:
    """Return the normal equations of all parts together."""
    positive_of = np.array([listed[e].told[p].positive for e, p in owners])
    spread_of = np.array([_spread(listed[p.effect], p) for p in parts])
    bases, positive, ranks = [], [], []
    for part in parts:
        own = list(part.parameters)
        value, axes = np.linalg.eigh(np.sum([said[c].matrix[np.ix_(own, own)] for c in part.where], axis=0))
        held = positive_of[own] & part.shared
        basis = np.eye(len(own)) if held.any() else axes[:, value > settings.INFORMATION_FLOOR]
        bases.append(basis)
        positive.append((held @ basis).astype(bool))
        ranks.append(basis.shape[1])
    widths = np.cumsum([0, *ranks])
    matrix, vector = np.zeros((widths[-1],) * 2), np.zeros(widths[-1])
    for c, one in enumerate(said):
        across = np.zeros((len(owners), widths[-1]))
        for part, basis, (a, b) in zip(parts, bases, pairwise(widths), strict=True):
            if c in part.where:
                across[list(part.parameters), a:b] = basis
        matrix += across.T @ one.matrix @ across
        vector += across.T @ one.vector
    inverse = [one.inverse[0] for one in said]
    return Gram(
        matrix,
        vector,
        float(sum(one.vector @ inside @ one.vector for one, inside in zip(said, inverse, strict=True))),
        tuple(slice(int(a), int(b)) for a, b in pairwise(widths)),
        tuple(bases),
        np.concatenate([*positive, np.zeros(0, dtype=bool)]).astype(bool),
        tuple(ranks),
        spread_of,
        float(sum(np.linalg.matrix_rank(one.matrix, hermitian=True) for one in said)),
        compare_settings.HELD,
    )


def _spread(item: Candidate, part: Part) -> float:
    """Return how well the size of a part is known beforehand: deviation of its logarithm."""
    return item.effect.size_spread if part.shared else compare_settings.CHANGE_SPREAD


def _standing(
    search: Search, parts: Sequence[Part], best: Combination, looked_at: int
) -> tuple[Combination, tuple[Change, ...]]:
    """Take out, the weakest first, what differs by no more than chance makes one of so many places differ."""
    while True:
        changes = [_change(search, parts, best, b) for b in best.blocks if not parts[b].shared]
        weakest = max(changes, key=lambda c: c.p_value, default=None)
        if weakest is None or weakest.p_value * looked_at < compare_settings.FALSE_CHANGE:
            return best, tuple(sorted(changes, key=lambda c: -c.chi2))
        left = tuple(b for b in best.blocks if parts[b] is not weakest.part)
        shared = [k for k, p in enumerate(parts) if p.shared and p.effect == weakest.part.effect]
        tried = [left, *(tuple(sorted((*left, k))) for k in shared if search.allowed((*left, k)) and k not in left)]
        best = max((search.evaluate(blocks) for blocks in tried), key=lambda c: c.log_evidence)


def _change(search: Search, parts: Sequence[Part], best: Combination, number: int) -> Change:
    """Return a part that differs, judged beside all others of the best explanation, without its own prior."""
    start = sum(search.gram.bases[b].shape[1] for b in best.blocks[: best.blocks.index(number)])
    own = slice(start, start + search.gram.bases[number].shape[1])
    tight = np.linalg.inv(best.covariance[own, own])
    information = tight - np.eye(len(tight)) / best.scales[number] ** 2
    score = tight @ best.values[own]
    chi2, degrees = float(score @ np.linalg.pinv(information) @ score), len(tight)
    part = parts[number]
    same = {k for k, p in enumerate(parts) if not p.shared and set(p.parameters) & set(part.parameters)}
    seen, weight = search.probabilities()
    probability = float(sum(w for c, w in zip(seen, weight, strict=True) if same & set(c.blocks)))
    return Change(part, chi2, degrees, float(chdtrc(degrees, max(chi2, 0.0))), min(probability, 1.0))


def _probability(search: Search, parts: Sequence[Part], effect: int) -> float:
    own = {k for k, p in enumerate(parts) if p.effect == effect}
    seen, weight = search.probabilities()
    return min(float(sum(w for c, w in zip(seen, weight, strict=True) if own & set(c.blocks))), 1.0)


def _values(
    parts: Sequence[Part], problem: Gram, best: Combination, campaigns: int, parameters: int
) -> tuple[Array, Array]:
    """(K, P) values of each campaign and (K P, K P) their covariance."""
    across, start = np.zeros((campaigns * parameters, len(best.values))), 0
    for b in best.blocks:
        basis = problem.bases[b]
        for c in parts[b].where:
            rows = [c * parameters + k for k in parts[b].parameters]
            across[rows, start : start + basis.shape[1]] += basis
        start += basis.shape[1]
    return (across @ best.values).reshape(campaigns, parameters), across @ best.covariance @ across.T
