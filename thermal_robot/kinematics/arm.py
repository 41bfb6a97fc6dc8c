"""A chain as the compiled kernels want it: arrays of numbers, and nothing else."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.kinematics.model import PRISMATIC, Chain
from thermal_robot.kinematics.walk import steps

FIXED, TURNS, TURNS_ALIGNED, SLIDES = 0, 1, 2, 3
"""What happens behind a placement: nothing, a turn about an axis of the frame, or about any other, a slide."""


class Arm(NamedTuple):
    """Constant arrays of a chain of K elements, M movable joints, n driving ones and S segments.

    Parameters
    ----------
    kinds, joint
        (K,) what happens behind each placement, and the number of the movable joint, −1 for a fixed element.
    turns
        (K, 2) columns of the rotation: the first turns towards the second.
    place, aligned, back
        (K, 3, 4), (K, 3, 4) and (3, 4): placements of the walk, rotations that put the third axis on that of the
        joint, and the way back behind the last one; as :class:`~thermal_robot.kinematics.walk.Steps` has them.
    axes
        (K, 3) of the joints.
    movable, placed
        (M,) and (S,) elements.
    lead, factor, offset, first, last
        (M,) column of the driving joint (−1: none), how a joint follows it, and whether it is the first or last to.
    masses, centres
        (M,) kg and (M, 3) m, as a chain has them.
    point
        (3,) m, of the tool.
    """

    kinds: NDArray[np.int64]
    joint: NDArray[np.int64]
    turns: NDArray[np.int64]
    place: Array
    aligned: Array
    back: Array
    axes: Array
    movable: NDArray[np.int64]
    placed: NDArray[np.int64]
    lead: NDArray[np.int64]
    factor: Array
    offset: Array
    first: NDArray[np.bool_]
    last: NDArray[np.bool_]
    masses: Array
    centres: Array
    point: Array


def arm_of(chain: Chain, point: Array | None) -> Arm:
    """Write a chain, and a point of its tool, as the kernels want it."""
    taken, matrix = steps(chain), chain.coupling.matrix
    still = [step.joint is None for step in taken.each]
    kinds = np.array([FIXED if f else TURNS for f in still])
    kinds[[step.aligned is not None for step in taken.each]] = TURNS_ALIGNED
    kinds[chain.kinds == PRISMATIC] = SLIDES
    eye = np.eye(4)
    lead = [chain.coupling.leader(j) for j in range(len(matrix))]
    return Arm(
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
        point=np.array(np.zeros(3) if point is None else point),
    )


def _rigid(transposed: list[Array]) -> Array:
    return np.ascontiguousarray(np.array(transposed).transpose(0, 2, 1)[:, :3])
