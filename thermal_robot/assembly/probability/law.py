"""The law of an error in the plane of a hole: a normal part, a mean, and what may be uniform beside it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from thermal_robot.arrays import Array
from thermal_robot.assembly.probability.spread import UniformSpread

Randomised = Literal["uniform", "normal"]
Thermal = UniformSpread | npt.ArrayLike | None


@dataclass(frozen=True)
class Law:
    """Laws of planar errors; their leading axes broadcast.

    Parameters
    ----------
    matrices
        Covariances of the normal parts, shape ``(..., 2, 2)``.
    means
        Shape ``(..., 2)``.
    spread
        The uniform part, of all of them; ``None`` for none.
    segments
        Ends of a uniform part of each, which runs from ``-segment`` to ``segment``, shape ``(..., 2)``; ``None`` for
        none.
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
        """Check what `joining_probability` is given, and put the thermal part where it belongs.

        Raises
        ------
        ValueError
            For wrong shapes, or a covariance that is none.
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
        """Shape of the laws."""
        own = () if self.segments is None else self.segments.shape[:-1]
        return np.broadcast_shapes(self.matrices.shape[:-2], self.means.shape[:-1], own)

    def flat(self, leading: tuple[int, ...]) -> Law:
        """Return the laws broadcast to a shape, one after the other."""
        ends = self.segments
        return Law(
            np.broadcast_to(self.matrices, (*leading, 2, 2)).reshape(-1, 2, 2),
            np.broadcast_to(self.means, (*leading, 2)).reshape(-1, 2),
            self.spread,
            None if ends is None else np.broadcast_to(ends, (*leading, 2)).reshape(-1, 2),
        )

    def rows(self, chosen: npt.NDArray[np.bool_] | npt.NDArray[np.intp]) -> Law:
        """Return some of the laws that are flat."""
        ends = self.segments
        return Law(self.matrices[chosen], self.means[chosen], self.spread, None if ends is None else ends[chosen])


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
