"""What an explanation leaves, whitened, and what near-repeats say of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from thermal_robot.inference import settings
from thermal_robot.inference.algebra import orthonormal, without
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.target import Target

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Remainder:
    """What is left after the explanation, of N rows that are not outliers.

    Attributes
    ----------
    rows
        Their numbers.
    target
        The remainder in units of the noise that was settled on, everything that was fitted projected out.
    """

    rows: NDArray[np.int64]
    target: Target

    @property
    def white(self) -> Array:
        """(N, m) remainder over the noise."""
        return self.target.white.reshape(len(self.rows), -1)

    @property
    def freedom(self) -> int:
        """Equations less what was fitted."""
        return self.target.freedom

    @property
    def scale2(self) -> float:
        """Mean square, corrected for what was fitted, in squares of the noise."""
        return float((self.white**2).sum() / self.freedom)

    def some(self, count: int) -> Remainder:
        """Return so many rows drawn at random, with what was fitted projected out of them; all if they are fewer."""
        if len(self.rows) <= count:
            return self
        drawn = np.sort(np.random.default_rng(settings.TEST_SEED).choice(len(self.rows), count, replace=False))
        m = self.white.shape[1]
        basis, _ = np.linalg.qr(self.target.basis.reshape(len(self.rows), m, -1)[drawn].reshape(count * m, -1))
        white = without(self.white[drawn].ravel(), basis)
        return Remainder(self.rows[drawn], Target(white, self.target.root[drawn], basis))


def remainder(fit: Fit) -> Remainder:
    """Refit frames and explanation without priors, so that tests on what is left are exact."""
    e = fit.explanation
    rows = np.flatnonzero(~e.outliers)
    columns = [e.linear.frames[rows]]
    for b in e.best.blocks:
        columns.append(e.linear.blocks[b].columns[rows] * e.linear.blocks[b].sizes)
    root = np.broadcast_to(1.0 / e.whitening.noise, (len(rows), len(e.whitening.noise)))
    design = np.concatenate(columns, axis=2) * root[:, :, None]
    basis = orthonormal(design.reshape(root.size, design.shape[2]))
    # of the exact model, not the linear one: where effects are large and noise is small they differ
    gap = (fit.corrected.gap[rows] * root).ravel()
    return Remainder(rows, Target(without(gap, basis), root, basis))


@dataclass(frozen=True)
class Repeats:
    """What near-repeats say: the noise's mean square in squares of the settled noise, from how many pairs."""

    pairs: int
    scale2: float
    position: float


def repeats(fit: Fit, left: Remainder) -> Repeats | None:
    """Compare each command with its nearest neighbour, if near (``settings.NEAR``); ``None`` where too few have one."""
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
    """Return distances and numbers (N, count) of each point's nearest others, itself left out however many coincide."""
    from scipy.spatial import cKDTree

    distance, number = cKDTree(points).query(points, k=count + 1)
    own = number == np.arange(len(points))[:, None]
    own[~own.any(axis=1), -1] = True  # others at the same place came first: drop the last of them
    shape = (len(points), count)
    return distance[~own].reshape(shape), number[~own].reshape(shape)
