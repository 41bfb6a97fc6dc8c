"""Probability that a peg finds its hole (Eq 22): the position error stays within the clearance."""

from __future__ import annotations

from typing import Literal

import numpy as np
import numpy.typing as npt

from thermal_robot.assembly.probability.links import generator_lengths, planar_link_nodes
from thermal_robot.assembly.probability.planar import planar_probability
from thermal_robot.assembly.probability.quadrature import integrate_panels
from thermal_robot.assembly.probability.spread import Parallelotope, UniformSpread

Array = npt.NDArray[np.float64]
Shape = Literal["circle", "rectangle"]
Randomised = Literal["uniform", "normal"]
Thermal = UniformSpread | npt.ArrayLike | None

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

    Returns
    -------
    Array
        Probabilities, in the broadcast shape of the leading axes; 0-d for a single case. Absolute error below 1e-12.

    Raises
    ------
    ValueError
        For wrong shapes, a covariance that is not symmetric positive semidefinite, a negative clearance.
    """
    return _evaluate(covariance, clearance, mean, shape, thermal, randomised, outside=False)


def failing_probability(
    covariance: npt.ArrayLike,
    clearance: npt.ArrayLike,
    mean: npt.ArrayLike = 0.0,
    *,
    shape: Shape = "circle",
    thermal: Thermal = None,
    randomised: Randomised = "uniform",
) -> Array:
    """Probability that the deviation exceeds the clearance, ``1 - P`` of Eq 22, integrated directly over the outside.

    It keeps its digits (1e-10 relative) when ``P`` rounds to one. Parameters, shapes and errors as in
    `joining_probability`.
    """
    return _evaluate(covariance, clearance, mean, shape, thermal, randomised, outside=True)


def _evaluate(
    covariance: npt.ArrayLike,
    clearance: npt.ArrayLike,
    mean: npt.ArrayLike,
    shape: Shape,
    thermal: Thermal,
    randomised: Randomised,
    *,
    outside: bool,
) -> Array:
    """Check, broadcast, and integrate all cases at once."""
    matrices = check_covariance(covariance)
    sizes = _sizes(clearance, shape)
    means = np.zeros(2) if np.ndim(mean) == 0 and float(np.asarray(mean)) == 0.0 else np.asarray(mean, dtype=float)
    if means.shape[-1:] != (2,) or not np.all(np.isfinite(means)):
        raise ValueError(f"mean must be 0 or finite with shape (..., 2), not of shape {np.shape(mean)}")
    spread: UniformSpread | None = None
    if isinstance(thermal, UniformSpread):
        if thermal.dimension != 2:
            raise ValueError(f"the thermal part must be planar, not of dimension {thermal.dimension}")
        if randomised == "normal":
            matrices, means = matrices + thermal.covariance, means + thermal.mean
        elif randomised == "uniform":
            spread = thermal
        else:
            raise ValueError(f"randomised must be 'uniform' or 'normal', not {randomised!r}")
    elif thermal is not None:
        shift = np.asarray(thermal, dtype=float)
        if shift.shape[-1:] != (2,) or not np.all(np.isfinite(shift)):
            raise ValueError(f"a thermal shift must be finite with shape (..., 2), not of shape {shift.shape}")
        means = means + shift

    leading = np.broadcast_shapes(matrices.shape[:-2], sizes.shape[:-1], means.shape[:-1])
    all_sizes = np.broadcast_to(sizes, (*leading, sizes.shape[-1])).reshape(-1, sizes.shape[-1])
    all_means = np.broadcast_to(means, (*leading, 2)).reshape(-1, 2)
    all_matrices = np.broadcast_to(matrices, (*leading, 2, 2)).reshape(-1, 2, 2)
    if spread is None or all(piece.generators.shape[1] < 2 for piece in spread.pieces):
        return _cases(all_matrices, all_means, all_sizes, shape, spread, outside).reshape(leading)
    # sums over several generators are as fine as the normal part demands: one after the other
    kinds, kind = np.unique(all_matrices.reshape(-1, 4), axis=0, return_inverse=True)
    result = np.empty(len(all_means))
    for number, flat in enumerate(kinds):
        chosen = kind.reshape(-1) == number
        result[chosen] = _cases(flat.reshape(2, 2), all_means[chosen], all_sizes[chosen], shape, spread, outside)
    return result.reshape(leading)


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


def _cases(
    covariance: Array, means: Array, sizes: Array, shape: Shape, spread: UniformSpread | None, outside: bool
) -> Array:
    """Return all cases, of one covariance ``(2, 2)`` or of one each; zero and infinite clearances are settled here."""
    result = np.full(len(means), 1.0 if outside else 0.0)
    pieces = spread.pieces if spread is not None else (Parallelotope(1.0, np.zeros(2), np.empty((2, 0))),)
    reach = max(float(np.sum(np.abs(p.generators)) + np.sum(np.abs(p.centre))) for p in pieces)
    far = _FAR * np.sqrt(np.trace(covariance, axis1=-2, axis2=-1)) + reach + np.linalg.norm(means, axis=1)
    endless = np.all(np.isinf(sizes), axis=1)
    result[endless] = 0.0 if outside else 1.0
    sizes = np.where(np.isinf(sizes), 2.0 * far[:, None], sizes)
    proper = np.all(sizes > 0.0, axis=1) & ~endless
    if np.any(proper):
        total = np.zeros(int(np.sum(proper)))
        for piece in pieces:
            total += piece.weight * _piece_probability(
                covariance if covariance.ndim == 2 else covariance[proper],
                means[proper] + piece.centre,
                sizes[proper],
                shape,
                piece.generators,
                outside,
            )
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
