"""Probability of joining (Eq 22): the position error of a peg stays within the clearance.

Several independent uniform parts are Gauss-Legendre sums, as fine as the normal part demands.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Literal

import numpy as np
import numpy.typing as npt

from thermal_robot.arrays import Array
from thermal_robot.assembly.probability.compiled import circle_chances
from thermal_robot.assembly.probability.kernels import integrate_panels
from thermal_robot.assembly.probability.planar import planar_probability
from thermal_robot.assembly.probability.spread import Parallelotope, UniformSpread

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
        """Validate the input of `joining_probability`, and sort the thermal part into mean, segments and box."""
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
        """Leading shape of the laws."""
        own = () if self.segments is None else self.segments.shape[:-1]
        return np.broadcast_shapes(self.matrices.shape[:-2], self.means.shape[:-1], own)

    def flat(self, leading: tuple[int, ...]) -> Law:
        """Laws broadcast to a shape, flattened."""
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


def _vectors(value: npt.ArrayLike, name: str) -> Array:
    array = np.asarray(value, dtype=float)
    if array.shape[-1:] != (2,) or not np.all(np.isfinite(array)):
        raise ValueError(f"{name} must be finite with shape (..., 2), not of shape {array.shape}")
    return array


def check_covariance(covariance: npt.ArrayLike) -> Array:
    """Validate a covariance of shape ``(..., 2, 2)``; ``ValueError`` otherwise."""
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
# Standard deviations of the normal part within which the sums are exact to rounding: all of double precision for one
# generator, and as far as a failing probability of 1e-20 where sums multiply.
_REACH, _REACH_MANY = 38.0, 9.0


def link_nodes(covariance: Array, generators: Array) -> tuple[Array, Array]:
    """Quadrature nodes (N, d) and weights (N,) for the mean over ``generators @ u``, ``u`` uniform on [-1, 1].

    A function smoothed by the normal part grows along a generator no faster than ``exp(reach * length * u)``, with the
    length and the reach in standard deviations; panels and nodes follow from that. Refused where the normal part is too
    narrow for a sum of reasonable length.
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
    """Quadrature nodes (N, 2) and weights (N,) for the same mean in the plane, for any number of generators.

    A smooth function of the sum of many generators depends on a point in the plane only. The law of the sum is
    therefore moved, one generator after the other, on a fixed product grid of Chebyshev points over the sum's bounding
    box, such that every polynomial up to the grid's degree keeps its mean. Weights may be slightly negative. Refused
    where the normal part is too narrow for a grid of reasonable size.
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
    """Composite Gauss rule on [-1, 1] for functions that grow like ``exp(reach * length * u)``."""
    panels, count = _rule_size(length, reach)
    points, weights = np.polynomial.legendre.leggauss(count)
    centres = (2.0 * np.arange(panels) + 1.0) / panels - 1.0
    return (centres[:, None] + points / panels).ravel(), np.tile(weights / (2.0 * panels), panels)


def _rule_size(length: float, reach: float) -> tuple[int, int]:
    """Return the number of panels of :func:`_rule`, and of points on each."""
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


Shape = Literal["circle", "rectangle"]

# Beyond this many standard deviations the normal part is zero in double precision; stands for an infinite clearance.
_FAR = 50.0
# Longest second generator, in standard deviations of the normal part, for which a fixed sum is the cheaper way.
_SMOOTH = 6.0


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
    """Probability that the deviation lies within the clearance (Eq 22).

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
    """Probability that the deviation exceeds the clearance, ``1 - P`` of Eq 22, integrated directly over the outside.

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
    """Validate, broadcast and integrate all cases; large batches of plain ones go to compiled loops."""
    plain = shape == "circle" and thermal is None and segments is None
    chances = circle_chances(covariance, clearance, mean) if plain else None
    quick: Array | None = None if chances is None else chances[int(outside)]
    if quick is not None and not np.any(np.isnan(quick)):
        return quick
    law = Law.of(covariance, mean, thermal, randomised, segments)
    sizes = _sizes(clearance, shape)
    leading = np.broadcast_shapes(law.leading, sizes.shape[:-1])
    law = law.flat(leading)
    sizes = np.broadcast_to(sizes, (*leading, sizes.shape[-1])).reshape(-1, sizes.shape[-1])
    if quick is None:
        return _integrated(law, sizes, shape, outside).reshape(leading)
    result: Array = quick.reshape(-1)
    left = np.isnan(result)
    result[left] = _integrated(law.rows(left), sizes[left], shape, outside)
    return np.asarray(result.reshape(leading))


def _integrated(law: Law, sizes: Array, shape: Shape, outside: bool) -> Array:
    """Integrate validated cases, together or, with several generators, by groups of equal covariance."""
    if law.spread is None or all(piece.generators.shape[1] < 2 for piece in law.spread.pieces):
        return _cases(law, sizes, shape, outside)
    # sums over several generators are as fine as the normal part demands: one covariance after the other
    kinds, kind = np.unique(law.matrices.reshape(-1, 4), axis=0, return_inverse=True)
    result = np.empty(len(sizes))
    for number in range(len(kinds)):
        chosen = kind.reshape(-1) == number
        result[chosen] = _cases(law.rows(chosen), sizes[chosen], shape, outside)
    return result


def _sizes(clearance: npt.ArrayLike, shape: Shape) -> Array:
    """Clearances as diameters ``(..., 1)`` or side lengths ``(..., 2)``."""
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


def _cases(law: Law, sizes: Array, shape: Shape, outside: bool) -> Array:
    """Integrate flattened cases; zero and infinite clearances have probability 0 and 1."""
    result = np.full(len(sizes), 1.0 if outside else 0.0)
    pieces = law.spread.pieces if law.spread is not None else (Parallelotope(1.0, np.zeros(2), np.empty((2, 0))),)
    reach = max(float(np.sum(np.abs(p.generators)) + np.sum(np.abs(p.centre))) for p in pieces)
    far = _FAR * np.sqrt(np.trace(law.matrices, axis1=1, axis2=2)) + reach + np.linalg.norm(law.means, axis=1)
    if law.segments is not None:
        far = far + np.linalg.norm(law.segments, axis=1)
    endless = np.all(np.isinf(sizes), axis=1)
    result[endless] = 0.0 if outside else 1.0
    sizes = np.where(np.isinf(sizes), 2.0 * far[:, None], sizes)
    proper = np.all(sizes > 0.0, axis=1) & ~endless
    if np.any(proper):
        law, sizes, total = law.rows(proper), sizes[proper], np.zeros(int(np.sum(proper)))
        for piece in pieces:
            means = law.means + piece.centre
            if piece.generators.shape[1] < 2:
                ends = piece.generators[:, 0] if piece.generators.shape[1] else law.segments
                found = planar_probability(law.matrices, means, sizes, shape=shape, segment=ends, outside=outside)
            else:
                found = _piece_probability(law.matrices[0], means, sizes, shape, piece.generators, outside)
            total += piece.weight * found
        result[proper] = np.minimum(total, 1.0)
    return result


def _piece_probability(
    covariance: Array, means: Array, sizes: Array, shape: Shape, generators: Array, outside: bool
) -> Array:
    """Integrate one parallelotope: longest generator in closed form, the others by quadrature."""
    count = generators.shape[1]
    segment = generators[:, 0] if count else None
    if count < 2:
        return planar_probability(covariance, means, sizes, shape=shape, segment=segment, outside=outside)
    smooth = generator_lengths(covariance, generators[:, 1:2])[0] < _SMOOTH
    summed = 1 if smooth else 2
    if count > summed:
        shifts, weights = planar_link_nodes(covariance, generators[:, summed:])
        shifted = (means[:, None, :] + shifts).reshape(-1, 2)
        repeated = np.repeat(sizes, len(weights), axis=0)
        values = _piece_probability(covariance, shifted, repeated, shape, generators[:, :summed], outside)
        return np.asarray(values.reshape(len(means), -1) @ weights)
    second = generators[:, 1]

    def shifted_probability(owner: npt.NDArray[np.intp], u: Array) -> Array:
        centres = (means[owner][:, None, :] + u[..., None] * second).reshape(-1, 2)
        repeated = np.repeat(sizes[owner], u.shape[1], axis=0)
        values = planar_probability(covariance, centres, repeated, shape=shape, segment=segment, outside=outside)
        return 0.5 * values.reshape(u.shape)

    return integrate_panels(shifted_probability, _second_breakpoints(generators, means, sizes), tolerance=1e-12)


def _second_breakpoints(generators: Array, means: Array, sizes: Array) -> Array:
    """Breakpoints over the second generator, graded to where the first one's segment crosses the centre."""
    first, second = generators[:, 0], generators[:, 1]
    normal = np.array([-first[1], first[0]])
    across = float(second @ normal)
    with np.errstate(divide="ignore", invalid="ignore"):
        centre = np.clip(np.nan_to_num(-(means @ normal) / across), -1.0, 1.0)[:, None]
    finest = float(np.min(sizes)) / float(np.linalg.norm(second))
    steps = int(np.clip(np.ceil(np.log2(4.0 / finest)), 1, 40)) if finest < 4.0 else 1
    ladder = 2.0 * 2.0 ** -np.arange(steps + 1.0) if steps > 1 else np.array([])
    points = np.concatenate(
        [[-1.0, 0.0, 1.0] * np.ones((len(means), 1)), centre, centre - ladder, centre + ladder], axis=1
    )
    return np.sort(np.clip(points, -1.0, 1.0), axis=1)
