"""The joint fit: what campaigns share and what differs between them, weighed by evidence.

Every campaign says y_c = X_c θ_c + noise, its own frames projected out. An effect that is shared is one block of
columns over all campaigns; one of its places (a joint, a link), or one parameter there, that differs in some campaigns
is a block over these alone. All blocks compete by the marginal likelihood of a diagnosis
(:mod:`thermal_robot.inference.evidence`), from the campaigns' sums of products; noise and frames are each campaign's
own. What the search holds for a change must also stand by its chi-square, corrected for all that was looked at.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtrc

from thermal_robot.arrays import Array
from thermal_robot.fleet import compare_settings
from thermal_robot.fleet.compare_effects import Candidate
from thermal_robot.fleet.compare_problem import Part, Problem
from thermal_robot.fleet.compare_sums import Sums
from thermal_robot.inference.evidence import Combination, Gram
from thermal_robot.inference.search import Search


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
    starts: list[Sequence[int]] = [[], [n for n, k in enumerate(held) if _is_begun(problem.parts[k], named)]]
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


def _is_begun(part: Part, named: Sequence[bool]) -> bool:
    """Whether a search begins with a part: an effect that a diagnosis names, shared."""
    return part.shared and not part.place[1] and named[part.effect]


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
