"""Hill climbing over combinations of blocks: neighbours are screened to first order, near ones evaluated exactly.

A search climbs from a combination by adding, dropping and exchanging blocks. Larger moves find what single steps miss:
two exchanges of which neither gains alone, one block that contains several smaller ones, and another setting of one
block in place of two blocks.

The gain of one more block is found for all blocks at once, to first order: the parameters of the others stay. In the
eigenvectors of a block's information given the others, with eigenvalues w, the scores c, and the remaining noise s'²,

    (n + ν) s'² = ν + Q − Σ c² λ²/(s'² + λ² w) ,
    gain(λ) = −½ Σ log(1 + λ² w/s'²) − ½ (n + ν) log(s'²/s₀²) ,

Q = y'y − b'θ, and s₀ the same without the block. A non-negative column has a half-normal prior. Where it would be
negative it stays at zero; in both cases its own factor is

    log 2 Φ(z) ,  and at zero beside that  ½ z² − ½ log(1 + λ² w/s'²) ,    z = c λ/(s' (s'² + λ² w)^½) .

with w and c of this column given the others of its block. For a block of one column that is exact.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import erfcx, log_ndtr

from thermal_robot.arrays import Array
from thermal_robot.errors import EstimationError
from thermal_robot.inference import settings
from thermal_robot.inference.evidence import Combination, Gram, conditional_scales, evidence

_Sides = tuple[NDArray[np.int64], Array, Array]
_NO_SIDES: _Sides = np.zeros(0, dtype=int), np.zeros(0), np.zeros(0)
_LOG_2, _ROOT_2 = np.log(2.0), np.sqrt(2.0)


@dataclass(frozen=True, eq=False)
class _EqualWidth:
    """Blocks of equal width with the statistics of their first-order gain, given the blocks already in the model.

    ``value`` w and ``along`` c² (K, D): eigenvalues of each block's information, and squared scores in its
    eigenvectors, columns held at zero excepted. ``sides`` (J,): place in ``blocks``, w and c of each column that cannot
    be negative.
    """

    blocks: list[int]
    value: Array
    along: Array
    sides: _Sides


def gains(gram: Gram, base: Combination, blocks: Sequence[int]) -> list[tuple[int, float, float]]:
    """First-order gain of log evidence by adding each block, its scale integrated out: block, gain and best scale."""
    used = gram.columns_of(base.blocks)
    # a column that is held at zero takes nothing up
    values, covariance = gram.posterior(base)
    kept = np.flatnonzero((values != 0.0) | ~gram.positive[used])
    used, values, covariance = used[kept], values[kept], covariance[kept[:, None], kept] / base.noise**2
    left = gram.vector - gram.matrix[:, used] @ values
    log_scale = np.array(settings.SCALE_GRID)
    square = np.exp(2.0 * log_scale)[:, None]
    step = float(log_scale[1] - log_scale[0])
    freedom = gram.equations + gram.noise_dof
    rest = (gram.noise_dof + gram.total - float(gram.vector[used] @ values)) / freedom
    rest = max(rest, settings.LEAST_VARIANCE * base.noise**2)
    held = list(base.blocks)
    scales = np.log([base.scales[b] for b in held])
    result = []
    for alike in _padded([_beside(gram, base, own, used, left, covariance) for own in _by_width(gram, blocks)]):
        left_over = np.full((len(alike.blocks), len(log_scale)), rest)
        seen, told = square * alike.value[:, None], alike.along[:, None] * square
        part = np.empty_like(seen)
        for _ in range(settings.NOISE_ROUNDS):
            np.add(left_over[:, :, None], seen, out=part)
            taken = np.divide(told, part, out=part).sum(axis=2) / freedom
            left_over = np.maximum(rest - taken, settings.LEAST_VARIANCE * rest)
        about, spread = conditional_scales(gram.spreads[held], scales, gram.spreads[alike.blocks][:, None])
        log = -0.5 * np.log1p(np.divide(seen, left_over[:, :, None], out=part), out=part).sum(axis=2)
        log -= 0.5 * ((log_scale - about) / spread) ** 2 + np.log(np.sqrt(2.0 * np.pi) * spread / step)
        log -= 0.5 * freedom * np.log(left_over / rest)
        if gram.most is not None:
            log[log_scale > np.log(gram.most[alike.blocks])[:, None]] = -np.inf
        log += _log_half_lines(alike, square, left_over)
        top = log.max(axis=1)
        gain = top + np.log(np.exp(log - top[:, None]).sum(axis=1))
        result += list(zip(alike.blocks, gain.tolist(), np.exp(log_scale[log.argmax(axis=1)]).tolist(), strict=True))
    return result


def _beside(
    gram: Gram, base: Combination, blocks: list[int], used: NDArray[np.int64], left: Array, covariance: Array
) -> _EqualWidth:
    """Statistics of blocks of equal width given the columns in use, which are projected out by their covariance."""
    own = np.array([np.arange(gram.slices[b].start, gram.slices[b].stop) for b in blocks])
    cross = gram.matrix[own[:, :, None], used]
    inside = gram.matrix[own[:, :, None], own[:, None, :]] - cross @ covariance @ cross.transpose(0, 2, 1)
    pull, free, sides = left[own], np.ones(own.shape, dtype=bool), _NO_SIDES
    if gram.positive[own].any():
        free, sides = _constrained(inside, pull, gram.positive[own], base.noise**2)
        inside, pull = inside * (free[:, :, None] & free[:, None, :]), pull * free
    value, vector = np.linalg.eigh(inside)
    along = (vector.transpose(0, 2, 1) @ pull[:, :, None])[:, :, 0] ** 2
    return _EqualWidth(blocks, np.maximum(value, 0.0), along, sides)


def _constrained(
    inside: Array, pull: Array, constrained: NDArray[np.bool_], noise2: float
) -> tuple[NDArray[np.bool_], _Sides]:
    """Active set of each block at its expected sizes: mask of columns not held at zero; statistics of constrained ones.

    Of a free column its information and score given the other free ones; of one held at zero its information and
    gradient given these.
    """
    free = ~constrained | (pull > 0.0)
    for last in [*(False,) * settings.NOISE_ROUNDS, True]:
        both = free[:, :, None] & free[:, None, :]
        value, vector = np.linalg.eigh(np.where(both, inside, 0.0))
        inverse = (vector / (np.maximum(value, 0.0) + noise2)[:, None, :]) @ vector.transpose(0, 2, 1)
        inverse = np.where(both, inverse, 0.0)
        mean = (inverse @ pull[:, :, None])[:, :, 0]
        rest = pull - (inside @ mean[:, :, None])[:, :, 0]
        wrong = constrained & np.where(free, mean < 0.0, rest > 0.0)
        if last or not wrong.any():
            break
        free = free ^ wrong
    taken = (inside @ inverse * inside).sum(axis=2)
    tight = 1.0 / np.where(free, inverse.diagonal(axis1=1, axis2=2), 1.0)
    own = np.where(free, tight - noise2, inside.diagonal(axis1=1, axis2=2) - taken)
    where = np.nonzero(constrained)
    return free, (where[0], np.maximum(own, 0.0)[where], np.where(free, mean * tight, rest)[where])


def _log_half_lines(alike: _EqualWidth, square: Array, noise: Array) -> Array:
    """Log factors (K, S) of the half-normal priors of each block's non-negative columns, at each of S scales."""
    found = np.zeros_like(noise)
    block, value, pull = alike.sides
    if not len(block):
        return found
    scale2, noise2 = square[:, 0], noise[block]
    seen = scale2 * value[:, None] / noise2
    z = pull[:, None] * np.sqrt(scale2 / (1.0 + seen)) / noise2
    # ½ z² + log 2 Φ(z), which does not underflow where z is far below zero
    at_zero = np.log(erfcx(-np.minimum(z, 0.0) / _ROOT_2)) - 0.5 * np.log1p(seen)
    np.add.at(found, block, np.where(pull[:, None] > 0.0, log_ndtr(np.maximum(z, 0.0)) + _LOG_2, at_zero))
    return found


def _padded(parts: Sequence[_EqualWidth]) -> Iterator[_EqualWidth]:
    """Yield narrow blocks together, padded with zeros, and wide ones as they are."""
    narrow = [part for part in parts if part.value.shape[1] <= settings.NARROW]
    yield from (part for part in parts if part.value.shape[1] > settings.NARROW)
    if narrow:
        wide = max(part.value.shape[1] for part in narrow)
        first = np.cumsum([0, *(len(part.blocks) for part in narrow)])
        value, along = np.zeros((int(first[-1]), wide)), np.zeros((int(first[-1]), wide))
        for start, part in zip(first, narrow, strict=False):
            rows, columns = slice(start, start + len(part.blocks)), slice(part.value.shape[1])
            value[rows, columns], along[rows, columns] = part.value, part.along
        places = [part.sides[0] + start for start, part in zip(first, narrow, strict=False)]
        seen, pull = (np.concatenate([part.sides[k] for part in narrow]) for k in (1, 2))
        yield _EqualWidth(
            [b for part in narrow for b in part.blocks], value, along, (np.concatenate(places), seen, pull)
        )


def _by_width(gram: Gram, blocks: Sequence[int]) -> list[list[int]]:
    widths: dict[int, list[int]] = {}
    for b in blocks:
        widths.setdefault(gram.slices[b].stop - gram.slices[b].start, []).append(b)
    return list(widths.values())


@dataclass(eq=False)
class Search:
    """Memoised hill climbing over combinations of blocks by their log evidence.

    ``exclusive`` pairs of blocks must not be together; ``containers`` are blocks whose columns span those of a block of
    another effect; blocks that are ``out`` are in no combination. ``seen`` is the memo.
    """

    gram: Gram
    log_prior: Sequence[float]
    exclusive: frozenset[frozenset[int]] = frozenset()
    containers: frozenset[int] = frozenset()
    seen: dict[tuple[int, ...], Combination] = field(default_factory=dict)
    out: frozenset[int] = frozenset()

    def __post_init__(self) -> None:
        """List for each block those that it excludes, and find the largest log evidence in the memo."""
        self._apart: dict[int, set[int]] = {}
        self._expanded: set[tuple[int, ...]] = set()
        self._left_at: dict[tuple[int, ...], float] = {}
        self._most = max((c.log_evidence for c in self.seen.values() if c.exact), default=-np.inf)
        for a, b in self.exclusive:
            self._apart.setdefault(a, set()).add(b)
            self._apart.setdefault(b, set()).add(a)

    def without(self, out: frozenset[int]) -> Search:
        """Search without some blocks, with the memo of the others."""
        seen = {key: found for key, found in self.seen.items() if not out & set(key)}
        return replace(self, seen=seen, out=self.out | out)

    def allowed(self, blocks: Sequence[int]) -> bool:
        """Whether no two of the blocks exclude each other."""
        whole = set(blocks)
        return not any(self._apart.get(b, whole - whole) & whole for b in blocks)

    def evaluate(self, blocks: Sequence[int], start: Combination | None = None, wanted: float = -np.inf) -> Combination:
        """Log evidence of a combination, memoised; stopped early where clearly below ``wanted`` or the best."""
        key = tuple(sorted(blocks))
        known, floor = self.seen.get(key), max(wanted, self._most - settings.DETOUR_FROM)
        if known is None or not (known.exact or self._left_at.get(key, np.inf) <= floor):
            self.seen[key] = self._computed(key, known or start, floor)
            self._most = max(self._most, self.seen[key].log_evidence)
            if not self.seen[key].exact:
                self._left_at[key] = floor
        return self.seen[key]

    def _at_least(self, blocks: Sequence[int], start: Combination) -> Combination:
        """Evaluate a combination exactly, unless its log evidence is clearly below that of ``start``."""
        return self.evaluate(blocks, start, start.log_evidence - settings.NEARLY)

    def _computed(self, key: tuple[int, ...], start: Combination | None, floor: float) -> Combination:
        try:
            return evidence(self.gram, key, sum(self.log_prior[b] for b in key), start, floor)
        except EstimationError:
            if not key:
                raise
            # rounding hides what blocks so nearly alike bring: nothing
            return replace(self.evaluate(()), blocks=key, log_evidence=-np.inf, scales=dict.fromkeys(key, 1.0))

    def run(self, start: Sequence[int] = ()) -> Combination:
        """Hill climbing with larger moves, until no move improves.

        All neighbours of the best combination are scored, near ones exactly, so that its probability is relative to
        all.
        """
        best = self.climb(start)
        detours = (self._simpler, self._smaller, self._two_at_once)
        while (better := next((found for detour in detours if (found := detour(best))), None)) is not None:
            best = self.climb(better.blocks)
        return best

    def climb(self, start: Sequence[int] = ()) -> Combination:
        """Hill climbing by adding, dropping and exchanging blocks, also from combinations that are nearly as good."""
        best = self._climb(start, frozenset())
        while (better := self._near_ties(best)) is not None:
            best = self._climb(better.blocks, frozenset())
        return best

    def _smaller(self, best: Combination) -> Combination | None:
        """Climb without a block that contains others; return an improvement, if any."""
        for large in self.containers & set(best.blocks):
            barred = frozenset(b for b in self._apart[large] | {large} if self._width(b) >= self._width(large))
            found = self._climb([b for b in best.blocks if b != large], barred)
            if found.log_evidence > best.log_evidence + settings.BETTER:
                return found
        return None

    def _two_at_once(self, best: Combination) -> Combination | None:
        """Add two blocks, or exchange one for two; return an improvement, if any.

        Of similar blocks one alone may gain nothing, and two a lot.
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

    def _near_ties(self, best: Combination) -> Combination | None:
        """Evaluate the neighbours of near ties; return an improvement, if any.

        This finds two effects that replace two others: with only one exchanged the evidence is nearly the same.
        """
        for tie in self.ties(best)[1:]:
            if tie.blocks in self._expanded:
                continue
            self._expanded.add(tie.blocks)
            found = self.evaluate_neighbours(tie.blocks)
            if found.log_evidence > best.log_evidence + settings.BETTER:
                return found
        return None

    def ties(self, best: Combination) -> list[Combination]:
        """Best combination, then others with as many blocks and nearly the same log evidence, best first."""
        near = [c for c in self.seen.values() if c.exact and self._near(c, best) and c.blocks != best.blocks]
        near = [c for c in near if len(c.blocks) == len(best.blocks)]
        return [best, *sorted(near, key=lambda c: -c.log_evidence)[: settings.TIES]]

    def evaluate_neighbours(self, blocks: Sequence[int]) -> Combination:
        """Evaluate the neighbours of a combination that come near it to first order; return the best of all."""
        own = self.evaluate(blocks)
        near = [self._at_least(c.blocks, own) for c in self._promising(own)]
        return max((own, *near), key=lambda c: c.log_evidence)

    def _simpler(self, best: Combination) -> Combination | None:
        """Replace one block by another setting that makes further blocks needless; return an improvement, if any.

        A more general setting, such as one more joint, pays only once the blocks that it replaces are removed.
        """
        for b in best.blocks:
            for setting in self._apart.get(b, set()) - self.out:
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
        """Backward elimination, as long as the evidence grows, of blocks other than ``kept``."""
        while True:
            without = [self.evaluate([c for c in found.blocks if c != b], found) for b in found.blocks if b != kept]
            best = max(without, key=lambda c: c.log_evidence, default=found)
            if best.log_evidence <= found.log_evidence:
                return found
            found = best

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
        """Neighbours with one block more, less or exchanged that may improve the evidence, best first.

        Additions are scored to first order, which underestimates a block whose effect the others imitate: so the best
        exchange for each block is always included.
        """
        bases = self._bases(best)
        found = {c.blocks: c for c in bases[1:] if self._near(c, best)}
        for base in bases:
            added = [c for c in self._with_one_more(base, best) if not barred & set(c.blocks)]
            added.sort(key=lambda c: -c.log_evidence)
            found |= {c.blocks: c for k, c in enumerate(added) if k == 0 or self._near(c, best)}
        return sorted(found.values(), key=lambda c: -c.log_evidence)

    def _bases(self, best: Combination) -> list[Combination]:
        """Return the combination itself, and without each one of its blocks: the starting points of additions."""
        return [best, *(self.evaluate([c for c in best.blocks if c != b], best) for b in best.blocks)]

    def _with_one_more(self, base: Combination, best: Combination) -> list[Combination]:
        if not np.isfinite(base.log_evidence):  # rounding hides what it leaves
            return []
        known = {*best.blocks, *base.blocks, *self.out}
        others = [b for b in range(len(self.gram.slices)) if b not in known]
        keys = {b: tuple(sorted((*base.blocks, b))) for b in others}
        barred = set().union(*(self._apart.get(b, ()) for b in base.blocks))
        new = [b for b in others if b not in barred and keys[b] not in self.seen]
        for b, gain, scale in gains(self.gram, base, new):
            self.seen[keys[b]] = Combination(
                keys[b],
                base.log_evidence + gain + self.log_prior[b],
                base.noise,
                {**base.scales, b: scale},
                base.effective,
                exact=False,
            )
        return [self.seen[keys[b]] for b in others if keys[b] in self.seen]

    def set_best(self, blocks: Sequence[int], families: Sequence[str]) -> Combination:
        """Best settings of the same effects by coordinate search: single blocks are exchanged while that gains."""
        best = self.evaluate(blocks)
        while True:
            names = {families[b]: b for b in best.blocks}
            swaps = [
                (names[f], b) for b, f in enumerate(families) if f in names and b != names[f] and b not in self.out
            ]
            tried = [tuple(sorted((set(best.blocks) - {old}) | {new})) for old, new in swaps]
            near = (self.evaluate(c, best) for c in tried if self.allowed(c))
            found = max(near, key=lambda c: c.log_evidence, default=best)
            if found.log_evidence <= best.log_evidence + settings.BETTER:
                return best
            best = found

    def probabilities(self) -> tuple[list[Combination], Array]:
        """Return all combinations evaluated, with their posterior probabilities among these, most probable first."""
        order = sorted(self.seen.values(), key=lambda c: -c.log_evidence)
        log = np.array([c.log_evidence for c in order])
        weight = np.exp(log - log[0])
        return order, weight / weight.sum()
