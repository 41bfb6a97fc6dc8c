"""Quantities that count the other way than the format says: a campaign that reads them with the other sign."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from thermal_robot.campaign.campaign import Campaign
from thermal_robot.robot import Robot, load_robot

GRAVITY = "gravity"
"""The quantity that no column holds: the robot has it."""


def turned_round(campaign: Campaign, quantity: str) -> Campaign:
    """Return a campaign that reads a quantity with the other sign.

    Parameters
    ----------
    campaign
        Any; its arrays stay as they are.
    quantity
        ``torque`` or ``approach``, whose columns of all joints change their sign; ``temperature``, whose differences
        from ``reference_temperature`` do; ``gravity``, of the robot.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> campaign = tr.demo_campaign()
    >>> other = turned_round(campaign, "approach")
    >>> other.turned, bool((other.covariates["approach.joint_1"] == -campaign.covariates["approach.joint_1"]).all())
    (('approach',), True)
    """
    if quantity == GRAVITY:
        robot = campaign.robot
        up = load_robot(robot.urdf, robot.tool_frame, root_frame=robot.root_frame, gravity=-robot.gravity)
        return replace(campaign, robot=up)
    about = 2.0 * campaign.reference_temperature if quantity == "temperature" else 0.0
    own = {name: about - values for name, values in campaign.covariates.items() if name.split(".")[0] == quantity}
    names = {*campaign.turned} ^ {quantity}
    return replace(campaign, covariates={**campaign.covariates, **own}, turned=tuple(sorted(names)))


def read_alike(campaign: Campaign, robot: Robot, turned: Iterable[str]) -> Campaign:
    """Return a campaign of a robot that reads the same quantities with the other sign as another one does."""
    for quantity in {*campaign.turned} ^ {*turned}:
        campaign = turned_round(campaign, quantity)
    return campaign if (campaign.robot.gravity == robot.gravity).all() else replace(campaign, robot=robot)
