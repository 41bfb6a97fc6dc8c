"""The arm as it stood in some rows, with the share of the gap that enters at each place."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from thermal_robot.diagnosis.explained import Arm
from thermal_robot.kinematics import link_poses
from thermal_robot.shapes.visuals import hulls

if TYPE_CHECKING:
    from thermal_robot.diagnosis.parts import Where
    from thermal_robot.robot import Robot


def arm(robot: Robot, q: ArrayLike, where: Where) -> Arm:
    """Return the arm in (R, n) joint positions, rad or m, with the shares of its places."""
    chain = robot.chain
    links = (*chain.parent_links, robot.tool_frame)
    joints = [chain.names[k] for k in chain.movable]
    for j, name in zip(chain.coupling.driving.tolist(), robot.joint_names, strict=True):
        joints[j] = name  # one beside the chain is seen at the first that follows it
    return Arm(
        links=links,
        link_shares=np.array([where.links.get(name, 0.0) for name in links]),
        poses=link_poses(robot, q)[:, [robot.urdf_links.index(name) for name in links]],
        joints=tuple(joints),
        joint_shares=np.array([where.joints.get(name, 0.0) for name in joints]),
        moves=np.asarray(chain.movable) + 1,
        hulls=hulls(robot),
        base_share=where.beyond.get("base", 0.0),
        tool_share=where.beyond.get("tool", 0.0),
        instrument_share=where.beyond.get("instrument", 0.0),
    )
