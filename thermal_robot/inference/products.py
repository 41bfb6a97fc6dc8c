"""Products of whitened columns, kept while weights and noise stay: no column is formed, or multiplied, twice."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from weakref import WeakKeyDictionary

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.inference.columns import Block
from thermal_robot.inference.gram import Gram
from thermal_robot.inference.problem import Linear, Whitening, normal_equations, whitened_columns


class Products:
    """Gram matrices of many selections of blocks with the same gap, frames and whitening.

    A block that takes the place of another costs its own columns and their products with the others. What is kept of a
    block goes with it.
    """

    def __init__(self, linear: Linear, whitening: Whitening) -> None:
        self._gap, self._frames, self._whitening = linear.gap, linear.frames, whitening
        both = np.concatenate([linear.frames, linear.gap[:, :, None]], axis=2)
        self._flat = whitened_columns(both, whitening)
        self._own = self._flat.T @ self._flat
        self._white: WeakKeyDictionary[Block, Array] = WeakKeyDictionary()
        self._beside: WeakKeyDictionary[Block, Array] = WeakKeyDictionary()
        self._pairs: WeakKeyDictionary[Block, WeakKeyDictionary[Block, Array]] = WeakKeyDictionary()

    def problem(self, blocks: Sequence[Block]) -> tuple[Linear, Gram]:
        """Return the linear problem of some blocks and its normal equations, as ``gram`` forms them."""
        linear, flat = Linear(self._gap, self._frames, tuple(blocks)), self._frames.shape[2]
        ends = np.cumsum([flat, *(len(item.sizes) for item in blocks)]).tolist()
        spans = [slice(a, b) for a, b in pairwise(ends)]
        full, outer = np.zeros((ends[-1] + 1, ends[-1] + 1)), np.array([*range(flat), ends[-1]])
        full[np.ix_(outer, outer)] = self._own
        for k, (item, span) in enumerate(zip(blocks, spans, strict=True)):
            if item not in self._white:
                self._white[item] = whitened_columns(item.columns, self._whitening)
                self._beside[item] = self._flat.T @ self._white[item]
            full[outer, span] = self._beside[item]
            full[span, outer] = self._beside[item].T
            for other, there in zip(blocks[: k + 1], spans[: k + 1], strict=True):
                full[there, span] = products = self._pair(other, item)
                full[span, there] = products.T
        return linear, normal_equations(linear, self._whitening, full, len(self._flat))

    def _pair(self, one: Block, other: Block) -> Array:
        """Return the (P, Q) products of the columns of two blocks."""
        for first, second in ((one, other), (other, one)):
            known = self._pairs[first].get(second) if first in self._pairs else None
            if known is not None:
                return known if first is one else np.asarray(known.T)
        found = self._white[one].T @ self._white[other]
        self._pairs.setdefault(one, WeakKeyDictionary())[other] = found
        return np.asarray(found)
