"""What may have moved between campaigns, and the evidence for any combination of moves, from products alone.

In campaign k the parameters are θ_k = θ + Σ_i a_i s_i(k) e_i: a constant for all campaigns, and moves. Of a move i,
parameter e_i changes with a shape s_i over time: a step after campaign j (a jump), or a straight line (a trend). A walk
is all steps of a parameter at once, the variance of each in proportion to the time that it took. With the whitened
products of campaign k, G_k = X'X and b_k = X'y, unknown frames projected out, everything follows from sums over k:

    V_ij = Σ s_i s_j G_k[e_i, e_j] − B_i A⁻¹ B_j',   g_i = Σ s_i b_k[e_i] − B_i A⁻¹ Σ b_k,

with A = Σ G_k + prior and B_i = Σ s_i G_k[e_i, :]: the information on moves that is left beside the constants. For
moves of prior variances τ, and a factor φ by which campaigns scatter more than their deviations say,

    log BF = −½ log|1 + √τ V √τ/φ²| + ½ g'(V + φ² τ⁻¹)⁻¹ g / φ².

φ and the common scale of τ are summed over a grid.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from thermal_robot.arrays import Array
from thermal_robot.fleet import wear_settings as settings
from thermal_robot.inference.algebra import equations_of, whitener


class Move(NamedTuple):
    """A parameter by its number, how it moves, and after which campaign it jumps; −1 where it does not jump."""

    parameter: int
    kind: str
    after: int = -1


@dataclass(frozen=True, eq=False)
class Series:
    """K campaigns in the order of time, as products in units of the P parameters' expected sizes.

    Attributes
    ----------
    matrices, vectors
        (K, P, P) and (K, P): whitened, frames projected out. A parameter that a campaign does not have is zero in it.
    times
        (K,) not falling: days, or numbers.
    followed
        (P,) which parameters may move.
    """

    matrices: Array
    vectors: Array
    times: Array
    followed: NDArray[np.bool_]

    @property
    def count(self) -> int:
        """Campaigns."""
        return len(self.times)

    @property
    def span(self) -> float:
        """From the first campaign to the last; 1 where all were measured at once."""
        return float(self.times[-1] - self.times[0]) or 1.0

    @cached_property
    def shapes(self) -> Array:
        """(K, K) a step after each campaign but the last, of length 1, then the straight line, which rises by 1."""
        k = np.arange(self.count)
        steps = (k[None, :] > k[:-1, None]).astype(float)
        middle = self.times.mean()
        return np.vstack([steps, (self.times - middle)[None] / self.span])

    @cached_property
    def constants(self) -> Array:
        """(P, P) A⁻¹: covariance of the constants, were nothing to move."""
        total = self.matrices.sum(axis=0) + np.eye(len(self.followed)) / settings.WIDE**2
        return np.asarray(np.linalg.inv(total))

    @cached_property
    def crossed(self) -> Array:
        """(P K, P) B: products of moves, parameter after parameter, with constants."""
        found = np.einsum("ik,kpq->piq", self.shapes, self.matrices)
        return equations_of(found)

    @cached_property
    def information(self) -> Array:
        """(P K, P K) V."""
        s, width = self.shapes, len(self.followed) * self.count
        own = np.einsum("ik,jk,kpq->piqj", s, s, self.matrices, optimize=True).reshape(width, width)
        return np.asarray(own - self.crossed @ self.constants @ self.crossed.T)

    @cached_property
    def pull(self) -> Array:
        """(P K,) g."""
        own = (self.vectors.T @ self.shapes.T).ravel()
        return np.asarray(own - self.crossed @ self.constants @ self.vectors.sum(axis=0))

    @cached_property
    def scattered(self) -> tuple[float, float]:
        """Squared distance of the campaigns from what is common to all, in deviations, and its degrees of freedom."""
        distance, degrees = 0.0, 0
        for matrix, vector in zip(self.matrices, self.vectors, strict=True):
            root = whitener(matrix)
            distance += float(((root.T @ vector) ** 2).sum())
            degrees += root.shape[1]
        total = self.vectors.sum(axis=0)
        shared = whitener(self.matrices.sum(axis=0)).shape[1]
        return max(distance - float(total @ self.constants @ total), 0.0), float(max(degrees - shared, 1))

    @cached_property
    def columns(self) -> NDArray[np.int64]:
        """(C,) numbers of the single moves that are weighed: steps and the line of each parameter that is followed."""
        return np.flatnonzero(np.repeat(self.followed, self.count))

    def spans(self, move: Move) -> list[int]:
        """Return the columns that a move is made of."""
        first = move.parameter * self.count
        if move.kind == "walk":
            return list(range(first, first + self.count - 1))
        return [first + (move.after if move.kind == "jump" else self.count - 1)]

    def shares(self, move: Move) -> Array:
        """Return the prior variance of each of a move's columns, over the common one."""
        gaps = np.diff(self.times) / self.span
        return np.maximum(gaps, 1e-6) if move.kind == "walk" else np.ones(1)


@dataclass(frozen=True, eq=False)
class Grid:
    """Scales of moves and factors of scatter, each with its prior and what the base of all explanations is worth.

    Attributes
    ----------
    variance, inflation
        (H,) common prior variance of moves, in expected sizes squared, and φ².
    log_base
        (H,) log prior, and log likelihood if nothing moves.
    """

    variance: Array
    inflation: Array
    log_base: Array

    @classmethod
    def of(cls, series: Series) -> Grid:
        """Return the grid of a series."""
        scale, factor = (np.array(each) for each in (settings.SCALES, settings.SCATTER))
        distance, degrees = series.scattered
        prior = -0.5 * (np.log(factor) / settings.SCATTER_SPREAD) ** 2 + np.log(np.gradient(np.log(factor)))
        base = prior - logsumexp(prior) - 0.5 * distance / factor**2 - degrees * np.log(factor)
        variance, inflation = np.meshgrid(scale**2, factor**2, indexing="ij")
        alike = np.broadcast_to(base - np.log(len(scale)), variance.shape)
        return cls(variance.ravel(), inflation.ravel(), alike.ravel())


def log_prior(move: Move, series: Series) -> float:
    """Return the log prior odds of one move against none: few change, and of many parameters each is less likely."""
    followed = max(int(series.followed.sum()), 1)
    one = 1.0 - (1.0 - settings.ANY_CHANGE) ** (1.0 / followed)
    days = series.count - 1 if move.kind == "jump" else 1
    return float(np.log(one / (1.0 - one)) + np.log(settings.KINDS[move.kind] / days))


@dataclass(frozen=True, eq=False)
class Beside:
    """Some moves at every point of the grid, and what is left of the others beside them.

    Attributes
    ----------
    log_likelihood
        (H,) with the base.
    mean, covariance
        (H, D) and (H, D, D) of the moves' columns.
    columns
        Their numbers.
    """

    log_likelihood: Array
    mean: Array
    covariance: Array
    columns: NDArray[np.int64]

    @classmethod
    def of(cls, series: Series, grid: Grid, moves: Sequence[Move]) -> Beside:
        """Solve for some moves."""
        columns = np.array([c for move in moves for c in series.spans(move)], dtype=np.int64)
        share = np.concatenate([*(series.shares(move) for move in moves), np.zeros(0)])
        own, pull = series.information[np.ix_(columns, columns)], series.pull[columns]
        deviation = np.sqrt(grid.variance[:, None] * share)
        inside = own * deviation[:, :, None] * deviation[:, None, :] / grid.inflation[:, None, None]
        tight = np.eye(len(columns)) + inside
        whole = deviation[:, :, None] * np.linalg.inv(tight) * deviation[:, None, :]
        mean = whole @ pull / grid.inflation[:, None]
        gain = 0.5 * (mean @ pull) / grid.inflation - 0.5 * np.linalg.slogdet(tight)[1]
        return cls(grid.log_base + gain, mean, whole, columns)

    def left(self, series: Series, grid: Grid, others: NDArray[np.int64]) -> tuple[Array, Array]:
        """Return (H, C) information on other columns beside these, and their pull; φ² = 1 in its units."""
        cross = series.information[np.ix_(others, self.columns)]
        along = cross @ self.covariance
        own = series.information[others, others] - (along * cross).sum(axis=2) / grid.inflation[:, None]
        return np.maximum(own, 0.0), series.pull[others] - self.mean @ cross.T
