"""The engine of NumPy for Jacobians, placement sensitivities and gravity torques.

It works on chunks of configurations that stay in the cache, N last, and writes results where they belong.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.kinematics.model import REVOLUTE, Chain
from thermal_robot.kinematics.walk import NOWHERE, Chained, Displaced, Weighted, chunks, rows_last, scratch, steps, walk


@dataclass(frozen=True, eq=False)
class Places:
    """Where the frames of C configurations are, C last: rotations (K, 3, 3, C), positions (K, 3, C), and the tool."""

    rotations: Array
    positions: Array
    tool_rotation: Array
    tool_position: Array

    def of(self, part: slice) -> Places:
        """Return those of some configurations."""
        return Places(
            self.rotations[..., part],
            self.positions[..., part],
            self.tool_rotation[..., part],
            self.tool_position[..., part],
        )

    def target(self, point: Array | None, part: slice) -> Array:
        """Where a point of the tool, (3,) or (N, 3) m in its frame, is in root axes: (3, C)."""
        if point is None:
            return self.tool_position
        if point.ndim == 2:
            return np.asarray(np.einsum("imc,cm->ic", self.tool_rotation, point[part]) + self.tool_position)
        target = np.matmul(point, self.tool_rotation, out=scratch("target", *self.tool_position.shape))
        target += self.tool_position
        return target


def chunk_jacobian(chain: Chain, places: Places, target: Array, out: Array) -> None:
    """Write the Jacobian at a target point, (6, n, C)."""
    plain, size = steps(chain).plain, target.shape[-1]
    block = out if plain else scratch("block", 6, len(chain.movable), size)
    axis, lever, term = (scratch(name, 3, size) for name in ("axis", "lever", "term"))
    for j, k in enumerate(chain.movable.tolist()):
        np.matmul(chain.axes[k], places.rotations[k], out=axis)
        if chain.kinds[k] == REVOLUTE:
            np.subtract(target, places.positions[k], out=lever)
            cross(axis, lever, block[:3, j], term[0])
            block[3:, j] = axis
        else:
            block[:3, j], block[3:, j] = axis, 0.0
    if not plain:
        np.matmul(chain.coupling.matrix.T, block, out=out)


def chunk_placements(chain: Chain, places: Places, target: Array, out: Array) -> None:
    """Write the sensitivities of a target point to every placement, (6, S, 6, C)."""
    lever, term = scratch("lever", 3, target.shape[-1]), scratch("term", 3, target.shape[-1])
    for s, k in enumerate(chain.placed.tolist()):
        rotation = places.rotations[k]
        np.subtract(target, places.positions[k], out=lever)
        out[:3, s, :3] = rotation
        out[3:, s, 3:] = rotation
        out[3:, s, :3] = 0.0
        cross(rotation, lever[:, None], out[:3, s, 3:], term)


def cross(a: Array, b: Array, out: Array, term: Array) -> None:
    """Cross product of vectors, or of one with many, components first; here several times faster than ``np.cross``."""
    for i, (j, k) in enumerate(((1, 2), (2, 0), (0, 1))):
        np.multiply(a[j], b[k], out=out[i])
        np.multiply(a[k], b[j], out=term)
        out[i] -= term


def chunk_gravity(chain: Chain, pull: Array, places: Places, mass: Array, moment: Array, out: Array) -> None:
    """Write the holding torques, (n, C); a payload's mass, (C,) or (), and its first moment (3, C) are added to."""
    plain, size = steps(chain).plain, moment.shape[-1]
    block = out if plain else scratch("block", len(chain.movable), size)
    axis, lever, term, turn = (scratch(name, 3, size) for name in ("axis", "lever", "term", "turn"))
    for j in range(len(chain.movable) - 1, -1, -1):
        k = chain.movable[j]
        last = k + 1 == len(chain.names)
        rotation = places.tool_rotation if last else places.rotations[k + 1]
        np.matmul(chain.mass_centres[j], rotation, out=term)
        term += places.tool_position if last else places.positions[k + 1]
        term *= chain.masses[j]
        moment += term
        mass = mass + chain.masses[j]
        np.matmul(chain.axes[k], places.rotations[k], out=axis)
        if chain.kinds[k] == REVOLUTE:
            # −m g · (axis × lever), the triple product turned so that the constant vector is crossed once
            np.multiply(mass, places.positions[k], out=term)
            np.subtract(moment, term, out=lever)
            cross(pull, lever, turn, term[0])
            turn *= axis
            np.add(turn[0], turn[1], out=block[j])
            block[j] += turn[2]
        else:
            np.matmul(-pull, axis, out=block[j])
            block[j] *= mass
    if not plain:
        np.matmul(chain.coupling.matrix.T, block, out=out)


def visit(robot: Chained, q: Array, given: Places | None, do: Callable[[Places, slice], None]) -> None:
    """Call a function with the places of one chunk of configurations after another.

    They are overwritten when ``do`` returns; ``q`` is not read where the places of all N are ``given``.
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
            chunk_jacobian(robot.chain, places, places.target(point, part), block)

    visit(robot, q, given, write)


def placements(robot: Chained, q: Array, point: Array | None, out: Array, given: Places | None = None) -> None:
    """Write the sensitivities of a point of the tool to every placement, (N, 6, S, 6)."""

    def write(places: Places, part: slice) -> None:
        with written(out, part) as block:
            chunk_placements(robot.chain, places, places.target(point, part), block)

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
            chunk_gravity(robot.chain, robot.gravity, places, held, moment, block)

    visit(robot, q, given, write)
