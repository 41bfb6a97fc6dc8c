"""Directions that the data see: here, and only here, columns are scaled, weak directions dropped, the rest solved for.

Every function scales to unit columns first, so that one floor serves metres, radians and coefficients alike.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from thermal_robot.inference import settings

Array = NDArray[np.float64]


def whitener(gram: Array, floor: float = settings.SEEN) -> Array:
    """Return R (D, r) with Rᵀ G R = 1: columns with the Gram matrix G (D, D), times R, are orthonormal.

    Directions whose eigenvalue, of the matrix scaled to a unit diagonal, lies below ``floor`` times the largest are
    left out: what remains of them is rounding.
    """
    length = np.sqrt(np.maximum(np.diag(gram), 0.0))
    length[length == 0.0] = 1.0
    value, vector = np.linalg.eigh(gram / np.outer(length, length))
    seen = value > floor * value.max(initial=1.0)
    return np.asarray(vector[:, seen] / np.sqrt(value[seen]) / length[:, None])


def solve(matrix: Array, vector: Array) -> Array:
    """Return the (D,) least-squares solution of normal equations; what nothing determines is zero."""
    root = whitener(matrix)
    return np.asarray(root @ (root.T @ vector))


def orthonormal(columns: Array) -> Array:
    """Return (E, r) an orthonormal basis of what (E, D) columns span."""
    scaled = columns / (np.linalg.norm(columns, axis=0) + settings.TINY)
    return np.linalg.qr(scaled @ whitener(scaled.T @ scaled))[0]


def without(columns: Array, basis: Array) -> Array:
    """Return (E, ...) columns with an orthonormal basis (E, r) projected out."""
    return np.asarray(columns - basis @ (basis.T @ columns))


def ridge(products: Array, flat: int, prior: Array) -> Array:
    """Return the (K,) solution of a fit from its sums of products alone.

    Parameters
    ----------
    products
        (K + 1, K + 1) products of K columns and the values, summed over the rows.
    flat
        How many columns come first that have no prior; what nothing determines stays where it is.
    prior
        (K − flat,) one over the prior variance of each other column, in the units of ``products``.
    """
    matrix = products[:-1, :-1].copy()
    own = np.diag(matrix)[:flat]
    matrix[np.diag_indices(len(matrix))] += np.concatenate([settings.FRAME_PRIOR * own + settings.TINY, prior])
    length = np.sqrt(np.diag(matrix))
    return np.asarray(np.linalg.solve(matrix / np.outer(length, length), products[:-1, -1] / length) / length)
