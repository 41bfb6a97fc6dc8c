"""The joint fit: what campaigns share and what differs between them, weighed by evidence.

Every campaign says y_c = X_c θ_c + noise, its own frames projected out. An effect that is shared is one block of
columns over all campaigns; one of its places (a joint, a link), or one parameter there, that differs in some campaigns
is a block over these alone. All blocks compete by the marginal likelihood of a diagnosis
(:mod:`thermal_robot.inference.evidence`), from the campaigns' sums of products; noise and frames are each campaign's
own. What the search holds for a change must also stand by its chi-square, corrected for all that was looked at.

Blocks that differ are many: of four campaigns fourteen sets may each differ in every place and parameter. Products are
formed of those that are asked for alone.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from thermal_robot.arrays import Array
from thermal_robot.errors import EstimationError
from thermal_robot.fleet import compare_settings
from thermal_robot.fleet.compare_sums import Candidate, Sums
from thermal_robot.inference import settings
from thermal_robot.inference.evidence import Combination, Gram, evidence
from thermal_robot.inference.explain import log_odds, share_of_places
from thermal_robot.inference.search import Search, gains

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
class Problem:
    """All parts that the campaigns tell, and what they say of their parameters.

    Attributes
    ----------
    parts
        Their numbers are those of the blocks of :meth:`gram` where it is asked for all.
    said
        Per campaign.
    bases
        Per part, (P, D): parameters, in expected sizes, of a unit of each of its columns.
    positive
        Per part, (D,): which columns cannot be negative.
    spreads
        (B,) deviation of the logarithm of each part's size.
    total, equations
        y'y along what the campaigns see, and how many directions that are: of all of them together.
    """

    parts: tuple[Part, ...]
    said: Sequence[Sums]
    bases: tuple[Array, ...]
    positive: tuple[NDArray[np.bool_], ...]
    spreads: Array
    total: float
    equations: float

    @classmethod
    def of(cls, listed: Sequence[Candidate], owners: Sequence[tuple[int, int]], said: Sequence[Sums]) -> Problem:
        """Return the problem of the effects that are compared; see :func:`thermal_robot.fleet.compare_joint.joint`."""
        positive_of = np.array([listed[e].told[p].positive for e, p in owners], dtype=bool)
        kept, bases, positive = [], [], []
        for part in _parts(listed, owners, len(said)):
            if not (part.shared or _can_differ(part, said)):
                continue
            own = list(part.parameters)
            value, axes = np.linalg.eigh(np.sum([said[c].matrix[np.ix_(own, own)] for c in part.where], axis=0))
            held = positive_of[own] & part.shared
            basis = np.eye(len(own)) if held.any() else axes[:, value > settings.INFORMATION_FLOOR]
            if basis.shape[1]:
                kept.append(part)
                bases.append(basis)
                positive.append((held @ basis).astype(bool))
        spreads = np.array(
            [listed[p.effect].effect.size_spread if p.shared else compare_settings.CHANGE_SPREAD for p in kept]
        )
        total = sum(float(one.vector @ one.inverse[0] @ one.vector) for one in said)
        equations = float(sum(np.linalg.matrix_rank(one.matrix, hermitian=True) for one in said))
        return cls(tuple(kept), said, tuple(bases), tuple(positive), spreads, total, equations)

    def gram(self, which: Sequence[int]) -> Gram:
        """Return the normal equations of some parts together."""
        bases = [self.bases[k] for k in which]
        ranks = [basis.shape[1] for basis in bases]
        ends = np.cumsum([0, *ranks]).tolist()
        matrix, vector = np.zeros((ends[-1], ends[-1])), np.zeros(ends[-1])
        for c, one in enumerate(self.said):
            across = np.zeros((len(one.vector), ends[-1]))
            for k, basis, (a, b) in zip(which, bases, pairwise(ends), strict=True):
                if c in self.parts[k].where:
                    across[list(self.parts[k].parameters), a:b] = basis
            matrix += across.T @ one.matrix @ across
            vector += across.T @ one.vector
        return Gram(
            matrix,
            vector,
            self.total,
            tuple(slice(a, b) for a, b in pairwise(ends)),
            tuple(bases),
            np.concatenate([*(self.positive[k] for k in which), np.zeros(0, dtype=bool)]).astype(bool),
            tuple(ranks),
            self.spreads[list(which)],
            self.equations,
            compare_settings.HELD,
        )

    def apart(self, which: Sequence[int]) -> frozenset[frozenset[int]]:
        """Return the pairs, by their places in ``which``, that exclude each other."""
        pairs = combinations(enumerate(self.parts[k] for k in which), 2)
        return frozenset(frozenset((i, j)) for (i, a), (j, b) in pairs if _exclude(a, b))

    def better(self, held: Sequence[int], bases: Sequence[Combination], best: float) -> list[int]:
        """Return parts that better a combination, beside it or in place of one of its blocks.

        All are weighed to first order; of each place the first is returned that is better exactly, those that promise
        most before the others. Where the effect is shared, to differ in some campaigns or in all others is the same:
        then the fewer are returned, which others may join that differ elsewhere.

        Parameters
        ----------
        held
            Parts that take part already, in the order in which the bases number them.
        bases
            Combinations to which others are added: the best one, those as near, and those without one of its blocks.
        best
            Log evidence of the best.
        """
        found: dict[tuple[int, tuple[str, str]], int] = {}
        number = {(p.effect, p.parameters, p.where): k for k, p in enumerate(self.parts) if not p.shared}
        for k, base in self._promising(held, bases, best):
            part = self.parts[k]
            if (part.effect, part.place) in found:
                continue
            own = self._beside(held, base, k, best)
            if own > best + settings.BETTER:
                others = tuple(c for c in range(len(self.said)) if c not in part.where)
                small = number.get((part.effect, part.parameters, others), k)
                fewer = (len(others), others) < (len(part.where), part.where) and small not in held
                alike = fewer and self._beside(held, base, small, own) > own - settings.NEARLY
                found[part.effect, part.place] = small if alike else k
        return sorted(found.values())

    def _promising(
        self, held: Sequence[int], bases: Sequence[Combination], best: float
    ) -> list[tuple[int, Combination]]:
        """Return what may be better to first order, those that promise most first, each with the base that it joins."""
        found: dict[int, tuple[float, Combination]] = {}
        used = sorted({b for base in bases for b in base.blocks})
        others = [k for k in range(len(self.parts)) if k not in set(held)]
        for first in range(0, len(others), compare_settings.AT_ONCE):
            some = others[first : first + compare_settings.AT_ONCE]
            gram = self.gram([*(held[b] for b in used), *some])
            for base in bases:
                inside = [self.parts[held[b]] for b in base.blocks]
                free = [n for n, k in enumerate(some) if not any(_exclude(self.parts[k], p) for p in inside)]
                for n, gain, _ in gains(gram, _numbered(base, used), [len(used) + n for n in free]):
                    k = some[n - len(used)]
                    promised = base.log_evidence + gain + self.parts[k].log_prior
                    if promised > max(best + settings.BETTER, found.get(k, (-np.inf, base))[0]):
                        found[k] = promised, base
        return [(k, found[k][1]) for k in sorted(found, key=lambda k: -found[k][0])]

    def _beside(self, held: Sequence[int], base: Combination, k: int, wanted: float) -> float:
        """Return the log evidence of a part beside a base, exactly unless it clearly stays below what is wanted."""
        which = [*(held[b] for b in base.blocks), k]
        prior = sum(self.parts[n].log_prior for n in which)
        try:
            found = evidence(
                self.gram(which),
                tuple(range(len(which))),
                prior,
                _numbered(base, base.blocks),
                wanted - settings.NEARLY,
            )
        except EstimationError:  # rounding hides what parts so nearly alike bring
            return -np.inf
        return found.log_evidence if found.exact else -np.inf


def _numbered(base: Combination, used: Sequence[int]) -> Combination:
    """Return a combination with its blocks numbered by their places among those in use."""
    at = {b: n for n, b in enumerate(used)}
    return replace(base, blocks=tuple(at[b] for b in base.blocks), scales={at[b]: base.scales[b] for b in base.blocks})


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


def _exclude(a: Part, b: Part) -> bool:
    """Whether two parts exclude each other: shared settings of one effect, and the same differing in two ways.

    One parameter may differ in a set of campaigns and in another, but not both alone and with its place in one.
    """
    if a.effect != b.effect or a.shared != b.shared or set(a.parameters).isdisjoint(b.parameters):
        return False
    return a.shared or not set(a.where).isdisjoint(b.where)


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
    problem = Problem.of(listed, owners, said)
    looked_at = len({(p.effect, p.parameters) for p in problem.parts if not p.shared})
    named = [any(item.named) for item in listed]
    parts, search, best = _searched(problem, named)
    best, changes = _standing(search, parts, best, looked_at)
    values, covariance = _values(parts, search.gram, best, len(said), len(owners))
    seen, weight = search.probabilities()
    changes = tuple(replace(c, probability=_held(seen, weight, _alike(parts, c.part))) for c in changes)
    probability = tuple(
        _held(seen, weight, {k for k, p in enumerate(parts) if p.effect == e}) for e in range(len(listed))
    )
    return Joint(tuple(parts[b] for b in best.blocks), changes, values, covariance, probability, looked_at)


def _searched(problem: Problem, named: Sequence[bool]) -> tuple[tuple[Part, ...], Search, Combination]:
    """Return the parts that were weighed together, the search over them, and the best combination.

    All parts, where they are few. Of many, those that are shared first; others join while one of them, to first order,
    would better the best combination, beside it or in place of one of its blocks.
    """
    every = range(len(problem.parts))
    few = len(every) <= compare_settings.AT_ONCE
    held = [k for k in every if few or problem.parts[k].shared]
    # a search begins with nothing, and with the effects that a diagnosis names, shared
    begun = [p.shared and not p.place[1] and named[p.effect] for p in (problem.parts[k] for k in held)]
    starts: list[Sequence[int]] = [[], np.flatnonzero(begun).tolist()]
    known: dict[tuple[int, ...], Combination] = {}
    while True:
        parts = tuple(problem.parts[k] for k in held)
        search = Search(problem.gram(held), [p.log_prior for p in parts], problem.apart(held), seen=known)
        if few:
            return parts, search, max((search.run(start) for start in starts), key=lambda c: c.log_evidence)
        best = max((search.climb(start) for start in starts), key=lambda c: c.log_evidence)
        more = problem.better(held, search.ties(best), best.log_evidence)
        if not more:
            best = search.run(best.blocks)
            bases = [
                *search.ties(best),
                *(search.evaluate([c for c in best.blocks if c != b], best) for b in best.blocks),
            ]
            more = problem.better(held, bases, best.log_evidence)
        if not more:
            return parts, search, best
        # what joins comes behind the others, so that these keep their numbers
        held, starts = [*held, *more], [best.blocks]
        known = {blocks: c for blocks, c in search.seen.items() if c.exact}


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
    return Change(parts[number], chi2, degrees, float(chdtrc(degrees, max(chi2, 0.0))), 0.0)


def _alike(parts: Sequence[Part], part: Part) -> set[int]:
    """Return the parts that differ in any parameter of one."""
    return {k for k, p in enumerate(parts) if not p.shared and set(p.parameters) & set(part.parameters)}


def _held(seen: Sequence[Combination], weight: Array, blocks: set[int]) -> float:
    """Return the probability that any of the blocks is at work."""
    return min(float(sum(w for c, w in zip(seen, weight, strict=True) if not blocks.isdisjoint(c.blocks))), 1.0)


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
