"""What an error may follow: everything recorded, and what anybody can compute from it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from thermal_robot.observations import Observations
    from thermal_robot.robot import Robot

Array = NDArray[np.float64]

GRAVITY = ("gravity.x", "gravity.y", "gravity.z")
"""Components of gravity's direction in the tool frame."""
REACH = ("reach.x", "reach.y", "reach.z")
"""Where the tool frame is in the root frame, m: what leans on the base."""


_UNITS = {
    "time": "s",
    "temperature": "°C",
    "payload": "kg",
    "torque": "N·m",
    "velocity": "rad/s",
    "acceleration": "rad/s²",
    "encoder": "rad",
    "reach": "m",
}


def unit(robot: Robot, name: str) -> str:
    """Return the unit of a quantity's values; empty where it has none, or none that is known."""
    if name in robot.joint_names:
        return "m" if robot.joint_types[robot.joint_names.index(name)] == "prismatic" else "rad"
    return _UNITS.get(name.split(".")[0], "")


def quantities(observations: Observations) -> dict[str, Array]:
    """Return what a remainder might follow, by name, (N,) each; only what varies.

    Recorded covariates first, the row's number where neither time nor order is recorded, the session as its number in
    the alphabet, then each joint's position, gravity's direction in the tool frame and the tool's place.
    """
    recorded = [name for name in observations.covariates if observations.varies(name)]
    names = [*recorded, *([] if {"time", "order"} & set(recorded) else ["order"]), "session"]
    names += [*observations.robot.joint_names, *GRAVITY, *REACH]
    found = {name: quantity(observations, name) for name in names}
    return {name: values for name, values in found.items() if values is not None and np.ptp(values) > 0}


def quantity(observations: Observations, name: str) -> Array | None:
    """Return the (N,) values of one quantity; ``None`` where the campaign does not have it."""
    if name in observations.covariates:
        return np.asarray(observations.covariates[name], dtype=float)
    robot = observations.robot
    if name in robot.joint_names:
        return np.asarray(observations.q[:, robot.joint_names.index(name)])
    if name in GRAVITY:
        down = robot.gravity / max(float(np.linalg.norm(robot.gravity)), 1e-9)
        return np.asarray(observations.commanded.tool_rotation[:, :, GRAVITY.index(name)] @ down)
    if name in REACH:
        return np.asarray(observations.commanded.tool_position[:, REACH.index(name)])
    if name == "order":
        return np.arange(observations.campaign.samples, dtype=float)
    labels = observations.campaign.labels.get(name)
    if labels is None or len(set(labels.tolist())) < 2:
        return None
    return np.unique(labels, return_inverse=True)[1].astype(float)
