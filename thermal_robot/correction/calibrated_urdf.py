"""The calibrated robot as a URDF: its own text, with other origins of some joints."""

from __future__ import annotations

from thermal_robot.correction.calibrated import Calibrated
from thermal_robot.kinematics.rewritten import rewritten


def calibrated_urdf(robot: Calibrated) -> str:
    """Return the URDF of the calibrated robot.

    Zeros and placements are put into the origins of the joints between root and tool frame, by which all that follows
    moves with them. The measured target becomes a link of its own, ``<tool_frame>_target``, where it is not the tool
    frame itself. Everything else stands as in the nominal robot's text: meshes, masses, limits, branches, comments. A
    joint outside the chain that mimics one of it is not displaced.

    Parameters
    ----------
    robot
        The calibrated robot.

    Returns
    -------
    str
        XML text, with a comment that lists what is in it and what is not.

    Raises
    ------
    RobotError
        If the robot has another link of the target's name.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> from thermal_robot.correction import calibrated, calibrated_urdf
    >>> warm = calibrated(tr.diagnose(tr.demo_campaign()).model, temperature=26.0)
    >>> tr.load_robot(calibrated_urdf(warm), "tool0_target").n
    5
    """
    return rewritten(robot.robot.urdf, robot.origins, links=robot.links, notes=robot.notes("a URDF"))
