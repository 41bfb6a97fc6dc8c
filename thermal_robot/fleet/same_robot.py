"""Whether campaigns are of one robot: the same joints, and the same nominal model."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from thermal_robot.errors import CampaignError
from thermal_robot.fleet import compare_settings
from thermal_robot.robot import Robot, joint_range


def require_same_robot(robots: Sequence[Robot], names: Sequence[str]) -> None:
    """Refuse to compare campaigns of different robots.

    Parameters
    ----------
    robots
        Of each campaign.
    names
        What the campaigns are called.

    Raises
    ------
    CampaignError
        Their joints differ, or the same joints put the tool frame elsewhere.
    """
    first = robots[0]
    low, high = (
        np.where(np.isfinite(end), end, sign) for end, sign in zip(joint_range(first), (-1.0, 1.0), strict=True)
    )
    q = np.random.default_rng(0).uniform(low, high, (compare_settings.TRIED, first.n))
    for robot, name in zip(robots[1:], names[1:], strict=True):
        if robot.joint_names != first.joint_names:
            raise CampaignError(
                name,
                f"is of another robot than {names[0]}: their joints differ",
                found=", ".join(robot.joint_names),
                expected=", ".join(first.joint_names),
            )
        apart = float(np.abs(robot.forward(q) - first.forward(q)).max())
        if apart > compare_settings.SAME_PLACE:
            raise CampaignError(
                name,
                f"is described by another nominal model than {names[0]}: the same joint positions put "
                f"{robot.tool_frame} up to {apart * 1e3:.3g} mm away from {first.tool_frame}",
                expected="the same URDF and tool frame for all campaigns",
            )
