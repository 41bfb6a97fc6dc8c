"""Which components of the displacement are measured at which pose, as rows of one system (Eq 12)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from thermal_robot.errors import EstimationError

Array = NDArray[np.float64]

Axes: TypeAlias = "str | Sequence[str]"
"""Letters among x, y and z that are measured at every pose, or a word of them for each pose."""

RANK_TOLERANCE = 1e-9
"""Singular values below this share of the largest are zero: between rounding and any geometry that can be built."""


_LEAST_SHARE = 1e-6
# Of an unknown in what the system cannot see: a millimetre there would be a nanometre here.


def axes_of(axes: Axes, count: int) -> tuple[str, ...]:
    """Write the measured axes as a word for each of ``count`` poses.

    Raises
    ------
    EstimationError
        If a letter is not x, y or z, a word is empty, or there is not one word a pose.
    """
    words = (axes,) * count if isinstance(axes, str) else tuple(axes)
    if len(words) != count:
        raise EstimationError(f"measured axes are given for {len(words)} poses, but there are {count}")
    for word in words:
        if not word or set(word) - set("xyz") or len(set(word)) != len(word):
            raise EstimationError(f"the axes measured at a pose are some of the letters x, y and z, not {word!r}")
    return words


def measured(words: Sequence[str]) -> NDArray[np.bool_]:
    """Whether each component was measured, (N, 3)."""
    return np.array([[letter in word for letter in "xyz"] for word in words], dtype=bool).reshape(-1, 3)


def visible(right_vectors: Array, rank: int) -> NDArray[np.bool_]:
    """Whether each unknown is determined alone: no combination that the system cannot see holds it."""
    unseen = np.sqrt(np.sum(right_vectors[rank:] ** 2, axis=0))
    return np.asarray(unseen < _LEAST_SHARE)


def rank_of(singular: Array) -> int:
    """Return how many singular values, largest first, are not zero."""
    return int(np.sum(singular > RANK_TOLERANCE * singular[0])) if len(singular) and singular[0] > 0.0 else 0
