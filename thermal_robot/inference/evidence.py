"""Which combination of effects the data speak for: marginal likelihoods from one Gram matrix.

The whitened gap is y = F f + Σ_b X_b θ_b + e, with flat frames f, e ~ N(0, s²), and θ_b ~ N(0, λ_b² size²) for the
blocks that are in the combination. F is projected out first. For a combination γ

    log p(y | γ) = −½ [ n log s² + log|I + Λ G/s²| + (y'y − b'(G + s²Λ⁻¹)⁻¹ b)/s² ] + log p(s) + log p(λ),

with G = X'X and b = X'y restricted to γ. Noise s and scales λ_b are found at their most probable values, s by MacKay's
fixed point (*Neural Computation* 4, 1992), ln λ_b by Newton's steps; their priors are scaled inverse chi-square about
the stated noise, and log-normal about the stated sizes;
ln λ is integrated out by Laplace's method, s held.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dpotrf, dpotri

from thermal_robot.errors import EstimationError
from thermal_robot.inference import settings
from thermal_robot.inference.gram import Gram

Array = NDArray[np.float64]
UNDETERMINED = "the measurements do not determine anything: too few, or all alike"


@dataclass(frozen=True, eq=False)
class Combination:
    """One combination of blocks, its scales at their most probable values.

    Attributes
    ----------
    blocks
        Numbers of the blocks that are in.
    log_evidence
        Log marginal likelihood with log prior odds.
    noise
        s, in units of the whitening noise.
    scales
        λ of each block.
    values
        Posterior mean of the reduced columns, block after block.
    covariance
        Their posterior covariance.
    effective
        How many parameters the data determine.
    exact
        Whether all scales are at their most probable values; else those of one block alone, and there are no values.
    """

    blocks: tuple[int, ...]
    log_evidence: float
    noise: float
    scales: dict[int, float]
    values: Array
    covariance: Array
    effective: float
    exact: bool = True


@dataclass(eq=False)
class Search:
    """Evaluates combinations, each once, and keeps them all.

    Parameters
    ----------
    gram
        The problem.
    log_prior
        Log prior odds of each block.
    exclusive
        Pairs of blocks that must not be together.
    """

    gram: Gram
    log_prior: Sequence[float]
    exclusive: frozenset[frozenset[int]] = frozenset()
    seen: dict[tuple[int, ...], Combination] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """List what each block excludes."""
        self._apart: dict[int, set[int]] = {}
        self._expanded: set[tuple[int, ...]] = set()
        for a, b in self.exclusive:
            self._apart.setdefault(a, set()).add(b)
            self._apart.setdefault(b, set()).add(a)

    def allowed(self, blocks: Sequence[int]) -> bool:
        """Tell whether no two of the blocks exclude each other."""
        whole = set(blocks)
        return not any(self._apart.get(b, whole - whole) & whole for b in blocks)

    def evaluate(self, blocks: Sequence[int], start: Combination | None = None) -> Combination:
        """Return the combination's evidence, computed once."""
        key = tuple(sorted(blocks))
        known = self.seen.get(key)
        if known is None or not known.exact:
            self.seen[key] = self._computed(key, known or start)
        return self.seen[key]

    def _computed(self, key: tuple[int, ...], start: Combination | None) -> Combination:
        try:
            return evidence(self.gram, key, sum(self.log_prior[b] for b in key), start)
        except EstimationError:
            if not key:
                raise
            # rounding hides what blocks so nearly alike bring
            return replace(self.evaluate(()), blocks=key, log_evidence=-np.inf)

    def run(self, start: Sequence[int] = ()) -> Combination:
        """Climb from a combination by adding, dropping and swapping blocks until nothing is better.

        Every neighbour of the best combination is weighed, so that its probability is against all of them.
        """
        best = self._climb(start, frozenset())
        large = {b for pair in self.exclusive for b in pair if self._width(b) == max(map(self._width, pair))}
        if large & set(best.blocks):
            # several smaller effects may suffice where one that contains them all came first
            best = max(best, self._climb((), frozenset(large)), key=lambda c: c.log_evidence)
            best = self._climb(best.blocks, frozenset())
        while (missed := self._missed(best) or self._simpler(best) or self._beside_a_tie(best)) is not None:
            best = self._climb(missed.blocks, frozenset())
        return best

    def _beside_a_tie(self, best: Combination) -> Combination | None:
        """Weigh the neighbours of what is nearly as probable as the best, too; return what is better, if any is.

        Two effects that stand in for two others are told only so: with one of them exchanged there is little to choose.
        """
        near = [c for c in self.seen.values() if c.exact and self._near(c, best) and c.blocks != best.blocks]
        near = [c for c in near if len(c.blocks) == len(best.blocks)]
        for tie in sorted(near, key=lambda c: -c.log_evidence)[: settings.TIES]:
            if tie.blocks in self._expanded:
                continue
            self._expanded.add(tie.blocks)
            found = max((self.evaluate(c.blocks, tie) for c in self._promising(tie)), key=lambda c: c.log_evidence)
            if found.log_evidence > best.log_evidence + settings.BETTER:
                return found
        return None

    def _simpler(self, best: Combination) -> Combination | None:
        """Let another setting of one block stand in for a further block; return what is better, if any is.

        A setting that does more, such as in one joint more, is worth its price only once what it replaces is gone.
        """
        whole = set(best.blocks)
        for seen in list(self.seen.values()):
            (gone, new) = (whole - set(seen.blocks), set(seen.blocks) - whole)
            near = seen.log_evidence > best.log_evidence - settings.DETOUR
            if not (near and len(gone) == len(new) == 1 and new & self._apart.get(min(gone), set())):
                continue
            for other in set(seen.blocks) - new:
                found = self.evaluate([b for b in seen.blocks if b != other], best)
                if found.log_evidence > best.log_evidence + settings.BETTER:
                    return found
        return None

    def _missed(self, best: Combination) -> Combination | None:
        """Compute exactly what was weighed on the way and comes near the best; return one that is better, if any is."""
        near = [c.blocks for c in self.seen.values() if not c.exact and self._near(c, best)]
        found = max((self.evaluate(blocks) for blocks in near), key=lambda c: c.log_evidence, default=best)
        return found if found.log_evidence > best.log_evidence + settings.BETTER else None

    @staticmethod
    def _near(one: Combination, best: Combination) -> bool:
        return one.log_evidence > best.log_evidence - settings.NEARLY

    def _width(self, block: int) -> int:
        return int(self.gram.slices[block].stop - self.gram.slices[block].start)

    def _climb(self, start: Sequence[int], barred: frozenset[int]) -> Combination:
        best = max(self.evaluate(()), self.evaluate(start), key=lambda c: c.log_evidence)
        while True:
            close = [c.blocks for c in self._promising(best, barred)]
            better = best
            for k in range(0, len(close), settings.AT_ONCE):
                some = (self.evaluate(blocks, best) for blocks in close[k : k + settings.AT_ONCE])
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
        without = [self.evaluate([c for c in best.blocks if c != b], best) for b in best.blocks]
        bases = [c for c in (best, *without) if np.isfinite(c.log_evidence)]
        found: dict[tuple[int, ...], Combination] = {c.blocks: c for c in without if self._near(c, best)}
        for base in bases:
            added = [c for c in self._with_one_more(base, best) if not barred & set(c.blocks)]
            added.sort(key=lambda c: -c.log_evidence)
            found |= {c.blocks: c for k, c in enumerate(added) if k == 0 or self._near(c, best)}
        return sorted(found.values(), key=lambda c: -c.log_evidence)

    def _with_one_more(self, base: Combination, best: Combination) -> list[Combination]:
        others = [b for b in range(len(self.gram.slices)) if b not in best.blocks]
        keys = {b: tuple(sorted((*base.blocks, b))) for b in others}
        barred = set().union(*(self._apart.get(b, ()) for b in base.blocks))
        new = [b for b in others if b not in barred and keys[b] not in self.seen]
        for b, gain, scale in _gains(self.gram, base, new):
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

    def probabilities(self) -> tuple[list[Combination], Array]:
        """Return the combinations seen, most probable first, with their posterior probabilities."""
        order = sorted(self.seen.values(), key=lambda c: -c.log_evidence)
        log = np.array([c.log_evidence for c in order])
        weight = np.exp(log - log[0])
        return order, weight / weight.sum()


def _gains(gram: Gram, base: Combination, blocks: Sequence[int]) -> list[tuple[int, float, float]]:
    """Return for each block what adding it gains in log evidence, its scale integrated out, and its best scale.

    Scales of the others stay. In the eigenvectors of the block's own information beside the others, w, with the vector
    c there, and with the noise s'² that it leaves,

        (n + ν) s'² = ν + Q − Σ c² λ²/(s'² + λ² w) ,
        gain(λ) = −½ Σ log(1 + λ² w/s'²) − ½ (n + ν) log(s'²/s₀²) ,

    Q = y'y − b'θ, and s₀ the same without the block.
    """
    spans = [np.arange(gram.slices[b].start, gram.slices[b].stop) for b in base.blocks]
    used = np.concatenate([*spans, np.zeros(0, dtype=int)])
    variance = base.noise**2
    left = gram.vector - gram.matrix[:, used] @ base.values
    log_scale = np.array(settings.SCALE_GRID)
    square = np.exp(2.0 * log_scale)[:, None]
    prior = -0.5 * (log_scale / settings.SIZE_SPREAD) ** 2
    norm = np.log((log_scale[1] - log_scale[0]) / (np.sqrt(2.0 * np.pi) * settings.SIZE_SPREAD))
    freedom = gram.equations + gram.noise_dof
    rest = (gram.noise_dof + gram.total - float(gram.vector[used] @ base.values)) / freedom
    rest = max(rest, settings.LEAST_VARIANCE * variance)
    result = []
    for alike in _by_width(gram, blocks):
        own = np.array([np.arange(gram.slices[b].start, gram.slices[b].stop) for b in alike])
        cross = gram.matrix[own[:, :, None], used]
        inside = gram.matrix[own[:, :, None], own[:, None, :]]
        value, vector = np.linalg.eigh(inside - cross @ (base.covariance / variance) @ cross.transpose(0, 2, 1))
        value = np.maximum(value, 0.0)[:, None, :]
        along = ((vector.transpose(0, 2, 1) @ left[own][:, :, None])[:, :, 0] ** 2)[:, None, :]
        left_over = np.full((len(alike), len(log_scale)), rest)
        for _ in range(settings.NOISE_ROUNDS):
            taken = (along * square / (left_over[:, :, None] + square * value)).sum(axis=2) / freedom
            left_over = np.maximum(rest - taken, settings.LEAST_VARIANCE * rest)
        log = -0.5 * np.log1p(square * value / left_over[:, :, None]).sum(axis=2) + prior
        log -= 0.5 * freedom * np.log(left_over / rest)
        top = log.max(axis=1)
        gain = top + np.log(np.exp(log - top[:, None]).sum(axis=1)) + norm
        result += list(zip(alike, gain.tolist(), np.exp(log_scale[log.argmax(axis=1)]).tolist(), strict=True))
    return result


def _by_width(gram: Gram, blocks: Sequence[int]) -> list[list[int]]:
    widths: dict[int, list[int]] = {}
    for b in blocks:
        widths.setdefault(gram.slices[b].stop - gram.slices[b].start, []).append(b)
    return list(widths.values())


@dataclass(eq=False)
class _Posterior:
    """Parameters of one combination at given scales and noise.

    Attributes
    ----------
    values, covariance
        Posterior mean and covariance.
    log_det
        log|I + Λ G/s²|.
    fitted, determined
        Per block: |θ|²/λ², and how many of its columns the data determine.
    """

    values: Array
    covariance: Array
    log_det: float
    fitted: Array
    determined: Array

    @classmethod
    def at(cls, matrix: Array, vector: Array, owner: NDArray[np.int64], scale: Array, variance: float) -> _Posterior:
        """Solve (G/s² + Λ⁻¹) θ = b/s²."""
        size = len(vector)
        if not size:
            return cls(np.zeros(0), np.zeros((0, 0)), 0.0, np.zeros(len(scale)), np.zeros(len(scale)))
        tight = 1.0 / scale[owner] ** 2
        precision = matrix / variance
        precision.ravel()[:: size + 1] += tight
        factor, failed = dpotrf(precision, lower=1, clean=1)
        if failed:
            raise EstimationError(UNDETERMINED)
        lower, _ = dpotri(factor, lower=1)
        covariance = lower + lower.T  # above the diagonal it is zero
        covariance.ravel(order="K")[:: size + 1] *= 0.5
        values = covariance @ vector / variance
        well = 1.0 - covariance.ravel(order="K")[:: size + 1] * tight
        return cls(
            values,
            covariance,
            float(2.0 * np.log(factor.ravel(order="K")[:: size + 1]).sum() - np.log(tight).sum()),
            np.bincount(owner, values**2, len(scale)) / scale**2,
            np.bincount(owner, well, len(scale)).astype(float),
        )

    def step(self, log_scale: Array) -> Array:
        """Return the Newton step of ln λ, its curvature held positive."""
        slope = self.fitted - self.determined - log_scale / settings.SIZE_SPREAD**2
        return np.minimum(
            np.maximum(slope / (self.fitted + self.determined + 1.0 / settings.SIZE_SPREAD**2), -1.0), 1.0
        )


def evidence(gram: Gram, blocks: tuple[int, ...], prior: float, start: Combination | None) -> Combination:
    """Return one combination with noise and scales at their most probable values.

    Parameters
    ----------
    gram
        The problem.
    blocks
        That are in it.
    prior
        Their log prior odds.
    start
        A combination like it, from whose noise and scales the iteration starts.
    """
    spans = [np.arange(gram.slices[b].start, gram.slices[b].stop) for b in blocks]
    used = np.concatenate([*spans, np.zeros(0, dtype=int)])
    owner = np.repeat(np.arange(len(blocks)), [len(span) for span in spans])
    matrix, vector = gram.matrix[np.ix_(used, used)], gram.vector[used]
    scale = np.array([start.scales.get(b, 1.0) if start else 1.0 for b in blocks])
    equations, held = gram.equations, gram.noise_dof
    least = settings.LEAST_VARIANCE
    variance = start.noise**2 if start else max((held + gram.total) / (held + equations), least)
    for last in [*(False,) * settings.EVIDENCE_STEPS, True]:
        found = _Posterior.at(matrix, vector, owner, scale, variance)
        effective = float(found.determined.sum())
        step = found.step(np.log(scale))
        residual = gram.total - 2 * vector @ found.values + found.values @ matrix @ found.values
        target = max((held + max(residual, 0.0)) / max(held + equations - effective, 1.0), least)
        moved = max(abs(np.log(target / variance)), float(np.abs(step).max(initial=0.0)))
        if last or moved < settings.EVIDENCE_SETTLED:
            break
        variance, scale = target, scale * np.exp(step)
    quadratic = gram.total - vector @ found.values
    log_evidence = float(
        -0.5 * ((equations + held) * np.log(variance) + held / variance + found.log_det + quadratic / variance)
        - 0.5 * float(((np.log(scale) / settings.SIZE_SPREAD) ** 2).sum())
        + _log_volume(owner, scale, found.values, found.covariance)
        + prior
        + gram.offset
    )
    if not np.isfinite(log_evidence):
        raise EstimationError(UNDETERMINED)
    scales = dict(zip(blocks, scale.tolist(), strict=True))
    return Combination(
        blocks, log_evidence, float(np.sqrt(variance)), scales, found.values, found.covariance, effective
    )


def _log_volume(owner: NDArray[np.int64], scale: Array, values: Array, covariance: Array) -> float:
    """Return −½ log|σ² H|: the volume of the peak over all ln λ against that of their prior N(0, σ²).

    H is minus the second derivative of the log integrand: with m and C posterior mean and covariance of the values,
    H_bc = δ_bc (2 (m_bᵀm_b + tr C_bb)/λ_b² + 1/σ²) − (4 m_bᵀ C_bc m_c + 2 tr C_bc C_cb)/(λ_b λ_c)². It leaves out
    that s follows λ, and what is not parabolic: both within about 0.1 for blocks that are well seen.
    """
    each = np.eye(len(scale))[:, owner] / scale[:, None] ** 2
    bend = -2.0 * (each @ (covariance * (2.0 * np.outer(values, values) + covariance)) @ each.T)
    spread2 = settings.SIZE_SPREAD**2
    bend[np.diag_indices(len(scale))] += 2.0 * (each @ (values**2 + np.diag(covariance))) + 1.0 / spread2
    peak = np.linalg.eigvalsh(bend) * spread2
    return -0.5 * float(np.log(np.maximum(peak, settings.FLATTEST_PEAK)).sum())
