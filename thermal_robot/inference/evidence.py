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

from dataclasses import dataclass

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
