"""Pinocchio's models of the whole robot: the poses of all links, and virtual prismatic joints.

With these every segment with a length may grow along itself (Kluz et al. 2018, Eqs 6–11).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from thermal_robot.arrays import Array
from thermal_robot.errors import RobotError
from thermal_robot.kinematics.frames import ChainFrames, as_rows, chain_frames
from thermal_robot.kinematics.thin import joint_model

if TYPE_CHECKING:
    from thermal_robot.robot import Robot


ELONGATION = "elongation of "
"""What the name of a virtual joint begins with; the name of its segment follows."""


@dataclass(frozen=True, eq=False)
class AugmentedModel:
    """A Pinocchio model of the chain with M movable joints and S virtual prismatic ones; the world is the root frame.

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
        """Write joint positions and elongations as the model does.

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
        """Pose (N, 4, 4) of the tool frame in the root frame, m; arguments as for :meth:`configurations`."""
        data, poses = self.model.createData(), []
        for row in self.configurations(q, elongations):
            pin.forwardKinematics(self.model, data, row)
            poses.append(pin.updateFramePlacement(self.model, data, self.tool).homogeneous)
        return np.array(poses).reshape(-1, 4, 4)

    def jacobians(self, q: ArrayLike, elongations: ArrayLike = 0.0) -> Array:
        """Twist (N, 6, M + S) of the tool, linear rows first, in root axes, for a unit speed of each coordinate.

        The column of a joint that others mimic holds what they do with it; their own are zero.
        """
        data, model = self.model.createData(), self.model
        found = [
            pin.computeFrameJacobian(model, data, row, self.tool, pin.LOCAL_WORLD_ALIGNED)
            for row in self.configurations(q, elongations)
        ]
        return np.array(found).reshape(-1, 6, model.nv) @ self.coupling


def growing(robot: Robot) -> tuple[int, ...]:
    """Return which of the robot's segments have a length along which they can grow; S of them, from the root on."""
    return tuple(s for s, segment in enumerate(robot.segments) if np.any(segment.direction))


def elongation_jacobian(robot: Robot, q: ArrayLike, *, rows: int = 3, frames: ChainFrames | None = None) -> Array:
    """Displacement of the tool, in root axes, for a unit elongation of each segment with a length (Eqs 6–11).

    The columns are unit vectors: the directions of the segments. They are the same for every point of the tool, and
    an elongation turns nothing, so that the displacement is linear in the elongations, not only to first order.

    Parameters
    ----------
    robot
        The robot.
    q
        (N, n) rad or m; (n,) counts as one configuration.
    rows
        3 for the position alone, 6 for the twist (linear first; its angular rows are zero).
    frames
        From :func:`~thermal_robot.kinematics.chain_frames`, to save computing them again or to differentiate a
        displaced chain.

    Returns
    -------
    ndarray
        (N, rows, S) m/m; S segments as by :func:`growing`.

    Raises
    ------
    RobotError
        If ``q`` does not have the shape that the robot asks for, or ``rows`` is neither 3 nor 6.
    """
    if rows not in (3, 6):
        raise RobotError(f"an elongation Jacobian has 3 or 6 rows, not {rows}", name=robot.name)
    frames = chain_frames(robot, as_rows(robot, q)) if frames is None else frames
    chosen = [robot.segments[s] for s in growing(robot)]
    out = np.zeros((len(frames.tool_position), rows, len(chosen)))
    for column, segment in enumerate(chosen):
        out[:, :3, column] = frames.rotations[:, segment.index] @ segment.direction
    return out


def augmented_model(robot: Robot) -> AugmentedModel:
    """Build the Pinocchio model in which every segment with a length begins with a virtual prismatic joint.

    A fixed frame with a length between two joints (``column_top`` of the RV-M2) gets a virtual joint of its own, so
    that two elongations of one body are two coordinates. At zero elongations it is the same robot.
    """
    chain, coupling, model = robot.chain, robot.chain.coupling, pin.Model()
    model.name, model.gravity.linear = robot.model.name, robot.gravity
    model.addFrame(pin.Frame(robot.root_frame, 0, 0, pin.SE3.Identity(), pin.FrameType.BODY))
    directions = {segment.index: segment.direction for segment in robot.segments}
    links = (*chain.parent_links[1:], robot.tool_frame)
    placements: dict[int, int] = {}
    parent, here, movable = 0, pin.SE3.Identity(), chain.movable.tolist()
    for k, (name, link) in enumerate(zip(chain.names, links, strict=True)):
        here = here * pin.SE3(chain.rotations[k], chain.translations[k])
        joints = []
        if np.any(directions.get(k, 0.0)):
            joints.append((pin.JointModelPrismaticUnaligned(directions[k]), ELONGATION + name, ()))
        if k in movable:
            joints.append((joint_model(chain, k), name, _limits(robot, movable.index(k))))
        for joint, called, limits in joints:
            parent, here = model.addJoint(parent, joint, here, called, *limits), pin.SE3.Identity()
            placements.setdefault(k, parent)
        model.addFrame(pin.Frame(link, parent, 0, here, pin.FrameType.BODY))

    def columns(called: Iterable[str]) -> NDArray[np.int64]:
        return np.array([model.joints[model.getJointId(name)].idx_q for name in called], dtype=np.int64)

    rows, joints = columns(chain.names[k] for k in movable), columns(chain.names[movable[j]] for j in coupling.driving)
    matrix, offset = np.eye(model.nq), np.zeros(model.nq)
    matrix[rows], offset[rows] = 0.0, coupling.offset
    matrix[np.ix_(rows, joints)] = coupling.matrix
    names = tuple(robot.segments[s].name for s in growing(robot))
    return AugmentedModel(
        model,
        joints,
        columns(ELONGATION + name for name in names),
        names,
        tuple(placements[segment.index] for segment in robot.segments),
        model.getFrameId(robot.tool_frame, pin.FrameType.BODY),
        matrix,
        offset,
    )


def _limits(robot: Robot, row: int) -> tuple[Array, ...]:
    """Return what Pinocchio wants of a movable joint: no bounds of effort and speed, and those of its position."""
    free, coupling = np.full(1, np.inf), robot.chain.coupling
    low, high = -free, free
    for j in np.flatnonzero(coupling.driving == row):
        ends = coupling.matrix[row, j] * np.array([robot.lower[j], robot.upper[j]]) + coupling.offset[row]
        low, high = ends.min(keepdims=True), ends.max(keepdims=True)
    return free, free, low, high


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
    """Write (N, n) configurations as Pinocchio does, (N, nq): mimicking ones too, continuous as cosine and sine."""
    rows = robot.chain.coupling.positions(np.atleast_2d(np.asarray(q, dtype=float)))
    columns = []
    for joint, position in zip(list(robot.model.joints)[1:], rows.T, strict=True):
        columns += [np.cos(position), np.sin(position)] if joint.nq == 2 else [position]
    return np.column_stack(columns)
