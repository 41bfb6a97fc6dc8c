"""Probability that a peg finds its hole (Eq 22): the position error stays within the clearance.

Several independent uniform parts are Gauss-Legendre sums, as fine as the normal part demands.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product
from typing import Literal

import numpy as np
import numpy.typing as npt
from numpy.polynomial.chebyshev import chebpts1, chebvander

from thermal_robot.arrays import Array
from thermal_robot.assembly.probability.kernels import integrate_panels
from thermal_robot.assembly.probability.planar import Rows, across, planar_probability
from thermal_robot.assembly.probability.spread import Parallelotope, UniformSpread

Randomised = Literal["uniform", "normal"]
Shape = Literal["circle", "rectangle"]
Thermal = UniformSpread | npt.ArrayLike | None

_FAR = 50.0
# Standard deviations beyond which the normal part is zero in double precision; stands for an infinite clearance.
_SMOOTH = 6.0
# Longest second generator, in standard deviations of the normal part, for which a fixed sum is the cheaper way.
_LARGEST, _LARGEST_GRID = 400_000, 10_000  # nodes
_REACH, _REACH_MANY = 38.0, 9.0
# Standard deviations of the normal part within which the sums are exact to rounding: all of double precision for one
# generator, and as far as a failing probability of 1e-20 where sums multiply.


@dataclass(frozen=True)
class Law:
    """Laws of planar errors; their leading axes broadcast.

    Covariances ``(..., 2, 2)`` and means ``(..., 2)`` of the normal parts; uniform parts, one of each from
    ``-segment`` to ``segment``, ``(..., 2)``, and a mixture of parallelotopes that all have in common.
    """

    matrices: Array
    means: Array
    segments: Array
    pieces: tuple[Parallelotope, ...]

    @classmethod
    def of(
        cls,
        covariance: npt.ArrayLike,
        mean: npt.ArrayLike = 0.0,
        thermal: Thermal = None,
        randomised: Randomised = "uniform",
        segments: npt.ArrayLike | None = None,
    ) -> Law:
        """Check what `joining_probability` is given, and put the thermal part where it belongs."""
        matrices = check_covariance(covariance)
        ends = np.zeros(2) if segments is None else _vectors(segments, "segments")
        nothing = np.ndim(mean) == 0 and float(np.asarray(mean)) == 0.0
        means = np.zeros(2) if nothing else _vectors(mean, "mean")
        plain = (Parallelotope(1.0, np.zeros(2), np.empty((2, 0))),)
        if not isinstance(thermal, UniformSpread):
            return cls(
                matrices, means if thermal is None else means + _vectors(thermal, "a thermal shift"), ends, plain
            )
        if segments is not None:
            raise ValueError("a uniform part is one for all, as thermal, or one of each, as segments, not both")
        if thermal.dimension != 2:
            raise ValueError(f"the thermal part must be planar, not of dimension {thermal.dimension}")
        if randomised == "normal":
            return cls(matrices + thermal.covariance, means + thermal.mean, ends, plain)
        if randomised == "uniform":
            return cls(matrices, means, ends, thermal.pieces)
        raise ValueError(f"randomised must be 'uniform' or 'normal', not {randomised!r}")

    @property
    def leading(self) -> tuple[int, ...]:
        """Shape of the laws."""
        return np.broadcast_shapes(self.matrices.shape[:-2], self.means.shape[:-1], self.segments.shape[:-1])

    def flat(self, leading: tuple[int, ...]) -> Law:
        """Return the laws broadcast to a shape, one after the other."""
        means, segments = (np.broadcast_to(v, (*leading, 2)).reshape(-1, 2) for v in (self.means, self.segments))
        matrices = np.broadcast_to(self.matrices, (*leading, 2, 2)).reshape(-1, 2, 2)
        return Law(matrices, means, segments, self.pieces)

    def rows(self, chosen: npt.NDArray[np.bool_] | Rows) -> Law:
        """Return some of the laws that are flat."""
        return Law(self.matrices[chosen], self.means[chosen], self.segments[chosen], self.pieces)

    @property
    def size(self) -> Array:
        """Largest distance of the mean from the origin, the uniform part included, of each law that is flat."""
        common = max(float(np.sum(np.abs(p.generators)) + np.sum(np.abs(p.centre))) for p in self.pieces)
        return np.asarray(np.linalg.norm(self.means, axis=1) + np.linalg.norm(self.segments, axis=1) + common)

    def chances(self, sizes: Array, shape: Shape, outside: bool) -> Array:
        """Probabilities ``(N,)`` of laws that are flat; zero and infinite clearances are settled here."""
        far = _FAR * np.sqrt(np.trace(self.matrices, axis1=1, axis2=2)) + self.size
        endless = np.all(np.isinf(sizes), axis=1)
        result = np.where(endless ^ outside, 1.0, 0.0)
        proper = np.flatnonzero(np.all(sizes > 0.0, axis=1) & ~endless)
        sizes = np.where(np.isinf(sizes), 2.0 * far[:, None], sizes)[proper]
        law, total = self.rows(proper), np.zeros(len(proper))
        for piece in self.pieces:
            moved = replace(law, means=law.means + piece.centre)
            total += piece.weight * _piece(moved, sizes, shape, piece.generators, outside)
        result[proper] = np.minimum(total, 1.0)
        return result


def _vectors(value: npt.ArrayLike, name: str) -> Array:
    array = np.asarray(value, dtype=float)
    if array.shape[-1:] != (2,) or not np.all(np.isfinite(array)):
        raise ValueError(f"{name} must be finite with shape (..., 2), not of shape {array.shape}")
    return array


def check_covariance(covariance: npt.ArrayLike) -> Array:
    """Return a covariance of shape ``(..., 2, 2)``, or raise ``ValueError`` if it is none."""
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


def _sizes(clearance: npt.ArrayLike, shape: Shape) -> Array:
    """Diameters ``(..., 1)`` or side lengths ``(..., 2)``; refused where there are none."""
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


def link_nodes(covariance: Array, generators: Array) -> tuple[Array, Array]:
    """(N, d) nodes and (N,) weights for the mean over ``generators @ u``, the ``u`` independent and uniform on [-1, 1].

    A function smoothed by the normal part grows along a generator no faster than ``exp(reach * length * u)``, with the
    length and the reach in standard deviations; panels and nodes follow from that. Refused where the normal part is too
    narrow for a sum of reasonable length.
    """
    reach = _REACH if generators.shape[1] == 1 else _REACH_MANY
    lengths = generator_lengths(covariance, generators)
    panels = np.maximum(1.0, np.ceil(lengths * (reach + lengths) / 12.0))
    counts = _node_count(lengths / panels * (reach + lengths))
    # Counted before any node is made: next to a vanishing normal part there would be 1e12 of them.
    if np.prod(panels * counts) > _LARGEST:
        raise ValueError(_too_narrow(len(lengths) + 1))
    points, shares = [], []
    for number, count in zip(panels.astype(int), counts.astype(int), strict=True):
        nodes, weights = np.polynomial.legendre.leggauss(count)
        centres = (2.0 * np.arange(number) + 1.0) / number - 1.0
        points.append((centres[:, None] + nodes / number).ravel())
        shares.append(np.tile(weights / (2.0 * number), number))
    units = np.array(list(product(*points))).reshape(-1, len(points))
    return units @ generators.T, np.array([np.prod(w) for w in product(*shares)])


def planar_link_nodes(covariance: Array, generators: Array) -> tuple[Array, Array]:
    """(N, 2) nodes and (N,) weights for the same mean in the plane, as many for any number of generators.

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
    sizes = np.where(half == 0.0, 1.0, _node_count(lengths * (_REACH_MANY + lengths)))
    if np.prod(sizes) > _LARGEST_GRID:
        raise ValueError(_too_narrow(generators.shape[1] + 1))
    counts = sizes.astype(int)
    grids = [chebpts1(n) for n in counts]
    to_grid = [
        chebvander(g, n - 1) * np.where(np.arange(n) == 0, 1.0, 2.0) / n for g, n in zip(grids, counts, strict=True)
    ]
    units, unit_weights = np.polynomial.legendre.leggauss(int(np.max(counts)))
    points, weights, reached = np.zeros((1, 2)), np.ones(1), np.zeros(2)
    for generator in components.T:
        points = (points[:, None, :] + units[:, None] * generator).reshape(-1, 2)
        weights = np.outer(weights, 0.5 * unit_weights).ravel()
        # The box of the sum so far; it must hold all points, since the next sum starts from its grid.
        reached = reached + np.where(half > 0.0, np.abs(generator), 0.0)
        scaled = np.clip(points / np.where(reached > 0.0, reached, np.inf), -1.0, 1.0)
        one, two = (chebvander(scaled[:, k], n - 1) for k, n in enumerate(counts))
        weights = (to_grid[0] @ (one.T @ (weights[:, None] * two)) @ to_grid[1].T).ravel()
        points = np.stack(np.meshgrid(*(reached[k] * grids[k] for k in (0, 1)), indexing="ij"), -1).reshape(-1, 2)
    return points @ axes.T, weights


def generator_lengths(covariance: Array, generators: Array) -> Array:
    """Length of every generator in standard deviations of the normal part along it."""
    values, vectors = np.linalg.eigh(covariance)
    components = vectors.T @ generators
    floor = 1e-12 * max(float(values[-1]), float(np.max(np.sum(generators**2, axis=0))))
    return np.asarray(np.sqrt(np.sum(components**2 / np.maximum(values, floor)[:, None], axis=0)))


def _node_count(rate: Array) -> Array:
    """Points per panel [-1, 1] for functions that grow like ``exp(rate * u)``, to rounding."""
    return np.ceil(7.0 + 0.8 * rate)


def _too_narrow(count: int) -> str:
    return (
        f"{count} independent uniform links next to so narrow a normal part need too many nodes; "
        "use a segment, a box, or a zonotope with over='area'"
    )


def _piece(law: Law, sizes: Array, shape: Shape, generators: Array, outside: bool) -> Array:
    """Probabilities ``(N,)`` with one parallelotope about each mean: its longest generator in closed form."""
    if generators.shape[1] < 2:
        segment = generators[:, 0] if generators.shape[1] else law.segments
        return planar_probability(law.matrices, law.means, sizes, shape=shape, segment=segment, outside=outside)
    # sums over several generators are as fine as the normal part demands: one covariance after the other
    kinds, kind = np.unique(law.matrices.reshape(-1, 4), axis=0, return_inverse=True)
    result = np.empty(len(sizes))
    for number in range(len(kinds)):
        rows = np.flatnonzero(kind.reshape(-1) == number)
        result[rows] = _several(law.rows(rows), sizes[rows], shape, generators, outside)
    return result


def _several(law: Law, sizes: Array, shape: Shape, generators: Array, outside: bool) -> Array:
    """Take the longest generator in closed form, the others by sums; next to a narrow normal part the second adapts."""
    covariance, second = law.matrices[0], generators[:, 1]

    def shifted(owner: Rows, shifts: Array, left: Array) -> Array:
        """Probabilities ``(P, n)`` of laws moved by ``(P, n, 2)``, with the generators that are left."""
        every = np.repeat(owner, shifts.shape[1])
        moved = replace(law.rows(every), means=law.means[every] + shifts.reshape(-1, 2))
        return _piece(moved, sizes[every], shape, left, outside).reshape(shifts.shape[:2])

    summed = 1 if generator_lengths(covariance, second[:, None])[0] < _SMOOTH else 2
    if generators.shape[1] > summed:
        shifts, weights = planar_link_nodes(covariance, generators[:, summed:])
        every = np.arange(len(sizes))
        return shifted(every, np.broadcast_to(shifts, (len(every), *shifts.shape)), generators[:, :summed]) @ weights

    def integrand(owner: Rows, u: Array) -> Array:
        return 0.5 * shifted(owner, u[..., None] * second, generators[:, :1])

    # Panels end where the band that the first generator sweeps touches the region, and where the scatter reaches it.
    normal = across(generators[:, 0] / np.linalg.norm(generators[:, 0]))
    width = 0.5 * (sizes[:, 0] if shape == "circle" else sizes @ np.abs(normal))
    touching = width[:, None] + np.sqrt(normal @ covariance @ normal) * np.array([-_REACH, -9.0, 0.0, 9.0, _REACH])
    levels = (
        np.concatenate([-touching, touching, np.zeros_like(width)[:, None]], axis=1) - (law.means @ normal)[:, None]
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        breaks = np.clip(np.nan_to_num(levels / (second @ normal)), -1.0, 1.0)
    breaks = np.sort(np.pad(breaks, ((0, 0), (1, 1)), constant_values=(-1.0, 1.0)), axis=1)
    return integrate_panels(integrand, breaks, tolerance=1e-12)


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
    return _evaluate(Law.of(covariance, mean, thermal, randomised, segments), clearance, shape, outside=False)


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
    return _evaluate(Law.of(covariance, mean, thermal, randomised, segments), clearance, shape, outside=True)


def _evaluate(law: Law, clearance: npt.ArrayLike, shape: Shape, *, outside: bool) -> Array:
    sizes = _sizes(clearance, shape)
    leading = np.broadcast_shapes(law.leading, sizes.shape[:-1])
    sizes = np.broadcast_to(sizes, (*leading, sizes.shape[-1])).reshape(-1, sizes.shape[-1])
    return law.flat(leading).chances(sizes, shape, outside).reshape(leading)
