"""Batch kinematics: poses, Jacobians, placement sensitivities, gravity torques; the one room with Pinocchio."""

from thermal_robot.kinematics.augmented import AugmentedModel, augmented_model
from thermal_robot.kinematics.frames import (
    Displacement,
    chain_frames,
    frame_jacobians,
    placement_sensitivities,
    tool_poses,
)
from thermal_robot.kinematics.gravity import gravity_torques, segment_loads, static_regressor
from thermal_robot.kinematics.inverse import Reached, inverse_kinematics, nearest_postures
from thermal_robot.kinematics.lanes import ChainFrames
from thermal_robot.kinematics.lie import (
    align,
    exp3,
    exp6,
    homogeneous,
    left_jacobian,
    log3,
    log6,
    point_jacobian,
    quaternion_to_rotation,
    rotation_to_quaternion,
    rotation_to_rpy,
)
from thermal_robot.kinematics.links import elongation_jacobian, growing, link_poses

__all__ = [
    "AugmentedModel",
    "ChainFrames",
    "Displacement",
    "Reached",
    "align",
    "augmented_model",
    "chain_frames",
    "elongation_jacobian",
    "exp3",
    "exp6",
    "frame_jacobians",
    "gravity_torques",
    "growing",
    "homogeneous",
    "inverse_kinematics",
    "left_jacobian",
    "link_poses",
    "log3",
    "log6",
    "nearest_postures",
    "placement_sensitivities",
    "point_jacobian",
    "quaternion_to_rotation",
    "rotation_to_quaternion",
    "rotation_to_rpy",
    "segment_loads",
    "static_regressor",
    "tool_poses",
]
