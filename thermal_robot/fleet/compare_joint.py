"""Bayesian model selection over all campaigns together: what they share and what differs between them.

The model of campaign c is y_c = X_c θ_c + noise, its own frames projected out. An effect that is shared is one block of
columns over all campaigns; one of its places (a joint, a link), or one parameter there, that differs in some campaigns
is a block over these alone. All blocks compete by the marginal likelihood of a diagnosis
(:mod:`thermal_robot.inference.evidence`), from the campaigns' sums of products; noise and frames are each campaign's
own. A change must also be significant by its chi-square, corrected for the number of comparisons.

There are many differing blocks: with four campaigns fourteen subsets for every place and parameter. Products are formed
on demand.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from thermal_robot.arrays import Array
from thermal_robot.fleet import settings
from thermal_robot.fleet.compare_sums import Candidate, Sums
from thermal_robot.inference import settings as inference
from thermal_robot.inference.algebra import total_probability
from thermal_robot.inference.evidence import Combination, Gram
from thermal_robot.inference.explain import log_odds, share_of_places
from thermal_robot.inference.search import Search, gains

Place = tuple[str, str]
Choice = tuple[Place, tuple[int, ...], tuple[int, ...], bool, float]
"""Place, parameters, campaigns, whether shared, and log prior odds of a part."""


@dataclass(frozen=True, eq=False)
class JointBlock:
    """One block of the joint fit: parameters of an effect, shared by all campaigns or different in some.

    ``effect`` is the index of the effect, ``place`` kind and name of its place, empty for all places; ``parameters``
    are indices among all compared ones, ``where`` those of the campaigns, all for a shared block. ``log_prior`` are
    prior log odds, ``spread`` is the standard deviation of the logarithm of its size. ``basis`` (P, D) has the
    parameters, in expected sizes, per unit of each of D coefficients; those in ``positive`` (D,) cannot be negative.
    """

    effect: int
    place: Place
    parameters: tuple[int, ...]
    where: tuple[int, ...]
    shared: bool
    log_prior: float
    spread: float
    basis: Array
    positive: NDArray[np.bool_]

    def excludes(self, other: JointBlock) -> bool:
        """Whether two blocks cannot be in one model: both shared, or both differing, with a common parameter.

        They are of one effect; two differing blocks must also have a common campaign.
        """
        if (self.effect, self.shared) != (other.effect, other.shared):
            return False
        alike = not set(self.parameters).isdisjoint(other.parameters)
        return alike and (self.shared or not set(self.where).isdisjoint(other.where))


@dataclass(frozen=True, eq=False)
class Problem:
    """Joint model-selection problem: all candidate blocks, and the normal equations of each campaign.

    ``total`` is y'y within the range of the columns, ``equations`` the rank, both summed over the campaigns.
    """

    parts: tuple[JointBlock, ...]
    statistics: Sequence[Sums]
    total: float
    equations: float

    @classmethod
    def of(cls, listed: Sequence[Candidate], statistics: Sequence[Sums]) -> Problem:
        """Build the problem of the compared effects, with a block for each shared or differing alternative."""
        parts = []
        for number, item in enumerate(listed):
            for place, own, where, shared, prior in _choices(item, statistics) if item.at else ():
                held = np.array([p.positive for k, p in zip(item.at, item.compared, strict=True) if k in own]) & shared
                value, axes = np.linalg.eigh(np.sum([statistics[c].some(own).matrix for c in where], axis=0))
                basis = np.eye(len(own)) if held.any() else axes[:, value > inference.INFORMATION_FLOOR]
                spread = item.effect.size_spread if shared else settings.CHANGE_SPREAD
                positive = (held @ basis).astype(bool)
                if basis.shape[1]:
                    parts.append(JointBlock(number, place, own, where, shared, prior, spread, basis, positive))
        total = sum(float(one.vector @ one.inverse[0] @ one.vector) for one in statistics)
        equations = float(sum(np.linalg.matrix_rank(one.matrix, hermitian=True) for one in statistics))
        return cls(tuple(parts), statistics, total, equations)

    def gram(self, parts: Sequence[JointBlock]) -> Gram:
        """Return the joint normal equations, summed over the campaigns, of a selection of blocks."""
        ends = np.cumsum([0, *(part.basis.shape[1] for part in parts)]).tolist()
        slices = tuple(slice(a, b) for a, b in pairwise(ends))
        matrix, vector = np.zeros((ends[-1], ends[-1])), np.zeros(ends[-1])
        for c, one in enumerate(self.statistics):
            across = np.zeros((len(one.vector), ends[-1]))
            for part, own in zip(parts, slices, strict=True):
                if c in part.where:
                    across[list(part.parameters), own] = part.basis
            matrix += across.T @ one.matrix @ across
            vector += across.T @ one.vector
        bases = tuple(part.basis for part in parts)
        positive = np.concatenate([*(part.positive for part in parts), np.zeros(0, dtype=bool)])
        spreads = np.array([part.spread for part in parts])
        ranks = tuple(basis.shape[1] for basis in bases)
        return Gram(matrix, vector, self.total, slices, bases, positive, ranks, spreads, self.equations, settings.HELD)

    def better(self, held: Sequence[JointBlock], bases: Sequence[Combination], best: float) -> list[JointBlock]:
        """Blocks that improve the evidence of a combination, added or in place of one of its blocks.

        All are scored to first order; for each place the first that improves the exact evidence is returned, in the
        order of the first-order gain. For a shared effect, a difference in some campaigns or in the complement is
        equivalent: the smaller subset is returned. ``held`` are the parts in the model already, as the ``bases`` number
        them: the best combination, those as near, and those without one of its blocks. ``best`` is the log evidence of
        the best.
        """
        found: dict[tuple[int, Place], JointBlock] = {}
        alike = {(p.effect, p.parameters, p.where): p for p in self.parts if not p.shared}
        for part, base in self._promising(held, bases, best):
            if (part.effect, part.place) in found:
                continue
            inside = [held[b] for b in base.blocks]
            own = self._beside(inside, base, part, best)
            if own <= best + inference.BETTER:
                continue
            others = tuple(c for c in range(len(self.statistics)) if c not in part.where)
            small = alike.get((part.effect, part.parameters, others), part)
            fewer = (len(others), others) < (len(part.where), part.where) and small not in held
            fewer = fewer and self._beside(inside, base, small, own) > own - inference.NEARLY
            found[part.effect, part.place] = small if fewer else part
        chosen = set(found.values())
        return [part for part in self.parts if part in chosen]

    def _promising(
        self, held: Sequence[JointBlock], bases: Sequence[Combination], best: float
    ) -> list[tuple[JointBlock, Combination]]:
        """Blocks whose first-order gain beats ``best``, largest first, each with the combination that it would join."""
        found: dict[JointBlock, tuple[float, Combination]] = {}
        used = sorted({b for base in bases for b in base.blocks})
        others = [part for part in self.parts if part not in held]
        for first in range(0, len(others), settings.AT_ONCE):
            some = others[first : first + settings.AT_ONCE]
            gram = self.gram([*(held[b] for b in used), *some])
            for base in bases:
                inside = [held[b] for b in base.blocks]
                free = [n for n, part in enumerate(some, len(used)) if not any(part.excludes(p) for p in inside)]
                for n, gain, _ in gains(gram, _numbered(base, used), free):
                    part = some[n - len(used)]
                    promised = base.log_evidence + gain + part.log_prior
                    if promised > max(best + inference.BETTER, found.get(part, (-np.inf, base))[0]):
                        found[part] = promised, base
        return [(part, base) for part, (_, base) in sorted(found.items(), key=lambda item: -item[1][0])]

    def _beside(self, inside: Sequence[JointBlock], base: Combination, part: JointBlock, wanted: float) -> float:
        """Log evidence of a combination with one more block; −∞ where it stays clearly below ``wanted``."""
        parts, start = [*inside, part], _numbered(base, base.blocks)
        search = Search(self.gram(parts), [p.log_prior for p in parts])
        found = search.evaluate(range(len(parts)), start, wanted - inference.NEARLY)
        return found.log_evidence if found.exact else -np.inf


def _numbered(base: Combination, used: Sequence[int]) -> Combination:
    """Return the combination with its blocks renumbered by their positions in ``used``."""
    at = {b: n for n, b in enumerate(used)}
    return replace(base, blocks=tuple(at[b] for b in base.blocks), scales={at[b]: base.scales[b] for b in base.blocks})


def _choices(item: Candidate, statistics: Sequence[Sums]) -> Iterator[Choice]:
    """Yield the alternative blocks of an effect: shared in all places or one; differing by place or parameter.

    Differing ones come for each subset of campaigns that has information on both sides.
    """
    everywhere, some, places = tuple(range(len(statistics))), campaign_subsets(len(statistics)), item.places
    among = len(places) if len(places) > 1 else 0
    shared: list[tuple[Place, tuple[int, ...]]] = [(("", ""), item.at)]
    shared += [(place, tuple(inside)) for place, inside in places.items() if among]
    for k, (place, own) in enumerate(shared):
        yield place, own, everywhere, True, log_odds() + float(np.log(share_of_places(min(k, 1), among)))
    odds = settings.CHANGED / (1.0 - settings.CHANGED)
    for place, own, share in _differing(item):
        tells = [one.informs(own) for one in statistics]
        prior = float(np.log(odds * share / len(some)))
        for where in some:
            # where campaigns on one side alone tell any of its parameters, nobody knows that it changed
            if any(tells[c] for c in where) and any(yes for c, yes in enumerate(tells) if c not in where):
                yield place, own, where, False, prior


def _differing(item: Candidate) -> Iterator[tuple[Place, tuple[int, ...], float]]:
    """Yield subsets of an effect's parameters that may differ, with their prior shares."""
    if len(item.places) > 1:
        yield ("", ""), item.at, settings.EVERYWHERE
    each = (1.0 - settings.EVERYWHERE) / len(item.places)
    for place, inside in item.places.items():
        several = len(inside) > 1
        yield place, tuple(inside), each / (2.0 if several else 1.0)
        if several:
            yield from ((place, (k,), each / (2.0 * len(inside))) for k in inside)


def campaign_subsets(campaigns: int) -> tuple[tuple[int, ...], ...]:
    """Subsets of campaigns that may differ from the others: all; of more than five, singles and splits in time only."""
    every = range(campaigns)
    if campaigns <= settings.FEW:
        return tuple(s for size in range(1, campaigns) for s in combinations(every, size))
    steps = [tuple(range(k)) for k in range(1, campaigns)] + [tuple(range(k, campaigns)) for k in range(1, campaigns)]
    return tuple(dict.fromkeys([*((k,) for k in every), *steps]))


@dataclass(frozen=True, eq=False)
class Change:
    """Block that differs between campaigns: its score test (χ², degrees, p-value) and posterior probability."""

    part: JointBlock
    chi2: float
    degrees: int
    p_value: float
    probability: float


@dataclass(frozen=True, eq=False)
class Joint:
    """Most probable joint explanation of K campaigns.

    ``parts`` are at work, of which ``changes`` differ between campaigns; ``values`` (K, P) are the parameters of each
    campaign in expected sizes; ``probability`` is, per effect, that it is at work in any campaign; ``looked_at`` counts
    the places that were compared.
    """

    parts: tuple[JointBlock, ...]
    changes: tuple[Change, ...]
    values: Array
    probability: tuple[float, ...]
    looked_at: int


def joint(listed: Sequence[Candidate], statistics: Sequence[Sums]) -> Joint:
    """Select by Bayesian model selection which parameters all campaigns share and which differ between them."""
    problem = Problem.of(listed, statistics)
    looked_at = len({(p.effect, p.parameters) for p in problem.parts if not p.shared})
    parts, search, best = _searched(problem, [any(item.named) for item in listed])
    best, changes = _standing(search, parts, best, looked_at)
    weighed = list(zip(*search.probabilities(), strict=True))

    def probability(blocks: set[int]) -> float:
        return total_probability([w for c, w in weighed if not blocks.isdisjoint(c.blocks)])

    def alike(part: JointBlock) -> set[int]:
        own = set(part.parameters)
        return {k for k, p in enumerate(parts) if not p.shared and own & set(p.parameters)}

    changes = tuple(replace(c, probability=probability(alike(c.part))) for c in changes)
    of_effects = ({k for k, p in enumerate(parts) if p.effect == e} for e in range(len(listed)))
    at_work, values = tuple(parts[b] for b in best.blocks), np.zeros((len(statistics), len(statistics[0].vector)))
    ends = np.cumsum([part.basis.shape[1] for part in at_work], dtype=int)
    for part, own in zip(at_work, np.split(search.gram.posterior(best)[0], ends), strict=False):
        values[np.ix_(part.where, part.parameters)] += part.basis @ own
    return Joint(at_work, changes, values, tuple(map(probability, of_effects)), looked_at)


def _searched(problem: Problem, named: Sequence[bool]) -> tuple[list[JointBlock], Search, Combination]:
    """Search the best combination of blocks; returns the blocks considered, the search, and that combination.

    All blocks are considered where they are few; otherwise the shared ones, and others as long as one improves the
    evidence, added or in place of a block.
    """
    few = len(problem.parts) <= settings.AT_ONCE
    held = [part for part in problem.parts if few or part.shared]
    # a search begins with nothing, and with the effects that a diagnosis names, shared
    begun = [k for k, p in enumerate(held) if p.shared and not p.place[1] and named[p.effect]]
    starts: list[Sequence[int]] = [[], begun]
    known: dict[tuple[int, ...], Combination] = {}
    while True:
        pairs = combinations(enumerate(held), 2)
        apart = frozenset(frozenset((i, j)) for (i, a), (j, b) in pairs if a.excludes(b))
        search = Search(problem.gram(held), [p.log_prior for p in held], apart, seen=known)
        if few:
            return held, search, max((search.run(start) for start in starts), key=lambda c: c.log_evidence)
        best = max((search.climb(start) for start in starts), key=lambda c: c.log_evidence)
        more = problem.better(held, search.ties(best), best.log_evidence)
        if not more:
            best = search.run(best.blocks)
            less = (search.evaluate([c for c in best.blocks if c != b], best) for b in best.blocks)
            more = problem.better(held, [*search.ties(best), *less], best.log_evidence)
        if not more:
            return held, search, best
        # what joins comes behind the others, so that these keep their numbers
        held, starts = [*held, *more], [best.blocks]
        known = {blocks: c for blocks, c in search.seen.items() if c.exact}


def _standing(
    search: Search, parts: Sequence[JointBlock], best: Combination, looked_at: int
) -> tuple[Combination, tuple[Change, ...]]:
    """Backward elimination of differing blocks that are insignificant (Bonferroni over all that were compared)."""
    while True:
        changes = [_change(search, parts, best, b) for b in best.blocks if not parts[b].shared]
        weakest = max(changes, key=lambda c: c.p_value, default=None)
        if weakest is None or weakest.p_value * looked_at < settings.FALSE_CHANGE:
            return best, tuple(sorted(changes, key=lambda c: -c.chi2))
        left = tuple(b for b in best.blocks if parts[b] is not weakest.part)
        shared = [k for k, p in enumerate(parts) if p.shared and p.effect == weakest.part.effect]
        tried = [left, *(tuple(sorted((*left, k))) for k in shared if search.allowed((*left, k)) and k not in left)]
        best = max((search.evaluate(blocks) for blocks in tried), key=lambda c: c.log_evidence)


def _change(search: Search, parts: Sequence[JointBlock], best: Combination, number: int) -> Change:
    """Score test that a differing block is zero, jointly with all others of the best explanation, without its prior."""
    start = sum(parts[b].basis.shape[1] for b in best.blocks[: best.blocks.index(number)])
    own = slice(start, start + parts[number].basis.shape[1])
    values, covariance = search.gram.posterior(best)
    tight = np.linalg.inv(covariance[own, own])
    information = tight - np.eye(len(tight)) / best.scales[number] ** 2
    score = tight @ values[own]
    chi2, degrees = float(score @ np.linalg.pinv(information) @ score), len(tight)
    return Change(parts[number], chi2, degrees, float(chdtrc(degrees, max(chi2, 0.0))), 0.0)
