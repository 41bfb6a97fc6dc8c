"""Your own simulator in MuJoCo: a campaign is compared with what it predicts; what is found is written back to it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.correction.calibrated import target_link
from thermal_robot.correction.mujoco_models import Bodies, compiled, known
from thermal_robot.errors import CampaignError
from thermal_robot.kinematics import rotation_to_quaternion


def with_simulator(campaign: Campaign, mjcf: str | Path) -> Campaign:
    """Return a campaign with what a MuJoCo model predicts of its target, as ``sim.*`` columns would bring it.

    The model's joints are put where they were commanded, and those that mimic another where that one takes them; no
    motor and no gravity is at work. A diagnosis then compares the robot with this simulator, not with the URDF, and
    :func:`~thermal_robot.correction.calibrated_mjcf` writes into the simulator what of the difference is constant.

    Parameters
    ----------
    campaign
        Commands, with or without measurements.
    mjcf
        The simulator's model, as a path or as its text, with the URDF's names of joints. Its target is the site or
        body ``<tool_frame>_target`` of a calibrated model; else the declared one, on a body or site of the tool frame's
        name.

    Returns
    -------
    Campaign
        With the predicted positions, in the root frame: the body of its name, or else the world; and with orientations
        where the campaign measures poses.

    Raises
    ------
    CampaignError
        If MuJoCo is not installed or does not take the model, or that lacks a joint or the tool frame.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> from thermal_robot.correction import mjcf_of_urdf, with_simulator
    >>> sound = tr.simulate("builtin:rv_m2", tool_frame="tool0", rows=10)
    >>> seen = with_simulator(sound, mjcf_of_urdf(sound.robot.urdf))
    >>> bool(abs(seen.simulated_position - sound.position).max() < 1e-9)
    True
    """
    path = Path(mjcf) if isinstance(mjcf, Path) or not mjcf.lstrip().startswith("<") else None
    name, model, robot = str(path or "the MJCF"), compiled(path or mjcf), campaign.robot
    moving = [robot.chain.names[k] for k in robot.chain.movable]
    for joint in moving:
        if known(model, "joint", joint) is None:
            raise CampaignError(name, f"has no joint {joint!r}", expected="the URDF's names of joints")
    kind, number, held = _target(name, model, campaign)
    root = known(model, "body", robot.root_frame) or 0
    seen = np.empty((campaign.samples, 4, 4))
    bodies = Bodies.of(model)
    for i, row in enumerate(robot.chain.coupling.positions(campaign.q).tolist()):
        bodies.move(dict(zip(moving, row, strict=True)))
        carrier = bodies.site(number) if kind == "site" else bodies.pose(number)
        seen[i] = np.linalg.inv(bodies.pose(root)) @ carrier @ held
    turned = rotation_to_quaternion(seen[:, :3, :3]) if campaign.orientation is not None else None
    return replace(campaign, simulated_position=seen[:, :3, 3], simulated_orientation=turned)


def _target(name: str, model: Any, campaign: Campaign) -> tuple[str, int, Array]:
    """Return the kind and number of what carries the target, and (4, 4) the target's pose on it."""
    declared = np.eye(4)
    declared[:3, 3] = campaign.target
    tool = campaign.robot.tool_frame
    for link, pose in ((target_link(tool), np.eye(4)), (tool, declared)):
        for kind in ("site", "body"):
            number = known(model, kind, link)
            if number is not None:
                return kind, number, pose
    raise CampaignError(name, f"has no tool frame {tool!r}", expected="a body or a site of that name")
