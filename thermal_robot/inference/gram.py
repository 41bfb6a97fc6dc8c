"""A linear problem as the evidence sees it: products of its columns, the unknown frames projected out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array


@dataclass(frozen=True, eq=False)
class Gram:
    """Normal equations of a linear problem after the frames are projected out, whitened, in units of prior sizes.

    G (D, D), b (D,) and y'y are ``matrix``, ``vector`` and ``total``; each block, reduced to what the data see of it
    (``ranks``), has D_b columns (``slices``), of which ``bases`` (P_b, D_b) are the parameter values. ``positive`` (D,)
    cannot be negative: each is then a parameter. ``spreads`` (B,): prior standard deviation of ln λ; ``most`` (B,): λ
    at most. ``equations`` n is less the rank of the frames; ``noise_dof`` holds the whitening noise, 0 where it is not
    known; ``offset`` is the log evidence that all combinations share: −½ log of the determinants of the rows'
    covariance and of the frames, and the log prior of that covariance.
    """

    matrix: Array
    vector: Array
    total: float
    slices: tuple[slice, ...]
    bases: tuple[Array, ...]
    positive: NDArray[np.bool_]
    ranks: tuple[int, ...]
    spreads: Array
    equations: float
    noise_dof: float
    offset: float = 0.0
    most: Array | None = None

    def columns_of(self, blocks: Sequence[int]) -> NDArray[np.int64]:
        """(D_γ,) numbers of the reduced columns of some blocks."""
        return np.array([k for b in blocks for k in range(self.slices[b].start, self.slices[b].stop)], dtype=int)

    def some(self, blocks: Sequence[int]) -> Gram:
        """Return the problem of some of the blocks alone."""
        widths = [self.bases[b].shape[1] for b in blocks]
        ends = np.cumsum([0, *widths])
        own = self.columns_of(blocks)
        return replace(
            self,
            matrix=self.matrix[own[:, None], own],
            vector=self.vector[own],
            slices=tuple(slice(a, b) for a, b in pairwise(ends.tolist())),
            bases=tuple(self.bases[b] for b in blocks),
            positive=self.positive[own],
            ranks=tuple(self.ranks[b] for b in blocks),
            spreads=self.spreads[list(blocks)],
            most=None if self.most is None else self.most[list(blocks)],
        )
