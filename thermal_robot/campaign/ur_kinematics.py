"""Factory calibration of Universal Robots as the ROS file kinematics.yaml, read and written.

Source: github.com/UniversalRobots/Universal_Robots_ROS2_Description, ``config/<model>/default_kinematics.yaml`` and
``urdf/inc/ur_common.xacro``; ``ur_calibration`` of the driver extracts one from a robot. Under ``kinematics`` each of
shoulder, upper_arm, forearm, wrist_1, wrist_2 and wrist_3 has x y z (m) and roll pitch yaw (rad, about fixed axes): the
origin of the joint that carries this link. All joints turn about the z axis of their own frames. ``hash`` says which
robot it is of.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from thermal_robot.campaign.document import read_yaml
from thermal_robot.errors import CampaignError
from thermal_robot.kinematics import homogeneous
from thermal_robot.kinematics.urdf import rewritten
from thermal_robot.robot import Robot, load_robot

LINKS = {
    "shoulder": "shoulder_pan_joint",
    "upper_arm": "shoulder_lift_joint",
    "forearm": "elbow_joint",
    "wrist_1": "wrist_1_joint",
    "wrist_2": "wrist_2_joint",
    "wrist_3": "wrist_3_joint",
}
"""Links of the file, and how the names of the joints end that carry them: a robot may have a prefix."""
FIGURES = ("x", "y", "z", "roll", "pitch", "yaw")
FARTHEST, MOST_TURNED = 0.01, 0.1
"""m and rad by which an origin may differ from the nominal one: robots leave the factory within some 3 mm and 10 mrad,
and of two models or of two conventions at least one origin differs by more."""


def elements(robot: Robot, file: str) -> dict[str, int]:
    """Index in the chain of the joint that carries each UR link; a missing joint, or an axis not z, is refused."""
    chain = robot.chain
    found = {}
    for link, ending in LINKS.items():
        own = [k for k, name in enumerate(chain.names) if name.endswith(ending)]
        if len(own) != 1 or not np.allclose(chain.axes[own[0]], [0.0, 0.0, 1.0]):
            raise CampaignError(
                file,
                f"is for robots of Universal Robots, and {robot.name!r} has no {ending} that turns about its z axis",
                expected="a URDF made of ur_description for ROS 2, whose frames are those of kinematics.yaml",
            )
        found[link] = own[0]
    return found


def with_kinematics(robot: Robot, file: str | Path) -> Robot:
    """Replace the joint origins of a ur_description robot by those of a kinematics.yaml (factory calibration).

    A CampaignError refuses another kind of file, one of another model, and a robot with other frames.
    """
    from scipy.spatial.transform import Rotation

    held: Any = next(iter(read_yaml(Path(file))), None)
    origins = {}
    for link, k in elements(robot, str(file)).items():
        try:
            # what has an exponent and no point is text to YAML
            figures = np.array([float(held["kinematics"][link][key]) for key in FIGURES])
        except (TypeError, KeyError, ValueError):
            figures = np.array([np.nan])
        if not np.isfinite(figures).all():
            expected = f"{', '.join(FIGURES)} under kinematics: {link}"
            raise CampaignError(str(file), "is no kinematics.yaml", key=f"kinematics.{link}", expected=expected)
        pose = homogeneous(Rotation.from_euler("xyz", figures[3:]).as_matrix(), figures[:3])
        away = np.linalg.norm(pose[:3, 3] - robot.chain.translations[k])
        turned = np.linalg.norm(pose[:3, :3] - robot.chain.rotations[k]) / np.sqrt(2.0)
        if away > FARTHEST or turned > MOST_TURNED:
            raise CampaignError(
                str(file),
                f"is of another model than {robot.name!r}, or the robot is not ur_description's",
                key=f"kinematics.{link}",
                found=f"{1e3 * away:.1f} mm and {turned:.2g} rad from the origin in the URDF",
                expected=f"at most {1e3 * FARTHEST:g} mm and {MOST_TURNED:g} rad",
            )
        origins[robot.chain.names[k]] = pose
    urdf = rewritten(robot.urdf, origins, notes=[f"Joint origins of {Path(file).name}."])
    return load_robot(urdf, robot.tool_frame, root_frame=robot.root_frame, gravity=robot.gravity)
