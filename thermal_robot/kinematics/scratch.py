"""Arrays to work in, kept by each thread from chunk to chunk and from call to call; and arrays for results."""

from __future__ import annotations

import math
import threading
from collections.abc import Iterator

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.errors import RobotError
from thermal_robot.kinematics import settings

_FRAME = 12 * 8
"""Bytes of one frame of one configuration."""

_kept = threading.local()


def scratch(name: str, *shape: int) -> Array:
    """Return an array of that shape with anything in it, the same memory each time; until the next call it is yours.

    Parameters
    ----------
    name
        What it is for. Two arrays that are in use together have two names.
    shape
        Of the array, which is contiguous.
    """
    size = math.prod(shape)
    kept: Array | None = getattr(_kept, name, None)
    if kept is None or kept.size < size:
        kept = np.empty(size)
        setattr(_kept, name, kept)
    return kept[:size].reshape(shape)


def chunks(rows: int, frames: int) -> Iterator[slice]:
    """Consecutive slices that cover all rows, each short enough for that many frames a row to stay in the cache."""
    fits = settings.CACHE // (_FRAME * max(frames, 1))
    step = max(min(settings.CHUNK, fits), min(settings.SHORTEST_CHUNK, settings.CHUNK))
    return (slice(start, min(start + step, rows)) for start in range(0, rows, step))


def rows_last(array: Array) -> Array:
    """Return an array (N, ...) as (..., N), the same memory."""
    return array.transpose(*range(1, array.ndim), 0)


def result(out: Array | None, rows: int, *shape: int) -> Array:
    """Return the array for the results of N configurations: a new one with N last in memory, or the caller's.

    Parameters
    ----------
    out
        Of shape (N, ...) as the results, in any layout; ``None`` for a new one.
    rows
        N.
    shape
        Of the result of one configuration.

    Raises
    ------
    RobotError
        If ``out`` is not such an array of floats, or must not be written to.
    """
    if out is None:
        last = len(shape)
        return np.empty((*shape, rows)).transpose(last, *range(last))
    wanted = (rows, *shape)
    if not isinstance(out, np.ndarray) or out.shape != wanted or out.dtype != np.float64:
        raise RobotError(
            f"out of shape {np.shape(out)} and type {getattr(out, 'dtype', type(out).__name__)} does not fit: "
            f"expected an array of float64 of shape {wanted}"
        )
    if not out.flags.writeable:
        raise RobotError("out must not be written to: give an array that may be, or none")
    return out
