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
from thermal_robot.inference.algebra import total_probability
from thermal_robot.inference.evidence import Combination, Gram, evidence
from thermal_robot.inference.kernels import (
    DesignMatrix,
    Kernel,
    KernelCovariance,
    decomposed,
)
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
from thermal_robot.inference.weights import Noise, first_whitening, reweigh

Hyperparameters = tuple[int, float]
"""Number of the kernel and its amplitude τ; (−1, 0) where there is no discrepancy."""
PLAIN: Hyperparameters = (-1, 0.0)


@dataclass(eq=False)
class ModelSearch:
    """Model search over combinations of blocks and over kernels and amplitudes of a correlated model discrepancy.

    ``whitening`` is that without a discrepancy. ``log_prior`` are log prior odds of the blocks. ``exclusive`` pairs of
    blocks must not be together, nor those of which one contains the other. ``among`` is the number of kernels that
    share the prior of a discrepancy; ``kernels`` are those of them that are still searched.
    """

    linear: Linear
    whitening: Whitening
    kernels: Sequence[Kernel]
    log_prior: Sequence[float]
    exclusive: frozenset[frozenset[int]] = frozenset()
    among: int = 0
    stack: DesignMatrix | None = None
    searches: dict[Hyperparameters, Search] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Form the Gram matrix without a discrepancy, and decompose each kernel once for all amplitudes."""
        w = self.whitening
        self._stack = white_stack(self.stack or DesignMatrix.of(self.linear.columns), w)
        self._products, self._equations = self._stack.products(), self._stack.equations
        self._first = np.unique(self._stack.number, return_index=True)[1]
        plain = normal_equations(self.linear, w, self._products, self._equations)
        inside = contained(plain)
        self._pairs = inside | self.exclusive
        self._containers = frozenset(self._containing(plain, inside - self.exclusive))
        share = settings.SMOOTH_PRIOR if self.kernels or self.among else 0.0
        ends = np.cumsum([self.linear.frames.shape[2], *(len(block.sizes) for block in self.linear.blocks)])
        self._spans = [np.arange(a, b) for a, b in pairwise(ends)]
        self._log_evidences: dict[tuple[Hyperparameters, tuple[int, ...]], float] = {}
        self._combinations: dict[tuple[int, tuple[int, ...]], Combination] = {}
        self._priors = {PLAIN: float(np.log1p(-share))}
        self._out: frozenset[int] = frozenset()
        self._amplitudes: dict[int, float] = {}
        self._last: tuple[object, Array] = None, np.zeros((0, 0))
        self._spectra = [decomposed(kernel.over(w.relative), w.weights, w.noise) for kernel in self.kernels]
        # products with all columns are kept, but not those of per-pose kernels, which have too many
        both = zip(self.kernels, self._spectra, strict=True)
        self._projections = [None if kernel.grouped else spectrum.along(self._stack) for kernel, spectrum in both]
        if self.kernels:
            each = float(np.log(share / max(self.among, len(self.kernels)))) - float(np.log(len(settings.TAUS)))
            self._priors |= {(k, tau): each for k in range(len(self.kernels)) for tau in settings.TAUS}
        self.searches[PLAIN] = self._search(PLAIN, plain)

    def without(self, out: frozenset[int]) -> ModelSearch:
        """Copy of the search without some blocks; evaluations of the others stay in the memo."""
        found = copy(self)
        found._amplitudes = dict(self._amplitudes)
        found._log_evidences = {key: log for key, log in self._log_evidences.items() if not out & set(key[1])}
        found._combinations = {key: own for key, own in self._combinations.items() if not out & set(key[1])}
        found._out = self._out | out
        left = {hyper: search.without(out) for hyper, search in self.searches.items()}
        found.searches = {hyper: search for hyper, search in left.items() if search.seen or hyper == PLAIN}
        return found

    def without_columns(self) -> ModelSearch:
        """Copy without the stored design columns, to save memory; unchanged if a per-pose kernel still needs them."""
        if any(kernel.grouped for kernel in self.kernels):
            return self
        found = copy(self)
        found.stack, found._stack = None, replace(self._stack, different=())
        return found

    @staticmethod
    def _containing(plain: Gram, inside: frozenset[frozenset[int]]) -> Iterator[int]:
        """Yield the larger block of each nested pair whose smaller block the data see (information above a limit)."""
        for pair in inside:
            small, large = sorted(pair, key=lambda b: plain.ranks[b])
            own = plain.slices[small]
            if float(np.trace(plain.matrix[own, own])) > settings.CONTAINS:
                yield large

    def whitened_at(self, hyper: Hyperparameters) -> Whitening:
        """Whitening with a discrepancy of the given kernel and amplitude."""
        kernel, tau = hyper
        return (
            self.whitening
            if kernel < 0
            else replace(self.whitening, smooth=KernelCovariance(self._spectra[kernel], tau))
        )

    def search_at(self, hyper: Hyperparameters) -> Search:
        """Return the memoised search over blocks with one discrepancy in the rows' covariance."""
        if hyper not in self.searches:
            white, products = self.whitened_at(hyper), self._whitened_gram(hyper, np.arange(len(self._products)))
            plain = self.searches[PLAIN].gram
            self.searches[hyper] = self._search(
                hyper, normal_equations(self.linear, white, products, self._equations, like=plain)
            )
        return self.searches[hyper]

    def _search(self, hyper: Hyperparameters, problem: Gram) -> Search:
        offset = problem.offset + self._priors[hyper]
        found = Search(replace(problem, offset=offset), self.log_prior, self._pairs, self._containers)
        return found.without(self._out) if self._out else found

    def run(
        self, starts: Sequence[tuple[int, ...]] = (), *, detours: bool = True
    ) -> tuple[Hyperparameters, Combination]:
        """Hill climbing over combinations and discrepancies from several starts; return the best of both.

        With ``detours`` larger moves are tried, too.
        """
        first = self.search_at(PLAIN)
        allowed = dict.fromkeys([*(s for s in starts if first.allowed(s)), ()])
        begin = sorted((first.evaluate(s) for s in allowed), key=lambda c: -c.log_evidence)
        hyper, best = PLAIN, first.climb(begin[0].blocks)
        seeds = [c.blocks for c in begin[: settings.STARTS]]
        while True:
            tried = dict.fromkeys([best.blocks, *seeds])
            found = [(*self._best_amplitude(k, blocks), blocks) for k in range(len(self.kernels)) for blocks in tried]
            seeds = []
            other = max(found, key=lambda item: item[1], default=(hyper, -np.inf, ()))
            nearby = self._climbed(other, best) or self._beside_others(best)
            nearby = nearby or (self._larger_moves(hyper, best) if detours else None)
            if nearby is None:
                return hyper, best
            hyper, best = nearby

    def _climbed(
        self, found: tuple[Hyperparameters, float, tuple[int, ...]], best: Combination
    ) -> tuple[Hyperparameters, Combination] | None:
        """Hill climbing from an amplitude with more evidence than the best; return an improvement, if any."""
        hyper, promised, blocks = found
        return self._better(hyper, blocks, best) if promised > best.log_evidence + settings.BETTER else None

    def _better(
        self, hyper: Hyperparameters, blocks: tuple[int, ...], best: Combination
    ) -> tuple[Hyperparameters, Combination] | None:
        nearby = self.search_at(hyper).climb(blocks)
        return (hyper, nearby) if nearby.log_evidence > best.log_evidence + settings.BETTER else None

    def _larger_moves(self, hyper: Hyperparameters, best: Combination) -> tuple[Hyperparameters, Combination] | None:
        """Hill climbing with larger moves at a fixed discrepancy; return an improvement, if any."""
        found = self.search_at(hyper).run(best.blocks)
        return (hyper, found) if found.log_evidence > best.log_evidence + settings.BETTER else None

    def _best_amplitude(self, kernel: int, blocks: tuple[int, ...]) -> tuple[Hyperparameters, float]:
        """Most probable amplitude of a kernel for one combination, taken as unimodal, and the log evidence there."""
        k = settings.TAUS.index(self._amplitudes.get(kernel, 1.0))
        best = self._log_evidence((kernel, settings.TAUS[k]), blocks)
        for step in settings.TAU_STEPS:
            for sign in (step, -step):
                while 0 <= k + sign < len(settings.TAUS):
                    other = self._log_evidence((kernel, settings.TAUS[k + sign]), blocks)
                    if other <= best:
                        break
                    k, best = k + sign, other
        self._amplitudes[kernel] = settings.TAUS[k]
        return (kernel, settings.TAUS[k]), best

    def _log_evidence(self, hyper: Hyperparameters, blocks: tuple[int, ...]) -> float:
        """Log evidence of one combination with one discrepancy, memoised; −∞ where rounding errors dominate."""
        key = hyper, tuple(sorted(blocks))
        if key not in self._log_evidences:
            flat, white = self.linear.frames.shape[2], self.whitened_at(hyper)
            picked = np.concatenate([np.arange(flat), *(self._spans[b] for b in key[1]), [len(self._products) - 1]])
            problem = normal_equations(
                Linear(self.linear.gap, self.linear.frames, tuple(self.linear.blocks[b] for b in key[1])),
                white,
                self._whitened_gram(hyper, picked.astype(int)),
                self._equations,
                like=self.searches[PLAIN].gram.some(key[1]),
            )
            prior = self._priors[hyper] + sum(self.log_prior[b] for b in key[1])
            try:
                found = evidence(problem, tuple(range(len(blocks))), prior, self._warm_start(hyper[0], key[1]))
                self._combinations[hyper[0], key[1]], self._log_evidences[key] = found, found.log_evidence
            except EstimationError:  # what so large a discrepancy leaves is rounding
                self._log_evidences[key] = -np.inf
        return self._log_evidences[key]

    def _warm_start(self, kernel: int, blocks: tuple[int, ...]) -> Combination | None:
        """Warm start: the combination with the last amplitude, or else without a discrepancy; ``None`` if unknown."""
        if (kernel, blocks) in self._combinations:
            return self._combinations[kernel, blocks]
        known = self.searches[PLAIN].seen.get(blocks)
        return known and replace(known, scales={k: known.scales.get(b, 1.0) for k, b in enumerate(blocks)})

    def _whitened_gram(self, hyper: Hyperparameters, picked: NDArray[np.int64]) -> Array:
        """Gram matrix of some columns, whitened with a discrepancy."""
        kept, number = np.unique(self._stack.number[picked], return_inverse=True)
        plain = self._products[np.ix_(self._first[kept], self._first[kept])]
        covariance = KernelCovariance(self._spectra[hyper[0]], hyper[1])
        found = covariance.reduced(plain, self._projected(hyper[0], kept))
        return np.asarray(found[np.ix_(number, number)])

    def _projected(self, kernel: int, kept: NDArray[np.int64]) -> Array:
        """Products BᵀS of a kernel's factor B with distinct columns S; the last are kept for its next amplitude."""
        known = self._projections[kernel]
        if known is not None:
            return known[:, kept]
        key = self._spectra[kernel], kept.tobytes()
        if self._last[0] != key:  # one after another its sizes are tried
            self._last = key, self._spectra[kernel].along(self._stack.some_columns(kept))
        return self._last[1]

    def likeliest_joints(self) -> Kernel | None:
        """Kernel of joint scatter with the most evidence over all combinations and amplitudes; ``None`` without any."""
        asked = [(log, k) for ((k, _), _), log in self._log_evidences.items() if k >= 0 and self.kernels[k].joints]
        return self.kernels[max(asked)[1]] if asked else None

    def plausible_kernels(self, best: Combination) -> tuple[Kernel, ...]:
        """Kernels whose log evidence, at their best amplitude, is at most :data:`settings.KERNEL_REACH` below the best.

        A kernel whose best amplitude is the smallest of the grid is noise, and is left out.
        """
        least, near = best.log_evidence - settings.KERNEL_REACH, self._peaks(best)
        kept = [k for log, tau, k in near.values() if tau > settings.TAUS[0] and log > least]
        return tuple(self.kernels[k] for k in sorted(kept))

    def _peaks(self, best: Combination) -> dict[str, tuple[float, float, int]]:
        """Largest log evidence of each kernel, by name, with the best combination; with its amplitude and its number.

        The maximum is over amplitudes and over the relative sizes of joints.
        """
        peaks: dict[str, tuple[float, float, int]] = {}
        for ((kernel, tau), blocks), log in self._log_evidences.items():
            if blocks == best.blocks and kernel >= 0:
                name = self.kernels[kernel].name
                peaks[name] = max(peaks.get(name, (-np.inf, 0.0, -1)), (log, tau, kernel))
        return peaks

    def _beside_others(self, best: Combination) -> tuple[Hyperparameters, Combination] | None:
        """Evaluate the best combination's neighbours with each plausible discrepancy; return an improvement, if any."""
        likeliest = {kernel for _, _, kernel in self._peaks(best).values()}
        asked = [(r, log) for (r, blocks), log in self._log_evidences.items() if blocks == best.blocks]
        near = [r for r, log in asked if r[0] in likeliest and self._is_near(log, best)]
        for other in dict.fromkeys((PLAIN, *near)):
            if self._is_near(self.search_at(other).evaluate(best.blocks).log_evidence, best):
                nearby = self.search_at(other).evaluate_neighbours(best.blocks)
                if nearby.log_evidence > best.log_evidence + settings.BETTER:
                    return self._better(other, nearby.blocks, best)
        return None

    @staticmethod
    def _is_near(log_evidence: float, best: Combination) -> bool:
        return log_evidence > best.log_evidence - settings.AMPLITUDE_REACH

    def evaluate_pairs(self, hyper: Hyperparameters, best: Combination) -> None:
        """Evaluate pairs of changes of the best combination of which each alone is uncertain.

        Two uncertain effects that are independent may both be at work; without such pairs each would lower the
        probability of the other.
        """
        search = self.search_at(hyper)
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

    def consensus(self, families: Sequence[str]) -> tuple[Hyperparameters, Combination]:
        """Best combination of the most probable set of effects, summed over settings and discrepancies."""
        compared, probabilities = self.probabilities()
        mass: dict[frozenset[str], float] = {}
        for combination, p in zip(compared, probabilities, strict=True):
            names = frozenset(families[b] for b in combination.blocks)
            mass[names] = mass.get(names, 0.0) + float(p)
        chosen = max(mass, key=lambda names: mass[names])
        held = [
            (hyper, c)
            for hyper, search in self.searches.items()
            for c in search.seen.values()
            if frozenset(families[b] for b in c.blocks) == chosen
        ]
        hyper, best = max(held, key=lambda item: item[1].log_evidence)
        return hyper, self.search_at(hyper).evaluate(best.blocks)

    def probabilities(self) -> tuple[list[Combination], Array]:
        """Posterior probability of each combination with each discrepancy, normalised over all, most probable first."""
        masses = [(mass, c) for own in self._log_masses().values() for mass, c in own]
        masses.sort(key=lambda item: -item[0])
        weight = np.exp(np.array([mass for mass, _ in masses]) - masses[0][0])
        return [c for _, c in masses], weight / weight.sum()

    def kernel_probabilities(self) -> dict[str, float]:
        """Posterior probability of each kernel by its name; under the empty name that of no discrepancy."""
        held = {hyper: np.array([mass for mass, _ in own]) for hyper, own in self._log_masses().items()}
        top = max(own.max() for own in held.values())
        mass: dict[str, float] = {}
        for hyper, own in held.items():
            name = self.kernels[hyper[0]].name if hyper[0] >= 0 else ""
            mass[name] = mass.get(name, 0.0) + float(np.exp(own - top).sum())
        return {name: m / sum(mass.values()) for name, m in mass.items()}

    def _log_masses(self) -> dict[Hyperparameters, list[tuple[float, Combination]]]:
        """Log evidence of all combinations for each discrepancy, plus the log of the number of its amplitudes.

        It counts for the amplitudes of the grid that are nearest to it, as only some of them are computed.
        """
        seen = {hyper: list(search.seen.values()) for hyper, search in self.searches.items()}
        best = max((c for own in seen.values() for c in own), key=lambda c: c.log_evidence)
        computed: dict[int, list[int]] = {}
        for (kernel, tau), blocks in self._log_evidences:
            if blocks == best.blocks and kernel >= 0:
                computed.setdefault(kernel, []).append(settings.TAUS.index(tau))
        stands = {PLAIN: 0.0}
        for kernel, sizes in computed.items():
            sizes.sort()
            between = [0.5 * (a + b) for a, b in pairwise(sizes)]
            ends = [sizes[0] - 0.5, *between, sizes[-1] + 0.5]
            for k, (a, b) in zip(sizes, pairwise(ends), strict=True):
                stands[kernel, settings.TAUS[k]] = float(np.log(b - a))
        return {hyper: [(c.log_evidence + stands.get(hyper, 0.0), c) for c in own] for hyper, own in seen.items()}


@dataclass(frozen=True)
class Discrepancy:
    """Posterior of a correlated discrepancy: the probability of any, and of each kernel by its name.

    Beside the best combination: ``kernel`` and ``tau``, its rms over the noise (``None`` and 0 where there is none),
    and ``noise`` in units of the whitening noise.
    """

    kernel: Kernel | None
    tau: float
    probability: float
    kernels: Mapping[str, float]
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
    kernels: Sequence[Kernel]
    searched: _Iteration | None = None

    def without(self, out: Sequence[int]) -> Explanation:
        """Best explanation without some blocks, at the same weights, from memoised evidences."""
        if self.searched is None:
            raise ValueError("what was weighed for this explanation is no longer known")
        return self.searched.without(frozenset(out)).explanation(self.outliers)

    def block_of(self, effect: Effect) -> int:
        """Return the number of that block of the best combination which is a setting of the given effect."""
        return next(b for b in self.best.blocks if self.linear.blocks[b].effect.name == effect.name)

    def held(self, block: int) -> Array:
        """Prior standard deviations (P,) of a block's parameters, SI; next to 0 for those held at zero."""
        item = self.linear.blocks[block]
        return item.sizes * self.best.scales[block] * item.kept(self.values[block][0])

    def probability(self, blocks: Sequence[int]) -> float:
        """Posterior probability that any of the blocks is in the model."""
        held = [bool(set(c.blocks) & set(blocks)) for c in self.combinations]
        return total_probability(self.probabilities[held])


def explain(
    linear: Linear,
    noise: Noise,
    *,
    families: Sequence[str] = (),
    starts: Sequence[Sequence[int]] = (),
    before: Explanation | None = None,
    kernels: Sequence[Kernel] = (),
    log_prior: Sequence[float] | None = None,
) -> Explanation:
    """Bayesian model selection of blocks together with outliers, noise and a correlated discrepancy.

    Robust: rows at a squared distance beyond a χ² limit are set aside, those in the tail weigh less (Huber). Blocks of
    one family are settings that exclude each other and share its prior probability. The search starts from ``starts``.
    With an explanation of a similar problem ``before``, its weights, noise and plausible kernels are reused; if the
    first of the starts is found again with the same kernel, the iteration ends. ``log_prior`` is by default that of the
    blocks' effects.
    """
    aside = np.zeros(len(linear.gap), dtype=bool) if before is None else before.outliers
    families = families or [str(k) for k in range(len(linear.blocks))]
    log_prior = log_priors([b.effect for b in linear.blocks]) if log_prior is None else log_prior
    inputs = _Inputs(
        linear, families, log_prior, exclusive_settings(families), len(kernels), DesignMatrix.of(linear.columns)
    )
    seeds = [tuple(sorted(start)) for start in starts]
    first, history = before is None, list[tuple[object, ...]]()
    beside: Sequence[Kernel] = ()
    if before is None:
        # effects that are far off, and gross errors, are settled first, beside a noise that is free
        whitening = first_whitening(linear, noise)
    else:
        whitening, alive = replace(before.whitening, smooth=None), {kernel.name for kernel in before.kernels}
        beside, kernel = [kernel for kernel in kernels if kernel.name in alive], before.discrepancy.kernel
        beside += [kernel for kernel in before.kernels if kernel.further]
        history += [_state(seed, kernel, whitening) for seed in seeds[:1]]

    def settled(found: _Iteration) -> bool:
        return bool(history) and (found.state in history or len(history) >= settings.FIRST_ROUNDS)

    while True:
        found = _Iteration.of(inputs, whitening, beside, seeds)
        if settled(found):
            found = found.without(frozenset())  # weights stay: only now is it worth to look for what steps miss
            if settled(found):
                return found.explanation(aside)
        history.append(found.state)
        whitening, aside = reweigh(found.rough_residual, noise, found.leverage, linear.measures)
        seeds = [found.best.blocks]
        beside = kernels if first else found.next_kernels(kernels)
        first = False
        del found  # before the next one takes as much memory


def _state(blocks: tuple[int, ...], kernel: Kernel | None, whitening: Whitening) -> tuple[object, ...]:
    """Key of an iteration, to detect convergence: blocks, kernel of the discrepancy, and rows in use."""
    return blocks, kernel and kernel.name, np.packbits(whitening.weights > 0).tobytes()


@dataclass(frozen=True, eq=False)
class _Inputs:
    """Inputs of :func:`explain` that are the same in all iterations; ``rivals`` are blocks that exclude each other."""

    linear: Linear
    families: Sequence[str]
    log_prior: Sequence[float]
    rivals: frozenset[frozenset[int]]
    kernels: int
    stack: DesignMatrix | None


@dataclass(frozen=True, eq=False)
class _Iteration:
    """One model search at fixed weights: best combination, its discrepancy with posterior mean, and its residual."""

    inputs: _Inputs
    models: ModelSearch
    hyper: Hyperparameters
    best: Combination
    remainder: Array
    smooth: Array

    @classmethod
    def of(
        cls, inputs: _Inputs, whitening: Whitening, beside: Sequence[Kernel], seeds: Sequence[tuple[int, ...]]
    ) -> _Iteration:
        models = ModelSearch(
            inputs.linear, whitening, beside, inputs.log_prior, inputs.rivals, inputs.kernels, inputs.stack
        )
        return cls._searched(inputs, models, seeds, detours=False)

    def without(self, out: frozenset[int]) -> _Iteration:
        """Repeat the search without some blocks, started from the best combination without them."""
        return self._searched(
            self.inputs, self.models.without(out), [tuple(b for b in self.best.blocks if b not in out)]
        )

    @classmethod
    def _searched(
        cls, inputs: _Inputs, models: ModelSearch, seeds: Sequence[tuple[int, ...]], *, detours: bool = True
    ) -> _Iteration:
        models.run(seeds, detours=detours)
        hyper, best = models.consensus(inputs.families)
        white = models.whitened_at(hyper)
        remainder = residual_of(
            inputs.linear, white, parameter_values(inputs.linear, models.search_at(hyper).gram, best)
        )
        return cls(inputs, models, hyper, best, remainder, discrepancy_mean(white, remainder))

    @property
    def kernel(self) -> Kernel | None:
        return self.models.kernels[self.hyper[0]] if self.hyper[0] >= 0 else None

    def next_kernels(self, kernels: Sequence[Kernel]) -> Sequence[Kernel]:
        """Forward selection of scattering joints: plausible kernels, and the likeliest joint scatter plus one joint."""
        likely, known = self.models.plausible_kernels(self.best), {kernel.name for kernel in self.models.kernels}
        own = self.models.likeliest_joints() if self.kernel and self.kernel.grouped else None
        more = own.with_one_more(kernels) if own else []
        return [*likely, *(wider for wider in more if wider.name not in known)]

    @property
    def state(self) -> tuple[object, ...]:
        return _state(self.best.blocks, self.kernel, self.models.whitening)

    @property
    def rough_residual(self) -> Array:
        """Residual (N, m) less a smooth discrepancy; a per-pose discrepancy is not subtracted."""
        return self.remainder if self.kernel is None or self.kernel.grouped else self.remainder - self.smooth

    @property
    def leverage(self) -> float:
        """Share of the equations fitted by effects, frames and a smooth discrepancy."""
        flat, smooth = self.inputs.linear.frames.shape[2], self.models.whitened_at(self.hyper).smooth
        followed = self.best.effective + flat
        if smooth is not None and self.kernel is not None and not self.kernel.grouped:
            followed += smooth.degrees
        equations = self.models.search_at(self.hyper).gram.equations + flat
        return float(min(followed / max(equations, 1), settings.MOST_LEVERAGE))

    def explanation(self, aside: NDArray[np.bool_]) -> Explanation:
        """Build the explanation at this iteration's best combination: values, residual, probabilities.

        Settings and values are those of the best correction: with a smooth discrepancy, which no correction contains,
        the effects are refitted without it, at a noise that includes it.
        """
        linear, models = self.inputs.linear, self.models
        hyper = self.hyper if self.kernel is None or self.kernel.grouped else PLAIN
        search, white = models.search_at(hyper), models.whitened_at(hyper)
        best = (
            search.evaluate(self.best.blocks)
            if hyper == self.hyper
            else search.set_best(self.best.blocks, self.inputs.families)
        )
        values = parameter_values(linear, search.gram, best)
        models.evaluate_pairs(self.hyper, self.best)
        compared, probabilities = models.probabilities()
        odds = models.kernel_probabilities()
        return Explanation(
            linear,
            white,
            search.gram,
            best,
            compared,
            probabilities,
            values,
            residual_of(linear, white, values),
            self.smooth,
            aside,
            Discrepancy(self.kernel, self.hyper[1], 1.0 - odds.get("", 0.0), odds, self.best.noise),
            models.plausible_kernels(self.best),
            replace(self, inputs=replace(self.inputs, stack=None), models=models.without_columns()),
        )


def log_odds() -> float:
    """Log prior odds of one effect."""
    return float(np.log(settings.PRIOR_PROBABILITY / (1.0 - settings.PRIOR_PROBABILITY)))


def exclusive_settings(families: Sequence[str]) -> frozenset[frozenset[int]]:
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
    """Prior probability, given an effect, that it acts in exactly one set of ``count`` places of ``among``.

    With a count of 0 it is that of acting in all; without places 1.
    """
    return settings.IN_ALL * settings.ONE_MORE ** max(count - 1, 0) / comb(max(among, count), count) if among else 1.0


def residual_of(linear: Linear, whitening: Whitening, values: dict[int, tuple[Array, Array]]) -> Array:
    """Residual (N, m): gap less effects at given values, and less the unknown frames fitted to the rest."""
    moved = (linear.contribution(b, mean) for b, (mean, _) in values.items())
    left = linear.gap - sum(moved, np.zeros_like(linear.gap))
    return np.asarray(left - linear.frames @ frame_step(linear, whitening, left))
