"""The calibrated robot of Universal Robots as a kinematics.yaml, which ur_description and the driver for ROS read."""

from __future__ import annotations

import numpy as np

from thermal_robot.campaign.ur_kinematics import FIGURES, elements
from thermal_robot.correction.calibrated import Calibrated
from thermal_robot.kinematics.rewritten import xyz_rpy


def ur_kinematics(robot: Calibrated) -> str:
    """Return the kinematics.yaml of the calibrated robot; zeros and placements of joints are in its six origins.

    A fixed frame before a joint that is displaced counts to that joint's origin. Where the frames behind the last joint
    are displaced, or the target sits elsewhere, the file cannot hold it: the controller's tool does.

    Parameters
    ----------
    robot
        The calibrated robot, of a URDF that is made of ur_description for ROS 2.

    Returns
    -------
    str
        YAML, with a comment that lists what is in it and what is not. Its ``hash`` is that of no robot: the driver says
        that it differs, unless the robot's own takes its place.

    Raises
    ------
    CampaignError
        A robot of others, or of other frames.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> from thermal_robot.correction import calibrated, ur_kinematics
    >>> ur_kinematics(calibrated(tr.diagnose(tr.demo_campaign()).model))
    Traceback (most recent call last):
    thermal_robot.errors.CampaignError: kinematics.yaml: is for robots of Universal Robots, and 'rv_m2' has no ...
    """
    chain, placed = robot.robot.chain, robot.placements
    joints = {k: link for link, k in elements(robot.robot, "kinematics.yaml").items()}
    origins, nominal, real = {}, np.eye(4), np.eye(4)
    for k, pose in enumerate(placed):
        real = real @ pose
        if k in joints:
            origins[joints[k]] = np.linalg.solve(nominal, real)
            nominal, real = np.eye(4), np.eye(4)
            continue
        own = np.eye(4)
        own[:3, :3], own[:3, 3] = chain.rotations[k], chain.translations[k]
        nominal = nominal @ own
    notes = robot.notes("a kinematics.yaml")
    if not np.allclose(nominal, real, rtol=0, atol=1e-9):
        notes.append("Frames behind the last joint are displaced as well, which only a URDF holds.")
    lines = [*(f"# {note}" for note in notes), "kinematics:"]
    for link, pose in origins.items():
        # no exponents: YAML takes 1e-05 for text
        figures = (np.format_float_positional(float(figure), trim="0") for figure in " ".join(xyz_rpy(pose)).split())
        lines += [f"  {link}:", *(f"    {key}: {figure}" for key, figure in zip(FIGURES, figures, strict=True))]
    return "\n".join([*lines, "  hash: calib_thermal_robot", ""])
