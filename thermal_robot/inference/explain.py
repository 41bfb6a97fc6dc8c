"""Bayesian model selection: effects, outliers, noise and a correlated discrepancy, iterated until they are consistent.

Combinations of effects are searched for every kernel and amplitude of a discrepancy, in one memo, and their evidence is
summed over these.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from itertools import combinations, pairwise
from math import comb

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.effects import Effect
from thermal_robot.errors import EstimationError
from thermal_robot.inference import settings
from thermal_robot.inference.evidence import Combination, Gram, evidence
from thermal_robot.inference.kernels import Form, Grouped, Smooth, Spectrum, Stack, decomposed
from thermal_robot.inference.problem import (
    Linear,
    Whitening,
    contained,
    discrepancy_mean,
    frame_step,
    normal_equations,
    parameter_values,
    white_stack,
)
from thermal_robot.inference.search import Search
from thermal_robot.inference.weights import Noise, distance_limit, first_whitening, reweigh

Rung = tuple[int, float]
"""Number of the form and τ; (−1, 0) where there is no discrepancy."""
PLAIN: Rung = (-1, 0.0)


@dataclass(eq=False)
class Ladder:
    """Model search over combinations of blocks and over kernels and amplitudes of a discrepancy.

    ``whitening`` is without a discrepancy; ``exclusive`` pairs of blocks must not be together, nor those of which one
    contains the other; ``among`` is the number of kernels that share the prior, of which ``forms`` are left.
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
        """Decompose each kernel once for all amplitudes."""
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
        """Copy of the search without some blocks; evaluations of the others stay in the memo."""
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

    def bare(self) -> Ladder:
        """Copy without the rows' columns, unless a per-pose discrepancy still needs them."""
        if any(form.anew for form in self.forms):
            return self
        found = copy(self)
        found.stack, found._stack = None, replace(self._stack, different=())
        return found

    def _consider(self, form: Form, log_prior: float) -> int:
        """Add a kernel, whose prior is divided among its amplitudes; return its number.

        Products with all columns are cached, but not for per-pose kernels, which have too many.
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
        """Yield the larger block of each nested pair of which the data determine the smaller."""
        for pair in inside:
            small, large = sorted(pair, key=lambda b: plain.ranks[b])
            own = plain.slices[small]
            if float(np.trace(plain.matrix[own, own])) > settings.CONTAINS:
                yield large

    def whitened_at(self, rung: Rung) -> Whitening:
        """Whitening with a discrepancy of the given kernel and amplitude."""
        form, tau = rung
        return self.whitening if form < 0 else replace(self.whitening, smooth=Smooth(self._spectra[form], tau))

    def beside(self, rung: Rung) -> Search:
        """Search over blocks with one discrepancy in the covariance, made once."""
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
        """Hill climbing over combinations and discrepancies from several starts.

        With ``detours`` larger moves are tried, too.
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
        """Extend a per-pose discrepancy to several joints, one after another; return an improvement, if any.

        Tried with the best combination and with none, since the amplitudes of one need not suit the other.
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
        """Climb where an amplitude promises more evidence than the best; return an improvement, if any."""
        rung, promised, blocks = found
        return self._better(rung, blocks, best) if promised > best.log_evidence + settings.BETTER else None

    def _better(self, rung: Rung, blocks: tuple[int, ...], best: Combination) -> tuple[Rung, Combination] | None:
        nearby = self.beside(rung).climb(blocks)
        return (rung, nearby) if nearby.log_evidence > best.log_evidence + settings.BETTER else None

    def _further(self, rung: Rung, best: Combination) -> tuple[Rung, Combination] | None:
        """Search beyond single steps with the present discrepancy; return an improvement, if any."""
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
        """Remove the last kernel."""
        number = len(self.forms) - 1
        del self.forms[number], self._spectra[number], self._along[number]
        self._quick = {key: log for key, log in self._quick.items() if key[0][0] != number}
        self._settled = {key: found for key, found in self._settled.items() if key[0] != number}

    def _size(self, form: int, blocks: tuple[int, ...], start: float = 1.0) -> tuple[Rung, float]:
        """Most probable amplitude of a kernel with one combination, and its log evidence; it is unimodal."""
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
        """Log evidence of one combination with one discrepancy, from the columns of its blocks alone."""
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
        """Warm start: the same combination with the last amplitude, or without a discrepancy."""
        if (form, blocks) in self._settled:
            return self._settled[form, blocks]
        known = self.searches[PLAIN].seen.get(blocks)
        return known and replace(known, scales={k: known.scales.get(b, 1.0) for k, b in enumerate(blocks)})

    def _left(self, rung: Rung, picked: NDArray[np.int64]) -> Array:
        """Gram matrix of some columns, whitened with a discrepancy."""
        kept, number = np.unique(self._stack.number[picked], return_inverse=True)
        plain = self._products[np.ix_(self._first[kept], self._first[kept])]
        found = self._spectra[rung[0]].products(rung[1], self._along_form(rung[0], kept), plain)
        return np.asarray(found[np.ix_(number, number)])

    def _along_form(self, form: int, kept: NDArray[np.int64]) -> list[Array]:
        """Products of a kernel's factor with some of the distinct columns."""
        known = self._along[form]
        if known is not None:
            return [own[:, kept] for own in known]
        key = self._spectra[form], kept.tobytes()
        if self._last[0] != key:  # one after another its sizes are tried
            self._last = key, self._spectra[form].along(self._stack.differing(kept))
        return self._last[1]

    def in_question(self, best: Combination) -> tuple[Form, ...]:
        """Kernels with substantial posterior probability beside the best combination.

        A kernel whose most probable amplitude is the smallest is noise; one that is far less probable is left out.
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
        """Evaluate the neighbours with all plausible discrepancies; return an improvement, if any."""
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
        """Evaluate pairs of changes of the best combination of which each alone is uncertain.

        Two uncertain effects that are independent may both be at work; without such pairs each would lower the
        probability of the other.
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
        """Best combination of the most probable set of effects, summed over settings and discrepancies."""
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
        """Posterior probabilities of all combinations, summed over discrepancies, most probable first."""
        masses = [(mass, c) for own in self._masses().values() for mass, c in own]
        masses.sort(key=lambda item: -item[0])
        weight = np.exp(np.array([mass for mass, _ in masses]) - masses[0][0])
        return [c for _, c in masses], weight / weight.sum()

    def forms_in_question(self) -> dict[str, float]:
        """Posterior probability of each kernel by its name, and by an empty name that of none."""
        held = {rung: np.array([mass for mass, _ in own]) for rung, own in self._masses().items()}
        top = max(own.max() for own in held.values())
        mass: dict[str, float] = {}
        for rung, own in held.items():
            name = self.forms[rung[0]].name if rung[0] >= 0 else ""
            mass[name] = mass.get(name, 0.0) + float(np.exp(own - top).sum())
        return {name: m / sum(mass.values()) for name, m in mass.items()}

    def _masses(self) -> dict[Rung, list[tuple[float, Combination]]]:
        """Log evidence of all combinations for each discrepancy, weighted by the amplitudes that it represents.

        Sum over all amplitudes by those computed: each represents the amplitudes nearest to it.
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


NOTHING = np.zeros(0)


@dataclass(frozen=True)
class Discrepancy:
    """Posterior of a correlated discrepancy: the probability of any, and of each kernel by its name.

    Beside the best combination: ``form`` and ``tau``, its rms over the noise (``None`` and 0 where there is none), and
    ``noise`` in units of the whitening noise.
    """

    form: Form | None
    tau: float
    probability: float
    forms: Mapping[str, float]
    noise: float = 1.0


@dataclass(frozen=True, eq=False)
class Explanation:
    """Most probable combination of effects, its outliers and noise, and the probabilities of all combinations.

    ``problem`` is the Gram matrix of the ``linear`` problem at the final ``whitening``; ``combinations`` all that were
    compared, most probable first, without values; ``values`` mean and covariance per block of the best; ``remainder``
    (N, m) the residual of all rows, gap less effects and frames; ``smooth`` (N, m) the discrepancy's posterior mean,
    part of it; ``outliers`` (N,) rows set aside; ``searched`` holds all that was weighed.
    """

    linear: Linear
    whitening: Whitening
    problem: Gram
    best: Combination
    combinations: Sequence[Combination]
    probabilities: Array
    values: dict[int, tuple[Array, Array]]
    remainder: Array
    smooth: Array
    outliers: NDArray[np.bool_]
    discrepancy: Discrepancy
    forms: Sequence[Form]
    searched: _Round | None = None

    def without(self, out: Sequence[int]) -> Explanation:
        """Best explanation without some blocks, at the same weights, from the memo."""
        if self.searched is None:
            raise ValueError("what was weighed for this explanation is no longer known")
        return self.searched.without(frozenset(out)).told(self.outliers)

    def block_of(self, effect: Effect) -> int:
        """Block of the best combination that belongs to this effect, in whatever setting."""
        return next(b for b in self.best.blocks if self.linear.blocks[b].effect.name == effect.name)

    def held(self, block: int) -> Array:
        """Prior standard deviations (P,) of a block's parameters, SI; next to 0 for those held at zero."""
        item = self.linear.blocks[block]
        return item.sizes * self.best.scales[block] * item.kept(self.values[block][0])

    def far(self, rows: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Outliers (N,) among the given rows."""
        beyond = self.whitening.sigma() * self.best.noise * np.hypot(1.0, self.discrepancy.tau)
        distance2 = ((self.remainder / beyond) ** 2).sum(axis=1)
        return np.asarray(rows & (distance2 > distance_limit(self.whitening.figures(self.linear.measures), len(rows))))

    def probability(self, blocks: Sequence[int]) -> float:
        """Posterior probability that any of the blocks is in the model."""
        held = [bool(set(c.blocks) & set(blocks)) for c in self.combinations]
        return min(float(self.probabilities[held].sum()), 1.0)


def explain(
    linear: Linear,
    noise: Noise,
    *,
    rows: NDArray[np.bool_] | None = None,
    families: Sequence[str] = (),
    starts: Sequence[Sequence[int]] = (),
    outliers: NDArray[np.bool_] | None = None,
    before: Explanation | None = None,
    forms: Sequence[Form] = (),
    log_prior: Sequence[float] | None = None,
) -> Explanation:
    """Bayesian model selection of blocks together with outliers, noise and a correlated discrepancy.

    Robust: rows further than noise allows are set aside, those in the tail weigh less (Huber). Rows not in ``rows``
    (N,) are ignored. Blocks of one family are settings that exclude each other and share its prior probability.
    ``starts`` and ``outliers`` are where the search starts. With an explanation of a similar problem ``before``, its
    weights, noise and plausible kernels are reused; if the first of the starts is found again with the same kernel, the
    iteration ends. ``log_prior`` is by default that of the blocks' effects.
    """
    samples = len(linear.gap)
    use = np.ones(samples, dtype=bool) if rows is None else rows
    outliers = before.outliers if before and outliers is None else outliers
    aside = np.zeros(samples, dtype=bool) if outliers is None else outliers & use
    families = families or [str(k) for k in range(len(linear.blocks))]
    log_prior = log_priors([b.effect for b in linear.blocks]) if log_prior is None else log_prior
    asked = _Asked(linear, families, log_prior, settings_of_one(families), len(forms), Stack.of(linear.columns))
    seeds = [tuple(sorted(start)) for start in starts]
    first, history = before is None, list[tuple[object, ...]]()
    beside: Sequence[Form] = ()
    if before is None:
        # effects that are far off, and gross errors, are settled first, beside a noise that is free
        whitening = replace(first_whitening(linear, noise, use & ~aside), held=0.0)
    else:
        whitening, alive = replace(before.whitening, smooth=None), {form.name for form in before.forms}
        beside, form = [form for form in forms if form.name in alive], before.discrepancy.form
        history += [_state(seed, form, whitening) for seed in seeds[:1]]

    def settled(found: _Round) -> bool:
        return bool(history) and (found.state in history or len(history) >= settings.FIRST_ROUNDS)

    while True:
        found = _Round.of(asked, whitening, beside, seeds)
        if settled(found):
            found = found.without(frozenset())  # weights stay: only now is it worth to look for what steps miss
            if settled(found):
                return found.told(aside)
        history.append(found.state)
        whitening, aside = reweigh(found.rough, noise, use, found.leverage, linear.measures)
        seeds = [found.best.blocks]
        beside = forms if first else found.ladder.in_question(found.best)
        first = False
        del found  # before the next one takes as much memory


def _state(blocks: tuple[int, ...], form: Form | None, whitening: Whitening) -> tuple[object, ...]:
    """Key of an iteration, to detect convergence: blocks, kernel of the discrepancy, and rows in use."""
    return blocks, form and form.words, np.packbits(whitening.weights > 0).tobytes()


@dataclass(frozen=True, eq=False)
class _Asked:
    """Inputs that stay the same in all iterations."""

    linear: Linear
    families: Sequence[str]
    log_prior: Sequence[float]
    rivals: frozenset[frozenset[int]]
    forms: int
    stack: Stack | None


@dataclass(frozen=True, eq=False)
class _Round:
    """One search at fixed weights: best combination, its discrepancy, and both residuals."""

    asked: _Asked
    ladder: Ladder
    rung: Rung
    best: Combination
    remainder: Array
    smooth: Array

    @classmethod
    def of(
        cls, asked: _Asked, whitening: Whitening, beside: Sequence[Form], seeds: Sequence[tuple[int, ...]]
    ) -> _Round:
        ladder = Ladder(asked.linear, whitening, list(beside), asked.log_prior, asked.rivals, asked.forms, asked.stack)
        return cls._on(asked, ladder, seeds, detours=False)

    def without(self, out: frozenset[int]) -> _Round:
        """Return the round without some blocks, started from the best combination without them."""
        return self._on(self.asked, self.ladder.without(out), [tuple(b for b in self.best.blocks if b not in out)])

    @classmethod
    def _on(cls, asked: _Asked, ladder: Ladder, seeds: Sequence[tuple[int, ...]], *, detours: bool = True) -> _Round:
        ladder.run(seeds, detours=detours)
        rung, best = ladder.consensus(asked.families)
        white = ladder.whitened_at(rung)
        remainder = left_of(asked.linear, white, parameter_values(asked.linear, ladder.beside(rung).gram, best))
        return cls(asked, ladder, rung, best, remainder, discrepancy_mean(white, remainder))

    @property
    def form(self) -> Form | None:
        return self.ladder.forms[self.rung[0]] if self.rung[0] >= 0 else None

    @property
    def state(self) -> tuple[object, ...]:
        return _state(self.best.blocks, self.form, self.ladder.whitening)

    @property
    def rough(self) -> Array:
        """Residual (N, m) less a smooth discrepancy; a per-pose discrepancy is not subtracted."""
        return self.remainder if self.form is None or self.form.anew else self.remainder - self.smooth

    @property
    def leverage(self) -> float:
        """Share of the equations fitted by effects, frames and a smooth discrepancy."""
        flat, smooth = self.asked.linear.frames.shape[2], self.ladder.whitened_at(self.rung).smooth
        followed = self.best.effective + flat
        if smooth is not None and self.form is not None and not self.form.anew:
            followed += smooth.degrees
        equations = self.ladder.beside(self.rung).gram.equations + flat
        return float(min(followed / max(equations, 1), settings.MOST_LEVERAGE))

    def told(self, aside: NDArray[np.bool_]) -> Explanation:
        """Explanation of this round.

        Settings and values are those of the best correction: with a smooth discrepancy, which no correction contains,
        the effects are refitted without it, at a noise that includes it.
        """
        linear, ladder = self.asked.linear, self.ladder
        rung = self.rung if self.form is None or self.form.anew else PLAIN
        search, white = ladder.beside(rung), ladder.whitened_at(rung)
        best = (
            search.evaluate(self.best.blocks)
            if rung == self.rung
            else search.set_best(self.best.blocks, self.asked.families)
        )
        values = parameter_values(linear, search.gram, best)
        ladder.weigh_pairs(self.rung, self.best)
        compared, probabilities = ladder.probabilities()
        odds = ladder.forms_in_question()
        return Explanation(
            linear,
            white,
            search.gram,
            best,
            [replace(c, values=NOTHING, covariance=NOTHING) for c in compared],
            probabilities,
            values,
            left_of(linear, white, values),
            self.smooth,
            aside,
            Discrepancy(self.form, self.rung[1], 1.0 - odds.get("", 0.0), odds, self.best.noise),
            ladder.in_question(self.best),
            replace(self, asked=replace(self.asked, stack=None), ladder=ladder.bare()),
        )


def log_odds() -> float:
    """Log prior odds of one effect."""
    return float(np.log(settings.PRIOR_PROBABILITY / (1.0 - settings.PRIOR_PROBABILITY)))


def settings_of_one(families: Sequence[str]) -> frozenset[frozenset[int]]:
    """Pairs of blocks that are settings of one effect, and exclude each other."""
    pairs = combinations(range(len(families)), 2)
    return frozenset(frozenset((a, b)) for a, b in pairs if families[a] == families[b])


def log_priors(effects: Sequence[Effect]) -> list[float]:
    """Log prior odds of each setting of an effect: a share of the odds of its name.

    An effect is as probable in all its places as in one, half as probable in two, and so on; places are exchangeable,
    and settings of the same places share by weight. The share does not depend on settings in other places.
    """
    single: dict[str, set[str]] = {effect.name: set() for effect in effects}
    for effect in effects:
        single[effect.name].update(effect.places if len(effect.places) == 1 else ())
    kin = [(e.name, frozenset(e.places if single[e.name] else ())) for e in effects]
    # a constant that stands apart is as rare as an effect
    own = [effect.weight * float(np.exp(log_odds() * effect.apart)) for effect in effects]
    alike: dict[tuple[str, frozenset[str]], float] = {}
    for key, weight in zip(kin, own, strict=True):
        alike[key] = alike.get(key, 0.0) + weight
    shares = [
        share_of_places(len(key[1]), len(single[key[0]])) * weight / alike[key]
        if effect.share is None
        else effect.share
        for effect, key, weight in zip(effects, kin, own, strict=True)
    ]
    return [log_odds() + float(np.log(share)) for share in shares]


def share_of_places(count: int, among: int) -> float:
    """Prior probability that an effect acts in exactly so many given places, in all where 0; 1 without places."""
    return settings.IN_ALL * settings.ONE_MORE ** max(count - 1, 0) / comb(max(among, count), count) if among else 1.0


def left_of(linear: Linear, whitening: Whitening, values: dict[int, tuple[Array, Array]]) -> Array:
    """Residual (N, m): gap less effects and frames."""
    moved = (linear.contribution(b, mean) for b, (mean, _) in values.items())
    left = linear.gap - sum(moved, np.zeros_like(linear.gap))
    return np.asarray(left - linear.frames @ frame_step(linear, whitening, left))
