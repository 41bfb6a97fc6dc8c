"""The arm as it stood in some rows, with the share of the gap that enters at each place."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal_robot.diagnosis.explained import Arm
from thermal_robot.kinematics import chain_frames
from thermal_robot.solids import solids

if TYPE_CHECKING:
    from thermal_robot.diagnosis.parts import Where
    from thermal_robot.robot import Robot

Array = NDArray[np.float64]


def arm(robot: Robot, q: ArrayLike, where: Where) -> Arm:
    """Return the arm in (R, n) joint positions, rad or m, with the shares of its places."""
    chain = robot.chain
    links = (*chain.parent_links, robot.tool_frame)
    joints = tuple(chain.names[k] for k in chain.movable)
    return Arm(
        links=links,
        link_shares=np.array([where.links.get(name, 0.0) for name in links]),
        poses=link_poses(robot, q),
        joints=joints,
        joint_shares=np.array([where.joints.get(name, 0.0) for name in joints]),
        moves=np.asarray(chain.movable) + 1,
        solids=solids(robot),
    )


def link_poses(robot: Robot, q: ArrayLike) -> Array:
    """Return the poses (R, L, 4, 4) of the links of the chain in the root frame, its own first, the tool's last; m.

    A link's frame is where the placement of the next element starts from: ``T_k · P_k⁻¹``, with ``T_k`` the frame of
    that element and ``P_k`` its placement.
    """
    chain, frames = robot.chain, chain_frames(robot, q)
    rows, elements = frames.positions.shape[:2]
    poses = np.zeros((rows, elements + 1, 4, 4))
    poses[..., 3, 3] = 1.0
    turned = np.einsum("rkij,klj->rkil", frames.rotations, chain.rotations)
    poses[:, :-1, :3, :3] = turned
    poses[:, :-1, :3, 3] = frames.positions - np.einsum("rkij,kj->rki", turned, chain.translations)
    poses[:, -1, :3, :3], poses[:, -1, :3, 3] = frames.tool_rotation, frames.tool_position
    return poses
