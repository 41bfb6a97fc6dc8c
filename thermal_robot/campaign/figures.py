"""How large and how small a figure of a campaign can be, whoever wrote it: beyond that, squares overflow or vanish."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from thermal_robot.schema import LARGEST

SMALLEST = 1e-30
"""In any unit: what is nearer to 0 is 0; a picometre in metres is 1e-12."""
QUATERNION_TOLERANCE = 0.1
"""A quaternion whose length differs from 1 by more is a mistake, not a rounding: four parts that are written with one
decimal change the length by at most 0.05 · √4."""
LARGEST_COMMAND = 1e6
"""rad or m: 160 000 turns, which leave ten digits for the angle."""


def first_beyond(values: NDArray[np.float64], most: float = LARGEST) -> int | None:
    """Return the row of the first figure that is not finite or too large, of (N,) or (N, k); ``None`` without one."""
    beyond = ~(np.abs(values) <= most)
    rows = beyond if values.ndim == 1 else beyond.any(axis=1)
    return int(np.argmax(rows)) if rows.any() else None


def settled(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the figures with those that are next to nothing as 0; the array itself where there are none."""
    vanishing = (np.abs(values) < SMALLEST) & (values != 0.0)
    return np.where(vanishing, 0.0, values) if vanishing.any() else values


def no_orientation(quaternions: NDArray[np.float64]) -> int | None:
    """Return the row of the first quaternion, of (N, 4), whose length is not 1; ``None`` without one."""
    refused = np.abs(np.linalg.norm(quaternions, axis=1) - 1.0) > QUATERNION_TOLERANCE
    return int(np.argmax(refused)) if refused.any() else None
