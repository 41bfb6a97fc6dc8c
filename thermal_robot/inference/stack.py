"""Columns of a linear problem over very many rows: each different one is held once, and rows are taken in chunks."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from hashlib import blake2b

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import equations_of

Numbers = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Stack:
    """K columns over E = n·m equations, n rows of m components, those that settings of an effect share kept once.

    ``different`` are U arrays (N, m) of all rows, ``number`` (K,) which of them each column is, ``used`` (n,) the rows
    in use, ``root`` (n, m) by what they are multiplied.
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


@dataclass(frozen=True, eq=False)
class Part:
    """B = functions (N, k) × moves (N, m, c) of the rows in use (n,), times the square ``root`` (n,) of their weights.

    Moves are in units of the noise; (m, c) where all rows have the same.
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


Labels = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Grouped:
    """1 + τ²BBᵀ where B has c columns for each of G groups of rows: all is done group by group.

    With M_g = Σ over the group's rows of their movesᵀ moves (c, c), by Woodbury's identity Sᵀ(1 + τ²BBᵀ)⁻¹S = SᵀS − τ²
    Σ_g (BᵀS)_gᵀ (1 + τ²M_g)⁻¹ (BᵀS)_g, and log|1 + τ²BBᵀ| = Σ_g log|1 + τ²M_g|. ``moves`` (n, m, c) are in units of the
    noise with the square roots of the weights, ``everywhere`` (N, m, c) without weights; ``value`` (G, c) and
    ``vector`` (G, c, c) are the eigensystem of every M_g.
    """

    moves: Array
    group: NDArray[np.int64]
    everywhere: Array
    groups: NDArray[np.int64]
    value: Array = field(repr=False)
    vector: Array = field(repr=False)

    @classmethod
    def of(cls, moves: Array, groups: NDArray[np.int64], weights: Array, noise: Array) -> Grouped:
        """Scale moves (N, m, c) to a mean square of one a component, in units of the noise, and decompose all M_g."""
        everywhere = moves / noise[:, None]
        everywhere = everywhere / np.sqrt(max(float((everywhere**2).sum(axis=2).mean()), settings.TINY))
        used = np.flatnonzero(weights > 0)
        own = everywhere[used] * np.sqrt(weights[used])[:, None, None]
        count = int(groups.max(initial=-1)) + 1
        inside = _summed(groups[used], own.transpose(0, 2, 1) @ own, count)
        value, vector = np.linalg.eigh(inside)
        return cls(own, groups[used], everywhere, groups, np.maximum(value, 0.0), vector)

    def along(self, stack: Array | Stack) -> list[Array]:
        """Return BᵀS in the eigenvectors of every group: one array (G c, U), S the columns that differ."""
        stack = stack if isinstance(stack, Stack) else Stack.around(stack, self.moves.shape[1])
        found = np.zeros((*self.value.shape, len(stack.different)))
        for groups, rows, starts in _in_chunks(self.group):
            each = self.moves[rows].transpose(0, 2, 1) @ stack.rows(rows)
            found[groups] = self.vector[groups].transpose(0, 2, 1) @ np.add.reduceat(each, starts, axis=0)
        return [equations_of(found)]

    def products(self, tau: float, along: list[Array], plain: Array) -> Array:
        """Return Sᵀ(1 + τ²BBᵀ)⁻¹S, from :meth:`along` and SᵀS."""
        weight = tau**2 / (1.0 + tau**2 * self.value.ravel())
        found = plain.copy()
        for part in chunks(len(weight)):
            found -= along[0][part].T @ (weight[part, None] * along[0][part])
        return found

    def log_det(self, tau: float) -> float:
        """log|1 + τ²BBᵀ|."""
        return float(np.log1p(tau**2 * self.value).sum())

    def degrees(self, tau: float) -> float:
        """Trace of the smoother."""
        return float((tau**2 * self.value / (1.0 + tau**2 * self.value)).sum())

    def whitened(self, tau: float, stack: Array) -> Array:
        """Return (1 + τ²BBᵀ)^(−½) times (E, K) columns."""
        value = self.value.ravel()
        power = np.expm1(-0.5 * np.log1p(tau**2 * value)) / np.maximum(value, settings.SMOOTH_FLOOR)
        return np.asarray(
            stack + self._back(self.moves, self.group, power[:, None] * self.along(stack)[0], stack.shape)
        )

    def mean(self, tau: float, left: Array) -> Array:
        """(N, m) posterior mean given the (E,) residual of the rows in use, in units of the noise."""
        weight = tau**2 / (1.0 + tau**2 * self.value.ravel())
        inner = weight[:, None] * self.along(left[:, None])[0]
        rows = len(self.groups), self.everywhere.shape[1]
        return self._back(self.everywhere, self.groups, inner, (rows[0] * rows[1], 1)).reshape(rows)

    def taken(self, tau: float, rows: NDArray[np.bool_], white: Callable[[Labels], Array], floor: float) -> Array:
        """Return SᵀS − SᵀV⁻¹S over some rows; see :meth:`Smooth.taken <.discrepancy.Smooth.taken>`."""
        heard = tau**2 * self.value > floor
        unit = self.vector * np.where(heard, 1.0 / np.sqrt(np.where(heard, self.value, 1.0)), 0.0)[:, None, :]
        tight = 1.0 / np.where(heard, tau**2 * self.value, 1.0)
        numbers, found = np.flatnonzero(rows), np.zeros((1, 1))
        for groups, which, starts in _in_chunks(self.group[numbers]):
            own = self.moves[numbers[which]] @ unit[self.group[numbers[which]]]
            turned = own.transpose(0, 2, 1)
            along = np.add.reduceat(turned @ white(numbers[which]), starts, axis=0)
            inside = np.add.reduceat(turned @ own, starts, axis=0) + tight[groups][:, :, None] * np.eye(own.shape[2])
            solved = np.asarray(np.linalg.solve(inside, along), dtype=np.float64)
            found = found + np.asarray(equations_of(along).T @ equations_of(solved))
        return found

    def _back(self, moves: Array, group: NDArray[np.int64], inner: Array, shape: tuple[int, ...]) -> Array:
        """Return B times (G c, K) in the eigenvectors of the groups."""
        turned = self.vector @ inner.reshape(*self.value.shape, inner.shape[1])
        return np.asarray((moves @ turned[group]).reshape(shape))


def _in_chunks(group: Labels) -> Iterator[tuple[Labels, Labels, Labels]]:
    """Yield groups by the thousand: which they are, the numbers of their rows, and where in these each group starts."""
    order = np.argsort(group, kind="stable")
    starts = np.flatnonzero(np.diff(group[order], prepend=-1))
    for part in chunks(len(starts)):
        own = starts[part]
        last = starts[part.stop] if part.stop < len(starts) else len(order)
        yield group[order[own]], order[own[0] : last], own - own[0]


def _summed(group: NDArray[np.int64], each: Array, count: int) -> Array:
    """(count, ...) sums of what belongs to each group."""
    found = np.zeros((count, *each.shape[1:]))
    order = np.argsort(group, kind="stable")
    first = np.flatnonzero(np.diff(group[order], prepend=-1))
    if len(first):
        found[group[order][first]] = np.add.reduceat(each[order], first, axis=0)
    return found
