"""The engine for very many configurations, with the extra ``fast``: kernels compiled by numba, on all processors."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.kinematics import lanes, settings
from thermal_robot.kinematics.model import PRISMATIC, Chain
from thermal_robot.kinematics.scratch import rows_last, scratch
from thermal_robot.kinematics.walk import steps

if TYPE_CHECKING:
    from thermal_robot.kinematics.chained import Chained, Weighted
    from thermal_robot.kinematics.kernels import Arm

Array = NDArray[np.float64]

_ORIGIN = np.zeros(3)


@cache
def installed() -> bool:
    """Whether numba is there; it is not loaded for that."""
    return find_spec("numba") is not None


def threads() -> int:
    """How many threads work on a batch."""
    if settings.THREADS:
        return settings.THREADS
    allowed = getattr(os, "sched_getaffinity", None)
    return len(allowed(0)) if allowed else os.cpu_count() or 1


def poses(robot: Chained, q: Array, out: Array) -> None:
    """Write the poses of the tool, (N, 4, 4)."""
    from thermal_robot.kinematics import kernels

    _run(kernels.poses, (arm(robot.chain, _ORIGIN),), q, out)


def jacobians(robot: Chained, q: Array, point: Array | None, out: Array) -> None:
    """Write the Jacobians at a point of the tool, (N, 6, n); a point of each row is left to NumPy."""
    from thermal_robot.kinematics import kernels

    if point is not None and point.ndim == 2:
        lanes.jacobians(robot, q, point, out)
    else:
        _run(kernels.jacobians, (arm(robot.chain, point),), q, out)


def placements(robot: Chained, q: Array, point: Array | None, out: Array) -> None:
    """Write the sensitivities of a point of the tool, (N, 6, S, 6); a point of each row is left to NumPy."""
    from thermal_robot.kinematics import kernels

    if point is not None and point.ndim == 2:
        lanes.placements(robot, q, point, out)
    else:
        _run(kernels.placements, (arm(robot.chain, point),), q, out)


def gravity(robot: Weighted, q: Array, mass: Array, com: Array, out: Array) -> None:
    """Write the holding torques, (N, n); payloads that differ from row to row are left to NumPy."""
    from thermal_robot.kinematics import kernels

    if mass.ndim:
        lanes.gravity(robot, q, mass, com, out)
    else:
        pull = np.array(robot.gravity, dtype=float)
        _run(kernels.gravity, (arm(robot.chain, com), pull, float(mass)), q, out)


def arm(chain: Chain, point: Array | None) -> Arm:
    """Write a chain, and a point of its tool, as the kernels want it."""
    from thermal_robot.kinematics import kernels

    taken, matrix = steps(chain), chain.coupling.matrix
    still = [step.joint is None for step in taken.each]
    kinds = np.array([kernels.FIXED if f else kernels.TURNS for f in still])
    kinds[[step.aligned is not None for step in taken.each]] = kernels.TURNS_ALIGNED
    kinds[chain.kinds == PRISMATIC] = kernels.SLIDES
    eye = np.eye(4)
    lead = [chain.coupling.leader(j) for j in range(len(matrix))]
    return kernels.Arm(
        kinds=kinds,
        joint=np.array([-1 if step.joint is None else step.joint for step in taken.each]),
        turns=np.array([(step.turns[0].start, step.turns[1].start) for step in taken.each]),
        place=_rigid([step.place for step in taken.each]),
        aligned=_rigid([eye if step.aligned is None else step.aligned for step in taken.each]),
        back=_rigid([eye if taken.last is None else taken.last])[0],
        axes=np.array(chain.axes),
        movable=np.array(chain.movable),
        placed=np.array(chain.placed),
        lead=np.array([-1 if j is None else j for j in lead]),
        factor=np.array([0.0 if j is None else matrix[row, j] for row, j in enumerate(lead)]),
        offset=np.array(chain.coupling.offset),
        first=np.array([j not in lead[:row] for row, j in enumerate(lead)]),
        last=np.array([j not in lead[row + 1 :] for row, j in enumerate(lead)]),
        masses=np.array(chain.masses),
        centres=np.array(chain.mass_centres),
        point=np.array(_ORIGIN if point is None else point),
    )


def _rigid(transposed: list[Array]) -> Array:
    return np.ascontiguousarray(np.array(transposed).transpose(0, 2, 1)[:, :3])


def _run(kernel: Callable[..., None], constants: tuple[Any, ...], q: Array, out: Array) -> None:
    """Let the kernel write the rows of ``out``, in pieces, in threads."""
    rows = rows_last(out)
    if np.may_share_memory(q, out):
        q = q.copy()
    if rows.flags.c_contiguous:
        _pieces(kernel, constants, q, rows.reshape(-1, len(q)))
        return
    size = math.prod(out.shape[1:])
    step = settings.PIECE * threads()
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
    count = max(1, len(q) // settings.PIECE)
    cuts = [len(q) * piece // count for piece in range(count + 1)]

    def work(piece: int) -> None:
        _called(kernel, *constants, q, cuts[piece], cuts[piece + 1], rows)

    workers = min(threads(), count)
    if workers < 2:
        for piece in range(count):
            work(piece)
        return
    work(0)  # compiles, where nothing is on disk
    with ThreadPoolExecutor(workers) as pool:
        list(pool.map(work, range(1, count)))


def _called(kernel: Callable[..., None], *arguments: Any) -> None:
    # A full disk stops numba when it has compiled a function and is to keep it; the next try goes on from there.
    for _ in range(settings.MOST_UNKEPT):
        try:
            return kernel(*arguments)
        except OSError:
            continue
    kernel(*arguments)
