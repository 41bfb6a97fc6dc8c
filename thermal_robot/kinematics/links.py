"""Where every link of a URDF is, those beside the chain too: what a drawing of the whole robot needs."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from thermal_robot.arrays import Array

if TYPE_CHECKING:
    from thermal_robot.robot import Robot


def link_poses(robot: Robot, q: ArrayLike) -> Array:
    """Pose of every link of the URDF in the root frame, by Pinocchio, one configuration after another.

    Parameters
    ----------
    robot
        The robot; joints beside its chain stand where they are held.
    q
        (N, n) rad or m; (n,) counts as one configuration.

    Returns
    -------
    ndarray
        (N, L, 4, 4) homogeneous matrices, lengths in m, in the order of ``robot.urdf_links``.
    """
    model, data = robot.model, robot.model.createData()
    frames = [model.getFrameId(link, pin.FrameType.BODY) for link in robot.urdf_links]
    root = frames[robot.urdf_links.index(robot.root_frame)]
    configurations = to_pinocchio(robot, q)
    poses = np.empty((len(configurations), len(frames), 4, 4))
    for i, configuration in enumerate(configurations):
        pin.framesForwardKinematics(model, data, configuration)
        poses[i] = [data.oMf[root].actInv(data.oMf[frame]).homogeneous for frame in frames]
    return poses


def to_pinocchio(robot: Robot, q: ArrayLike) -> Array:
    """Write configurations as Pinocchio does: mimicking joints too, a continuous joint as its cosine and sine.

    Parameters
    ----------
    robot
        The robot.
    q
        (N, n) rad or m.

    Returns
    -------
    ndarray
        (N, nq).
    """
    rows = robot.chain.coupling.positions(np.atleast_2d(np.asarray(q, dtype=float)))
    columns = []
    for joint, position in zip(list(robot.model.joints)[1:], rows.T, strict=True):
        columns += [np.cos(position), np.sin(position)] if joint.nq == 2 else [position]
    return np.column_stack(columns)
