"""Gauss-Legendre sums over several independent uniform parts, as fine as the normal part demands."""

from __future__ import annotations

from itertools import product

import numpy as np

from thermal_robot.arrays import Array

_LARGEST, _LARGEST_GRID = 400_000, 10_000  # nodes
# Standard deviations of the normal part within which the sums are exact to rounding: all of double precision for one
# generator, and as far as a failing probability of 1e-20 where sums multiply.
_REACH, _REACH_MANY = 38.0, 9.0


def link_nodes(covariance: Array, generators: Array) -> tuple[Array, Array]:
    """Nodes and weights for the mean over ``generators @ u``, the ``u`` independent and uniform on [-1, 1].

    A function smoothed by the normal part grows along a generator no faster than ``exp(reach * length * u)``, with
    the length and the reach in standard deviations; panels and nodes follow from that.

    Parameters
    ----------
    covariance
        Normal part, shape ``(d, d)``.
    generators
        Shape ``(d, m)``.

    Returns
    -------
    shifts : Array
        Shape ``(N, d)``.
    weights : Array
        Shape ``(N,)``, sum one.

    Raises
    ------
    ValueError
        When the normal part is too narrow along the generators for a sum of reasonable length.
    """
    reach = _REACH if generators.shape[1] == 1 else _REACH_MANY
    lengths = generator_lengths(covariance, generators)
    # Counted before any node is made: next to a vanishing normal part there would be 1e12 of them.
    if np.prod([panels * count for panels, count in (_rule_size(v, reach) for v in lengths)], dtype=float) > _LARGEST:
        raise ValueError(_too_narrow(len(lengths) + 1))
    rules = [_rule(length, reach) for length in lengths]
    units = np.array(list(product(*(rule[0] for rule in rules)))).reshape(-1, len(rules))
    weights = np.array([np.prod(w) for w in product(*(rule[1] for rule in rules))])
    return units @ generators.T, weights


def planar_link_nodes(covariance: Array, generators: Array) -> tuple[Array, Array]:
    """Nodes and weights for the same mean in the plane, their number independent of how many generators there are.

    A smooth function of the sum of many generators depends on a point in the plane only. The law of the sum is
    therefore moved, one generator after the other, on a fixed product grid of Chebyshev points over the sum's
    bounding box, such that every polynomial up to the grid's degree keeps its mean. Weights may be slightly negative.

    Parameters
    ----------
    covariance
        Normal part, shape ``(2, 2)``.
    generators
        Shape ``(2, m)``.

    Returns
    -------
    shifts : Array
        Shape ``(N, 2)``.
    weights : Array
        Shape ``(N,)``, sum one.

    Raises
    ------
    ValueError
        When the normal part is too narrow along the generators for a grid of reasonable size.
    """
    if generators.shape[1] < 2:
        return link_nodes(covariance, generators)
    axes = np.linalg.svd(generators)[0]
    components = axes.T @ generators
    half = np.sum(np.abs(components), axis=1)
    half[half <= 1e-13 * np.max(half)] = 0.0
    lengths = generator_lengths(covariance, axes * half)
    counts = [
        1 if h == 0.0 else _node_count(length * (_REACH_MANY + length)) for h, length in zip(half, lengths, strict=True)
    ]
    if counts[0] * counts[1] > _LARGEST_GRID:
        raise ValueError(_too_narrow(generators.shape[1] + 1))
    angles = [np.pi * (np.arange(n) + 0.5) / n for n in counts]
    to_grid = [np.cos(np.outer(np.arange(n), angle)) * (2.0 / n) for n, angle in zip(counts, angles, strict=True)]
    for matrix in to_grid:
        matrix[0] *= 0.5
    units, unit_weights = np.polynomial.legendre.leggauss(max(counts))
    points, weights, reached = np.zeros((1, 2)), np.ones(1), np.zeros(2)
    for k in range(generators.shape[1]):
        points = (points[:, None, :] + units[:, None] * components[:, k]).reshape(-1, 2)
        weights = np.outer(weights, 0.5 * unit_weights).ravel()
        # The box of the sum so far; it must hold all points, since the next sum starts from its grid.
        reached = reached + np.where(half > 0.0, np.abs(components[:, k]), 0.0)
        bases = []
        for axis in (0, 1):
            scaled = points[:, axis] / reached[axis] if reached[axis] > 0.0 else np.zeros(len(points))
            bases.append(np.cos(np.outer(np.arccos(np.clip(scaled, -1.0, 1.0)), np.arange(counts[axis]))))
        weights = (to_grid[0].T @ (bases[0].T @ (weights[:, None] * bases[1])) @ to_grid[1]).ravel()
        axes_points = [reach * np.cos(angle) for reach, angle in zip(reached, angles, strict=True)]
        points = np.stack(np.meshgrid(*axes_points, indexing="ij"), -1).reshape(-1, 2)
    return points @ axes.T, weights


def generator_lengths(covariance: Array, generators: Array) -> list[float]:
    """Length of every generator in standard deviations of the normal part along it."""
    values, vectors = np.linalg.eigh(covariance)
    components = vectors.T @ generators
    floor = 1e-12 * max(float(values[-1]), float(np.max(np.sum(generators**2, axis=0))))
    return [float(v) for v in np.sqrt(np.sum(components**2 / np.maximum(values, floor)[:, None], axis=0))]


def _rule(length: float, reach: float) -> tuple[Array, Array]:
    """Composite rule on [-1, 1] for functions that grow like ``exp(reach * length * u)``."""
    panels, count = _rule_size(length, reach)
    points, weights = np.polynomial.legendre.leggauss(count)
    centres = (2.0 * np.arange(panels) + 1.0) / panels - 1.0
    return (centres[:, None] + points / panels).ravel(), np.tile(weights / (2.0 * panels), panels)


def _rule_size(length: float, reach: float) -> tuple[int, int]:
    """Panels of that rule, and points on each."""
    panels = max(1, int(np.ceil(length * (reach + length) / 12.0)))
    return panels, _node_count(length / panels * (reach + length))


def _node_count(rate: float) -> int:
    """Points per panel [-1, 1] for functions that grow like ``exp(rate * u)``, to rounding."""
    return int(np.ceil(7.0 + 0.8 * rate))


def _too_narrow(count: int) -> str:
    return (
        f"{count} independent uniform links next to so narrow a normal part need too many nodes; "
        "use a segment, a box, or a zonotope with over='area'"
    )
