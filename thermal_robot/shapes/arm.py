"""Forward kinematics for a drawing: the links of a chain in some postures, with the shares of its places."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal_robot.arrays import Array
from thermal_robot.kinematics import link_poses
from thermal_robot.robot import Robot
from thermal_robot.shapes.visuals import Solid, hulls


@dataclass(frozen=True, eq=False)
class Arm:
    """L links of a chain in R postures, with the shares 0..1 of the gap's mean square that enter at each place.

    ``links`` are named from the root frame to the tool frame; ``poses`` (R, L, 4, 4) stand in the root frame, m, as the
    model has them at what was commanded; ``joints`` are the J movable ones, those that mimic another too; ``moves``
    (J,) is which link each moves first; ``hulls`` is what links look like, nothing of those without a shape. Besides
    link and joint shares (L,) and (J,): where the robot stands, between tool frame and target, and at the instrument.
    """

    links: tuple[str, ...]
    link_shares: Array
    poses: Array
    joints: tuple[str, ...]
    joint_shares: Array
    moves: NDArray[np.int64]
    hulls: tuple[Solid, ...]
    base_share: float = 0.0
    tool_share: float = 0.0
    instrument_share: float = 0.0


def arm(robot: Robot, q: ArrayLike, shares: Mapping[tuple[str, str], float]) -> Arm:
    """Return the arm in (R, n) joint positions, rad or m, with the ``shares`` of its places by kind and name."""
    chain = robot.chain
    links = (*chain.parent_links, robot.tool_frame)
    joints = [chain.names[k] for k in chain.movable]
    for j, name in zip(chain.coupling.driving.tolist(), robot.joint_names, strict=True):
        joints[j] = name  # one beside the chain is seen at the first that follows it
    return Arm(
        links,
        np.array([shares.get(("link", name), 0.0) for name in links]),
        link_poses(robot, q)[:, [robot.urdf_links.index(name) for name in links]],
        tuple(joints),
        np.array([shares.get(("joint", name), 0.0) for name in joints]),
        np.asarray(chain.movable) + 1,
        hulls(robot),
        *(shares.get((end, end), 0.0) for end in ("base", "tool", "instrument")),
    )
