"""Flat-normal in the plane and in space: a normal part plus a uniform part on a segment, box or zonotope."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.special import logsumexp

from thermal_robot.arrays import Array
from thermal_robot.assembly.probability.joining import joining_probability
from thermal_robot.assembly.probability.kernels import log_density
from thermal_robot.assembly.probability.links import link_nodes
from thermal_robot.assembly.probability.spread import Parallelotope, UniformSpread

_LOG_2PI = np.log(2.0 * np.pi)
_CHUNK = 2_000_000  # numbers held at once


@dataclass(frozen=True)
class FlatNormalND:
    """Law of ``mean + normal + uniform``, both parts independent.

    Parameters
    ----------
    normal_covariance
        Covariance of the normal part, shape ``(d, d)``, positive definite.
    spread
        Uniform part; it may have a mean of its own.
    offset
        Mean of the normal part, shape ``(d,)``.

    Raises
    ------
    ValueError
        For shapes that do not fit, or a covariance that is not positive definite: there is no density then
        (probabilities of joining do not need one, see `joining_probability`).
    """

    normal_covariance: Array
    spread: UniformSpread
    offset: Array

    def __post_init__(self) -> None:
        """Check shapes and definiteness."""
        size = self.spread.dimension
        if self.normal_covariance.shape != (size, size) or self.offset.shape != (size,):
            raise ValueError(f"covariance and mean must have shapes ({size}, {size}) and ({size},)")
        if not np.allclose(self.normal_covariance, self.normal_covariance.T, rtol=1e-9, atol=0.0):
            raise ValueError("covariance must be symmetric")
        if not np.all(np.linalg.eigvalsh(self.normal_covariance) > 0.0):
            raise ValueError("covariance must be positive definite for a density")

    @property
    def mean(self) -> Array:
        """Mean, shape ``(d,)``; exact."""
        return np.asarray(self.offset + self.spread.mean)

    @property
    def covariance(self) -> Array:
        """Covariance of both parts together, shape ``(d, d)``; exact (Eq 20)."""
        return np.asarray(self.normal_covariance + self.spread.covariance)

    def logpdf(self, x: npt.ArrayLike) -> Array:
        """Logarithm of the density.

        In units of the normal part, generators at right angles to each other (a segment; a box along the principal
        axes) give a product of one-dimensional flat-normal densities, correct far into the tails. Otherwise that
        holds for the longest one, and the others are Gauss-Legendre sums, relatively correct within nine standard
        deviations.

        Parameters
        ----------
        x
            Shape ``(..., d)``.
        """
        points = np.asarray(x, dtype=float)
        if points.shape[-1:] != self.offset.shape:
            raise ValueError(f"points must have shape (..., {self.offset.size}), not {points.shape}")
        flat = points.reshape(-1, self.offset.size) - self.offset
        terms = [np.log(piece.weight) + self._log_piece(flat - piece.centre, piece) for piece in self.spread.pieces]
        return np.asarray(logsumexp(terms, axis=0).reshape(points.shape[:-1]))

    def pdf(self, x: npt.ArrayLike) -> Array:
        """Density at points of shape ``(..., d)``; see `logpdf`."""
        return np.exp(self.logpdf(x))

    def rvs(self, size: int, random_state: int | np.random.Generator | None = None) -> Array:
        """Draw ``size`` points, shape ``(size, d)``."""
        generator = np.random.default_rng(random_state)
        normal = generator.standard_normal((size, self.offset.size)) @ np.linalg.cholesky(self.normal_covariance).T
        return self.offset + normal + self.spread.rvs(size, generator)

    def box_probability(self, lower: npt.ArrayLike, upper: npt.ArrayLike) -> Array:
        """Probability of ``lower <= X <= upper`` in the plane; infinite bounds make it the distribution function.

        Parameters
        ----------
        lower, upper
            Shape ``(..., 2)``.

        Raises
        ------
        ValueError
            In space, or for bounds in the wrong order.
        """
        if self.offset.size != 2:
            raise ValueError("box probabilities are for the plane")
        low, high = np.broadcast_arrays(np.asarray(lower, dtype=float), np.asarray(upper, dtype=float))
        if not np.all(low <= high):
            raise ValueError("a lower bound lies above its upper bound")
        reach = 50.0 * np.sqrt(np.diag(self.covariance))
        low = np.where(np.isneginf(low), np.minimum(self.mean - reach, high - reach), low)
        high = np.where(np.isposinf(high), np.maximum(self.mean + reach, low + reach), high)
        middle = 0.5 * (low + high)
        return joining_probability(
            self.normal_covariance, high - low, self.offset - middle, shape="rectangle", thermal=self.spread
        )

    def _log_piece(self, points: Array, piece: Parallelotope) -> Array:
        factor = np.linalg.cholesky(self.normal_covariance)
        white = np.linalg.solve(factor, points.T).T
        edges = np.linalg.solve(factor, piece.generators)
        lengths = np.linalg.norm(edges, axis=0)
        edges, lengths = edges[:, np.argsort(-lengths)], np.sort(lengths)[::-1]
        cosines = (edges / lengths).T @ (edges / lengths) - np.eye(lengths.size)
        log_scale = -float(np.sum(np.log(np.diag(factor))))
        if np.all(np.abs(cosines) < 1e-13):
            return log_scale + _log_product(white, edges, lengths)
        shifts, weights = link_nodes(np.eye(self.offset.size), edges[:, 1:])
        result = np.empty(len(white))
        step = max(1, _CHUNK // shifts.size)
        for start in range(0, len(white), step):
            part = white[start : start + step, None, :] - shifts
            values = _log_product(part.reshape(-1, self.offset.size), edges[:, :1], lengths[:1])
            result[start : start + step] = logsumexp(values.reshape(len(part), -1), b=weights, axis=1)
        return log_scale + result


def flat_normal_nd(covariance: npt.ArrayLike, spread: UniformSpread, mean: npt.ArrayLike | None = None) -> FlatNormalND:
    """Build a flat-normal distribution in the plane or in space.

    Parameters
    ----------
    covariance
        Covariance of the normal part, shape ``(d, d)``, positive definite.
    spread
        Uniform part, of dimension ``d``.
    mean
        Mean of the normal part, shape ``(d,)``; zero by default.
    """
    offset = np.zeros(spread.dimension) if mean is None else np.asarray(mean, dtype=float)
    return FlatNormalND(np.asarray(covariance, dtype=float), spread, offset)


def _log_product(white: Array, edges: Array, lengths: Array) -> Array:
    """Flat-normal along each of orthogonal edges, standard normal across; points in units of the normal part."""
    directions = edges / lengths
    along = white @ directions
    across = white - along @ directions.T
    rest = white.shape[1] - lengths.size
    total = -0.5 * np.sum(across**2, axis=1) - 0.5 * rest * _LOG_2PI
    for k, length in enumerate(lengths):
        total = total + log_density(along[:, k], 1.0, length)
    return np.asarray(total)
