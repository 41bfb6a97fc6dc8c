"""The search for the best combination of blocks: neighbours weighed to first order, the near ones exactly.

A search climbs from a combination by adding, dropping and exchanging blocks. What a climb by single steps misses is
looked for on purpose: two exchanges of which each alone brings nothing, one block that contains several smaller ones,
and another setting of one block in place of two blocks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.errors import EstimationError
from thermal_robot.inference import settings
from thermal_robot.inference.evidence import Combination, Gram, evidence
from thermal_robot.inference.gains import gains


@dataclass(eq=False)
class Search:
    """Evaluates combinations, each once, and keeps them all.

    ``exclusive`` pairs of blocks must not be together; ``containers`` can do all that a block of another effect can.
    """

    gram: Gram
    log_prior: Sequence[float]
    exclusive: frozenset[frozenset[int]] = frozenset()
    containers: frozenset[int] = frozenset()
    seen: dict[tuple[int, ...], Combination] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """List what each block excludes."""
        self._apart: dict[int, set[int]] = {}
        self._expanded: set[tuple[int, ...]] = set()
        self._left_at: dict[tuple[int, ...], float] = {}
        self._most = max((c.log_evidence for c in self.seen.values() if c.exact), default=-np.inf)
        for a, b in self.exclusive:
            self._apart.setdefault(a, set()).add(b)
            self._apart.setdefault(b, set()).add(a)

    def allowed(self, blocks: Sequence[int]) -> bool:
        """Tell whether no two of the blocks exclude each other."""
        whole = set(blocks)
        return not any(self._apart.get(b, whole - whole) & whole for b in blocks)

    def evaluate(self, blocks: Sequence[int], start: Combination | None = None, wanted: float = -np.inf) -> Combination:
        """Evidence of a combination, computed once; not to its end where clearly below ``wanted`` or the best."""
        key = tuple(sorted(blocks))
        known, floor = self.seen.get(key), max(wanted, self._most - settings.DETOUR_FROM)
        if known is None or not (known.exact or self._left_at.get(key, np.inf) <= floor):
            self.seen[key] = self._computed(key, known or start, floor)
            self._most = max(self._most, self.seen[key].log_evidence)
            if not self.seen[key].exact:
                self._left_at[key] = floor
        return self.seen[key]

    def _at_least(self, blocks: Sequence[int], start: Combination) -> Combination:
        """Return the evidence of what is of interest only where it comes near that of another combination."""
        return self.evaluate(blocks, start, start.log_evidence - settings.NEARLY)

    def _computed(self, key: tuple[int, ...], start: Combination | None, floor: float) -> Combination:
        try:
            return evidence(self.gram, key, sum(self.log_prior[b] for b in key), start, floor)
        except EstimationError:
            if not key:
                raise
            # rounding hides what blocks so nearly alike bring: nothing
            width = len(self.gram.columns_of(key))
            bare, nothing = self.evaluate(()), np.zeros((width, width))
            scales = dict.fromkeys(key, 1.0)
            return replace(
                bare, blocks=key, log_evidence=-np.inf, scales=scales, values=np.zeros(width), covariance=nothing
            )

    def run(self, start: Sequence[int] = ()) -> Combination:
        """Climb from a combination, and look on purpose for what single steps miss, until nothing is better.

        Every neighbour of the best combination is weighed, so that its probability is against all of them.
        """
        best = self.climb(start)
        detours = (self._simpler, self._smaller, self._two_at_once, self._missed)
        while (better := next((found for detour in detours if (found := detour(best))), None)) is not None:
            best = self.climb(better.blocks)
        return best

    def climb(self, start: Sequence[int] = ()) -> Combination:
        """Add, drop and exchange blocks until nothing is better, neighbours of near ties included."""
        best = self._climb(start, frozenset())
        while (better := self._missed(best) or self._beside_a_tie(best)) is not None:
            best = self._climb(better.blocks, frozenset())
        return best

    def _smaller(self, best: Combination) -> Combination | None:
        """Climb without one that contains others, which may suffice where it came first; return what is better."""
        for large in self.containers & set(best.blocks):
            barred = frozenset(b for b in self._apart[large] | {large} if self._width(b) >= self._width(large))
            found = self._climb([b for b in best.blocks if b != large], barred)
            if found.log_evidence > best.log_evidence + settings.BETTER:
                return found
        return None

    def _two_at_once(self, best: Combination) -> Combination | None:
        """Add two blocks, or put two in place of one; return what is better, if any is.

        Of blocks that resemble each other one alone may bring nothing, and with a second one all.
        """
        for base in self._bases(best):
            first = sorted(self._with_one_more(base, best), key=lambda c: -c.log_evidence)[: settings.LOOKED_BEYOND]
            for one in first:
                beyond = self._with_one_more(self.evaluate(one.blocks, base), best)
                two = max(beyond, key=lambda c: c.log_evidence, default=best)
                if self._near(two, best):
                    found = self.evaluate(two.blocks, one if one.exact else base)
                    if found.log_evidence > best.log_evidence + settings.BETTER:
                        return found
        return None

    def _beside_a_tie(self, best: Combination) -> Combination | None:
        """Weigh the neighbours of what is nearly as probable as the best, too; return what is better, if any is.

        Two effects that stand in for two others are told only so: with one of them exchanged there is little to choose.
        """
        for tie in self.ties(best)[1:]:
            if tie.blocks in self._expanded:
                continue
            self._expanded.add(tie.blocks)
            found = self.weigh(tie.blocks)
            if found.log_evidence > best.log_evidence + settings.BETTER:
                return found
        return None

    def ties(self, best: Combination) -> list[Combination]:
        """Return the best combination, and those of as many blocks that are nearly as probable, the nearest first."""
        near = [c for c in self.seen.values() if c.exact and self._near(c, best) and c.blocks != best.blocks]
        near = [c for c in near if len(c.blocks) == len(best.blocks)]
        return [best, *sorted(near, key=lambda c: -c.log_evidence)[: settings.TIES]]

    def weigh(self, blocks: Sequence[int]) -> Combination:
        """Weigh every neighbour of a combination; return the best of them and it."""
        own = self.evaluate(blocks)
        near = [self._at_least(c.blocks, own) for c in self._promising(own)]
        return max((own, *near), key=lambda c: c.log_evidence)

    def _simpler(self, best: Combination) -> Combination | None:
        """Let another setting of one block stand in for further blocks; return what is better, if any is.

        A setting that does more, such as in one joint more, is worth its price only once what it replaces is gone.
        """
        for b in best.blocks:
            for setting in self._apart.get(b, ()):
                # what it contains goes with the one that it replaces
                others = [c for c in best.blocks if c != b and c not in self._apart[setting]]
                key = tuple(sorted((*others, setting)))
                known = self.seen.get(key)
                if known and known.log_evidence < best.log_evidence - settings.DETOUR_FROM:
                    continue
                found = self.evaluate(key, best)
                if found.log_evidence > best.log_evidence - settings.DETOUR:
                    found = self._fewer(found, setting)
                if found.log_evidence > best.log_evidence + settings.BETTER:
                    return found
        return None

    def _fewer(self, found: Combination, kept: int) -> Combination:
        """Drop blocks as long as that is better, all but one of them."""
        while True:
            without = [self.evaluate([c for c in found.blocks if c != b], found) for b in found.blocks if b != kept]
            best = max(without, key=lambda c: c.log_evidence, default=found)
            if best.log_evidence <= found.log_evidence:
                return found
            found = best

    def _missed(self, best: Combination) -> Combination | None:
        """Compute exactly what was weighed on the way and comes near the best; return one that is better, if any is."""
        near = [c.blocks for c in self.seen.values() if not c.exact and self._near(c, best)]
        found = max((self._at_least(blocks, best) for blocks in near), key=lambda c: c.log_evidence, default=best)
        return found if found.log_evidence > best.log_evidence + settings.BETTER else None

    @staticmethod
    def _near(one: Combination, best: Combination) -> bool:
        return one.log_evidence > best.log_evidence - settings.NEARLY

    def _width(self, block: int) -> int:
        return self.gram.ranks[block]

    def _climb(self, start: Sequence[int], barred: frozenset[int]) -> Combination:
        best = max(self.evaluate(()), self.evaluate(start), key=lambda c: c.log_evidence)
        while True:
            close = [c.blocks for c in self._promising(best, barred)]
            better = best
            for k in range(0, len(close), settings.AT_ONCE):
                some = (self._at_least(blocks, best) for blocks in close[k : k + settings.AT_ONCE])
                better = max((better, *some), key=lambda c: c.log_evidence)
                if better.log_evidence > best.log_evidence + settings.BETTER:
                    break
            else:
                return best
            best = better

    def _promising(self, best: Combination, barred: frozenset[int] = frozenset()) -> list[Combination]:
        """Return the combinations with one block more, less or another that may be better, the best first.

        Those with a new block are known to first order, which tells too little where the others are stretched to do
        what the new one would do: the best one in place of each block is among them, however little it promises.
        """
        bases = self._bases(best)
        found = {c.blocks: c for c in bases[1:] if self._near(c, best)}
        for base in bases:
            added = [c for c in self._with_one_more(base, best) if not barred & set(c.blocks)]
            added.sort(key=lambda c: -c.log_evidence)
            found |= {c.blocks: c for k, c in enumerate(added) if k == 0 or self._near(c, best)}
        return sorted(found.values(), key=lambda c: -c.log_evidence)

    def _bases(self, best: Combination) -> list[Combination]:
        """Return the combination, and what it is without each of its blocks: to these others are added."""
        return [best, *(self.evaluate([c for c in best.blocks if c != b], best) for b in best.blocks)]

    def _with_one_more(self, base: Combination, best: Combination) -> list[Combination]:
        if not np.isfinite(base.log_evidence):  # rounding hides what it leaves
            return []
        others = [b for b in range(len(self.gram.slices)) if b not in best.blocks and b not in base.blocks]
        keys = {b: tuple(sorted((*base.blocks, b))) for b in others}
        barred = set().union(*(self._apart.get(b, ()) for b in base.blocks))
        new = [b for b in others if b not in barred and keys[b] not in self.seen]
        for b, gain, scale in gains(self.gram, base, new):
            self.seen[keys[b]] = Combination(
                keys[b],
                base.log_evidence + gain + self.log_prior[b],
                base.noise,
                {**base.scales, b: scale},
                base.values,
                base.covariance,
                base.effective,
                exact=False,
            )
        return [self.seen[keys[b]] for b in others if keys[b] in self.seen]

    def set_best(self, blocks: Sequence[int], families: Sequence[str]) -> Combination:
        """Return the best settings of the same effects, changed one after another."""
        best = self.evaluate(blocks)
        while True:
            names = {families[b]: b for b in best.blocks}
            swaps = [(names[f], b) for b, f in enumerate(families) if f in names and b != names[f]]
            tried = [tuple(sorted((set(best.blocks) - {old}) | {new})) for old, new in swaps]
            near = (self.evaluate(c, best) for c in tried if self.allowed(c))
            found = max(near, key=lambda c: c.log_evidence, default=best)
            if found.log_evidence <= best.log_evidence + settings.BETTER:
                return best
            best = found

    def probabilities(self) -> tuple[list[Combination], Array]:
        """Return the combinations seen, most probable first, with their posterior probabilities."""
        order = sorted(self.seen.values(), key=lambda c: -c.log_evidence)
        log = np.array([c.log_evidence for c in order])
        weight = np.exp(log - log[0])
        return order, weight / weight.sum()
