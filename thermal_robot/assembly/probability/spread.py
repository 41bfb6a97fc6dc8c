"""The thermal part of an error: uniform on a segment, a box or a zonotope (Eqs 16 and 19, any dimension)."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import Literal

import numpy as np
import numpy.typing as npt

from thermal_robot.arrays import Array


@dataclass(frozen=True)
class Parallelotope:
    """One piece of a spread: ``centre + generators @ u`` with the ``u`` independent and uniform on [-1, 1].

    ``weight``: share of the spread's probability; generators are half edges ``(d, m)``, none zero, longest first.
    """

    weight: float
    centre: Array
    generators: Array


@dataclass(frozen=True)
class UniformSpread:
    """A displacement known only by its bounds, randomised with the uniform distribution (section 4 of the paper).

    Use the constructors `segment`, `box` and `zonotope`; the fields are what they have in common.

    Parameters
    ----------
    pieces
        Parallelotopes; the law is their mixture.
    """

    pieces: tuple[Parallelotope, ...]

    @classmethod
    def segment(cls, end: npt.ArrayLike, start: npt.ArrayLike | None = None) -> UniformSpread:
        """Uniform on the segment from ``start`` (default ``-end``) to ``end``; one link, or all links warming together.

        Parameters
        ----------
        end, start
            Shape ``(d,)``, in the unit of the errors.
        """
        last = _vector(end)
        first = -last if start is None else _vector(start)
        return cls((_piece(1.0, 0.5 * (last + first), (0.5 * (last - first))[:, None]),))

    @classmethod
    def box(cls, half_widths: npt.ArrayLike, axes: npt.ArrayLike | None = None) -> UniformSpread:
        """Uniform on a box about the origin: independent axes, as the paper's Eqs 19-20 treat them.

        Parameters
        ----------
        half_widths
            Shape ``(d,)``, not negative.
        axes
            Directions of the edges as columns, shape ``(d, d)``, orthonormal; the coordinate axes by default.
        """
        half = _vector(half_widths)
        if np.any(half < 0.0):
            raise ValueError("half widths must not be negative")
        directions = np.eye(half.size) if axes is None else np.asarray(axes, dtype=float)
        if directions.shape != (half.size, half.size) or not np.allclose(
            directions.T @ directions, np.eye(half.size), atol=1e-9
        ):
            raise ValueError("axes must be orthonormal columns, one for each half width")
        return cls((_piece(1.0, np.zeros(half.size), directions * half),))

    @classmethod
    def zonotope(
        cls,
        generators: npt.ArrayLike,
        lower: npt.ArrayLike,
        upper: npt.ArrayLike,
        *,
        over: Literal["links", "area"] = "links",
    ) -> UniformSpread:
        """Displacements ``generators @ delta`` with ``lower <= delta <= upper`` (Eqs 14-15).

        Parameters
        ----------
        generators
            Sensitivities of the displacement as columns, shape ``(d, k)``.
        lower, upper
            Bounds, scalars or shape ``(k,)``.
        over
            ``"links"``: every ``delta`` uniform and independent; its image is not uniform when ``k > d``. ``"area"``:
            every point of the zonotope equally likely (its area in the plane, its volume in space), which then must
            not be zero.
        """
        columns, low, high = generator_bounds(generators, lower, upper)
        centre, half = columns @ (0.5 * (low + high)), columns * (0.5 * (high - low))
        if over == "links":
            return cls((_piece(1.0, centre, half),))
        if over != "area":
            raise ValueError(f"over must be 'links' or 'area', not {over!r}")
        return cls(_tiles(centre, half))

    @property
    def dimension(self) -> int:
        """Number of coordinates."""
        return self.pieces[0].centre.size

    @property
    def mean(self) -> Array:
        """Mean displacement, shape ``(d,)``; exact."""
        return np.asarray(np.sum([p.weight * p.centre for p in self.pieces], axis=0))

    @property
    def covariance(self) -> Array:
        """Covariance, shape ``(d, d)``; exact (Eq 19: an edge of half length ``a`` has the variance ``a**2 / 3``)."""
        mean = self.mean
        total = np.zeros((self.dimension, self.dimension))
        for piece in self.pieces:
            offset = piece.centre - mean
            total += piece.weight * (np.outer(offset, offset) + piece.generators @ piece.generators.T / 3.0)
        return total

    def rvs(self, size: int, random_state: int | np.random.Generator | None = None) -> Array:
        """Draw ``size`` displacements, shape ``(size, d)``."""
        generator = np.random.default_rng(random_state)
        which = generator.choice(len(self.pieces), size=size, p=[p.weight for p in self.pieces])
        result = np.empty((size, self.dimension))
        for k, piece in enumerate(self.pieces):
            chosen = which == k
            units = generator.uniform(-1.0, 1.0, (int(np.sum(chosen)), piece.generators.shape[1]))
            result[chosen] = piece.centre + units @ piece.generators.T
        return result


def generator_bounds(
    generators: npt.ArrayLike, lower: npt.ArrayLike, upper: npt.ArrayLike
) -> tuple[Array, Array, Array]:
    """Check columns ``(d, k)`` and their bounds, scalars or ``(k,)``, finite and ascending; return all as arrays."""
    columns = np.asarray(generators, dtype=float)
    if columns.ndim != 2:
        raise ValueError(f"generators must be columns, shape (d, k), not {columns.shape}")
    count = columns.shape[1]
    bounds = []
    for name, value in (("lower", lower), ("upper", upper)):
        array = np.asarray(value, dtype=float)
        if array.shape not in ((), (count,)):
            raise ValueError(f"{name} must be a scalar or of shape ({count},), not {array.shape}")
        bounds.append(np.broadcast_to(array, (count,)).astype(float))
    low, high = bounds
    if not (np.all(np.isfinite(columns)) and np.all(np.isfinite(low)) and np.all(np.isfinite(high))):
        raise ValueError("generators and bounds must be finite")
    if np.any(low > high):
        raise ValueError(f"lower bound above upper bound for generator {int(np.argmax(low > high))}")
    return columns, low, high


def _vector(value: npt.ArrayLike) -> Array:
    array = np.asarray(value, dtype=float)
    if array.ndim != 1 or not np.all(np.isfinite(array)):
        raise ValueError(f"expected a finite vector, got shape {array.shape}")
    return array


def _piece(weight: float, centre: Array, generators: Array) -> Parallelotope:
    lengths = np.linalg.norm(generators, axis=0)
    order = np.argsort(-lengths, kind="stable")
    return Parallelotope(weight, centre, generators[:, order[lengths[order] > 0.0]])


def _tiles(centre: Array, half: Array) -> tuple[Parallelotope, ...]:
    """Tile a zonotope with one parallelotope for every independent choice of ``d`` generators.

    Lift each generator by one more, generic coordinate: the lower faces of the lifted zonotope project to a tiling,
    and the side on which a face leaves the remaining lifted generators says at which end each of them stands.
    """
    dimension, count = half.shape
    # Any heights in general position give a tiling; these are fixed so that the result is reproducible.
    heights: Array = np.random.default_rng(0).normal(size=(count,))
    chosen, volumes = [], []
    for subset in combinations(range(count), dimension):
        edges = half[:, subset]
        volume = abs(float(np.linalg.det(edges)))
        if volume <= 1e-14 * float(np.prod(np.linalg.norm(edges, axis=0))):
            continue
        rest = [k for k in range(count) if k not in subset]
        # Height of each other generator above the hyperplane through the lifted edges; the lower face has it positive.
        above = heights[rest] - heights[list(subset)] @ np.linalg.solve(edges, half[:, rest])
        chosen.append((centre - half[:, rest] @ np.sign(above), edges))
        volumes.append(volume)
    if not chosen:
        raise ValueError("a zonotope without area or volume has no uniform density; use over='links'")
    shares = np.array(volumes) / np.sum(volumes)
    return tuple(_piece(float(w), c, e) for w, (c, e) in zip(shares, chosen, strict=True))
