"""The whitened residual of a fit, and the noise that near-repeats show."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import orthonormal, without
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.target import Target


@dataclass(frozen=True, eq=False)
class Remainder:
    """Residual of a fit, of the N rows that are not outliers.

    Attributes
    ----------
    rows
        Their numbers.
    target
        The residual in units of the estimated noise, with all fitted columns projected out.
    """

    rows: NDArray[np.int64]
    target: Target

    @property
    def white(self) -> Array:
        """(N, m) residual over the noise."""
        return self.target.white.reshape(len(self.rows), -1)

    @property
    def freedom(self) -> int:
        """Degrees of freedom: equations less fitted columns."""
        return self.target.freedom

    @property
    def scale2(self) -> float:
        """Sum of squares over the degrees of freedom, in squares of the noise."""
        return float((self.white**2).sum() / self.freedom)

    def some(self, count: int) -> Remainder:
        """Return a random subset of rows with the fitted columns projected out again; all rows if there are fewer."""
        if len(self.rows) <= count:
            return self
        drawn = np.sort(np.random.default_rng(settings.TEST_SEED).choice(len(self.rows), count, replace=False))
        m = self.white.shape[1]
        basis, _ = np.linalg.qr(self.target.basis.reshape(len(self.rows), m, -1)[drawn].reshape(count * m, -1))
        white = without(self.white[drawn].ravel(), basis)
        return Remainder(self.rows[drawn], Target(white, self.target.root[drawn], basis))


def remainder(fit: Fit) -> Remainder:
    """Return the residual of a fit of frames and effects without priors, so that tests on it are exact."""
    e = fit.explanation
    rows = np.flatnonzero(~e.outliers)
    columns = [e.linear.frames[rows]]
    for b in e.best.blocks:
        columns.append(e.linear.blocks[b].columns[rows] * e.linear.blocks[b].sizes)
    root = np.broadcast_to(1.0 / e.whitening.sigma(rows), (len(rows), len(e.whitening.noise)))
    design = np.concatenate(columns, axis=2) * root[:, :, None]
    basis = orthonormal(design.reshape(root.size, design.shape[2]))
    # of the exact model, not the linear one: where effects are large and noise is small they differ
    gap = (fit.corrected.gap[rows] * root).ravel()
    return Remainder(rows, Target(without(gap, basis), root, basis))


@dataclass(frozen=True)
class Repeats:
    """Noise from near-repeats: number of pairs, mean square over the estimated noise², sigma of position, m."""

    pairs: int
    scale2: float
    position: float


def repeats(fit: Fit, left: Remainder) -> Repeats | None:
    """Estimate the noise from pairs of nearest commands within ``settings.NEAR``; ``None`` with too few pairs."""
    q = fit.campaign.q[left.rows]
    distance, neighbour = nearest(q, 1)
    close = np.flatnonzero(distance[:, 0] < settings.NEAR)
    pairs = np.unique(np.sort(np.column_stack([close, neighbour[close, 0]]), axis=1), axis=0)
    # the remainder of both: their commands may differ by a little, and their conditions by much
    difference = left.white[pairs[:, 0]] - left.white[pairs[:, 1]]
    if len(pairs) < settings.FEWEST_PAIRS:
        return None
    place = (difference[:, :3] * fit.explanation.whitening.noise[0]) ** 2 / 2.0
    return Repeats(len(pairs), float((difference**2).mean() / 2.0), float(np.sqrt(place.mean())))


def nearest(points: Array, count: int) -> tuple[Array, NDArray[np.int64]]:
    """Return distances and indices (N, count) of the nearest other points; a point is never its own neighbour."""
    from scipy.spatial import cKDTree

    distance, number = cKDTree(points).query(points, k=count + 1)
    own = number == np.arange(len(points))[:, None]
    own[~own.any(axis=1), -1] = True  # others at the same place came first: drop the last of them
    shape = (len(points), count)
    return distance[~own].reshape(shape), number[~own].reshape(shape)
