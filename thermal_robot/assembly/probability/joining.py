"""Probability of joining (Eq 22): the position error of a peg stays within the clearance.

Several independent uniform parts are Gauss-Legendre sums, as fine as the normal part demands.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from thermal_robot.arrays import Array
from thermal_robot.assembly.probability.compiled import circle_chances
from thermal_robot.assembly.probability.kernels import integrate_panels
from thermal_robot.assembly.probability.planar import planar_probability
from thermal_robot.assembly.probability.spread import Parallelotope, UniformSpread

Shape = Literal["circle", "rectangle"]
Randomised = Literal["uniform", "normal"]
Thermal = UniformSpread | npt.ArrayLike | None


@dataclass(frozen=True)
class Law:
    """Batch of probability distributions of planar errors; leading axes broadcast.

    Covariances ``(..., 2, 2)`` and means ``(..., 2)`` of the normal parts; a uniform ``spread`` of all of them, or one
    of each, from ``-segment`` to ``segment``, ``(..., 2)``.
    """

    matrices: Array
    means: Array
    spread: UniformSpread | None = None
    segments: Array | None = None

    @classmethod
    def of(
        cls,
        covariance: npt.ArrayLike,
        mean: npt.ArrayLike = 0.0,
        thermal: Thermal = None,
        randomised: Randomised = "uniform",
        segments: npt.ArrayLike | None = None,
    ) -> Law:
        """Validate the input of `joining_probability`, and assign the thermal part to mean, covariance or uniform part.

        Vectors are added to the mean; a spread is kept, or with ``randomised="normal"`` replaced by its two moments.
        """
        matrices = check_covariance(covariance)
        ends = None if segments is None else _vectors(segments, "segments")
        if ends is not None and isinstance(thermal, UniformSpread):
            raise ValueError("a uniform part is one for all, as thermal, or one of each, as segments, not both")
        nothing = np.ndim(mean) == 0 and float(np.asarray(mean)) == 0.0
        means = np.zeros(2) if nothing else _vectors(mean, "mean")
        if isinstance(thermal, UniformSpread):
            if thermal.dimension != 2:
                raise ValueError(f"the thermal part must be planar, not of dimension {thermal.dimension}")
            if randomised == "normal":
                return cls(matrices + thermal.covariance, means + thermal.mean)
            if randomised == "uniform":
                return cls(matrices, means, thermal)
            raise ValueError(f"randomised must be 'uniform' or 'normal', not {randomised!r}")
        return cls(matrices, means if thermal is None else means + _vectors(thermal, "a thermal shift"), None, ends)

    @property
    def leading(self) -> tuple[int, ...]:
        """Broadcast shape of the leading axes of covariances, means and segments."""
        own = () if self.segments is None else self.segments.shape[:-1]
        return np.broadcast_shapes(self.matrices.shape[:-2], self.means.shape[:-1], own)

    def flat(self, leading: tuple[int, ...]) -> Law:
        """Broadcast the laws to a leading shape, and flatten it to one axis of N laws."""
        ends = self.segments
        return Law(
            np.broadcast_to(self.matrices, (*leading, 2, 2)).reshape(-1, 2, 2),
            np.broadcast_to(self.means, (*leading, 2)).reshape(-1, 2),
            self.spread,
            None if ends is None else np.broadcast_to(ends, (*leading, 2)).reshape(-1, 2),
        )

    def rows(self, chosen: npt.NDArray[np.bool_] | npt.NDArray[np.intp]) -> Law:
        """Subset of flattened laws."""
        ends = self.segments
        return Law(self.matrices[chosen], self.means[chosen], self.spread, None if ends is None else ends[chosen])

    def square(self) -> tuple[Array, Array]:
        """Mean ``(N,)`` of the squared length of the error, and its variance as if the error were normal."""
        matrices, means = self.matrices, self.means
        if self.spread is not None:
            matrices, means = matrices + self.spread.covariance, means + self.spread.mean
        if self.segments is not None:
            matrices = matrices + self.segments[:, :, None] * self.segments[:, None] / 3.0
        moved = np.einsum("ni,nij,nj->n", means, matrices, means)
        variance = 2.0 * np.sum(matrices**2, axis=(1, 2)) + 4.0 * moved
        return np.trace(matrices, axis1=1, axis2=2) + np.sum(means**2, axis=1), variance

    def probability(self, sizes: Array, shape: Shape, outside: bool) -> Array:
        """Probability ``(N,)`` that errors lie in (or ``outside``) discs of diameter ``(N, 1)`` or sides ``(N, 2)``."""
        result = np.full(len(sizes), 1.0 if outside else 0.0)
        endless = np.all(np.isinf(sizes), axis=1)
        result[endless] = 0.0 if outside else 1.0
        proper = np.flatnonzero(np.all(sizes > 0.0, axis=1) & ~endless)
        law, sizes = self.rows(proper), sizes[proper]
        pieces = (Parallelotope(1.0, np.zeros(2), np.empty((2, 0))),) if law.spread is None else law.spread.pieces
        if np.any(np.isinf(sizes)):  # a strip: no error is so long
            bound = sum(np.abs(p.centre).sum() + np.abs(p.generators).sum() for p in pieces)
            sizes = np.where(np.isinf(sizes), 2.0 * (bound + _FAR * np.sqrt(law.square()[0])[:, None]), sizes)
        total = np.zeros(len(sizes))
        for piece in pieces:
            total += piece.weight * _piece(law, law.means + piece.centre, sizes, shape, piece.generators, outside)
        result[proper] = np.minimum(total, 1.0)
        return result


def _vectors(value: npt.ArrayLike, name: str) -> Array:
    array = np.asarray(value, dtype=float)
    if array.shape[-1:] != (2,) or not np.all(np.isfinite(array)):
        raise ValueError(f"{name} must be finite with shape (..., 2), not of shape {array.shape}")
    return array


def check_covariance(covariance: npt.ArrayLike) -> Array:
    """Return covariances ``(..., 2, 2)`` made exactly symmetric; ``ValueError`` unless positive semidefinite."""
    matrices = np.asarray(covariance, dtype=float)
    if matrices.shape[-2:] != (2, 2) or not np.all(np.isfinite(matrices)):
        raise ValueError(f"covariance must be finite with shape (..., 2, 2), not of shape {matrices.shape}")
    a, b, c, d = (matrices[..., i, j] for i in (0, 1) for j in (0, 1))
    scale = np.maximum(np.abs(a), np.abs(d))
    if np.any(np.abs(b - c) > 1e-9 * scale):
        raise ValueError("covariance must be symmetric")
    middle = 0.5 * (b + c)
    if np.any(a < 0.0) or np.any(d < 0.0) or np.any(middle**2 > a * d * (1.0 + 1e-9) + (1e-12 * scale) ** 2):
        raise ValueError("covariance must be positive semidefinite")
    return np.stack([np.stack([a, middle], -1), np.stack([middle, d], -1)], -2)


_LARGEST, _LARGEST_GRID = 400_000, 10_000  # nodes
_REACH, _REACH_MANY = 38.0, 9.0
# Standard deviations of the normal part within which the sums are exact to rounding: all of double precision for one
# generator, and as far as a failing probability of 1e-20 where sums multiply.
_FAR = 50.0  # standard deviations beyond which the normal part is zero in double precision, for an infinite clearance
_SMOOTH = 6.0
# Longest second generator, in standard deviations of the normal part, for which a fixed sum is the cheaper way.


def link_nodes(covariance: Array, generators: Array) -> tuple[Array, Array]:
    """Gauss-Legendre product nodes (N, d), weights (N,) for the mean over ``generators @ u``, ``u`` uniform on [-1, 1].

    A function smoothed by the normal part grows along a generator no faster than ``exp(reach * length * u)``, with the
    length and the reach in standard deviations; panels and nodes follow from that. ``ValueError`` where the normal part
    is so narrow that there would be more than `_LARGEST` nodes.
    """
    lengths = generator_lengths(covariance, generators)
    rates = lengths * ((_REACH if len(lengths) == 1 else _REACH_MANY) + lengths)
    panels = np.maximum(np.ceil(rates / 12.0), 1.0)
    counts = _node_count(rates / panels)
    # Counted before any node is made: next to a vanishing normal part there would be 1e12 of them.
    _refuse(float(np.prod(panels * counts)), _LARGEST, len(lengths))
    units, weights = np.zeros((1, 0)), np.ones(1)
    for parts, count in zip(panels.astype(int), counts.astype(int), strict=True):
        points, shares = np.polynomial.legendre.leggauss(int(count))
        centres = (2.0 * np.arange(parts) + 1.0) / parts - 1.0
        rule = (centres[:, None] + points / parts).ravel()
        units = np.column_stack([np.repeat(units, len(rule), axis=0), np.tile(rule, len(units))])
        weights = np.outer(weights, np.tile(shares / (2.0 * parts), parts)).ravel()
    return units @ generators.T, weights


def planar_link_nodes(covariance: Array, generators: Array) -> tuple[Array, Array]:
    """Quadrature nodes (N, 2), weights (N,) for the mean over planar ``generators @ u``, ``u`` uniform on [-1, 1].

    As `link_nodes`, for any number of generators: the distribution of their sum is moved, one generator after the
    other, on a fixed product grid of Chebyshev points over the sum's bounding box, such that every polynomial up to the
    grid's degree keeps its mean. Weights may be slightly negative. ``ValueError`` where the normal part is so narrow
    that the grid would hold more than `_LARGEST_GRID` nodes.
    """
    if generators.shape[1] < 2:
        return link_nodes(covariance, generators)
    axes = np.linalg.svd(generators)[0]
    components = axes.T @ generators
    half = np.sum(np.abs(components), axis=1)
    half[half <= 1e-13 * np.max(half)] = 0.0
    lengths = generator_lengths(covariance, axes * half)
    counts = np.where(half > 0.0, _node_count(lengths * (_REACH_MANY + lengths)), 1.0)
    _refuse(float(np.prod(counts)), _LARGEST_GRID, generators.shape[1])
    cosines = [np.cos(np.pi * (np.arange(n) + 0.5) / n) for n in counts.astype(int)]
    to_grid = [np.polynomial.chebyshev.chebvander(c, len(c) - 1).T * (2.0 / len(c)) for c in cosines]
    for matrix in to_grid:
        matrix[0] *= 0.5
    units, unit_weights = np.polynomial.legendre.leggauss(int(counts.max()))
    points, weights, reached = np.zeros((1, 2)), np.ones(1), np.zeros(2)
    for column in components.T:
        points = (points[:, None, :] + units[:, None] * column).reshape(-1, 2)
        weights = np.outer(weights, 0.5 * unit_weights).ravel()
        # The box of the sum so far; it must hold all points, since the next sum starts from its grid.
        reached = reached + np.where(half > 0.0, np.abs(column), 0.0)
        scaled = np.clip(points / np.where(reached > 0.0, reached, np.inf), -1.0, 1.0)
        one, two = (np.polynomial.chebyshev.chebvander(scaled[:, k], len(cosines[k]) - 1) for k in (0, 1))
        weights = (to_grid[0].T @ (one.T @ (weights[:, None] * two)) @ to_grid[1]).ravel()
        grid = np.meshgrid(*(r * c for r, c in zip(reached, cosines, strict=True)), indexing="ij")
        points = np.stack(grid, -1).reshape(-1, 2)
    return points @ axes.T, weights


def generator_lengths(covariance: Array, generators: Array) -> Array:
    """Mahalanobis length ``sqrt(g' C**-1 g)`` of each generator ``g``, a column; ``C`` with its eigenvalues floored."""
    values, vectors = np.linalg.eigh(covariance)
    floor = 1e-12 * max(float(values[-1]), float(np.max(np.sum(generators**2, axis=0))))
    return np.asarray(np.linalg.norm((vectors / np.sqrt(np.maximum(values, floor))).T @ generators, axis=0))


def _node_count(rate: Array) -> Array:
    """Return the number of Gauss-Legendre nodes that integrate ``exp(rate * u)`` over [-1, 1] to rounding error."""
    return np.ceil(7.0 + 0.8 * rate)


def _refuse(nodes: float, most: int, count: int) -> None:
    if nodes > most:
        raise ValueError(
            f"{count + 1} independent uniform links next to so narrow a normal part need too many nodes; "
            "use a segment, a box, or a zonotope with over='area'"
        )


def joining_probability(
    covariance: npt.ArrayLike,
    clearance: npt.ArrayLike,
    mean: npt.ArrayLike = 0.0,
    *,
    shape: Shape = "circle",
    thermal: Thermal = None,
    randomised: Randomised = "uniform",
    segments: npt.ArrayLike | None = None,
) -> Array:
    """Probability that a planar normal error, with its thermal part, lies within the clearance (Eq 22).

    Parameters
    ----------
    covariance
        Covariance of the position error in the plane of the hole (``Lambda`` of Eq 21), shape ``(..., 2, 2)``; any
        correlation, singular or zero included.
    clearance
        ``shape="circle"``: clearance ``L``, the *diameter* of the disc in which the deviation may lie, as in the
        paper, shape ``(...)``. ``shape="rectangle"``: side lengths along the two coordinates, shape ``(..., 2)``, or
        one number for a square. Same unit as the errors. Zero is never met, ``inf`` always.
    mean
        Mean error, shape ``(..., 2)``, or 0.
    shape
        Clearance of a cylindrical or of a rectangular joint; turn covariance, mean and thermal part for a turned one.
    thermal
        Thermal part: a `UniformSpread` (independent of the normal part), or vectors ``(..., 2)`` that shift the mean.
    randomised
        What becomes of a `UniformSpread`. ``"uniform"``: as it is (flat-normal, Eq 16). ``"normal"``: a normal part
        with the same mean and covariance, added to ``covariance`` (Eqs 20-21), as the paper does for ``r < 1``.
    segments
        A uniform part of each case's own: ends of segments that run from ``-segment`` to ``segment``, shape
        ``(..., 2)``.

    Returns
    -------
    Array
        Probabilities, in the broadcast shape of the leading axes; 0-d for a single case. Absolute error below 1e-12.

    Raises
    ------
    ValueError
        For wrong shapes, a covariance that is not symmetric positive semidefinite, a negative clearance.
    """
    return _evaluate(covariance, clearance, mean, shape, thermal, randomised, segments, outside=False)


def failing_probability(
    covariance: npt.ArrayLike,
    clearance: npt.ArrayLike,
    mean: npt.ArrayLike = 0.0,
    *,
    shape: Shape = "circle",
    thermal: Thermal = None,
    randomised: Randomised = "uniform",
    segments: npt.ArrayLike | None = None,
) -> Array:
    """Probability that a planar error exceeds the clearance, ``1 - P`` of Eq 22, integrated directly over the outside.

    It keeps its digits (1e-10 relative) when ``P`` rounds to one. Parameters, shapes and errors as in
    `joining_probability`.
    """
    return _evaluate(covariance, clearance, mean, shape, thermal, randomised, segments, outside=True)


def _evaluate(
    covariance: npt.ArrayLike,
    clearance: npt.ArrayLike,
    mean: npt.ArrayLike,
    shape: Shape,
    thermal: Thermal,
    randomised: Randomised,
    segments: npt.ArrayLike | None,
    *,
    outside: bool,
) -> Array:
    """Validate, broadcast and integrate all cases; large batches of discs without uniform part go to compiled loops."""
    plain = shape == "circle" and thermal is None and segments is None
    chances = circle_chances(covariance, clearance, mean) if plain else None
    result = np.array(np.nan) if chances is None else chances[int(outside)]
    if not np.any(np.isnan(result)):
        return result
    law = Law.of(covariance, mean, thermal, randomised, segments)
    sizes = _sizes(clearance, shape)
    leading = np.broadcast_shapes(law.leading, sizes.shape[:-1])
    sizes = np.broadcast_to(sizes, (*leading, sizes.shape[-1])).reshape(-1, sizes.shape[-1])
    found = np.broadcast_to(result, leading).flatten()
    left = np.flatnonzero(np.isnan(found))
    found[left] = law.flat(leading).rows(left).probability(sizes[left], shape, outside)
    return found.reshape(leading)


def _sizes(clearance: npt.ArrayLike, shape: Shape) -> Array:
    """Clearances as diameters ``(..., 1)`` or side lengths ``(..., 2)``; ``ValueError`` for negative ones or NaN."""
    sizes = np.asarray(clearance, dtype=float)
    if shape == "circle":
        sizes = sizes[..., None]
    elif shape == "rectangle":
        sizes = np.broadcast_to(sizes, (2,)) if sizes.ndim == 0 else sizes
        if sizes.shape[-1] != 2:
            raise ValueError(f"the clearance of a rectangle has two sides, shape (..., 2), not {sizes.shape}")
    else:
        raise ValueError(f"shape must be 'circle' or 'rectangle', not {shape!r}")
    if not np.all(sizes >= 0.0):
        raise ValueError("clearance must not be negative or missing")
    return sizes


def _piece(law: Law, means: Array, sizes: Array, shape: Shape, generators: Array, outside: bool) -> Array:
    """Probability ``(N,)`` for one piece of the uniform part: longest generator in closed form, rest by quadrature."""
    count = generators.shape[1]
    segment = generators[:, 0] if count else law.segments
    if count < 2:
        return planar_probability(law.matrices, means, sizes, shape=shape, segment=segment, outside=outside)
    # Sums over several generators are as fine as the normal part demands: one covariance after the other.
    kinds, kind = np.unique(law.matrices.reshape(-1, 4), axis=0, return_inverse=True)
    result = np.empty(len(means))
    for number, matrix in enumerate(kinds.reshape(-1, 2, 2)):
        chosen = kind.reshape(-1) == number
        result[chosen] = _several(matrix, means[chosen], sizes[chosen], shape, generators, outside)
    return result


def _several(matrix: Array, means: Array, sizes: Array, shape: Shape, generators: Array, outside: bool) -> Array:
    """Average the probability over all generators but the longest by quadrature, ``(N,)``.

    A second one of `_SMOOTH` normal standard deviations or more goes by adaptive panels, others by fixed nodes.
    """

    def shifted(owner: npt.NDArray[np.intp], shifts: Array) -> Array:
        centres = (means[owner][:, None] + shifts).reshape(-1, 2)
        every = np.repeat(sizes[owner], shifts.shape[-2], axis=0)
        values = planar_probability(matrix, centres, every, shape=shape, segment=generators[:, 0], outside=outside)
        return values.reshape(len(owner), -1)

    every, second = np.arange(len(means)), generators[:, 1]
    smooth = generator_lengths(matrix, generators[:, 1:2])[0] < _SMOOTH
    rest = generators[:, 1 if smooth else 2 :]
    shifts, weights = planar_link_nodes(matrix, rest) if rest.shape[1] else (np.zeros((1, 2)), np.ones(1))
    if smooth:
        return shifted(every, shifts) @ weights

    def summed(owner: npt.NDArray[np.intp], u: Array) -> Array:
        every_shift = (u[:, :, None, None] * second + shifts).reshape(len(u), -1, 2)
        return 0.5 * shifted(owner, every_shift).reshape(*u.shape, -1) @ weights

    # Where the first generator's line passes the centre, and the farther off the fewer steps there are.
    normal = np.array([-generators[1, 0], generators[0, 0]])
    with np.errstate(divide="ignore", invalid="ignore"):
        centre = np.clip(np.nan_to_num(-(means @ normal) / (second @ normal)), -1.0, 1.0)[:, None]
    finest = min(float(np.min(sizes)) / float(np.linalg.norm(second)), 4.0)
    ladder = 2.0 * 2.0 ** -np.arange(np.clip(np.ceil(np.log2(4.0 / finest)), 0, 40) + 1.0)
    points = np.concatenate(
        [np.tile([-1.0, 0.0, 1.0], (len(means), 1)), centre, centre - ladder, centre + ladder], axis=1
    )
    return integrate_panels(summed, np.sort(np.clip(points, -1.0, 1.0), axis=1), tolerance=1e-12)
