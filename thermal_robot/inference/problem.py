"""Linear problem of all candidate columns, and its normal equations for any rows and weights."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import equations_of, solve, whitener
from thermal_robot.inference.columns import Block
from thermal_robot.inference.evidence import Combination, Gram
from thermal_robot.inference.kernels import DesignMatrix, KernelCovariance


@dataclass(frozen=True, eq=False)
class Linear:
    """Linear model gap ≈ F f + Σ_b X_b θ_b + noise, root frame axes: gap (N, m), m and rad, frames F (N, m, f).

    Values that were already applied are added back to the gap, so that θ is the whole value.
    """

    gap: Array
    frames: Array
    blocks: tuple[Block, ...]

    @property
    def measures(self) -> int:
        """Components m of a row: 3 for positions, 6 for poses."""
        return int(self.gap.shape[1])

    @property
    def columns(self) -> Iterator[Array]:
        """Columns (N, m, ·) of frames, blocks and gap, one after another."""
        yield self.frames
        yield from (b.columns for b in self.blocks)
        yield self.gap[:, :, None]

    @cached_property
    def stack(self) -> Array:
        """All columns in one array (N, m, f + P + 1)."""
        return self.rows(np.arange(len(self.gap)))

    def rows(self, rows: NDArray[np.int64]) -> Array:
        """All columns (n, m, f + P + 1) of some rows, not cached."""
        width = self.frames.shape[2] + sum(len(b.sizes) for b in self.blocks) + 1
        found, start = np.empty((len(rows), self.measures, width)), 0
        for columns in self.columns:
            found[:, :, start : start + columns.shape[2]] = columns[rows]
            start += columns.shape[2]
        return found

    def contribution(self, block: int, values: Array) -> Array:
        """Displacement (N, m) of the gap by a block's parameter values."""
        return np.asarray(self.blocks[block].columns @ values)


@dataclass(frozen=True, eq=False)
class Whitening:
    """Row weights (N,), 0 where not used, else up to 1, and noise (m,) of each component, m and rad.

    ``held``: degrees of freedom of the noise's prior, 0 where none is stated. ``smooth``: the correlated part of the
    rows' covariance. ``relative`` (N, m): noise of each figure over that of its component. ``seen`` (N, m/3): how many
    components of its place and turn a row sees, ``None`` for all in all rows.
    """

    weights: Array
    noise: Array
    held: float
    smooth: KernelCovariance | None = None
    relative: Array | None = None
    seen: NDArray[np.int64] | None = None

    @property
    def unseen(self) -> int:
        """Number of components that the rows in use do not measure, and that therefore are no equations."""
        return 0 if self.seen is None else int((3 - self.seen[self.weights > 0]).sum())

    def figures(self, measures: int) -> NDArray[np.int64] | int:
        """Return the number of measured components of a row: (N,) where rows differ."""
        return measures if self.seen is None else np.maximum(self.seen.sum(axis=1), 1)

    def sigma(self, rows: NDArray[Any] | slice = slice(None)) -> Array:
        """One sigma (n, m) of each component of some rows, m and rad; (1, m) where all rows are alike."""
        return self.noise[None] if self.relative is None else self.noise * self.relative[rows]


def gram(linear: Linear, whitening: Whitening) -> Gram:
    """Return normal equations: frames projected out, each block reduced to the directions that the data determine."""
    equations = int((whitening.weights > 0).sum()) * linear.measures
    return normal_equations(linear, whitening, products(linear, whitening), equations)


def products(linear: Linear, whitening: Whitening) -> Array:
    """Gram matrix (f + P + 1, f + P + 1) of the whitened columns of frames, parameters and gap, by chunks of rows."""
    stack = white_stack(DesignMatrix.of(linear.columns), whitening)
    return stack.products() if whitening.smooth is None else whitening.smooth.products(stack)


def white_stack(stack: DesignMatrix, whitening: Whitening) -> DesignMatrix:
    """Columns of the rows with weight, times root weight over noise; a correlated discrepancy is not whitened."""
    used = np.flatnonzero(whitening.weights > 0)
    return stack.weighted(used, np.sqrt(whitening.weights[used])[:, None] / whitening.sigma(used))


def normal_equations(
    linear: Linear, whitening: Whitening, full: Array, equations: int, like: Gram | None = None
) -> Gram:
    """Return the normal equations from the Gram matrix of all columns, frames projected out and each block reduced.

    ``full`` (f + P + 1, f + P + 1) are the products of the whitened columns; the reduction of each block is that of
    ``like``, or else to the directions that the data determine.
    """
    flat = linear.frames.shape[2]
    sizes = np.concatenate([*(b.sizes for b in linear.blocks), [1.0]])
    cross = full[:flat, flat:] * sizes
    known = whitener(full[:flat, :flat])
    along = known.T @ cross
    rest = full[flat:, flat:] * np.outer(sizes, sizes) - along.T @ along
    rest = 0.5 * (rest + rest.T)
    bases, ranks = (like.bases, like.ranks) if like else _reduction(linear, rest, np.diag(full)[flat:] * sizes**2)
    ends = np.cumsum([0, *(basis.shape[1] for basis in bases)]).tolist()
    log_det = _log_det(full[:flat, :flat], known.shape[1])
    return Gram(
        _reduced(_reduced(rest[:-1, :-1], bases).T, bases).T,
        _reduced(rest[-1:, :-1], bases)[0],
        float(rest[-1, -1]),
        tuple(slice(a, b) for a, b in pairwise(ends)),
        bases,
        _positive(linear, bases),
        ranks,
        np.array([b.spread for b in linear.blocks]),
        equations - whitening.unseen - known.shape[1],
        whitening.held,
        -0.5 * (log_det + (whitening.smooth.log_det if whitening.smooth else 0.0)),
        np.array([b.largest_scale for b in linear.blocks]),
    )


def _reduction(linear: Linear, rest: Array, before: Array) -> tuple[tuple[Array, ...], tuple[int, ...]]:
    """Eigenvectors of each block's information matrix with eigenvalues above rounding and noise, and their number.

    In a block with non-negative parameters, each determined parameter is its own direction.
    """
    bases, ranks, parameter = [], [], 0
    for item in linear.blocks:
        own = slice(parameter, parameter + len(item.sizes))
        value, vector = np.linalg.eigh(rest[own, own])
        # what is left of an exact alias of the frames is rounding of what it was before they were projected out
        longest = float(before[own].max(initial=0.0))
        floor = max(settings.INFORMATION_FLOOR, settings.PROJECTED_FLOOR * longest)
        seen = value > floor
        if item.positive.any():
            bases.append(np.eye(len(item.sizes))[:, np.diag(rest)[own] > floor])
        else:
            bases.append(vector[:, seen])
        ranks.append(int(seen.sum()))
        parameter = own.stop
    return tuple(bases), tuple(ranks)


def _positive(linear: Linear, bases: Sequence[Array]) -> NDArray[np.bool_]:
    """Mask (D,) of the reduced columns that cannot be negative."""
    pairs = zip(linear.blocks, bases, strict=True)
    return np.concatenate([*((item.positive @ basis).astype(bool) for item, basis in pairs), np.zeros(0, dtype=bool)])


def _reduced(rows: Array, bases: Sequence[Array]) -> Array:
    """Rows (n, D) in the reduced coordinates of each block, from rows (n, P) over all parameters."""
    result = np.empty((len(rows), sum(b.shape[1] for b in bases)))
    parameter, column = 0, 0
    for basis in bases:
        size, width = basis.shape
        np.matmul(rows[:, parameter : parameter + size], basis, out=result[:, column : column + width])
        parameter, column = parameter + size, column + width
    return result


def _log_det(matrix: Array, rank: int) -> float:
    """Log pseudo-determinant: logarithm of the product of the largest ``rank`` eigenvalues."""
    if not rank:
        return 0.0
    return float(np.log(np.linalg.eigvalsh(matrix)[-rank:]).sum())


def whitened(linear: Linear, whitening: Whitening) -> Array:
    """Whitened design (rows·m, f + P + 1) of frames, parameters and gap, over the rows with weight."""
    used = np.flatnonzero(whitening.weights > 0)
    return _white(linear.rows(used), used, whitening)


def whitened_columns(columns: Array, whitening: Whitening) -> Array:
    """Whitened columns (rows·m, K) over the rows with weight."""
    used = np.flatnonzero(whitening.weights > 0)
    return _white(columns[used], used, whitening)


def _white(stack: Array, used: NDArray[np.int64], whitening: Whitening) -> Array:
    """Whiten columns (n, m, K) of the rows in use, in place."""
    stack *= (np.sqrt(whitening.weights[used])[:, None] / whitening.sigma(used))[:, :, None]
    flat = equations_of(stack)
    return flat if whitening.smooth is None else whitening.smooth.whitened(flat)


def contained(problem: Gram) -> frozenset[frozenset[int]]:
    """Nested pairs of blocks: the columns of the smaller lie in the span of the larger, up to what the data resolve.

    The two exclude each other; the smaller is preferred where it suffices. A block with non-negative parameters
    contains none, as it does not span its columns.
    """
    matrix, slices = problem.matrix, problem.slices
    sizes = np.array(problem.ranks, dtype=int)
    owner = np.repeat(np.arange(len(slices)), [s.stop - s.start for s in slices])
    total = np.bincount(owner, np.diag(matrix), len(slices))
    enough = np.maximum(settings.CONTAINED * total, settings.CONTAINED_LEFT)
    pairs = set()
    for large, outer in enumerate(slices):
        smaller = (sizes > 0) & (sizes < sizes[large])
        if not smaller.any() or problem.positive[outer].any():
            continue
        inside = ((matrix[:, outer] @ whitener(matrix[outer, outer])) ** 2).sum(axis=1)
        left = total - np.bincount(owner, inside, len(slices))
        pairs |= {frozenset((int(small), large)) for small in np.flatnonzero(smaller & (left < enough))}
    return frozenset(pairs)


def parameter_values(linear: Linear, problem: Gram, found: Combination) -> dict[int, tuple[Array, Array]]:
    """Posterior mode (P,) and covariance (P, P) of the parameters of each block of a combination, SI.

    Directions that the data do not see keep their prior variance.
    """
    result, start = {}, 0
    values, every = problem.posterior(found)
    for index in found.blocks:
        basis, sizes = problem.bases[index], linear.blocks[index].sizes
        stop = start + basis.shape[1]
        mean = sizes * (basis @ values[start:stop])
        hidden = np.eye(len(sizes)) - basis @ basis.T
        hidden = hidden @ hidden.T * found.scales[index] ** 2  # a projection still, and rounding is not negative
        covariance = basis @ every[start:stop, start:stop] @ basis.T + hidden
        result[index] = (mean, sizes[:, None] * covariance * sizes)
        start = stop
    return result


def frame_step(linear: Linear, whitening: Whitening, remainder: Array) -> Array:
    """Least-squares step (f,) of the unknown frames that fits a residual, over the rows with weight."""
    flat = linear.frames.shape[2]
    if not flat:
        return np.zeros(0)
    full = products(Linear(remainder, linear.frames, ()), whitening)
    return solve(full[:flat, :flat], full[:flat, flat])


def discrepancy_mean(whitening: Whitening, remainder: Array) -> Array:
    """Posterior mean (N, m) of the discrepancy in a residual; zero without one."""
    if whitening.smooth is None:
        return np.zeros_like(remainder)
    used = np.flatnonzero(whitening.weights > 0)
    root = np.sqrt(whitening.weights[used])
    left = (remainder[used] / whitening.sigma(used) * root[:, None]).ravel()
    return np.asarray(whitening.smooth.mean(left) * whitening.sigma())


def generalised(linear: Linear, covariance: Array, noise: Array) -> Linear:
    """Generalised least squares: each row times diag(noise) L⁻¹, where L Lᵀ is its covariance (Aitken 1935).

    The residual's ``covariance`` (N, m, m) is then diag(noise²) in all rows; noise (m,), m and rad.
    """
    root = np.linalg.cholesky(covariance)

    def white(columns: Array) -> Array:
        return np.asarray(noise[:, None] * np.linalg.solve(root, columns))

    return Linear(
        white(linear.gap[:, :, None])[:, :, 0],
        white(linear.frames),
        tuple(replace(block, source=white(block.columns)) for block in linear.blocks),
    )


class Products:
    """Memo of Gram matrices for many selections of blocks with the same gap, frames and whitening.

    A block exchanged for another one costs its own products alone. The memo of a block is freed with it.
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
        """Linear problem of some blocks and its normal equations, as ``gram`` forms them."""
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
        """Cross products (P, Q) of the columns of two blocks."""
        for first, second in ((one, other), (other, one)):
            known = self._pairs[first].get(second) if first in self._pairs else None
            if known is not None:
                return known if first is one else np.asarray(known.T)
        found = self._white[one].T @ self._white[other]
        self._pairs.setdefault(one, WeakKeyDictionary())[other] = found
        return np.asarray(found)
