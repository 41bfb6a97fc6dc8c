"""The batch functions once more, by a loop over Pinocchio itself: slow, and the oracle of the tests.

Arguments, results, shapes and frames are those of the functions of the same names in
:mod:`thermal_robot.kinematics`. Nothing is shared with them but the names of the chain's elements and
which joint mimics which.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from thermal_robot.kinematics import ChainFrames, Displacement, augmented_model
from thermal_robot.kinematics.links import to_pinocchio

if TYPE_CHECKING:
    from thermal_robot.robot import Robot

Array = NDArray[np.float64]


def chain_frames(robot: Robot, q: ArrayLike, displacement: Displacement | None = None) -> ChainFrames:
    """Frames of every chain element and of the tool; see :func:`thermal_robot.kinematics.chain_frames`."""
    rows = np.atleast_2d(np.asarray(q, dtype=float))
    if displacement is None:
        poses = [_frames_by_pinocchio(robot, configuration) for configuration in to_pinocchio(robot, rows)]
    else:
        poses = [_frames_displaced(robot, rows, displacement, i) for i in range(len(rows))]
    return ChainFrames(
        np.array([[pose.rotation for pose in row[:-1]] for row in poses]),
        np.array([[pose.translation for pose in row[:-1]] for row in poses]),
        np.array([row[-1].rotation for row in poses]),
        np.array([row[-1].translation for row in poses]),
    )


def tool_poses(robot: Robot, q: ArrayLike, displacement: Displacement | None = None) -> Array:
    """Pose of the tool frame in the root frame; see :func:`thermal_robot.kinematics.tool_poses`."""
    frames = chain_frames(robot, q, displacement)
    poses = np.zeros((len(frames.tool_position), 4, 4))
    poses[:, :3, :3], poses[:, :3, 3], poses[:, 3, 3] = frames.tool_rotation, frames.tool_position, 1.0
    return poses


def frame_jacobians(robot: Robot, q: ArrayLike, *, point: ArrayLike = (0.0, 0.0, 0.0)) -> Array:
    """Geometric Jacobian (N, 6, n) by Pinocchio; see :func:`thermal_robot.kinematics.frame_jacobians`."""
    model, frame = _with_point(robot.model.copy(), _tool(robot).parentJoint, _tool(robot).placement, point)
    data, to_root = model.createData(), _to_root_axes(robot)
    each = [
        # of one joint Pinocchio gives a vector
        to_root @ pin.computeFrameJacobian(model, data, configuration, frame, pin.LOCAL_WORLD_ALIGNED).reshape(6, -1)
        for configuration in to_pinocchio(robot, q)
    ]
    return np.array(each) @ robot.chain.coupling.matrix


def placement_sensitivities(robot: Robot, q: ArrayLike, *, point: ArrayLike = (0.0, 0.0, 0.0)) -> Array:
    """Regressor (N, 6, S, 6) by Pinocchio; see :func:`thermal_robot.kinematics.placement_sensitivities`."""
    # Pinocchio's kinematic regressor knows placements of joints only: hence the virtual ones of fixed frames.
    augmented = augmented_model(robot)
    tool = augmented.model.frames[augmented.tool]
    model, frame = _with_point(augmented.model, tool.parentJoint, tool.placement, point)
    data = model.createData()
    rows = augmented.configurations(q)
    out = np.empty((len(rows), 6, len(robot.segments), 6))
    for i, row in enumerate(rows):
        pin.framesForwardKinematics(model, data, row)
        regressor = pin.computeFrameKinematicRegressor(model, data, frame, pin.LOCAL)
        turned = np.kron(np.eye(2), data.oMf[frame].rotation) @ regressor
        # The regressor begins with the first joint, which is number 1.
        out[i] = turned.reshape(6, model.njoints - 1, 6)[:, np.array(augmented.placements) - 1]
    return out


def gravity_torques(
    robot: Robot, q: ArrayLike, *, payload: ArrayLike | None = None, payload_com: ArrayLike = (0.0, 0.0, 0.0)
) -> Array:
    """Return holding torques (N, n) by Pinocchio; see :func:`thermal_robot.kinematics.gravity_torques`."""
    configurations = to_pinocchio(robot, q)
    payloads = np.broadcast_to(np.asarray(0.0 if payload is None else payload, dtype=float), len(configurations))
    tool = _tool(robot)
    out = np.empty((len(configurations), robot.model.nv))
    for i, (configuration, mass) in enumerate(zip(configurations, payloads, strict=True)):
        model = robot.model.copy()
        body = pin.Inertia(float(mass), np.asarray(payload_com, dtype=float), np.zeros((3, 3)))
        model.appendBodyToJoint(tool.parentJoint, body, tool.placement)
        out[i] = pin.computeGeneralizedGravity(model, model.createData(), configuration)
    return out @ robot.chain.coupling.matrix


def _frames_by_pinocchio(robot: Robot, configuration: Array) -> list[pin.SE3]:
    model = robot.model
    data = model.createData()
    pin.framesForwardKinematics(model, data, configuration)
    root = data.oMf[model.getFrameId(robot.root_frame, pin.FrameType.BODY)]
    poses = []
    for name in robot.chain.names:
        if model.existJointName(name):
            joint = model.getJointId(name)
            poses.append(data.oMi[model.parents[joint]] * model.jointPlacements[joint])
        else:
            poses.append(data.oMf[model.getFrameId(name, pin.FrameType.FIXED_JOINT)])
    poses.append(data.oMf[model.getFrameId(robot.tool_frame, pin.FrameType.BODY)])
    return [root.actInv(pose) for pose in poses]


def _frames_displaced(robot: Robot, q: Array, displacement: Displacement, i: int) -> list[pin.SE3]:
    joints = to_pinocchio(robot, q[i] + _row(displacement.joint, i, 1, np.zeros(robot.n)))[0]
    segments = _row(displacement.segment, i, 2, np.zeros((len(robot.segments), 6)))
    twists = dict(zip((segment.index for segment in robot.segments), segments, strict=True))
    pose, poses = pin.exp6(_row(displacement.base, i, 1, np.zeros(6))), []
    for k in range(len(robot.chain.names)):
        pose = (
            pose * pin.SE3(robot.chain.rotations[k], robot.chain.translations[k]) * pin.exp6(twists.get(k, np.zeros(6)))
        )
        poses.append(pose)
        if robot.model.existJointName(robot.chain.names[k]):
            joint = robot.model.joints[robot.model.getJointId(robot.chain.names[k])]
            data = joint.createData()
            joint.calc(data, joints)
            pose = pose * data.M
    poses.append(pose * pin.exp6(_row(displacement.tool, i, 1, np.zeros(6))))
    return poses


def _row(value: ArrayLike | None, i: int, dimensions: int, default: Array) -> Array:
    if value is None:
        return default
    array = np.asarray(value, dtype=float)
    return array if array.ndim == dimensions else np.asarray(array[i])


def _pose_of_link(robot: Robot, name: str) -> pin.Frame:
    return robot.model.frames[robot.model.getFrameId(name, pin.FrameType.BODY)]


def _tool(robot: Robot) -> pin.Frame:
    return _pose_of_link(robot, robot.tool_frame)


def _to_root_axes(robot: Robot) -> Array:
    rotation: Array = np.kron(np.eye(2), _pose_of_link(robot, robot.root_frame).placement.rotation.T)
    return rotation


def _with_point(model: pin.Model, joint: int, placement: pin.SE3, point: ArrayLike) -> tuple[pin.Model, int]:
    at = placement * pin.SE3(np.eye(3), np.asarray(point, dtype=float))
    return model, model.addFrame(pin.Frame("measured_point", joint, 0, at, pin.FrameType.OP_FRAME))
