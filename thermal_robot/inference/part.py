"""B of a discrepancy, functions × moves row by row: never written out, as it has a column for each pair of the two."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.inference.algebra import equations_of
from thermal_robot.inference.stack import chunks


@dataclass(frozen=True, eq=False)
class Part:
    """B = functions × moves of the rows in use.

    Attributes
    ----------
    functions
        (N, k) of all rows.
    moves
        (N, m, c) of all rows, in units of the noise; (m, c) where all rows have the same.
    used, root
        (n,) the rows in use, and the square roots of their weights.
    """

    functions: Array
    moves: Array
    used: NDArray[np.int64]
    root: Array

    def rows(self, chunk: slice) -> tuple[Array, Array]:
        """Return functions (r, k), square roots of the weights included, and moves of some of the rows in use."""
        which = self.used[chunk]
        moves = self.moves if self.moves.ndim == 2 else self.moves[which]
        return self.functions[which] * self.root[chunk, None], moves

    def adjoint(self, stack: Array, chunk: slice) -> Array:
        """Bᵀ times the columns (r, m, s) of some rows: (c k, s)."""
        functions, moves = self.rows(chunk)
        carried = np.moveaxis(np.matmul(np.swapaxes(moves, -1, -2), stack), 1, 0)
        return np.asarray(equations_of(np.matmul(functions.T, carried)))

    def times(self, inner: Array, chunk: slice) -> Array:
        """B times (c k, s), for some rows: (r, m, s)."""
        functions, moves = self.rows(chunk)
        carried = np.matmul(functions, inner.reshape(moves.shape[-1], functions.shape[1], inner.shape[1]))
        return np.asarray(np.matmul(moves, np.moveaxis(carried, 0, 1)))

    @property
    def wide(self) -> bool:
        """Whether B has more columns than rows."""
        return bool(len(self.used) * self.moves.shape[-2] <= self.functions.shape[1] * self.moves.shape[-1])

    def own(self) -> Array:
        """B Bᵀ (n m, n m) where B is wide, else BᵀB (c k, c k)."""
        if self.wide:
            functions, moves = self.rows(slice(None))
            m, c = moves.shape[-2:]
            flat = equations_of(np.broadcast_to(moves, (len(functions), m, c)))
            return np.asarray(np.repeat(np.repeat(functions @ functions.T, m, 0), m, 1) * (flat @ flat.T))
        c, count = self.moves.shape[-1], self.functions.shape[1]
        found = np.zeros((c, count, c, count))
        for chunk in chunks(len(self.used)):
            functions, moves = self.rows(chunk)
            moves = np.broadcast_to(moves, (len(functions), *moves.shape[-2:]))
            pairs = np.einsum("nac,nad->cdn", moves, moves, optimize=True)
            for i in range(c):
                for j in range(i, c):
                    found[i, :, j] += (functions * pairs[i, j][:, None]).T @ functions
        for i in range(c):
            for j in range(i + 1, c):
                found[j, :, i] = found[i, :, j].T
        return found.reshape(c * count, c * count)
