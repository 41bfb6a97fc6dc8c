"""Rank-revealing least squares: the one place where weakly determined directions are dropped.

The solvers scale columns to unit length first, so that one tolerance serves metres, radians and coefficients alike.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from thermal_robot.arrays import Array
from thermal_robot.inference import settings


def equations_of(columns: Array) -> Array:
    """Reshape columns (n, m, K) to (n·m, K), one equation a row; n and K may be 0."""
    return columns.reshape(columns.shape[0] * columns.shape[1], columns.shape[2])


def rms(vectors: Array) -> float:
    """Root mean square of the lengths of vectors (N, k)."""
    return float(np.sqrt((vectors**2).sum(axis=1).mean()))


def total_probability(probabilities: ArrayLike) -> float:
    """Sum the probabilities of mutually exclusive cases; rounding errors above 1 are clipped."""
    return min(float(np.sum(probabilities)), 1.0)


def whitener(gram: Array, floor: float = settings.SEEN) -> Array:
    """Return the whitening matrix R (D, r), Rᵀ G R = 1, of columns with the Gram matrix G (D, D).

    G is first scaled to a unit diagonal. Directions whose eigenvalue is then below ``floor`` times the largest are
    left out: what remains of them is rounding.
    """
    length = np.sqrt(np.maximum(np.diag(gram), 0.0))
    length[length == 0.0] = 1.0
    value, vector = np.linalg.eigh(gram / np.outer(length, length))
    seen = value > floor * value.max(initial=1.0)
    return np.asarray(vector[:, seen] / np.sqrt(value[seen]) / length[:, None])


def solve(matrix: Array, vector: Array) -> Array:
    """Solve normal equations by a pseudo-inverse: (D,), zero in directions that nothing determines."""
    root = whitener(matrix)
    return np.asarray(root @ (root.T @ vector))


def orthonormal(columns: Array) -> Array:
    """Return an orthonormal basis (E, r) of the span of columns (E, D).

    Columns are whitened twice, the second time against rounding, as in CholeskyQR2 (Yamamoto et al., *Electronic
    Transactions on Numerical Analysis* 44, 2015).
    """
    for _ in range(2):
        columns = columns @ whitener(columns.T @ columns)
    return columns


def without(columns: Array, basis: Array) -> Array:
    """Project the span of an orthonormal basis (E, r) out of columns (E, ...)."""
    return np.asarray(columns - basis @ (basis.T @ columns))


def ridge(products: Array, flat: int, prior: Array) -> Array:
    """Ridge regression: posterior mean (K,) with normal priors, from the Gram matrix (K + 1, K + 1) alone.

    The last row and column of ``products`` belong to the fitted values. The first ``flat`` coefficients have no prior
    and stay at zero where nothing determines them; ``prior`` (K − flat,) is one over the prior variance of the others.
    """
    matrix = products[:-1, :-1].copy()
    own = np.diag(matrix)[:flat]
    matrix[np.diag_indices(len(matrix))] += np.concatenate([settings.FRAME_PRIOR * own + settings.TINY, prior])
    length = np.sqrt(np.diag(matrix))
    scaled = matrix / np.outer(length, length) + settings.FRAME_PRIOR * np.eye(len(matrix))
    return np.asarray(np.linalg.solve(scaled, products[:-1, -1] / length) / length)
