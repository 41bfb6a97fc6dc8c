"""The engine for very many configurations, with the extra ``fast``: kernels compiled by numba, on all processors."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.compiling import in_pieces, loads, rows_at_once
from thermal_robot.kinematics import lanes, settings
from thermal_robot.kinematics.walk import Chained, Weighted, arm_of, rows_last, scratch


def installed() -> bool:
    """Whether numba is there and can be loaded; the first call loads it."""
    return loads("thermal_robot.kinematics.kernels")


def poses(robot: Chained, q: Array, out: Array) -> None:
    """Write the poses of the tool, (N, 4, 4)."""
    from thermal_robot.kinematics import kernels

    _run(kernels.poses, (arm_of(robot.chain, None),), q, out)


def jacobians(robot: Chained, q: Array, point: Array | None, out: Array) -> None:
    """Write the Jacobians at a point of the tool, (N, 6, n); a point of each row is left to NumPy."""
    from thermal_robot.kinematics import kernels

    if point is not None and point.ndim == 2:
        lanes.jacobians(robot, q, point, out)
    else:
        _run(kernels.jacobians, (arm_of(robot.chain, point),), q, out)


def placements(robot: Chained, q: Array, point: Array | None, out: Array) -> None:
    """Write the sensitivities of a point of the tool, (N, 6, S, 6); a point of each row is left to NumPy."""
    from thermal_robot.kinematics import kernels

    if point is not None and point.ndim == 2:
        lanes.placements(robot, q, point, out)
    else:
        _run(kernels.placements, (arm_of(robot.chain, point),), q, out)


def gravity(robot: Weighted, q: Array, mass: Array, com: Array, out: Array) -> None:
    """Write the holding torques, (N, n); payloads that differ from row to row are left to NumPy."""
    from thermal_robot.kinematics import kernels

    if mass.ndim:
        lanes.gravity(robot, q, mass, com, out)
    else:
        pull = np.array(robot.gravity, dtype=float)
        _run(kernels.gravity, (arm_of(robot.chain, com), pull, float(mass)), q, out)


def _run(kernel: Callable[..., None], constants: tuple[Any, ...], q: Array, out: Array) -> None:
    """Let the kernel write the rows of ``out``, in pieces, in threads."""
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
