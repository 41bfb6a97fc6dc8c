"""Thermal displacement with bounds only: zonotope (Eqs 14-15) and uniform distributions on it (16, 19).

The displacement is ``sum of g_i delta_i`` with ``lower_i <= delta_i <= upper_i``, the ``g_i`` being the sensitivities.
The set of its values is a zonotope: in a plane a polygon whose edges are the ``g_i`` themselves (the parallel lines of
Eq 15), in space a polyhedron. Both are built from the generators, never from their ``2**k`` corners.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import Literal

import numpy as np
import numpy.typing as npt

from thermal_robot.arrays import Array


@dataclass(frozen=True)
class Parallelotope:
    """Distribution of ``centre + generators @ u`` with ``u`` independent and uniform on [-1, 1].

    ``weight``: its share in a mixture; generators are half edges ``(d, m)``, none zero, longest first.
    """

    weight: float
    centre: Array
    generators: Array


@dataclass(frozen=True)
class UniformSpread:
    """Distribution of a displacement of which only bounds are known (section 4 of the paper): a mixture of pieces.

    Use the constructors `segment`, `box` and `zonotope`; the fields are what they have in common.

    Parameters
    ----------
    pieces
        Linear images of independent uniform variables; their weights sum to one.
    """

    pieces: tuple[Parallelotope, ...]

    @classmethod
    def segment(cls, end: npt.ArrayLike, start: npt.ArrayLike | None = None) -> UniformSpread:
        """Uniform distribution on the segment from ``start`` (default ``-end``) to ``end``.

        It is that of one link, or of all links warming together.

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
        """Uniform distribution on a box about the origin: independent axes, as the paper's Eqs 19-20 treat them.

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
        """Distribution of displacements ``generators @ delta``, ``lower <= delta <= upper`` (Eqs 14-15).

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
        """Draw ``size`` random displacements, shape ``(size, d)``."""
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
    """Return generators ``(d, k)`` and bounds ``(k,)``; ``ValueError`` for wrong shapes, infinities, lower > upper."""
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


# Two generators whose directions differ by less than this are one direction; rounding of sines and cosines is a tenth
# of it.
_PARALLEL = 1e-12


@dataclass(frozen=True)
class Zonotope:
    """Zonotope: all displacements within the bounds, in a plane or in space.

    Parameters
    ----------
    generators
        Sensitivities as columns, shape ``(d, k)``.
    lower, upper
        Bounds of the elongations, shape ``(k,)``.
    vertices
        Shape ``(V, d)``. In a plane counter-clockwise from the lowest; a segment has two, a point one.
    corners
        Elongations that lead to each vertex, shape ``(V, k)``; every entry is one of its bounds.
    faces
        In space: indices of the vertices around each face, counter-clockwise seen from outside. In a plane, or if all
        lies in one plane: empty.
    """

    generators: Array
    lower: Array
    upper: Array
    vertices: Array
    corners: Array
    faces: tuple[tuple[int, ...], ...] = ()

    @property
    def dimension(self) -> int:
        """Number of coordinates, 2 or 3."""
        return int(self.generators.shape[0])

    @property
    def content(self) -> float:
        """Area of the polygon, or volume of the polyhedron: the sum of ``|det|`` over choices of ``d`` generators."""
        edges = self.generators * (self.upper - self.lower)
        subsets = list(combinations(range(edges.shape[1]), self.dimension))
        if not subsets:
            return 0.0
        return float(np.sum(np.abs(np.linalg.det(np.moveaxis(edges[:, np.array(subsets)], 1, 0)))))

    @property
    def area(self) -> float:
        """Area of the polygon; ``ValueError`` for a zonotope in space."""
        if self.dimension != 2:
            raise ValueError("a zonotope in space has a volume; its polygon in a plane has an area")
        return self.content

    @property
    def volume(self) -> float:
        """Volume of the polyhedron; ``ValueError`` for a polygon."""
        if self.dimension != 3:
            raise ValueError("a polygon has an area, not a volume")
        return self.content

    @property
    def farthest(self) -> Array:
        """Vertex farthest from the origin, the nominal position; shape ``(d,)``."""
        return np.asarray(self.vertices[np.argmax(np.linalg.norm(self.vertices, axis=1))])

    @property
    def farthest_distance(self) -> float:
        """Distance of the farthest vertex: the largest displacement of the tool point."""
        return float(np.linalg.norm(self.farthest))


def zonotope(generators: npt.ArrayLike, lower: npt.ArrayLike, upper: npt.ArrayLike) -> Zonotope:
    """Zonotope of all displacements within the bounds: polygon (Eqs 14-15) or polyhedron.

    Parameters
    ----------
    generators
        Sensitivities of the displacement as columns, shape ``(2, k)`` or ``(3, k)``; the rows of Eq 14.
    lower, upper
        Bounds of the elongations, scalars or shape ``(k,)``.

    Returns
    -------
    Zonotope

    Raises
    ------
    ValueError
        For wrong shapes, numbers that are not finite, or a lower bound above its upper bound.
    """
    columns, low, high = generator_bounds(generators, lower, upper)
    if columns.shape[0] == 2:
        vertices, corners = _polygon(columns, low, high)
        return Zonotope(columns, low, high, vertices, corners)
    if columns.shape[0] == 3:
        return _polyhedron(columns, low, high)
    raise ValueError(f"generators must have two or three rows, not {columns.shape[0]}")


def polygon_in_plane(
    generators: npt.ArrayLike, lower: npt.ArrayLike, upper: npt.ArrayLike, plane: npt.ArrayLike | str
) -> Zonotope:
    """Polygon of a zonotope in space projected orthogonally on a plane, in the two coordinates of `plane_axes`.

    Parameters
    ----------
    generators
        Sensitivities as columns, shape ``(3, k)``.
    lower, upper
        Bounds of the elongations, scalars or shape ``(k,)``.
    plane
        Two coordinates by name (``"yz"`` as in Fig 5), two orthonormal directions as rows, shape ``(2, 3)``, or the
        plane's normal, shape ``(3,)``: the polygon's axes are then those of `plane_axes`.
    """
    columns, low, high = generator_bounds(generators, lower, upper)
    if columns.shape[0] != 3:
        raise ValueError(f"generators must have three rows, not {columns.shape[0]}")
    return zonotope(plane_axes(plane) @ columns, low, high)


def plane_axes(plane: npt.ArrayLike | str) -> Array:
    """Two orthonormal directions of a plane as rows, shape ``(2, 3)``; see `polygon_in_plane`.

    For a normal, the first direction is horizontal (along ``x`` if the normal is vertical), and both together with
    the normal are right-handed.
    """
    if isinstance(plane, str):
        if len(plane) != 2 or plane[0] == plane[1] or not set(plane) <= set("xyz"):
            raise ValueError(f"a plane is named by two of x, y, z, not {plane!r}")
        return np.eye(3)[["xyz".index(letter) for letter in plane]]
    array = np.asarray(plane, dtype=float)
    if array.shape == (2, 3):
        if not np.allclose(array @ array.T, np.eye(2), atol=1e-9):
            raise ValueError("the directions of a plane must be orthonormal")
        return array
    length = float(np.linalg.norm(array)) if array.shape == (3,) else 0.0
    if not 0.0 < length < np.inf:
        raise ValueError("a plane is two coordinates, two directions (2, 3) or a normal (3,) that is not zero")
    return np.asarray(planes(array))


def planes(normals: npt.ArrayLike) -> Array:
    """Two orthonormal directions of each plane, shape ``(..., 2, 3)``, as `plane_axes` for each normal ``(..., 3)``.

    Normals are not zero; one that is NaN has NaN.
    """
    array = np.asarray(normals, dtype=float)
    normal = array / np.linalg.norm(array, axis=-1, keepdims=True)
    across = np.hypot(normal[..., 0], normal[..., 1])[..., None]
    upright = across < 1e-9
    first = np.stack([-normal[..., 1], normal[..., 0], np.zeros_like(normal[..., 0])], axis=-1)
    first = np.where(upright, [1.0, 0.0, 0.0], first / np.where(upright, 1.0, across))
    first = first - normal * np.sum(first * normal, axis=-1, keepdims=True)
    first /= np.linalg.norm(first, axis=-1, keepdims=True)
    return np.stack([first, np.cross(normal, first)], axis=-2)


def _groups(edges: Array) -> list[tuple[Array, Array]]:
    """Group parallel edge vectors ``(d, k)``: for each direction a unit vector ``(d,)`` and the edges' signs ``(k,)``.

    The sign of an edge along another direction, or without length, is zero.
    """
    found: list[tuple[Array, Array]] = []
    lengths = np.linalg.norm(edges, axis=0)
    for k in np.flatnonzero(lengths > _PARALLEL * np.max(lengths, initial=0.0)):
        unit = edges[:, k] / lengths[k]
        for direction, signs in found:
            along = float(unit @ direction)
            if float(np.linalg.norm(unit - along * direction)) <= _PARALLEL:
                signs[k] = np.sign(along)
                break
        else:
            signs = np.zeros(edges.shape[1])
            signs[k] = 1.0
            found.append((unit, signs))
    return found


def _polygon(columns: Array, low: Array, high: Array) -> tuple[Array, Array]:
    """Vertices (V, 2) of a planar zonotope, counter-clockwise from the lowest, and the elongations (V, k) there."""
    edges = columns * (high - low)
    groups = []
    for direction, signs in _groups(edges):
        up = -1.0 if direction[1] < -_PARALLEL or (abs(direction[1]) <= _PARALLEL and direction[0] < 0.0) else 1.0
        angle = float(np.arctan2(max(up * direction[1], 0.0), up * direction[0]))
        groups.append((angle, up * signs))
    groups.sort(key=lambda group: group[0])
    # Start where every edge that points up, or right, has not been taken.
    corner = np.where(sum((signs for _, signs in groups), np.zeros(low.size)) >= 0.0, low, high)
    corners = [corner]
    for turn in (1.0, -1.0):
        for _, signs in groups:
            corner = np.where(signs * turn > 0.0, high, np.where(signs * turn < 0.0, low, corner))
            corners.append(corner)
    if groups:
        corners.pop()  # the walk ends where it began
    table = np.array(corners)
    return table @ columns.T, table


def _directions(edges: Array) -> tuple[Array, int]:
    """Return unit vectors ``(n, d)`` of the edges' directions, then of their orthogonal complement; and their rank."""
    basis = np.array([direction for direction, _ in _groups(edges)]).reshape(-1, len(edges))
    rank = int(np.linalg.matrix_rank(basis, tol=1e-10)) if len(basis) else 0
    return np.concatenate([basis, np.linalg.svd(basis)[2][rank:] if len(basis) else np.eye(len(edges))]), rank


def _polyhedron(columns: Array, low: Array, high: Array) -> Zonotope:
    """Zonotope in space by facet normals: a face is the polygon of the generators in its plane, the others at bounds.

    Of rank below three it has no faces: its vertices are those of a polygon, a segment or a point.
    """
    edges = columns * (high - low)
    basis, rank = _directions(edges)
    if rank < 3:  # no volume: its polygon, segment or point, in its own plane
        axes = np.linalg.svd(basis[: len(basis) - 3 + rank])[2][:2] if rank else np.eye(3)[:2]
        _, corners = _polygon(axes @ columns, low, high)
        return Zonotope(columns, low, high, corners @ columns.T, corners)
    members = np.abs(np.array([signs for _, signs in _groups(edges)])) > 0.0
    moving = np.any(members, axis=0)
    numbers: dict[bytes, int] = {}
    found: list[Array] = []
    faces: list[tuple[int, ...]] = []
    planes_seen = set()
    for i, j in combinations(range(len(basis)), 2):
        normal = np.cross(basis[i], basis[j])
        normal /= np.linalg.norm(normal)
        inside = np.abs(basis @ normal) <= 1e-10
        if inside.tobytes() in planes_seen:
            continue
        planes_seen.add(inside.tobytes())
        lying = np.any(members[inside], axis=0) | ~moving
        for outward in (normal, -normal):
            corner = np.where(outward @ edges > 0.0, high, low)
            _, polygon = _polygon(plane_axes(outward) @ columns[:, lying], low[lying], high[lying])
            face = np.tile(corner, (len(polygon), 1))
            face[:, lying] = polygon
            # A generator without length, or bounds without width, leads nowhere: one corner for all.
            face = np.where(moving, face, low)
            for key, end in zip(map(bytes, face), face, strict=True):
                if key not in numbers:
                    numbers[key] = len(found)
                    found.append(end)
            faces.append(tuple(numbers[bytes(end)] for end in face))
    table = np.array(found)
    return Zonotope(columns, low, high, table @ columns.T, table, tuple(faces))
