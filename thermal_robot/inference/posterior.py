"""Parameters of one combination at given scales and noise, those that cannot be negative held on their side.

A parameter that is at least zero has half a normal prior, of twice the density. The mode is looked for on that side: a
column that would be negative is dropped (block principal pivoting, Portugal, Júdice and Vicente, *Mathematics of
Computation* 63, 1994). What the side is worth is taken column by column, each along its own normal: with mean m and
deviation σ of a column that stays beside the others that stay, log 2Φ(m/σ); of one that is dropped, with the slope −g
and the curvature h of the log posterior at zero, log 2/(λ√h) + g²/2h + log Φ(−g/√h). For a single column both are
exact, and the same.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

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
    """Reduced columns of one combination: G (D, D), b (D,), the block of each, and which cannot be negative."""

    matrix: Array
    vector: Array
    owner: NDArray[np.int64]
    positive: Mask

    @cached_property
    def sided(self) -> NDArray[np.int64]:
        """Numbers of the columns that cannot be negative."""
        return np.flatnonzero(self.positive)

    def some(self, kept: NDArray[np.int64]) -> Columns:
        """Return those columns alone."""
        if len(kept) == len(self.vector):
            return self
        return Columns(self.matrix[kept[:, None], kept], self.vector[kept], self.owner[kept], self.positive[kept])


@dataclass(frozen=True, eq=False)
class Posterior:
    """Parameters of one combination at given scales and noise: posterior mode and covariance about it.

    Of a dropped column (``free`` (D,) False) zero, and its mean square. ``log_volume`` is the log of the posterior's
    volume over the prior's: −½ log|I + Λ G/s²|, and what the sides are worth; ``effective`` per block, how many of its
    columns the data determine; ``fitted`` and ``determined`` the same, and |θ|²/λ², by the sides' moments.
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
        """Solve (G/s² + Λ⁻¹) θ = b/s² with θ ≥ 0 where that is asked; ``free`` is a guess of what is not dropped.

        Raises :class:`EstimationError` if rounding hides what the columns bring.
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
        tight = scale[columns.owner] ** -2.0
        kept = np.flatnonzero(free)
        every, spread = len(kept) == size, np.zeros(size)
        spread[kept] = covariance.diagonal()
        effective = _by_block(
            columns, 1.0 - spread * tight if every else np.where(free, 1.0 - spread * tight, 0.0), count
        )
        first, second, worth = values, values**2 + spread, 0.0
        if len(columns.sided):
            first, second, worth = _sides(columns, values, spread, covariance, kept, pull, tight, variance)
        whole = covariance
        if not every:
            whole = np.diag(second)
            whole[kept[:, None], kept] = covariance
        return cls(
            values,
            whole,
            free,
            worth - 0.5 * log_det,
            effective,
            _by_block(columns, first**2 * tight, count),
            _by_block(columns, 1.0 - (second - first**2) * tight, count),
        )

    def bend(self, owner: NDArray[np.int64], scale: Array, tight: Array) -> Array:
        """Return minus the second derivative of the log integrand after ln λ, (B, B).

        With m and C mode and covariance of the values, a prior N(0, P⁻¹) of ln λ (P is ``tight``) and s held, it is
        H_bc = δ_bc 2 (m_bᵀm_b + tr C_bb)/λ_b² + P_bc − (4 m_bᵀ C_bc m_c + 2 tr C_bc C_cb)/(λ_b λ_c)².
        """
        each = np.zeros((len(scale), len(owner)))
        each[owner, np.arange(len(owner))] = scale[owner] ** -2.0
        moment = np.multiply.outer(2.0 * self.values, self.values)
        moment += self.covariance
        moment *= self.covariance
        bend = -2.0 * (each @ moment @ each.T)
        bend += tight
        bend.ravel()[:: len(scale) + 1] += 2.0 * (each @ (self.values**2 + self.covariance.diagonal()))
        return np.asarray(bend)

    def step(self, bend: Array, scale: Array, tight: Array) -> tuple[Array, float]:
        """Return the Newton step of ln λ, each at most one, and what it gains if the log integrand is parabolic.

        Where that is not convex, the step is of each scale for itself.
        """
        slope = self.fitted - self.determined - tight @ np.log(scale)
        _, step, failed = dposv(bend, slope) if len(scale) else (None, slope, 0)
        if failed:
            step = slope / (self.fitted + self.determined + tight.diagonal())
        return np.minimum(np.maximum(step, -1.0), 1.0), float(0.5 * slope @ step)


def _by_block(columns: Columns, values: Array, count: int) -> Array:
    """(count,) sums over the columns of each block."""
    return np.asarray(np.bincount(columns.owner, values, count), dtype=float)


def _solved(columns: Columns, scale: Array, variance: float, free: Mask) -> tuple[Array, Array, float, Array, Mask]:
    """Return what follows where just these columns are not dropped.

    Values (D,), covariance of those that stay, log determinant, slopes (D,) of the log likelihood where a column is
    dropped, and which columns should change by more than rounding: those that stay and are negative, those dropped that
    would be positive.
    """
    kept = np.flatnonzero(free)
    mean, covariance, log_det = _both_sides(columns.some(kept), scale, variance)
    values, pull, wrong = np.zeros(len(free)), np.zeros(len(free)), np.zeros(len(free), dtype=bool)
    values[kept] = mean
    if len(kept) < len(free):
        out = np.flatnonzero(~free)
        beside, vector = columns.matrix[out[:, None], kept], columns.vector[out]
        pull[out] = (vector - beside @ mean) / variance
        rounding = settings.SIDE_ROUNDING * (np.abs(vector) + np.abs(beside) @ np.abs(mean)) / variance
        wrong[out] = pull[out] > rounding
    if len(columns.sided):
        own = values[columns.sided]
        wrong[columns.sided] |= own < -settings.SIDE_ROUNDING * np.abs(values).max()
    return values, covariance, log_det, pull, wrong


def _both_sides(columns: Columns, scale: Array, variance: float) -> tuple[Array, Array, float]:
    """Return mean, covariance and log|I + Λ G/s²| without sides."""
    size = len(columns.vector)
    if not size:
        return np.zeros(0), np.zeros((0, 0)), 0.0
    tight = 1.0 / scale[columns.owner] ** 2
    precision = columns.matrix / variance
    precision.ravel()[:: size + 1] += tight
    # what stands below the diagonal of its transpose is above its own: it is symmetric, and nothing is copied
    factor, failed = dpotrf(precision.T, lower=1, clean=1, overwrite_a=1)
    if failed:
        raise EstimationError(UNDETERMINED)
    log_det = float(2.0 * np.log(factor.diagonal()).sum() - np.log(tight).sum())
    lower, _ = dpotri(factor, lower=1, overwrite_c=1)
    covariance = lower + lower.T  # above the diagonal it is zero
    covariance.ravel(order="K")[:: size + 1] *= 0.5
    return covariance @ columns.vector / variance, covariance, log_det


def _sides(
    columns: Columns,
    values: Array,
    spread: Array,
    covariance: Array,
    kept: NDArray[np.int64],
    pull: Array,
    tight: Array,
    s2: float,
) -> tuple[Array, Array, float]:
    """Return mean and mean square of every column on its side, and the logarithm of what the sides are worth."""
    mean, own, worth = values.copy(), spread.copy(), 0.0
    if len(kept) < len(values):
        dropped = np.ones(len(values), dtype=bool)
        dropped[kept] = False
        out = np.flatnonzero(dropped)
        along = columns.matrix[out[:, None], kept] / s2
        bend = columns.matrix[out, out] / s2 + tight[out] - ((along @ covariance) * along).sum(axis=1)
        bend = np.maximum(bend, tight[out])
        mean[out], own[out] = pull[out] / bend, 1.0 / bend
        worth = float((0.5 * np.log(tight[out] / bend) + 0.5 * pull[out] ** 2 / bend).sum())
    p = columns.sided
    at, beside = mean[p], own[p]
    root = np.sqrt(beside)
    z = at / root
    # of a normal on one side of zero: mean m + σ r, mean square σ² + m (m + σ r), with r = φ(z)/Φ(z)
    ratio = _ROOT_2_OVER_PI / erfcx(-z / _ROOT_2)
    first, second = mean, mean**2 + own
    first[p] = moved = np.maximum(at + root * ratio, 0.0)
    second[p] = np.maximum(beside + at * moved, moved**2)
    return first, second, worth + float((log_ndtr(z) + _LOG_2).sum())
