"""Rows that need not be looked at again: their sums of products, and how far the model may move before they must be.

In the fit of a diagnosis a row counts in full unless it stands in the tail, and the noise, where none is stated, is
told by the median of what rows leave. So a row bears on the fit by its products alone as long as it crosses neither the
edge of the tail nor the median. With J_i the row's columns in units of the noise, and any positive A, a step δ of the
parameters moves it by at most √tr(J_i A⁻¹ J_iᵀ) √(δᵀAδ) (Cauchy and Schwarz), and where A is that of all N rows, by
√(δᵀAδ/N) in the root mean square. Rows that might reach the tail at most, or the median by a few root mean squares, are
kept one by one; the others are in the sums. One that crosses the median all the same moves the noise by 1/N of itself,
and with it nothing but the weights in the tail. Where noise is stated, and no more than it remains, the median bears on
nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from thermal_robot.arrays import Array
from thermal_robot.diagnosis.growing import settings
from thermal_robot.diagnosis.growing.linearised import products
from thermal_robot.inference import settings as chosen

Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Guard:
    """How far parameters and limits may move while every row in the sums stays on its side of each limit.

    Steps up to √(δᵀAδ) = ``reach`` are safe, A (k, k) the ``metric``, positive. ``share`` and ``typical``: how far a
    step of 1 moves a row, at most and in the root mean square, in units of the noise, of the median row and over all;
    limits may move by as much beside. ``sigma`` (m,): the unit of distances. ``medians`` (G,) and ``bend``: median
    distance, and that from which on a row is in the tail. ``quiet``: noise is stated, and clearly less than its slack
    remains, so that medians bear on nothing.
    """

    metric: Array
    reach: float
    share: float
    typical: float
    sigma: Array
    medians: Array
    bend: float
    quiet: bool

    def scores(self, rows: Array, weights: Array) -> Array:
        """(N,) the reach up to which each of the rows at the point of the sums, (N, m, K + 1), is safe; −1 for none."""
        groups = len(self.medians)
        parts = np.sqrt(((rows[:, :, -1] / self.sigma) ** 2).reshape(len(rows), groups, 3).sum(axis=2))
        tail = (self.bend - np.sqrt((parts**2).sum(axis=1))) / (self.moves(rows) + self.share)
        if not self.quiet:
            wide = 2.0 * settings.WIDE * self.typical  # the row and the median
            tail = np.minimum(tail, np.abs(parts - self.medians).min(axis=1) / wide)
        return np.where((tail > 0.0) & (weights >= 1.0), tail, -1.0)

    def moves(self, rows: Array) -> Array:
        """(N,) how far a unit of reach moves each of the rows (N, m, K + 1) at most, in units of the noise."""
        white = rows[:, :, : len(self.metric)] / self.sigma[:, None]
        within = white @ np.linalg.inv(np.linalg.cholesky(self.metric)).T
        return np.asarray(np.sqrt((within**2).sum(axis=(1, 2))))

    def holds(self, step: Array, sigma: Array, medians: Array, bend: float, rms: Array) -> bool:
        """Tell whether a fit is within reach, its step (k,), noise, and limits in units of it.

        ``rms`` (G,) is what remains per axis, m and rad.
        """
        far, ratio = float(np.sqrt(step @ self.metric @ step)), sigma[::3] / self.sigma[::3]
        within = far <= self.reach and bool(np.abs(bend * ratio - self.bend).max() <= self.share * self.reach)
        if self.quiet:
            return within and bool((rms <= chosen.NOISE_SLACK * sigma[::3]).all())
        apart = np.abs(medians * ratio - self.medians).max()
        return within and bool(apart <= settings.WIDE * self.typical * self.reach)


@dataclass(frozen=True, eq=False)
class Sums:
    """Products of rows, with what must be known of them beside.

    ``weighed`` (G, K + 1, K + 1): of rows with weight, positions and orientations apart, in units of each row's own
    noise over that of all, columns and gap at the point of linearisation; ``plain``: of rows not set aside, m and rad.
    ``rows``, ``used`` and ``kept``: how many there are, have weight, are not set aside; ``below`` (G,): nearer than the
    median. ``guard`` says how far it holds; ``None`` where rows keep their weights, or there are none.
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
