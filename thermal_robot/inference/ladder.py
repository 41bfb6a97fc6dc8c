"""One evidence: combinations of effects, searched beside every size and form of a discrepancy, and summed over them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from thermal_robot.inference import settings
from thermal_robot.inference.discrepancy import Form, Spectrum
from thermal_robot.inference.evidence import Combination, Gram, Search
from thermal_robot.inference.problem import Linear, Whitening, contained, normal_equations, whitened

Array = NDArray[np.float64]
Rung = tuple[int, float]
"""Number of the form and τ; (−1, 0) where there is no discrepancy."""
PLAIN: Rung = (-1, 0.0)


@dataclass(eq=False)
class Ladder:
    """Evaluates combinations of blocks beside discrepancies of several forms and sizes.

    Parameters
    ----------
    linear, whitening
        The problem; its whitening without a discrepancy.
    forms
        Of the discrepancy; none where none is to be considered.
    log_prior
        Log prior odds of each block.
    exclusive
        Pairs of blocks that must not be together, beside those of which one contains the other.
    """

    linear: Linear
    whitening: Whitening
    forms: Sequence[Form]
    log_prior: Sequence[float]
    exclusive: frozenset[frozenset[int]] = frozenset()
    searches: dict[Rung, Search] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Decompose the forms once for all sizes."""
        w = self.whitening
        stack = whitened(self.linear, w)
        self._products, self._equations = stack.T @ stack, len(stack)
        self._spectra = [Spectrum.of(form, w.weights, w.noise) for form in self.forms]
        self._along = [spectrum.basis.T @ stack for spectrum in self._spectra]
        plain = normal_equations(self.linear, w, self._products, self._equations)
        self._pairs = contained(plain) | self.exclusive
        share = settings.SMOOTH_PRIOR if self.forms else 0.0
        each = max(len(self.forms) * len(settings.TAUS), 1)
        self._priors = {PLAIN: float(np.log1p(-share))}
        for k in range(len(self.forms)):
            self._priors |= {(k, tau): float(np.log(share / each)) for tau in settings.TAUS}
        self.searches[PLAIN] = self._search(PLAIN, plain)

    def whitened_at(self, rung: Rung) -> Whitening:
        """Return the whitening with the discrepancy of a rung."""
        form, tau = rung
        return self.whitening if form < 0 else replace(self.whitening, smooth=self._spectra[form].at(tau))

    def at(self, rung: Rung) -> Search:
        """Return the search beside one discrepancy, made once."""
        if rung not in self.searches:
            along, white = self._along[rung[0]], self.whitened_at(rung)
            assert white.smooth is not None
            taken = white.smooth.variance / (1.0 + white.smooth.variance)
            products = self._products - along.T @ (taken[:, None] * along)
            plain = self.searches[PLAIN].gram
            self.searches[rung] = self._search(
                rung, normal_equations(self.linear, white, products, self._equations, like=plain)
            )
        return self.searches[rung]

    def _search(self, rung: Rung, problem: Gram) -> Search:
        offset = problem.offset + self._priors[rung]
        return Search(replace(problem, offset=offset), self.log_prior, self._pairs)

    def run(self, starts: Sequence[tuple[int, ...]] = ()) -> tuple[Rung, Combination]:
        """Climb over combinations and discrepancies until neither betters the other, from the best of several starts."""
        first = self.at(PLAIN)
        allowed = dict.fromkeys([*(s for s in starts if first.allowed(s)), ()])
        begin = max((first.evaluate(s) for s in allowed), key=lambda c: c.log_evidence)
        rung, best = PLAIN, first.run(begin.blocks)
        seeds = list(allowed)
        while True:
            tried = dict.fromkeys([best.blocks, *seeds])
            found = [self._size(k, blocks) for k in range(len(self.forms)) for blocks in tried]
            seeds = []
            other = max(found, key=lambda item: item[1].log_evidence, default=(rung, best))
            if other[1].log_evidence > best.log_evidence + settings.BETTER:
                rung, best = other[0], self.at(other[0]).run(other[1].blocks)
                continue
            nearby = self._beside_others(best)
            if nearby is None:
                return rung, best
            rung, best = nearby

    def _size(self, form: int, blocks: tuple[int, ...]) -> tuple[Rung, Combination]:
        """Return the most probable size of a form beside one combination; its evidence has one peak."""
        k = settings.TAUS.index(1.0)
        step, seen = 1, {k: self.at((form, settings.TAUS[k])).evaluate(blocks)}
        for _ in range(2):
            while 0 <= k + step < len(settings.TAUS):
                seen[k + step] = self.at((form, settings.TAUS[k + step])).evaluate(blocks)
                if seen[k + step].log_evidence < seen[k].log_evidence:
                    break
                k += step
            step = -step
        return (form, settings.TAUS[k]), seen[k]

    def _beside_others(self, best: Combination) -> tuple[Rung, Combination] | None:
        """Weigh the neighbours beside all discrepancies that count; return what is better than the best, if any is."""
        for other, search in list(self.searches.items()):
            own = search.seen.get(best.blocks)
            if own is not None and own.log_evidence > best.log_evidence - settings.RUNG_REACH:
                nearby = search.run(best.blocks)
                if nearby.log_evidence > best.log_evidence + settings.BETTER:
                    return other, nearby
        return None

    def probabilities(self) -> tuple[list[Combination], Array]:
        """Return all combinations seen beside all discrepancies, most probable first, with their probabilities."""
        seen = [c for search in self.searches.values() for c in search.seen.values()]
        order = sorted(seen, key=lambda c: -c.log_evidence)
        log = np.array([c.log_evidence for c in order])
        weight = np.exp(log - log[0])
        return order, weight / weight.sum()

    def discrepancy(self) -> float:
        """Posterior probability that there is a discrepancy."""
        log = {r: [c.log_evidence for c in s.seen.values()] for r, s in self.searches.items()}
        top = max(max(values) for values in log.values())
        mass = {r: float(np.exp(np.array(values) - top).sum()) for r, values in log.items()}
        return 1.0 - mass[PLAIN] / sum(mass.values())
