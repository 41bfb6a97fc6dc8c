"""Columns of a linear problem over very many rows: each different one is held once, and rows are taken in chunks."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from hashlib import blake2b

import numpy as np
from numpy.typing import NDArray

from thermal_robot.inference import settings

Array = NDArray[np.float64]
Numbers = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Stack:
    """K columns over E = n·m equations, n rows of m components.

    The settings of one effect share most of their columns: of all settings together a third are different.

    Attributes
    ----------
    different
        U arrays (E,): the columns that differ.
    number
        (K,) which of these each column is.
    measures
        m.
    """

    different: tuple[Array, ...]
    number: Numbers
    measures: int

    @classmethod
    def of(cls, columns: Iterable[Array], used: Numbers, root: Array) -> Stack:
        """Take columns (N, m, ·), some at a time, of the rows in use, each multiplied by ``root`` (n, m)."""
        different: list[Array] = []
        number: list[int] = []
        seen: dict[bytes, int] = {}
        for some in columns:
            for k in range(some.shape[2]):
                own = np.ascontiguousarray(some[:, :, k])
                key = blake2b(own.tobytes(), digest_size=16).digest()
                if key not in seen:
                    seen[key] = len(different)
                    different.append((own[used] * root).ravel())
                number.append(seen[key])
        return cls(tuple(different), np.array(number, dtype=np.int64), root.shape[1])

    @classmethod
    def around(cls, array: Array, measures: int) -> Stack:
        """Take the (E, K) columns of an array as they are."""
        return cls(tuple(array.T), np.arange(array.shape[1]), measures)

    @property
    def equations(self) -> int:
        """E."""
        return len(self.different[0])

    def differing(self, kept: Numbers) -> Stack:
        """Return some of the columns that differ, each once."""
        return Stack(tuple(self.different[k] for k in kept), np.arange(len(kept)), self.measures)

    def rows(self, which: slice | Numbers) -> Array:
        """(r, m, U) the different columns of some rows."""
        first = next(iter(self.different)).reshape(-1, self.measures)[which]
        found = np.empty((*first.shape, len(self.different)))
        for k, own in enumerate(self.different):
            found[:, :, k] = own.reshape(-1, self.measures)[which]
        return found

    def chunks(self) -> Iterator[tuple[slice, Array]]:
        """Yield the rows in chunks: which they are, and (r, m, U) their columns."""
        for part in chunks(self.equations // self.measures):
            yield part, self.rows(part)

    def products(self) -> Array:
        """(K, K) products of the columns, summed over the equations."""
        found = np.zeros((len(self.different),) * 2)
        for _, rows in self.chunks():
            flat = rows.reshape(-1, rows.shape[2])
            found += flat.T @ flat
        return np.asarray(found[np.ix_(self.number, self.number)])


def chunks(rows: int) -> Iterator[slice]:
    """Yield the slices of so many rows that are worked on at a time."""
    for start in range(0, rows, settings.CHUNK):
        yield slice(start, min(start + settings.CHUNK, rows))
