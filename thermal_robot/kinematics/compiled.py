"""Numba engine for large batches (the extra ``fast``), on all processors."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.compiling import in_pieces, loads, rows_at_once
from thermal_robot.kinematics import settings
from thermal_robot.kinematics.lanes import Chained, arm_of, rows_last, scratch


def installed() -> bool:
    """Whether numba can be loaded; the first call loads it."""
    return loads("thermal_robot.kinematics.kernels")


def run(what: str, robot: Chained, q: Array, out: Array, point: Array | None = None, mass: Array | None = None) -> None:
    """Run the compiled kernel ``what`` for (N, n) configurations into ``out`` (N, …), with one point (3,) and mass."""
    from thermal_robot.kinematics import kernels

    arm = arm_of(robot.chain)
    constants: tuple[Any, ...] = (arm if point is None else arm._replace(point=np.array(point)),)
    if mass is not None:
        constants += np.array(robot.gravity, dtype=float), float(mass)
    _write(getattr(kernels, what), constants, q, out)


def _write(kernel: Callable[..., None], constants: tuple[Any, ...], q: Array, out: Array) -> None:
    """Run a compiled kernel in threads, into ``out`` itself where N is last in memory, else through a buffer."""
    rows = rows_last(out)
    if np.may_share_memory(q, out):
        q = q.copy()
    if rows.flags.c_contiguous:
        _pieces(kernel, constants, q, rows.reshape(-1, len(q)))
        return
    size = math.prod(out.shape[1:])
    step = rows_at_once()
    for start in range(0, len(q), step):
        part = slice(max(0, min(start, len(q) - settings.LANES)), min(start + step, len(q)))
        block = scratch("compiled", size, part.stop - part.start)
        _pieces(kernel, constants, q[part], block)
        rows[..., part] = block.reshape(*rows.shape[:-1], -1)


def _pieces(kernel: Callable[..., None], constants: tuple[Any, ...], q: Array, rows: Array) -> None:
    if len(q) < settings.LANES:  # a kernel wants a whole block
        padded = np.concatenate([q, np.zeros((settings.LANES - len(q), q.shape[1]))])
        whole = np.empty((len(rows), settings.LANES))
        _pieces(kernel, constants, padded, whole)
        rows[...] = whole[:, : len(q)]
        return
    in_pieces(kernel, (*constants, q), len(q), (rows,))
