"""Marginal likelihood (evidence) of combinations of effects, from one Gram matrix.

The whitened gap is y = F f + Σ_b X_b θ_b + e, with flat frames f, e ~ N(0, s²), and θ_b ~ N(0, λ_b² size²) for the
blocks that are in the combination. F is projected out first. For a combination γ

    log p(y | γ) = −½ [ n log s² + log|I + Λ G/s²| + (y'y − b'(G + s²Λ⁻¹)⁻¹ b)/s² ] + log p(s) + log p(λ),

with G = X'X and b = X'y restricted to γ. Noise s and scales λ_b are found at their most probable values, s by MacKay's
fixed point (*Neural Computation* 4, 1992), ln λ_b by Newton's steps; their priors are scaled inverse chi-square about
the stated noise, and log-normal about the stated sizes, with a factor κ that all of one robot share,

    ln λ_b ~ N(ln κ, σ_b²) ,  ln κ ~ N(0, σ_κ²) ,  so that  ln λ ~ N(0, C) ,  C = diag(σ_b²) + σ_κ² 11ᵀ ,

truncated at the largest plausible size; ln λ is integrated out by Laplace's method, s held.

A non-negative parameter has a half-normal prior. The mode is constrained: a column that would be negative is dropped
(block principal pivoting, Portugal, Júdice and Vicente, *Mathematics of Computation* 63, 1994). The factor of each half
line is approximated column by column: with mean m and deviation σ of a free column, log 2Φ(m/σ); of a dropped one, with
the slope −g and the curvature h of the log posterior at zero, log 2/(λ√h) + g²/2h + log Φ(−g/√h). For a single column
both are exact, and the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dposv, dpotrf, dpotri
from scipy.special import erfcx, log_ndtr

from thermal_robot.arrays import Array
from thermal_robot.errors import EstimationError
from thermal_robot.inference import settings

Mask = NDArray[np.bool_]
_ROOT_2, _ROOT_2_OVER_PI, _LOG_2 = np.sqrt(2.0), np.sqrt(2.0 / np.pi), np.log(2.0)
UNDETERMINED = "the measurements do not determine anything: too few, or all alike"


@dataclass(frozen=True, eq=False)
class Columns:
    """Normal equations of one combination: G (D, D), b (D,), the block of each column, and which cannot be negative."""

    matrix: Array
    vector: Array
    owner: NDArray[np.int64]
    positive: Mask

    @cached_property
    def constrained(self) -> NDArray[np.int64]:
        """Indices of the columns with a non-negativity constraint."""
        return np.flatnonzero(self.positive)

    def some(self, kept: NDArray[np.int64]) -> Columns:
        """Return the normal equations of a subset of the columns, given by their indices."""
        if len(kept) == len(self.vector):
            return self
        return Columns(self.matrix[kept[:, None], kept], self.vector[kept], self.owner[kept], self.positive[kept])


@dataclass(frozen=True, eq=False)
class Posterior:
    """Posterior of the parameters of one combination at given scales λ and noise s: mode, and covariance about it.

    A column held at zero by its constraint (``free`` (D,) False) has the mode zero, and its mean square as variance.
    ``log_volume`` is the log ratio of posterior to prior volume: −½ log|I + Λ G/s²|, and the factors of the half lines.
    Sums over the columns of each block: ``effective`` 1 − v/λ², the number that the data determine; ``fitted`` m²/λ²
    and ``determined`` 1 − v/λ², with mean m and variance v of the truncated columns where they are constrained.
    """

    values: Array
    covariance: Array
    free: Mask
    log_volume: float
    effective: Array
    fitted: Array
    determined: Array

    @classmethod
    def at(cls, columns: Columns, scale: Array, variance: float, free: Mask | None = None) -> Posterior:
        """Find the posterior mode under non-negativity constraints by block principal pivoting.

        It solves (G/s² + Λ⁻¹) θ = b/s² with s² = ``variance`` and Λ = diag(``scale``²), one scale for each block;
        ``free`` (D,) is a first guess of the columns not held at zero. Raises :class:`EstimationError` if rounding
        errors dominate.
        """
        size, count = len(columns.vector), len(scale)
        free = np.ones(size, dtype=bool) if free is None else free
        fewest = size + 1
        for _ in range(settings.PIVOTS):
            values, covariance, log_det, pull, wrong = _solved(columns, scale, variance, free)
            if not wrong.any():
                break
            # all that are wrong change at once, as long as they become fewer; else the last one (Murty)
            many, fewest = int(wrong.sum()) < fewest, min(int(wrong.sum()), fewest)
            free = free ^ (wrong if many else np.arange(size) == np.flatnonzero(wrong)[-1])
        else:
            values, covariance, log_det, pull, _ = _solved(columns, scale, variance, free)
            values = np.where(columns.positive, np.maximum(values, 0.0), values)
        prior_precision = scale[columns.owner] ** -2.0
        kept = np.flatnonzero(free)
        every, spread = len(kept) == size, np.zeros(size)
        spread[kept] = covariance.diagonal()
        effective = _by_block(
            columns,
            1.0 - spread * prior_precision if every else np.where(free, 1.0 - spread * prior_precision, 0.0),
            count,
        )
        first, second, log_mass = values, values**2 + spread, 0.0
        if len(columns.constrained):
            first, second, log_mass = _truncated(
                columns, values, spread, covariance, kept, pull, prior_precision, variance
            )
        whole = covariance
        if not every:
            whole = np.diag(second)
            whole[kept[:, None], kept] = covariance
        return cls(
            values,
            whole,
            free,
            log_mass - 0.5 * log_det,
            effective,
            _by_block(columns, first**2 * prior_precision, count),
            _by_block(columns, 1.0 - (second - first**2) * prior_precision, count),
        )

    def hessian(self, owner: NDArray[np.int64], scale: Array, prior_precision: Array) -> Array:
        """Negative Hessian (B, B) of the log integrand in ln λ.

        With m and C mode and covariance of the values, a prior N(0, P⁻¹) of ln λ (P is ``prior_precision``) and s held,
        it is H_bc = δ_bc 2 (m_bᵀm_b + tr C_bb)/λ_b² + P_bc − (4 m_bᵀ C_bc m_c + 2 tr C_bc C_cb)/(λ_b λ_c)².
        """
        each = np.zeros((len(scale), len(owner)))
        each[owner, np.arange(len(owner))] = scale[owner] ** -2.0
        moment = np.multiply.outer(2.0 * self.values, self.values)
        moment += self.covariance
        moment *= self.covariance
        hessian = -2.0 * (each @ moment @ each.T)
        hessian += prior_precision
        hessian.ravel()[:: len(scale) + 1] += 2.0 * (each @ (self.values**2 + self.covariance.diagonal()))
        return np.asarray(hessian)

    def step(self, hessian: Array, scale: Array, prior_precision: Array) -> tuple[Array, float]:
        """Newton step (B,) of ln λ, each component clipped to ±1, and the gain that a quadratic model predicts.

        Where the Hessian is not positive definite, each scale takes a step of its own, with a diagonal Hessian.
        """
        slope = self.fitted - self.determined - prior_precision @ np.log(scale)
        _, step, failed = dposv(hessian, slope) if len(scale) else (None, slope, 0)
        if failed:
            step = slope / (self.fitted + self.determined + prior_precision.diagonal())
        return np.minimum(np.maximum(step, -1.0), 1.0), float(0.5 * slope @ step)


def _by_block(columns: Columns, values: Array, count: int) -> Array:
    """Return the sums (count,) of values (D,) over the columns of each block."""
    return np.asarray(np.bincount(columns.owner, values, count), dtype=float)


def _solved(columns: Columns, scale: Array, variance: float, free: Mask) -> tuple[Array, Array, float, Array, Mask]:
    """Posterior with all columns that are not ``free`` held at zero (a given active set).

    Returns values (D,), covariance of the free columns, log|I + Λ G/s²|, slopes (D,) of the log likelihood at the held
    columns, and a mask (D,) of the violated constraints: free columns that are negative and held ones with a positive
    slope, by more than rounding.
    """
    kept = np.flatnonzero(free)
    mean, covariance, log_det = _unconstrained(columns.some(kept), scale, variance)
    values, pull, wrong = np.zeros(len(free)), np.zeros(len(free)), np.zeros(len(free), dtype=bool)
    values[kept] = mean
    if len(kept) < len(free):
        out = np.flatnonzero(~free)
        conditional_scales, vector = columns.matrix[out[:, None], kept], columns.vector[out]
        pull[out] = (vector - conditional_scales @ mean) / variance
        rounding = settings.SIDE_ROUNDING * (np.abs(vector) + np.abs(conditional_scales) @ np.abs(mean)) / variance
        wrong[out] = pull[out] > rounding
    if len(columns.constrained):
        own = values[columns.constrained]
        wrong[columns.constrained] |= own < -settings.SIDE_ROUNDING * np.abs(values).max()
    return values, covariance, log_det, pull, wrong


def _unconstrained(columns: Columns, scale: Array, variance: float) -> tuple[Array, Array, float]:
    """Unconstrained normal posterior: mean (D,), covariance (D, D) and log|I + Λ G/s²|, with Λ = diag(scale²)."""
    size = len(columns.vector)
    if not size:
        return np.zeros(0), np.zeros((0, 0)), 0.0
    prior_precision = 1.0 / scale[columns.owner] ** 2
    precision = columns.matrix / variance
    precision.ravel()[:: size + 1] += prior_precision
    # what stands below the diagonal of its transpose is above its own: it is symmetric, and nothing is copied
    factor, failed = dpotrf(precision.T, lower=1, clean=1, overwrite_a=1)
    if failed:
        raise EstimationError(UNDETERMINED)
    log_det = float(2.0 * np.log(factor.diagonal()).sum() - np.log(prior_precision).sum())
    lower, _ = dpotri(factor, lower=1, overwrite_c=1)
    covariance = lower + lower.T  # above the diagonal it is zero
    covariance.ravel(order="K")[:: size + 1] *= 0.5
    mean = covariance @ columns.vector / variance
    # refined once, as an inverse loses digits where values are many times their deviations
    mean += covariance @ ((columns.vector - columns.matrix @ mean) / variance - prior_precision * mean)
    return mean, covariance, log_det


def _truncated(
    columns: Columns,
    values: Array,
    spread: Array,
    covariance: Array,
    kept: NDArray[np.int64],
    pull: Array,
    prior_precision: Array,
    s2: float,
) -> tuple[Array, Array, float]:
    """Means and mean squares (D,) of normal columns, truncated to ≥ 0 where constrained, and the log factor of that."""
    mean, own, log_mass = values.copy(), spread.copy(), 0.0
    if len(kept) < len(values):
        dropped = np.ones(len(values), dtype=bool)
        dropped[kept] = False
        out = np.flatnonzero(dropped)
        along = columns.matrix[out[:, None], kept] / s2
        hessian = columns.matrix[out, out] / s2 + prior_precision[out] - ((along @ covariance) * along).sum(axis=1)
        hessian = np.maximum(hessian, prior_precision[out])
        mean[out], own[out] = pull[out] / hessian, 1.0 / hessian
        log_mass = float((0.5 * np.log(prior_precision[out] / hessian) + 0.5 * pull[out] ** 2 / hessian).sum())
    p = columns.constrained
    at, conditional_scales = mean[p], own[p]
    root = np.sqrt(conditional_scales)
    z = at / root
    # of a normal on one side of zero: mean m + σ r, mean square σ² + m (m + σ r), with r = φ(z)/Φ(z)
    ratio = _ROOT_2_OVER_PI / erfcx(-z / _ROOT_2)
    first, second = mean, mean**2 + own
    first[p] = moved = np.maximum(at + root * ratio, 0.0)
    second[p] = np.maximum(conditional_scales + at * moved, moved**2)
    return first, second, log_mass + float((log_ndtr(z) + _LOG_2).sum())


@dataclass(frozen=True, eq=False)
class Gram:
    """Normal equations of a linear problem, frames projected out, whitened, in units of the prior sizes.

    G (D, D), b (D,) and y'y are ``matrix``, ``vector`` and ``total``. Each block is reduced to the directions that the
    data determine (``ranks`` of them): it has D_b columns (``slices``), of which ``bases`` (P_b, D_b) are the parameter
    values. ``positive`` (D,) cannot be negative: each is then a parameter. ``spreads`` (B,): prior standard deviation
    of ln λ − ln κ; ``most`` (B,): largest λ. ``equations`` n: their number less the rank of the frames; ``noise_dof``:
    prior degrees of freedom of the noise, 0 where none is stated; ``offset``: the log evidence that all combinations
    share, −½ log of the determinants of the rows' covariance and of the frames, and the log prior of that covariance.
    """

    matrix: Array
    vector: Array
    total: float
    slices: tuple[slice, ...]
    bases: tuple[Array, ...]
    positive: NDArray[np.bool_]
    ranks: tuple[int, ...]
    spreads: Array
    equations: float
    noise_dof: float
    offset: float = 0.0
    most: Array | None = None

    def columns_of(self, blocks: Sequence[int]) -> NDArray[np.int64]:
        """Return the indices (D_γ,) of the reduced columns of some blocks."""
        return np.array([k for b in blocks for k in range(self.slices[b].start, self.slices[b].stop)], dtype=int)

    def equations_of(self, blocks: Sequence[int]) -> Columns:
        """Return the normal equations of one combination."""
        used, widths = self.columns_of(blocks), [self.bases[b].shape[1] for b in blocks]
        owner = np.repeat(np.arange(len(blocks)), widths)
        return Columns(self.matrix[used[:, None], used], self.vector[used], owner, self.positive[used])

    def posterior(self, found: Combination) -> tuple[Array, Array]:
        """Posterior mode (D_γ,) and covariance (D_γ, D_γ) of the reduced columns at a combination's scales and noise.

        Block after block. Columns held at zero by their constraint have the mode zero; all are zero where the log
        evidence is −∞, as rounding errors dominate.
        """
        columns = self.equations_of(found.blocks)
        if not np.isfinite(found.log_evidence):
            return np.zeros_like(columns.vector), np.zeros_like(columns.matrix)
        at = Posterior.at(columns, np.array([found.scales[b] for b in found.blocks]), found.noise**2)
        return at.values, at.covariance

    def some(self, blocks: Sequence[int]) -> Gram:
        """Return the normal equations of a subset of the blocks."""
        widths = [self.bases[b].shape[1] for b in blocks]
        ends = np.cumsum([0, *widths])
        own = self.columns_of(blocks)
        return replace(
            self,
            matrix=self.matrix[own[:, None], own],
            vector=self.vector[own],
            slices=tuple(slice(a, b) for a, b in pairwise(ends.tolist())),
            bases=tuple(self.bases[b] for b in blocks),
            positive=self.positive[own],
            ranks=tuple(self.ranks[b] for b in blocks),
            spreads=self.spreads[list(blocks)],
            most=None if self.most is None else self.most[list(blocks)],
        )


@dataclass(frozen=True, eq=False)
class Combination:
    """One combination of blocks with its evidence, at the most probable prior scales and noise.

    ``log_evidence`` is the log marginal likelihood with log prior odds; ``noise`` s, in units of the whitening noise;
    ``scales`` λ of each block; ``effective`` the number of determined parameters; ``exact`` False for an estimate: a
    search that stopped early, or one more block to first order, with the other scales as they were.
    """

    blocks: tuple[int, ...]
    log_evidence: float
    noise: float
    scales: dict[int, float]
    effective: float
    exact: bool = True


def evidence(
    gram: Gram,
    blocks: tuple[int, ...],
    prior: float,
    start: Combination | None,
    floor: float = -np.inf,
    settled: float = settings.EVIDENCE_SETTLED,
) -> Combination:
    """Log evidence of one combination at the most probable noise and prior scales (empirical Bayes).

    ``prior`` is its log prior odds. The iteration starts at the noise and scales of ``start``, ends once their
    logarithms move less than ``settled``, and early, with an estimate that is not ``exact``, where it is clear that the
    log evidence ``floor`` is not reached. Raises :class:`EstimationError` if rounding errors dominate.
    """
    columns = gram.equations_of(blocks)
    scale = np.array([start.scales.get(b, 1.0) if start else 1.0 for b in blocks])
    variance = start.noise**2 if start else (gram.noise_dof + gram.total) / (gram.noise_dof + gram.equations)
    variance, law = max(variance, settings.LEAST_VARIANCE), ScalePrior.of(gram.spreads[list(blocks)])
    known = prior + gram.offset
    most = np.full(len(scale), np.inf) if gram.most is None else gram.most[list(blocks)]
    peak = _most_probable(gram, columns, np.minimum(scale, most), law, most, variance, floor - known, settled)
    found, scale, variance = peak.posterior, peak.scale, peak.variance
    log_evidence = known + _log_joint(gram, columns, found, scale, law, variance) + _log_volume(peak.hessian, law)
    log_evidence += peak.promised or 0.0
    if not np.isfinite(log_evidence):
        raise EstimationError(UNDETERMINED)
    scales = dict(zip(blocks, scale.tolist(), strict=True))
    effective = float(found.effective.sum())
    exact = peak.promised is None
    noise = float(np.sqrt(variance))
    return Combination(blocks, log_evidence, noise, scales, effective, exact)


@dataclass(frozen=True, eq=False)
class ScalePrior:
    """Normal prior N(0, C) of B log scales with a common factor κ: C⁻¹ (``prior_precision``), and R with C = R Rᵀ."""

    prior_precision: Array
    root: Array

    @classmethod
    def of(cls, spread: Array) -> ScalePrior:
        """Prior of log scales with standard deviations ``spread`` (B,) about the common factor κ."""
        covariance = np.diag(spread**2) + settings.COARSENESS**2
        return cls(np.asarray(np.linalg.inv(covariance)), np.asarray(np.linalg.cholesky(covariance)))


def conditional_scales(spread: Array, log_scale: Array, own: Array) -> tuple[float, Array]:
    """Conditional mean and standard deviations of ln λ of further blocks, given those of B known ones.

    ``spread`` and ``log_scale`` (B,) are those of the known blocks, ``own`` (K,) the spreads of the further ones.
    """
    known = 1.0 / (settings.COARSENESS**-2.0 + float((spread**-2.0).sum()))
    return known * float((log_scale / spread**2).sum()), np.sqrt(own**2 + known)


@dataclass(frozen=True, eq=False)
class _Mode:
    """Posterior mode of scales and noise; ``promised``: log evidence left to gain where the search stopped early."""

    posterior: Posterior
    hessian: Array
    scale: Array
    variance: float
    promised: float | None = None


def _most_probable(
    gram: Gram,
    columns: Columns,
    scale: Array,
    law: ScalePrior,
    most: Array,
    variance: float,
    floor: float,
    settled: float,
) -> _Mode:
    """Posterior mode of scales and noise by Newton steps of ln λ and MacKay's fixed point of s.

    Stops early where the log evidence cannot reach ``floor``.
    """
    held = gram.noise_dof
    before, reach, free = np.zeros(len(scale)), 1.0, np.ones(len(columns.vector), dtype=bool)
    for last in [*(False,) * settings.EVIDENCE_STEPS, True]:
        found = Posterior.at(columns, scale, variance, free)
        hessian = found.hessian(columns.owner, scale, law.prior_precision)
        step, gain = found.step(hessian, scale, law.prior_precision)
        if (found.free != free).any() and step @ before < -settings.TAKEN_BACK * (before @ before):
            reach *= 0.5  # to and fro between two sets of dropped columns: the mode lies where they meet
        free, before, step = found.free, step, np.minimum(reach * step, np.log(most / scale))
        residual = float(gram.total - (2 * columns.vector - columns.matrix @ found.values) @ found.values)
        left = max(held + gram.equations - float(found.effective.sum()), 1.0)
        target = max((held + max(residual, 0.0)) / left, settings.LEAST_VARIANCE)
        if last or max(abs(np.log(target / variance)), np.abs(step).max(initial=0.0)) < settled:
            break
        if np.isfinite(floor):
            gain += 0.5 * (gram.equations + held) * (target / variance - 1.0 - np.log(target / variance))
            reached = _log_joint(gram, columns, found, scale, law, variance)
            if reached + settings.CLEARLY * gain < floor:
                return _Mode(found, hessian, scale, variance, gain)
        variance, scale = target, scale * np.exp(step)
    return _Mode(found, hessian, scale, variance)


def _log_joint(gram: Gram, columns: Columns, found: Posterior, scale: Array, law: ScalePrior, variance: float) -> float:
    """Log joint density log p(y, s, λ) of one combination, up to a common constant."""
    held = gram.noise_dof
    quadratic = gram.total - columns.vector @ found.values
    fit = -0.5 * ((gram.equations + held) * np.log(variance) + (held + quadratic) / variance)
    log = np.log(scale)
    return float(fit + found.log_volume - 0.5 * log @ law.prior_precision @ log)


def _log_volume(hessian: Array, law: ScalePrior) -> float:
    """Laplace approximation, −½ log|Rᵀ H R| with C = R Rᵀ: posterior over prior volume of ln λ with prior N(0, C).

    H neglects the dependence of s on λ and higher orders: both within about 0.1 for well determined blocks.
    """
    peak = np.linalg.eigvalsh(law.root.T @ hessian @ law.root)
    return -0.5 * float(np.log(np.maximum(peak, settings.FLATTEST_PEAK)).sum())
