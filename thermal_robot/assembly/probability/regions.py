"""The clearances a peg may use up: a disc, or a rectangle, each seen along parallel chords."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from thermal_robot.arrays import Array


class Region(Protocol):
    """A convex region about the origin, or ``N`` of one kind, in a frame whose second axis runs along the chords.

    The coordinate ``t`` parametrises the first axis, ``x = x(t)``, so that the chords' ends are smooth in ``t``
    between the breaks.
    """

    def breaks(self) -> Array:
        """Return ends and kinks in ``t``, ascending, shape ``(N, B)``."""
        ...

    def abscissa(self, owner: npt.NDArray[np.intp], t: Array) -> tuple[Array, Array]:
        """Return ``x(t)`` and ``dx/dt`` of region ``owner``, in the shape of ``t`` (first axis: ``owner``)."""
        ...

    def parameter(self, x: Array) -> Array:
        """``t`` of abscissae of shape ``(N, K)``, clipped to the region."""
        ...

    def chord(self, owner: npt.NDArray[np.intp], t: Array) -> tuple[Array, Array]:
        """Lower and upper end of the chord at ``t``."""
        ...

    def crossings(self, slope: npt.ArrayLike, intercept: Array) -> Array:
        """Abscissae where lines ``y = slope x + intercept``, shape ``(N, K)``, meet the boundary, shape ``(N, C)``.

        The slope is one number, or of shape ``(N, 1)``.
        """
        ...


@dataclass(frozen=True)
class Disc:
    """Discs about the origin with radii of shape ``(N,)``; ``x = radius sin t``."""

    radius: Array

    def breaks(self) -> Array:
        """Return the ends in ``t``, a quarter turn to either side."""
        return np.tile([-0.5 * np.pi, 0.5 * np.pi], (self.radius.size, 1))

    def abscissa(self, owner: npt.NDArray[np.intp], t: Array) -> tuple[Array, Array]:
        """``radius sin t`` and its derivative."""
        radius = self.radius[owner][:, None]
        return radius * np.sin(t), radius * np.cos(t)

    def parameter(self, x: Array) -> Array:
        """Arc sine of the clipped ratio."""
        return np.asarray(np.arcsin(np.clip(x / self.radius[:, None], -1.0, 1.0)))

    def chord(self, owner: npt.NDArray[np.intp], t: Array) -> tuple[Array, Array]:
        """``-radius cos t`` and ``radius cos t``."""
        half = self.radius[owner][:, None] * np.cos(t)
        return -half, half

    def crossings(self, slope: npt.ArrayLike, intercept: Array) -> Array:
        """Both intersections of every line; a line that misses gives its nearest approach twice."""
        slope = np.asarray(slope)
        square = 1.0 + slope * slope
        middle = -slope * intercept / square
        root = np.sqrt(np.maximum(self.radius[:, None] ** 2 * square - intercept**2, 0.0)) / square
        return np.concatenate([middle - root, middle + root], axis=1)


@dataclass(frozen=True)
class Rectangle:
    """Rectangles about the origin, each turned by an angle.

    Parameters
    ----------
    half_sides
        Half lengths along the rectangle's own axes, shape ``(N, 2)``.
    axes
        The rectangles' two axes as columns, in the frame of the chords; shape ``(2, 2)`` or ``(N, 2, 2)``, orthonormal.
    """

    half_sides: Array
    axes: Array

    def _corners(self) -> tuple[Array, Array]:
        one, two = (np.multiply(self.half_sides[:, k : k + 1], self.axes[..., k]) for k in (0, 1))  # each (N, 2)
        corners = np.stack([one + two, one - two, -one - two, -one + two], axis=1)
        return corners[..., 0], corners[..., 1]

    def breaks(self) -> Array:
        """Abscissae of the corners."""
        return np.sort(self._corners()[0], axis=1)

    def abscissa(self, owner: npt.NDArray[np.intp], t: Array) -> tuple[Array, Array]:
        """``t`` itself."""
        return t, np.ones_like(t)

    def parameter(self, x: Array) -> Array:
        """``x`` clipped to the region."""
        ends = self.breaks()
        return np.clip(x, ends[:, :1], ends[:, -1:])

    def chord(self, owner: npt.NDArray[np.intp], t: Array) -> tuple[Array, Array]:
        """Where the vertical line at ``t`` is within both strips ``|axis . point| <= half side``."""
        low, high = np.full_like(t, -np.inf), np.full_like(t, np.inf)
        axes = np.broadcast_to(self.axes, (len(self.half_sides), 2, 2))
        for k in (0, 1):
            across, along = axes[owner, 0, k][:, None], axes[owner, 1, k][:, None]
            half = self.half_sides[owner, k][:, None]
            crossed = along != 0.0  # a side along the chords does not end them
            ends = [(side - across * t) / np.where(crossed, along, 1.0) for side in (-half, half)]
            low = np.where(crossed, np.maximum(low, np.minimum(*ends)), low)
            high = np.where(crossed, np.minimum(high, np.maximum(*ends)), high)
        return low, np.maximum(low, high)

    def crossings(self, slope: npt.ArrayLike, intercept: Array) -> Array:
        """Where every line meets the four edges' lines."""
        result = []
        for k in (0, 1):
            across, along = self.axes[..., 0, k, None], self.axes[..., 1, k, None]
            rate = across + along * np.asarray(slope, dtype=float)
            half = self.half_sides[:, [k]]
            with np.errstate(divide="ignore", invalid="ignore"):
                for side in (-half, half):
                    result.append((side - along * intercept) / rate)
        return np.asarray(np.nan_to_num(np.concatenate(result, axis=1), nan=0.0, posinf=0.0, neginf=0.0))
