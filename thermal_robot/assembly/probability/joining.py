"""Probability that a peg finds its hole (Eq 22): the position error stays within the clearance."""

from __future__ import annotations

from typing import Literal

import numpy as np
import numpy.typing as npt

from thermal_robot.arrays import Array
from thermal_robot.assembly.probability.compiled import circle_chances
from thermal_robot.assembly.probability.law import Law, Randomised, Thermal
from thermal_robot.assembly.probability.links import generator_lengths, planar_link_nodes
from thermal_robot.assembly.probability.planar import planar_probability
from thermal_robot.assembly.probability.quadrature import integrate_panels
from thermal_robot.assembly.probability.spread import Parallelotope

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
    """Check, broadcast, and integrate all cases at once; compiled loops tell the plain ones of very many."""
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
    """Integrate cases that were checked, one after the other."""
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
    """Diameters ``(..., 1)`` or side lengths ``(..., 2)``."""
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
    """Return all cases; zero and infinite clearances are settled here."""
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
    """Take the longest generator in closed form, the others by sums; next to a narrow normal part the second adapts."""
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
    """Panels over the second generator, graded to where the first one's segment passes through the region's centre."""
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
