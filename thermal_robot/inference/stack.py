"""Columns of a linear problem over very many rows: each different one is held once, and rows are taken in chunks."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from hashlib import blake2b

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import equations_of

Numbers = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Stack:
    """K columns over E = n·m equations, n rows of m components.

    The settings of one effect share most of their columns: of all settings together a third are different.

    Attributes
    ----------
    different
        U arrays (N, m): the columns that differ, of all rows.
    number
        (K,) which of these each column is.
    used
        (n,) the rows in use.
    root
        (n, m) by which these are multiplied.
    """

    different: tuple[Array, ...]
    number: Numbers
    used: Numbers
    root: Array

    @classmethod
    def of(cls, columns: Iterable[Array]) -> Stack:
        """Take columns (N, m, ·), some at a time, of all rows as they are."""
        different: list[Array] = []
        number: list[int] = []
        seen: dict[bytes, int] = {}
        for some in columns:
            for k in range(some.shape[2]):
                own = np.ascontiguousarray(some[:, :, k])
                key = blake2b(own.tobytes(), digest_size=16).digest()
                if key not in seen:
                    seen[key] = len(different)
                    different.append(own)
                number.append(seen[key])
        return cls(tuple(different), np.array(number), np.arange(len(different[0])), np.ones(different[0].shape))

    @classmethod
    def around(cls, array: Array, measures: int) -> Stack:
        """Take the (E, K) columns of an array as they are."""
        different = tuple(column.reshape(-1, measures) for column in array.T)
        rows = len(array) // measures
        return cls(different, np.arange(len(different)), np.arange(rows), np.ones((rows, measures)))

    def weighed(self, used: Numbers, root: Array) -> Stack:
        """Return the columns over the rows in use, (n,), multiplied by ``root`` (n, m); they are not held anew."""
        return replace(self, used=used, root=root)

    @property
    def equations(self) -> int:
        """E."""
        return self.root.size

    def differing(self, kept: Numbers) -> Stack:
        """Return some of the columns that differ, each once."""
        return replace(self, different=tuple(self.different[k] for k in kept), number=np.arange(len(kept)))

    def rows(self, which: slice | Numbers) -> Array:
        """(r, m, U) the different columns of some rows."""
        rows, root = self.used[which], self.root[which]
        found = np.empty((*root.shape, len(self.different)))
        for k, own in enumerate(self.different):
            np.multiply(own[rows], root, out=found[:, :, k])
        return found

    def chunks(self) -> Iterator[tuple[slice, Array]]:
        """Yield the rows in chunks: which they are, and (r, m, U) their columns."""
        for part in chunks(len(self.used)):
            yield part, self.rows(part)

    def products(self) -> Array:
        """(K, K) products of the columns, summed over the equations."""
        found = np.zeros((len(self.different),) * 2)
        for _, rows in self.chunks():
            flat = equations_of(rows)
            found += flat.T @ flat
        return np.asarray(found[np.ix_(self.number, self.number)])


def chunks(rows: int) -> Iterator[slice]:
    """Yield the slices of so many rows that are worked on at a time."""
    for start in range(0, rows, settings.CHUNK):
        yield slice(start, min(start + settings.CHUNK, rows))
