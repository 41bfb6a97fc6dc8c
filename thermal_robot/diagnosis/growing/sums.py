"""Rows that need not be looked at again: their sums of products, and how far the model may move before they must be.

In the fit of a diagnosis a row counts in full unless it stands in the tail, and the noise, where none is stated, is the
median of what rows leave. So a row bears on the fit by its products alone as long as it crosses neither the median nor
the edge of the tail. With J_i the row's columns in units of the noise, and any positive A, a step δ of the parameters
moves the row by at most √tr(J_i A⁻¹ J_iᵀ) √(δᵀAδ) (Cauchy and Schwarz). Rows that such a step might carry across are
kept one by one; the others are in the sums.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from thermal_robot.diagnosis.growing.linearised import products
from thermal_robot.inference import settings as chosen

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Guard:
    """How far parameters and limits may move while every row in the sums stays on its side of each limit.

    Attributes
    ----------
    metric
        A (k, k) of the columns of frames and chosen effects; positive.
    reach
        √(δᵀAδ) up to which steps are safe.
    spare
        By how much each limit may move meanwhile, in units of the noise ``sigma``.
    sigma
        (m,) noise in whose units distances are told.
    medians
        (G,) median distance of positions and of orientations.
    bend
        Distance from which on a row is in the tail.
    """

    metric: Array
    reach: float
    spare: float
    sigma: Array
    medians: Array
    bend: float

    def scores(self, rows: Array, weights: Array) -> Array:
        """(N,) the reach up to which each of the rows at the point of the sums, (N, m, K + 1), is safe; −1 for none."""
        k, groups = len(self.metric), len(self.medians)
        white = rows / self.sigma[:, None]
        parts = np.sqrt(((white[:, :, -1] ** 2).reshape(len(rows), groups, 3)).sum(axis=2))
        slack = np.minimum(np.abs(parts - self.medians).min(axis=1), self.bend - np.sqrt((parts**2).sum(axis=1)))
        within = white[:, :, :k] @ np.linalg.inv(np.linalg.cholesky(self.metric)).T
        moves = np.sqrt((within**2).sum(axis=(1, 2)))
        return np.where((slack > 0.0) & (weights >= 1.0), slack / (moves + self.spare / self.reach), -1.0)

    def holds(self, step: Array, sigma: Array, medians: Array, bend: float) -> bool:
        """Tell whether a step of the parameters, and limits in units of another noise, are within reach."""
        far = float(np.sqrt(step @ self.metric @ step))
        ratio = sigma[::3] / self.sigma[::3]
        moved = max(np.abs(medians * ratio - self.medians).max(), np.abs(bend * ratio - self.bend).max())
        return bool(far <= self.reach and moved <= self.spare)


@dataclass(frozen=True, eq=False)
class Sums:
    """Products of rows, with what must be known of them beside.

    Attributes
    ----------
    weighed
        (G, K + 1, K + 1) of rows with weight, positions and orientations apart, in units of each row's own noise over
        that of all. Columns and gap are those at the point of linearisation.
    plain
        (G, K + 1, K + 1) of rows that are not set aside, in m and rad.
    rows, used, kept
        How many rows there are, how many have weight, how many are not set aside.
    below
        (G,) how many are nearer than the median.
    guard
        How far it holds; ``None`` where rows keep their weights, or there are none.
    """

    weighed: Array
    plain: Array
    rows: int
    used: int
    kept: int
    below: NDArray[np.int64]
    guard: Guard | None

    @classmethod
    def empty(cls, width: int, groups: int) -> Sums:
        """Return the sums of no rows, with K + 1 columns."""
        nothing = np.zeros((groups, width, width))
        return cls(nothing, nothing, 0, 0, 0, np.zeros(groups, dtype=np.int64), None)

    def plus(self, rows: Array, alike: Array, weights: Array, aside: Mask) -> Sums:
        """Return the sums with further rows (N, m, K + 1) at the same point, their weights, and which are set aside."""
        below = self.below
        if self.guard is not None:
            parts = ((alike[:, :, -1] / self.guard.sigma) ** 2).reshape(len(rows), len(below), 3).sum(axis=2)
            below = below + (parts < self.guard.medians**2).sum(axis=0)
        return replace(
            self,
            weighed=self.weighed + products(alike, weights),
            plain=self.plain + products(rows, (~aside).astype(float)),
            rows=self.rows + len(rows),
            used=self.used + int((weights > 0).sum()),
            kept=self.kept + int((~aside).sum()),
            below=below,
        )


def bend(measures: int, leverage: float, sigma: Array, scale: Array) -> float:
    """Return the distance, in units of the noise, from which on a row counts less; of two parts the nearer one's."""
    return float(np.sqrt(chdtri(measures, chosen.BEND_LEVEL) * (1.0 - leverage)) * (scale / sigma).min())
