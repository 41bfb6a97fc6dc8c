"""The engine of optimal design: which candidate tells most about the parameters while the frames are unknown.

The information of samples about the parameters is I(y; θ) = I(y; θ, f) − I(y; f | θ), with f the frames: half the
difference of two log determinants. Each choice maximises it given those before: a greedy D-optimal Bayesian design
(Chaloner and Verdinelli, *Statistical Science* 10, 1995).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array


def most_informative(
    root: Array, frames: Array, count: int, alike: NDArray[np.int64] | None = None
) -> tuple[list[int], list[float]]:
    """Choose candidates greedily, those that tell most about the parameters.

    Parameters
    ----------
    root, frames
        (K, m, p) and (K, m, f): root of the covariance of what is expected of each candidate's m components, in units
        of the noise, and of its part from the frames, were the parameters known.
    count
        How many are chosen.
    alike
        (K,) of those with the same number only one may be chosen; by default each has its own.

    Returns
    -------
    chosen
        Candidates, in the order in which they were chosen.
    gains
        Information of each and those before it, nats.
    """
    alike = np.arange(len(root)) if alike is None else alike
    free = np.ones(len(root), dtype=bool)
    chosen: list[int] = []
    gains: list[float] = []
    for _ in range(count):
        information = np.where(free, log_det(root) - log_det(frames), -np.inf)
        row = int(information.argmax())
        chosen.append(row)
        gains.append(float(information[row]) + (gains[-1] if gains else 0.0))
        root, frames = _learnt(root, root[row]), _learnt(frames, frames[row])
        free &= alike != alike[row]
    return chosen, gains


def log_det(root: Array) -> Array:
    """(K,) half the log determinant of root root' + 1 of each candidate, nats."""
    own = root @ root.transpose(0, 2, 1) + np.eye(root.shape[1])
    return np.asarray(0.5 * np.linalg.slogdet(own)[1])


def _learnt(root: Array, row: Array) -> Array:
    """(K, m, p) the root once a sample (m, p) was measured: root (1 + row' row)^(−½)."""
    if not row.size:
        return root
    _, value, along = np.linalg.svd(row, full_matrices=False)
    return np.asarray(root - ((root @ along.T) * (1.0 - 1.0 / np.sqrt(1.0 + value**2))) @ along)
