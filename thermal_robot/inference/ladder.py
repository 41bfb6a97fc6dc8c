"""One evidence: combinations of effects, searched beside every size and form of a discrepancy, and summed over them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from itertools import combinations, pairwise

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.errors import EstimationError
from thermal_robot.inference import settings
from thermal_robot.inference.discrepancy import Form, Smooth, Spectrum, decomposed
from thermal_robot.inference.evidence import Combination, Gram, evidence
from thermal_robot.inference.problem import Linear, Whitening, contained, normal_equations, white_stack
from thermal_robot.inference.search import Search
from thermal_robot.inference.stack import Grouped, Stack

Rung = tuple[int, float]
"""Number of the form and τ; (−1, 0) where there is no discrepancy."""
PLAIN: Rung = (-1, 0.0)


@dataclass(eq=False)
class Ladder:
    """Evaluates combinations of blocks beside discrepancies of several forms and sizes.

    ``whitening`` is without a discrepancy; ``exclusive`` pairs of blocks must not be together, nor those of which one
    contains the other; of ``among`` forms these are left, and keep their share of the prior.
    """

    linear: Linear
    whitening: Whitening
    forms: list[Form]
    log_prior: Sequence[float]
    exclusive: frozenset[frozenset[int]] = frozenset()
    among: int = 0
    stack: Stack | None = None
    searches: dict[Rung, Search] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Decompose the forms once for all sizes."""
        w = self.whitening
        self._stack = white_stack(self.stack or Stack.of(self.linear.columns), w)
        self._products, self._equations = self._stack.products(), self._stack.equations
        self._first = np.unique(self._stack.number, return_index=True)[1]
        plain = normal_equations(self.linear, w, self._products, self._equations)
        inside = contained(plain)
        self._pairs = inside | self.exclusive
        self._containers = frozenset(self._containing(plain, inside - self.exclusive))
        share = settings.SMOOTH_PRIOR if self.forms or self.among else 0.0
        ends = np.cumsum([self.linear.frames.shape[2], *(len(block.sizes) for block in self.linear.blocks)])
        self._spans = [np.arange(a, b) for a, b in pairwise(ends)]
        self._quick: dict[tuple[Rung, tuple[int, ...]], float] = {}
        self._settled: dict[tuple[int, tuple[int, ...]], Combination] = {}
        self._priors = {PLAIN: float(np.log1p(-share))}
        self._joined = False
        self._out: frozenset[int] = frozenset()
        self._sizes: dict[int, float] = {}
        given, self.forms = self.forms, []
        self._spectra: list[Spectrum | Grouped] = []
        self._along: list[list[Array] | None] = []
        self._last: tuple[object, list[Array]] = None, []
        for form in given:
            self._consider(form, float(np.log(share / max(self.among, len(given)))))
        self.searches[PLAIN] = self._search(PLAIN, plain)

    def without(self, out: frozenset[int]) -> Ladder:
        """Return the same without some blocks: what was evaluated of the others stays known."""
        found = copy(self)
        found.forms, found._joined = list(self.forms), any(form.several for form in self.forms)
        found._spectra, found._along = list(self._spectra), list(self._along)
        found._priors, found._sizes = dict(self._priors), dict(self._sizes)
        found._quick = {key: log for key, log in self._quick.items() if not out & set(key[1])}
        found._settled = {key: own for key, own in self._settled.items() if not out & set(key[1])}
        found._out = self._out | out
        left = {rung: search.without(out) for rung, search in self.searches.items()}
        found.searches = {rung: search for rung, search in left.items() if search.seen or rung == PLAIN}
        return found

    def _consider(self, form: Form, log_prior: float) -> int:
        """Add a form, which shares its prior among all sizes; return its number.

        Products with all columns are kept where they are few: not those with what is anew in every pose.
        """
        self.forms.append(form)
        w = self.whitening
        spectrum = decomposed(form.over(w.relative), w.weights, w.noise)
        self._spectra.append(spectrum)
        self._along.append(None if form.anew else spectrum.along(self._stack))
        number, each = len(self.forms) - 1, log_prior - float(np.log(len(settings.TAUS)))
        self._priors |= {(number, tau): each for tau in settings.TAUS}
        return number

    @staticmethod
    def _containing(plain: Gram, inside: frozenset[frozenset[int]]) -> Iterator[int]:
        """Yield the larger block of each pair of which one contains the other, where the data see the smaller."""
        for pair in inside:
            small, large = sorted(pair, key=lambda b: plain.ranks[b])
            own = plain.slices[small]
            if float(np.trace(plain.matrix[own, own])) > settings.CONTAINS:
                yield large

    def whitened_at(self, rung: Rung) -> Whitening:
        """Return the whitening with the discrepancy of a rung."""
        form, tau = rung
        return self.whitening if form < 0 else replace(self.whitening, smooth=Smooth(self._spectra[form], tau))

    def beside(self, rung: Rung) -> Search:
        """Return the search beside one discrepancy, made once."""
        if rung not in self.searches:
            white, products = self.whitened_at(rung), self._left(rung, np.arange(len(self._products)))
            plain = self.searches[PLAIN].gram
            self.searches[rung] = self._search(
                rung, normal_equations(self.linear, white, products, self._equations, like=plain)
            )
        return self.searches[rung]

    def _search(self, rung: Rung, problem: Gram) -> Search:
        offset = problem.offset + self._priors[rung]
        found = Search(replace(problem, offset=offset), self.log_prior, self._pairs, self._containers)
        return found.without(self._out) if self._out else found

    def run(self, starts: Sequence[tuple[int, ...]] = (), *, detours: bool = True) -> tuple[Rung, Combination]:
        """Climb over combinations and discrepancies until neither betters the other, from several starts.

        With ``detours`` what single steps miss is looked for, too.
        """
        first = self.beside(PLAIN)
        allowed = dict.fromkeys([*(s for s in starts if first.allowed(s)), ()])
        begin = sorted((first.evaluate(s) for s in allowed), key=lambda c: -c.log_evidence)
        rung, best = PLAIN, first.climb(begin[0].blocks)
        seeds = [c.blocks for c in begin[: settings.STARTS]]
        while True:
            tried = dict.fromkeys([best.blocks, *seeds])
            found = [(*self._size(k, blocks), blocks) for k in range(len(self.forms)) for blocks in tried]
            seeds = []
            other = max(found, key=lambda item: item[1], default=(rung, -np.inf, ()))
            nearby = self._climbed(other, best) or self._beside_others(best) or self._several_joints(rung, best)
            nearby = nearby or (self._further(rung, best) if detours else None)
            if nearby is None:
                return rung, best
            rung, best = nearby

    def _several_joints(self, rung: Rung, best: Combination) -> tuple[Rung, Combination] | None:
        """Let several joints err in every pose or visit, one after another; return what is better, if any is.

        Once beside the best combination and once beside none, so that neither has the sizes that suit the other.
        """
        if self._joined or rung[0] < 0 or not self.forms[rung[0]].anew:
            return None
        self._joined = True
        single = [k for k, f in enumerate(self.forms) if f.anew and f.joints]
        if not single:
            return None
        tried = [(*self._joined_beside(blocks, single), blocks) for blocks in {best.blocks, ()}]
        return self._climbed(max(tried, key=lambda item: item[1]), best)

    def _climbed(
        self, found: tuple[Rung, float, tuple[int, ...]], best: Combination
    ) -> tuple[Rung, Combination] | None:
        """Climb where a size promises more than the best; return what is better, if anything is, rounding aside."""
        rung, promised, blocks = found
        return self._better(rung, blocks, best) if promised > best.log_evidence + settings.BETTER else None

    def _better(self, rung: Rung, blocks: tuple[int, ...], best: Combination) -> tuple[Rung, Combination] | None:
        nearby = self.beside(rung).climb(blocks)
        return (rung, nearby) if nearby.log_evidence > best.log_evidence + settings.BETTER else None

    def _further(self, rung: Rung, best: Combination) -> tuple[Rung, Combination] | None:
        """Look beside the discrepancy for what single steps miss; return it, if anything is better."""
        found = self.beside(rung).run(best.blocks)
        return (rung, found) if found.log_evidence > best.log_evidence + settings.BETTER else None

    def _joined_beside(self, blocks: tuple[int, ...], single: Sequence[int]) -> tuple[Rung, float]:
        found = max((self._size(k, blocks) for k in single), key=lambda item: item[1])
        for _ in range(settings.SCATTERING - 1):
            further = self._one_more_joint(found[0], blocks, single)
            if further is None or further[1] <= found[1]:
                break
            found = further
        return found

    def _one_more_joint(self, rung: Rung, blocks: tuple[int, ...], single: Sequence[int]) -> tuple[Rung, float] | None:
        form = self.forms[rung[0]]
        others = [self.forms[k] for k in single if self.forms[k].functions is form.functions]
        others = [f for f in others if f.place[1] not in form.joints]
        if not others:
            return None
        prior = float(self._priors[rung] + np.log(len(settings.TAUS)) - np.log(len(others) * len(settings.PARTS)))
        tried = []
        for other in others:
            for part in settings.PARTS:
                further = form.beside(other, part)
                # the joints so far stay as they are
                tau = min(settings.TAUS, key=lambda t: abs(t - rung[1] * float(np.hypot(1.0, part))))
                tried.append((self._beside((self._consider(further, prior), tau), blocks), tau, further))
                self._forget()
        _, tau, best = max(tried, key=lambda item: item[0])
        return self._size(self._consider(best, prior), blocks, tau)

    def _forget(self) -> None:
        """Take the last form out again."""
        number = len(self.forms) - 1
        del self.forms[number], self._spectra[number], self._along[number]
        self._quick = {key: log for key, log in self._quick.items() if key[0][0] != number}
        self._settled = {key: found for key, found in self._settled.items() if key[0] != number}

    def _size(self, form: int, blocks: tuple[int, ...], start: float = 1.0) -> tuple[Rung, float]:
        """Return the most probable size of a form beside one combination, with the log evidence; it has one peak."""
        k = settings.TAUS.index(self._sizes.get(form, start))
        best = self._beside((form, settings.TAUS[k]), blocks)
        for step in settings.TAU_STEPS:
            for sign in (step, -step):
                while 0 <= k + sign < len(settings.TAUS):
                    other = self._beside((form, settings.TAUS[k + sign]), blocks)
                    if other <= best:
                        break
                    k, best = k + sign, other
        self._sizes[form] = settings.TAUS[k]
        return (form, settings.TAUS[k]), best

    def _beside(self, rung: Rung, blocks: tuple[int, ...]) -> float:
        """Return the log evidence of one combination beside one discrepancy, from the columns of its blocks alone."""
        key = rung, tuple(sorted(blocks))
        if key not in self._quick:
            flat, white = self.linear.frames.shape[2], self.whitened_at(rung)
            picked = np.concatenate([np.arange(flat), *(self._spans[b] for b in key[1]), [len(self._products) - 1]])
            problem = normal_equations(
                Linear(self.linear.gap, self.linear.frames, tuple(self.linear.blocks[b] for b in key[1])),
                white,
                self._left(rung, picked.astype(int)),
                self._equations,
                like=self.searches[PLAIN].gram.some(key[1]),
            )
            prior = self._priors[rung] + sum(self.log_prior[b] for b in key[1])
            try:
                found = evidence(problem, tuple(range(len(blocks))), prior, self._like(rung[0], key[1]))
                self._settled[rung[0], key[1]], self._quick[key] = found, found.log_evidence
            except EstimationError:  # what so large a discrepancy leaves is rounding
                self._quick[key] = -np.inf
        return self._quick[key]

    def _like(self, form: int, blocks: tuple[int, ...]) -> Combination | None:
        """Return the same combination beside the size tried last, or beside none: from there it is not far."""
        if (form, blocks) in self._settled:
            return self._settled[form, blocks]
        known = self.searches[PLAIN].seen.get(blocks)
        return known and replace(known, scales={k: known.scales.get(b, 1.0) for k, b in enumerate(blocks)})

    def _left(self, rung: Rung, picked: NDArray[np.int64]) -> Array:
        """Return the products of some columns, whitened by the discrepancy of a rung."""
        kept, number = np.unique(self._stack.number[picked], return_inverse=True)
        plain = self._products[np.ix_(self._first[kept], self._first[kept])]
        found = self._spectra[rung[0]].products(rung[1], self._along_form(rung[0], kept), plain)
        return np.asarray(found[np.ix_(number, number)])

    def _along_form(self, form: int, kept: NDArray[np.int64]) -> list[Array]:
        """Return the products of a form with some of the columns that differ."""
        known = self._along[form]
        if known is not None:
            return [own[:, kept] for own in known]
        key = self._spectra[form], kept.tobytes()
        if self._last[0] != key:  # one after another its sizes are tried
            self._last = key, self._spectra[form].along(self._stack.differing(kept))
        return self._last[1]

    def in_question(self, best: Combination) -> tuple[Form, ...]:
        """Return the forms that may be at work beside the best combination.

        One whose most probable size is the smallest is noise, and one that is far less probable is out of the question.
        """
        peaks: dict[int, tuple[float, float]] = {}
        for ((form, tau), blocks), log in self._quick.items():
            if blocks == best.blocks and form >= 0:
                peaks[form] = max(peaks.get(form, (-np.inf, 0.0)), (log, tau))
        least = best.log_evidence - settings.FORM_REACH
        near = {form for form, (log, tau) in peaks.items() if tau > settings.TAUS[0] and log > least}
        single = [form for form in self.forms if not form.several]
        several = any(self.forms[k].several for k in near)
        return tuple(f for k, f in enumerate(single) if k in near or (several and f.anew))

    def _beside_others(self, best: Combination) -> tuple[Rung, Combination] | None:
        """Weigh the neighbours beside all discrepancies that count; return what is better than the best, if any is."""
        near = [r for (r, blocks), log in self._quick.items() if blocks == best.blocks and self._counts(log, best)]
        for other in dict.fromkeys((PLAIN, *near)):
            if self._counts(self.beside(other).evaluate(best.blocks).log_evidence, best):
                nearby = self.beside(other).weigh(best.blocks)
                if nearby.log_evidence > best.log_evidence + settings.BETTER:
                    return self._better(other, nearby.blocks, best)
        return None

    @staticmethod
    def _counts(log_evidence: float, best: Combination) -> bool:
        return log_evidence > best.log_evidence - settings.RUNG_REACH

    def weigh_pairs(self, rung: Rung, best: Combination) -> None:
        """Weigh two changes of the best combination together, where each by itself is in doubt.

        Of two effects in doubt that have nothing to do with each other, both may be at work. Left out, each would take
        from the probability of the other.
        """
        search = self.beside(rung)
        own = set(best.blocks)
        near = []
        for c in search.seen.values():
            gone, new = own - set(c.blocks), set(c.blocks) - own
            lost = best.log_evidence - c.log_evidence
            if (gone or new) and max(len(gone), len(new)) == 1 and lost < settings.PAIR_REACH:
                near.append((lost, gone, new))
        near.sort(key=lambda item: item[0])
        pairs = [
            (a[0] + b[0], tuple(sorted((own - a[1] - b[1]) | a[2] | b[2])))
            for a, b in combinations(near, 2)
            if a[0] + b[0] < settings.PAIR_REACH and not a[1] & b[1] and not a[2] & b[2]
        ]
        for _, blocks in sorted(pairs)[: settings.PAIRS]:
            if search.allowed(blocks):
                search.evaluate(blocks, best)

    def consensus(self, families: Sequence[str]) -> tuple[Rung, Combination]:
        """Return the best combination of the most probable set of names, settings and discrepancies summed over."""
        compared, probabilities = self.probabilities()
        mass: dict[frozenset[str], float] = {}
        for combination, p in zip(compared, probabilities, strict=True):
            names = frozenset(families[b] for b in combination.blocks)
            mass[names] = mass.get(names, 0.0) + float(p)
        chosen = max(mass, key=lambda names: mass[names])
        held = [
            (rung, c)
            for rung, search in self.searches.items()
            for c in search.seen.values()
            if frozenset(families[b] for b in c.blocks) == chosen
        ]
        rung, best = max(held, key=lambda item: item[1].log_evidence)
        return rung, self.beside(rung).evaluate(best.blocks)

    def probabilities(self) -> tuple[list[Combination], Array]:
        """Return all combinations seen beside all discrepancies, most probable first, with their probabilities."""
        masses = [(mass, c) for own in self._masses().values() for mass, c in own]
        masses.sort(key=lambda item: -item[0])
        weight = np.exp(np.array([mass for mass, _ in masses]) - masses[0][0])
        return [c for _, c in masses], weight / weight.sum()

    def forms_in_question(self) -> dict[str, float]:
        """Return the posterior probability of each form by its name, and by an empty name that of none."""
        held = {rung: np.array([mass for mass, _ in own]) for rung, own in self._masses().items()}
        top = max(own.max() for own in held.values())
        mass: dict[str, float] = {}
        for rung, own in held.items():
            name = self.forms[rung[0]].name if rung[0] >= 0 else ""
            mass[name] = mass.get(name, 0.0) + float(np.exp(own - top).sum())
        return {name: m / sum(mass.values()) for name, m in mass.items()}

    def _masses(self) -> dict[Rung, list[tuple[float, Combination]]]:
        """Return beside each discrepancy searched all combinations, with the log evidence of the sizes it stands for.

        A sum over all sizes by those that were computed: each stands for those that are nearer to it than to another.
        """
        seen = {rung: list(search.seen.values()) for rung, search in self.searches.items()}
        best = max((c for own in seen.values() for c in own), key=lambda c: c.log_evidence)
        computed: dict[int, list[int]] = {}
        for (form, tau), blocks in self._quick:
            if blocks == best.blocks and form >= 0:
                computed.setdefault(form, []).append(settings.TAUS.index(tau))
        stands = {PLAIN: 0.0}
        for form, sizes in computed.items():
            sizes.sort()
            between = [0.5 * (a + b) for a, b in pairwise(sizes)]
            ends = [sizes[0] - 0.5, *between, sizes[-1] + 0.5]
            for k, (a, b) in zip(sizes, pairwise(ends), strict=True):
                stands[form, settings.TAUS[k]] = float(np.log(b - a))
        return {rung: [(c.log_evidence + stands.get(rung, 0.0), c) for c in own] for rung, own in seen.items()}
