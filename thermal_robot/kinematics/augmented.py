"""Pinocchio's model of the chain augmented with a virtual prismatic joint for each segment with a length.

Along it the segment may grow (Kluz et al. 2018, Eqs 6–11).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from thermal_robot.arrays import Array
from thermal_robot.errors import RobotError
from thermal_robot.kinematics.links import growing
from thermal_robot.kinematics.model import unit_motion

if TYPE_CHECKING:
    from thermal_robot.robot import Robot


ELONGATION = "elongation of "
"""Prefix of the name of a virtual joint; the name of its segment follows."""


@dataclass(frozen=True, eq=False)
class AugmentedModel:
    """Pinocchio model of the chain with M movable joints and S virtual prismatic ones; its world is the root frame.

    It knows positions only: it carries no masses, for which ``robot.model`` is there. A joint that mimics another has
    a coordinate in the model, which this class fills in: M = n unless there are such joints.

    Parameters
    ----------
    model
        ``pinocchio.Model`` with M + S joints of one coordinate each; a continuous joint is a revolute one without
        limits. The links of the chain are frames of type ``BODY`` with their own names.
    joints
        (n,) columns of the driving joints in a configuration, rad or m; of one beside the chain, that of its first
        follower.
    elongations
        (S,) columns of the virtual joints, m; their joints are called ``"elongation of <segment>"``.
    segments
        S names of the segments that have a length, from the root on.
    placements
        For every segment of the robot, with a length or not, the joint whose placement it is.
    tool
        Number of the tool's frame.
    coupling, offset
        (M + S, M + S) and (M + S,): a configuration, from one in which the mimicking joints are zero.
    """

    model: pin.Model
    joints: NDArray[np.int64]
    elongations: NDArray[np.int64]
    segments: tuple[str, ...]
    placements: tuple[int, ...]
    tool: int
    coupling: Array
    offset: Array

    def configurations(self, q: ArrayLike, elongations: ArrayLike = 0.0) -> Array:
        """Return the configurations of the model from joint positions and elongations.

        Parameters
        ----------
        q
            (N, n) rad or m; (n,) counts as one configuration.
        elongations
            (N, S) or (S,) m, or one number for all.

        Returns
        -------
        ndarray
            (N, M + S).

        Raises
        ------
        RobotError
            If a shape does not fit.
        """
        rows = np.atleast_2d(np.asarray(q, dtype=float))
        grown = np.asarray(elongations, dtype=float)
        if rows.ndim != 2 or rows.shape[1] != len(self.joints):
            raise RobotError(f"joint positions of shape {np.shape(q)} do not fit: expected (N, {len(self.joints)})")
        wanted = (len(rows), len(self.elongations))
        if grown.shape not in ((), wanted[1:], wanted):
            raise RobotError(f"elongations of shape {grown.shape} do not fit: expected {wanted[1:]} or {wanted}")
        out = np.zeros((len(rows), self.model.nq))
        out[:, self.joints], out[:, self.elongations] = rows, grown
        return out @ self.coupling.T + self.offset

    def tool_poses(self, q: ArrayLike, elongations: ArrayLike = 0.0) -> Array:
        """Forward kinematics: pose (N, 4, 4) of the tool frame in the root frame, m."""
        data, poses = self.model.createData(), []
        for row in self.configurations(q, elongations):
            pin.forwardKinematics(self.model, data, row)
            poses.append(pin.updateFramePlacement(self.model, data, self.tool).homogeneous)
        return np.array(poses).reshape(-1, 4, 4)

    def jacobians(self, q: ArrayLike, elongations: ArrayLike = 0.0) -> Array:
        """Geometric Jacobian (N, 6, M + S) of the tool, linear rows first, in root axes.

        The column of a joint that others mimic includes their motion; their own columns are zero.
        """
        data, model = self.model.createData(), self.model
        found = [
            pin.computeFrameJacobian(model, data, row, self.tool, pin.LOCAL_WORLD_ALIGNED)
            for row in self.configurations(q, elongations)
        ]
        return np.array(found).reshape(-1, 6, model.nv) @ self.coupling


def augmented_model(robot: Robot) -> AugmentedModel:
    """Build the Pinocchio model in which every segment with a length begins with a virtual prismatic joint.

    A fixed frame with a length between two joints (``column_top`` of the RV-M2) gets a virtual joint of its own, so
    that two elongations of one body are two coordinates.

    Parameters
    ----------
    robot
        The robot. Placements are those of its Pinocchio model, so that the batch functions can be checked against it;
        of its ``chain`` only names and coupling are read, and of its segments the directions.

    Returns
    -------
    AugmentedModel
        At zero elongations the same robot.
    """
    source, model = robot.model, pin.Model()
    model.name = robot.model.name
    model.gravity.linear = robot.gravity
    directions = {segment.index: segment.direction for segment in robot.segments}
    root = _frame(source, robot.root_frame, pin.FrameType.BODY)
    model.addFrame(pin.Frame(robot.root_frame, 0, 0, pin.SE3.Identity(), pin.FrameType.BODY))
    parent, here = 0, root.placement  # ``here``: where joint ``parent`` stands in the body of the source
    placements: dict[int, int] = {}
    links = (*robot.chain.parent_links[1:], robot.tool_frame)
    for k, (name, link) in enumerate(zip(robot.chain.names, links, strict=True)):
        moves = source.existJointName(name)
        number = source.getJointId(name)
        at = source.jointPlacements[number] if moves else _frame(source, name, pin.FrameType.FIXED_JOINT).placement
        offset = here.actInv(at)
        if k in directions:
            if np.any(directions[k]):
                parent = model.addJoint(
                    parent, pin.JointModelPrismaticUnaligned(directions[k]), offset, ELONGATION + name
                )
                placements[k], offset, here = parent, pin.SE3.Identity(), at
            if moves:
                parent = _add_movable(model, parent, robot, name, offset)
                placements.setdefault(k, parent)
                offset, here = pin.SE3.Identity(), pin.SE3.Identity()
        model.addFrame(pin.Frame(link, parent, 0, offset, pin.FrameType.BODY))
    names = tuple(robot.segments[s].name for s in growing(robot))
    chain = robot.chain
    joints = _columns(model, [chain.names[k] for k in chain.movable[chain.coupling.driving]])
    return AugmentedModel(
        model,
        joints,
        _columns(model, [ELONGATION + name for name in names]),
        names,
        tuple(placements[segment.index] for segment in robot.segments),
        model.getFrameId(robot.tool_frame, pin.FrameType.BODY),
        *_coupled(model, robot, joints),
    )


def _columns(model: pin.Model, names: Sequence[str]) -> NDArray[np.int64]:
    return np.array([model.joints[model.getJointId(name)].idx_q for name in names], dtype=np.int64)


def _coupled(model: pin.Model, robot: Robot, joints: NDArray[np.int64]) -> tuple[Array, Array]:
    """Matrix (M + S, M + S) and offset (M + S,) that couple mimicking joints; virtual joints are left as they are."""
    movable = _columns(model, [robot.chain.names[k] for k in robot.chain.movable])
    matrix, offset = np.eye(model.nq), np.zeros(model.nq)
    matrix[movable] = 0.0
    matrix[np.ix_(movable, joints)] = robot.chain.coupling.matrix
    offset[movable] = robot.chain.coupling.offset
    return matrix, offset


def _add_movable(model: pin.Model, parent: int, robot: Robot, name: str, placement: pin.SE3) -> int:
    joint = robot.model.joints[robot.model.getJointId(name)]
    # A continuous joint has two coordinates in Pinocchio, its cosine and sine; here it has one.
    one = joint if joint.nq == 1 else pin.JointModelRevoluteUnaligned(unit_motion(robot.model, joint)[3:])
    free = np.full(1, np.inf)
    low, high = -free, free
    coupling = robot.chain.coupling
    row = [robot.chain.names[k] for k in robot.chain.movable].index(name)
    if row in coupling.driving:
        j = coupling.driving.tolist().index(row)
        ends = coupling.matrix[row, j] * np.array([robot.lower[j], robot.upper[j]]) + coupling.offset[row]
        low, high = ends.min(keepdims=True), ends.max(keepdims=True)
    added: int = model.addJoint(parent, one, placement, name, free, free, low, high)
    return added


def _frame(model: pin.Model, name: str, kind: pin.FrameType) -> pin.Frame:
    return model.frames[model.getFrameId(name, kind)]
