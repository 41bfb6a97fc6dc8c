"""Principal axes of planar covariances, the smaller variance with all its digits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from thermal_robot.arrays import Array


def _difference_of_products(a: Array, b: Array, c: Array, d: Array) -> Array:
    """Return ``a b - c d`` correct to rounding (Dekker's exact products), also where it nearly cancels."""

    def product(p: Array, q: Array) -> tuple[Array, Array]:
        head = p * q
        p1, q1 = p * 134217729.0, q * 134217729.0
        ph, qh = p1 - (p1 - p), q1 - (q1 - q)
        pl, ql = p - ph, q - qh
        return head, ((ph * qh - head) + ph * ql + pl * qh) + pl * ql

    one, one_low = product(a, b)
    two, two_low = product(c, d)
    return (one - two) + (one_low - two_low)


@dataclass(frozen=True)
class Principal:
    """2x2 covariances by their principal axes.

    Parameters
    ----------
    large, small
        Variances along the axes, ``large >= small >= 0``, shape ``(...)``.
    direction
        Unit vector of the axis with the larger variance, shape ``(..., 2)``.
    """

    large: Array
    small: Array
    direction: Array

    @classmethod
    def of(cls, covariance: Array) -> Principal:
        """Decompose; the smaller variance comes from the determinant, which keeps its digits next to a large one."""
        size = np.max(np.abs(covariance), axis=(-2, -1))
        nothing = size == 0.0
        # a power of two: to divide by it rounds nothing
        scale = np.where(nothing, 1.0, np.ldexp(1.0, np.frexp(size)[1]))
        a, b, c = (covariance[..., i, j] / scale for i, j in ((0, 0), (0, 1), (1, 1)))
        large = 0.5 * (a + c + np.hypot(a - c, 2.0 * b))
        small = np.maximum(_difference_of_products(a, c, b, b), 0.0) / np.where(nothing, 1.0, large)
        angle = 0.5 * np.arctan2(2.0 * b, a - c)
        return cls(large * scale, small * scale, np.stack([np.cos(angle), np.sin(angle)], axis=-1))

    def turned(self, vectors: Array) -> Array:
        """Coordinates of vectors ``(N, 2)`` along the axes, the one with the larger variance first."""
        e1 = self.direction
        first = vectors[:, 0] * e1[..., 0] + vectors[:, 1] * e1[..., 1]
        return np.stack([first, vectors[:, 1] * e1[..., 0] - vectors[:, 0] * e1[..., 1]], axis=1)

    def rows(self, chosen: npt.NDArray[np.intp]) -> Principal:
        """Return the axes of some rows."""
        return Principal(self.large[chosen], self.small[chosen], self.direction[chosen])
