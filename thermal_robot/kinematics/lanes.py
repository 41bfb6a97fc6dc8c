"""The engine of NumPy: chunks of configurations that stay in the cache, N last, results written where they belong."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.kinematics import blocks
from thermal_robot.kinematics.blocks import Places
from thermal_robot.kinematics.displaced import NOWHERE, Displaced
from thermal_robot.kinematics.scratch import chunks, rows_last, scratch
from thermal_robot.kinematics.walk import walk

if TYPE_CHECKING:
    from thermal_robot.kinematics.displaced import Chained, Weighted


def visit(robot: Chained, q: Array, given: Places | None, do: Callable[[Places, slice], None]) -> None:
    """Call a function with the places of one chunk of configurations after another.

    Parameters
    ----------
    robot
        The robot.
    q
        (N, n) rad or m; not read if ``given`` is.
    given
        Places of all N, where they are known.
    do
        What to do; the places are overwritten when it returns.
    """
    chain, elements = robot.chain, len(robot.chain.names)
    if given is not None:
        for part in chunks(given.tool_position.shape[-1], elements):
            do(given.of(part), part)
        return
    for part in chunks(len(q), elements):
        frames = scratch("frames", elements + 1, 3, 4, part.stop - part.start)
        walk(chain, q, NOWHERE, part, frames[:-1], frames[-1])
        do(Places(frames[:-1, :, :3], frames[:-1, :, 3], frames[-1, :, :3], frames[-1, :, 3]), part)


def poses(robot: Chained, q: Array, out: Array, moved: Displaced = NOWHERE) -> None:
    """Write the poses of the tool, (N, 4, 4), displaced or not."""
    elements = len(robot.chain.names)
    for part in chunks(len(q), 4):
        pair = scratch("frames", 2, 3, 4, part.stop - part.start)
        with written(out, part) as block:
            block[3] = np.array([0.0, 0.0, 0.0, 1.0])[:, None]
            frames = [pair[k % 2] for k in range(elements - 1)] + [block[:3]]
            walk(robot.chain, q, moved, part, frames, frames[-1], keep=False)


@contextmanager
def written(out: Array, part: slice) -> Iterator[Array]:
    """Yield where the results (..., C) of a chunk are written: in place, where N is last in memory too."""
    rows = rows_last(out)[..., part]
    if rows.strides[-1] == rows.itemsize:
        yield rows
        return
    block = scratch("written", *rows.shape)
    yield block
    rows[...] = block


def jacobians(robot: Chained, q: Array, point: Array | None, out: Array, given: Places | None = None) -> None:
    """Write the Jacobians at a point of the tool, (N, 6, n)."""

    def write(places: Places, part: slice) -> None:
        with written(out, part) as block:
            blocks.jacobian(robot.chain, places, places.target(point, part), block)

    visit(robot, q, given, write)


def placements(robot: Chained, q: Array, point: Array | None, out: Array, given: Places | None = None) -> None:
    """Write the sensitivities of a point of the tool to every placement, (N, 6, S, 6)."""

    def write(places: Places, part: slice) -> None:
        with written(out, part) as block:
            blocks.placements(robot.chain, places, places.target(point, part), block)

    visit(robot, q, given, write)


def gravity(robot: Weighted, q: Array, mass: Array, com: Array, out: Array, given: Places | None = None) -> None:
    """Write the torques, (N, n), that hold the arm and a payload: its mass, () or (N,), at ``com`` in the tool."""

    def write(places: Places, part: slice) -> None:
        held = mass[part] if mass.ndim else mass
        moment = scratch("moment", *places.tool_position.shape)
        np.matmul(com, places.tool_rotation, out=moment)
        moment += places.tool_position
        moment *= held
        with written(out, part) as block:
            blocks.gravity(robot.chain, robot.gravity, places, held, moment, block)

    visit(robot, q, given, write)
