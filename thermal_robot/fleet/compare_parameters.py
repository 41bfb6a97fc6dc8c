"""Parameter by parameter and effect by effect: values in each campaign, their differences, and what chance does.

A campaign alone says θ = G⁺b with covariance G⁺ of all effects that are at work in any campaign together. Of one effect
with the others free, it says I θ = s, where I and s are what is left of G and b once the others are projected out; then

    χ² = Σ_c s_cᵀ I_c⁺ s_c − (Σ s_c)ᵀ (Σ I_c)⁺ (Σ s_c)

has Σ rank I_c − rank Σ I_c degrees of freedom if the effect is the same in all campaigns. What only one of them
determines adds to neither.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from scipy.special import chdtrc

from thermal_robot.arrays import Array
from thermal_robot.effects import Parameter as Told
from thermal_robot.fleet import compare_settings
from thermal_robot.fleet.compare_sums import Sums
from thermal_robot.fleet.comparison import Parameter
from thermal_robot.inference import settings


def parameters(
    told: Sequence[Told], sizes: Array, said: Sequence[Sums], numbers: Sequence[int], names: Sequence[str]
) -> tuple[Parameter, ...]:
    """Return some parameters in every campaign.

    Parameters
    ----------
    told
        What they are.
    sizes
        (p,) the unit of each, its expected size.
    said
        What each campaign says of all parameters of the effects at work.
    numbers
        Which of these they are.
    names
        What the campaigns are called.
    """
    values, stds = np.full((len(said), len(told)), np.nan), np.full((len(said), len(told)), np.nan)
    for c, one in enumerate(said):
        covariance, seen = one.inverse
        spread = np.sqrt(np.maximum(np.diag(covariance)[list(numbers)], 0.0))
        known = (seen[list(numbers)] > compare_settings.SEEN) & (spread < compare_settings.TOLD)
        values[c, known] = (covariance @ one.vector)[list(numbers)][known] * sizes[known]
        stds[c, known] = spread[known] * sizes[known]
    return tuple(_compared(p, values[:, k], stds[:, k], names) for k, p in enumerate(told))


def _compared(told: Told, values: Array, stds: Array, names: Sequence[str]) -> Parameter:
    known = np.flatnonzero(np.isfinite(values)).tolist()
    plain = [tuple(None if np.isnan(v) else float(v) for v in column) for column in (values, stds)]
    own = Parameter(told.name, told.kind, told.place, told.unit, plain[0], plain[1])
    if len(known) < 2:
        return own
    pairs = list(combinations(known, 2))
    spread = [float(np.hypot(stds[a], stds[b])) for a, b in pairs]
    most = max(range(len(pairs)), key=lambda k: abs(values[pairs[k][1]] - values[pairs[k][0]]) / spread[k])
    a, b = pairs[most]
    weight = stds[known] ** -2.0
    mean = float(weight @ values[known] / weight.sum())
    chi2, degrees = float(weight @ (values[known] - mean) ** 2), len(known) - 1
    return Parameter(
        told.name,
        told.kind,
        told.place,
        told.unit,
        plain[0],
        plain[1],
        (names[a], names[b]),
        float(values[b] - values[a]),
        spread[most],
        chi2,
        degrees,
        float(chdtrc(degrees, chi2)),
    )


def equal(said: Sequence[Sums], numbers: Sequence[int]) -> tuple[float, int, float]:
    """Return χ², degrees of freedom and probability by chance of some parameters being the same in all campaigns."""
    own = list(numbers)
    others = [k for k in range(len(said[0].vector)) if k not in set(own)]
    chi2, degrees = 0.0, 0
    together, score = np.zeros((len(own),) * 2), np.zeros(len(own))
    for one in said:
        inverse, _ = one.some(others).inverse
        cross = one.matrix[np.ix_(own, others)] @ inverse
        left = one.matrix[np.ix_(own, own)] - cross @ one.matrix[np.ix_(others, own)]
        what = one.vector[own] - cross @ one.vector[others]
        quadratic, rank = _quadratic(left, what, float(np.diag(one.matrix)[own].max(initial=0.0)))
        chi2, degrees, together, score = chi2 + quadratic, degrees + rank, together + left, score + what
    quadratic, rank = _quadratic(together, score, float(max(np.diag(one.matrix)[own].max(initial=0.0) for one in said)))
    chi2, degrees = max(chi2 - quadratic, 0.0), degrees - rank
    return chi2, degrees, float(chdtrc(degrees, chi2)) if degrees > 0 else 1.0


def _quadratic(matrix: Array, vector: Array, longest: float) -> tuple[float, int]:
    """Return vᵀ M⁺ v and the rank of M; what is left of columns of this square by rounding is none."""
    value, axes = np.linalg.eigh(0.5 * (matrix + matrix.T))
    seen = value > max(settings.INFORMATION_FLOOR, settings.PROJECTED_FLOOR * longest)
    along = axes[:, seen].T @ vector
    return float((along**2 / value[seen]).sum()), int(seen.sum())
