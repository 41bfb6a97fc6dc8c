"""The linear problem that all combinations of effects share, and its Gram matrix for any rows and weights."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from thermal_robot.estimation.columns import Block
from thermal_robot.estimation.evidence import Combination, Gram

Array = NDArray[np.float64]

_INFORMATION_FLOOR = 1e-5  # a column that moves the whole gap by less than this, squared and in noise, is not seen
_CONTAINED = 1e-3


@dataclass(frozen=True, eq=False)
class Linear:
    """gap ≈ F f + Σ_b X_b θ_b + noise, in the root frame's axes.

    Attributes
    ----------
    gap
        (N, m) with the contribution of values already applied put back, so that θ is absolute.
    frames
        (N, m, f) columns of the unknown frames.
    blocks
        The effects' columns.
    """

    gap: Array
    frames: Array
    blocks: tuple[Block, ...]

    @property
    def measures(self) -> int:
        """Components a row: 3 for positions, 6 for poses."""
        return self.gap.shape[1]

    def contribution(self, block: int, values: Array) -> Array:
        """(N, m) what a block's parameter values do to the gap."""
        return np.asarray(self.blocks[block].columns @ values)


@dataclass(frozen=True, eq=False)
class Whitening:
    """Weight of each row and noise of each component.

    Attributes
    ----------
    weights
        (N,) 0 for rows that are not used, else up to 1.
    noise
        (m,) one sigma: m for the first three, rad for the rest.
    held
        Degrees of freedom that the noise is worth as prior knowledge.
    """

    weights: Array
    noise: Array
    held: float


def gram(linear: Linear, whitening: Whitening) -> Gram:
    """Project the frames out, reduce each block to what the data see of it, and form the normal equations."""
    used = np.flatnonzero(whitening.weights > 0)
    root = (np.sqrt(whitening.weights[used])[:, None] / whitening.noise).ravel()
    gap = linear.gap[used].ravel() * root
    flat = linear.frames[used].reshape(len(gap), -1) * root[:, None]
    flat /= np.linalg.norm(flat, axis=0) + 1e-300
    basis, triangle, _ = _pivoted(flat)
    rank = int(np.count_nonzero(np.abs(np.diag(triangle)) > 1e-9)) if flat.shape[1] else 0
    basis = basis[:, :rank]
    gap = gap - basis @ (basis.T @ gap)
    reduced, bases, slices, start = [], [], [], 0
    for item in linear.blocks:
        columns = item.columns[used].reshape(len(gap), -1) * (root[:, None] * item.sizes)
        columns -= basis @ (basis.T @ columns)
        value, vector = np.linalg.eigh(columns.T @ columns) if columns.shape[1] else (np.zeros(0), np.zeros((0, 0)))
        seen = value > max(_INFORMATION_FLOOR, 1e-11 * float(value.max(initial=0.0)))
        bases.append(vector[:, seen])
        reduced.append(columns @ vector[:, seen])
        slices.append(slice(start, start + int(seen.sum())))
        start += int(seen.sum())
    design = np.hstack(reduced) if reduced else np.zeros((len(gap), 0))
    return Gram(
        design,
        gap,
        design.T @ design,
        design.T @ gap,
        float(gap @ gap),
        tuple(slices),
        tuple(bases),
        len(gap) - rank,
        whitening.held,
    )


def _pivoted(flat: Array) -> tuple[Array, Array, Array]:
    from scipy.linalg import qr

    if not flat.shape[1]:
        return np.zeros((len(flat), 0)), np.zeros((0, 0)), np.zeros(0)
    return tuple(qr(flat, mode="economic", pivoting=True, check_finite=False))  # type: ignore[return-value]


def contained(problem: Gram) -> frozenset[frozenset[int]]:
    """Return the pairs of blocks of which one's columns lie, as far as the data can see, within the other's.

    Such a pair is never named together: the smaller is preferred where it suffices, the larger carries both otherwise.
    """
    pairs = set()
    for small, inner in enumerate(problem.slices):
        own = problem.matrix[inner, inner]
        for large, outer in enumerate(problem.slices):
            if small == large or inner.stop == inner.start or outer.stop - outer.start <= inner.stop - inner.start:
                continue
            cross, other = problem.matrix[inner, outer], problem.matrix[outer, outer]
            scale = np.sqrt(np.diag(other))
            inverse = np.linalg.pinv(other / np.outer(scale, scale), rcond=1e-10, hermitian=True)
            left = np.trace(own) - np.trace((cross / scale) @ inverse @ (cross / scale).T)
            if left < max(_CONTAINED * np.trace(own), 0.5):
                pairs.add(frozenset((small, large)))
    return frozenset(pairs)


def parameter_values(linear: Linear, problem: Gram, found: Combination) -> dict[int, tuple[Array, Array]]:
    """Return for each block of a combination the (P,) posterior mean and (P, P) covariance of its parameters, SI.

    Directions that the data do not see keep their prior variance.
    """
    result, start = {}, 0
    for index in found.blocks:
        basis, sizes = problem.bases[index], linear.blocks[index].sizes
        stop = start + basis.shape[1]
        mean = sizes * (basis @ found.values[start:stop])
        hidden = (np.eye(len(sizes)) - basis @ basis.T) * found.scales[index] ** 2
        covariance = basis @ found.covariance[start:stop, start:stop] @ basis.T + hidden
        result[index] = (mean, sizes[:, None] * covariance * sizes)
        start = stop
    return result


def frame_step(linear: Linear, whitening: Whitening, remainder: Array) -> Array:
    """(f,) step of the unknown frames that fits what is left, least squares over the rows with weight."""
    if not linear.frames.shape[2]:
        return np.zeros(0)
    used = np.flatnonzero(whitening.weights > 0)
    root = (np.sqrt(whitening.weights[used])[:, None] / whitening.noise).ravel()
    flat = linear.frames[used].reshape(len(root), -1) * root[:, None]
    length = np.linalg.norm(flat, axis=0) + 1e-300
    step = np.linalg.lstsq(flat / length, remainder[used].ravel() * root, rcond=1e-9)[0] / length
    return np.asarray(step)
