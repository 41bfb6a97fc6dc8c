"""Covariates that an error may follow: recorded or computed ones that vary by more than their resolution."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.campaign.names import CLOCK
from thermal_robot.campaign.units import SI, unit_of
from thermal_robot.effects import settings
from thermal_robot.effects.effect import Driver

if TYPE_CHECKING:
    from thermal_robot.observations import Observations
    from thermal_robot.robot import Robot

_ROUNDING = 1e-9  # relative: how far sums of floats are off


def resolution(values: Array, unit: str) -> float:
    """Resolution of a quantity's values (N,): their smallest step, clipped to what instruments for its unit resolve.

    In its unit; 0 for quantities that are no readings, such as payload, label or direction of approach.
    """
    if unit not in settings.READS_TO:
        return 0.0
    levels = np.unique(values)
    step = float(np.diff(levels).min(initial=np.inf))
    return float(np.clip(step, *settings.READS_TO[unit]))


def varies(values: Array, least: float = 0.0) -> bool:
    """Whether the range of values (N,) exceeds a resolution; never for none."""
    return bool(np.ptp(values) > least * (1.0 + _ROUNDING)) if len(values) else False


def without_twins(readings: Mapping[str, Array], joints: tuple[str, ...]) -> dict[str, Array]:
    """Remove redundant quantities: readings that differ from another one by 1 % of its spread or less.

    An encoder reading that agrees with the command is removed, and a link temperature that agrees with the robot's.
    """
    found = {}
    for name, values in readings.items():
        column, _, place = name.partition(".")
        said = place if column == "encoder" and place in joints else "temperature" * (column == "temperature" != name)
        other = readings.get(said)
        if other is None or not np.std(values - other) < settings.TWIN * np.std(other):
            found[name] = values
    return found


GRAVITY = ("gravity.x", "gravity.y", "gravity.z")
"""Components of gravity's direction in the tool frame."""
REACH = ("reach.x", "reach.y", "reach.z")
"""Where the tool frame is in the root frame, m: what leans on the base."""
TURN = "since_turn."
"""Before a joint's name: signed distance from its last turning point, rad or m (:attr:`Campaign.since_turn`)."""


def unit(robot: Robot, name: str) -> str:
    """SI unit of a quantity; empty where it has none, or an unknown one."""
    return unit_of(name.removeprefix(TURN), robot) or (SI.length if name in REACH else "")


def quantities(observations: Observations) -> dict[str, Array]:
    """Quantities by name, (N,) each, that vary by more than their resolution.

    Of two readings that agree only the general one is kept (:func:`without_twins`). Recorded covariates come first, the
    row's number where neither time nor order is recorded, the session as its number in the alphabet, then each joint's
    position, gravity's direction in the tool frame and the tool's place. The way since a joint's turning point
    (:data:`TURN`) is not among them: it bears on that joint alone.
    """
    recorded = [name for name in observations.covariates if observations.varies(name)]
    names = [*recorded, *([] if set(CLOCK) & set(recorded) else ["order"]), "session"]
    names += [*observations.robot.joint_names, *GRAVITY, *REACH]
    found = {name: quantity(observations, name) for name in names}
    robot = observations.robot
    telling: dict[str, Array] = {}
    for name, values in found.items():
        if values is not None:
            least = settings.GRAVITY_READS_TO if name in GRAVITY else resolution(values, unit(robot, name))
            telling |= {name: values} if varies(values, least) else {}
    return without_twins(telling, robot.joint_names)


def quantity(observations: Observations, name: str) -> Array | None:
    """Values (N,) of one quantity; ``None`` where the campaign lacks it."""
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
    if name.startswith(TURN):
        return observations.campaign.since_turn.get(name.removeprefix(TURN))
    if name == "order":
        # the place in the file, which rows that are left out do not change
        return np.asarray(observations.campaign.rows - 2, dtype=float)
    labels = observations.campaign.labels.get(name)
    if labels is None or len(set(labels.tolist())) < 2:
        return None
    return np.unique(labels, return_inverse=True)[1].astype(float)


def began(observations: Observations, clock: Array) -> dict[str, float]:
    """Start times by session on a clock (N,), those of its first row; without sessions one, under an empty name."""
    rows = observations.campaign.labels.get("session")
    if rows is None:
        return {"": float(clock.min())}
    return {str(run): float(clock[rows == run].min()) for run in np.unique(rows)}


def driving(observations: Observations, name: str) -> Driver | None:
    """Name, unit and values (N,) of a quantity that drives an effect; ``None`` where it does not vary."""
    values = quantity(observations, name)
    if values is None or not np.ptp(values) > 0:
        return None
    return name, unit(observations.robot, name), values


def position_of(observations: Observations, joint: str) -> Driver:
    """Commanded position of a joint as a driver: name, unit and (N,) values, rad or m."""
    robot = observations.robot
    return f"position of {joint}", unit(robot, joint), observations.q[:, robot.joint_names.index(joint)]


def torque_columns(observations: Observations) -> tuple[str, ...]:
    """Return the recorded torques of the chain's joints, and the payload where one is not recorded."""
    columns = tuple(f"torque.{joint}" for joint in observations.robot.joint_names)
    recorded = tuple(column for column in columns if column in observations.covariates)
    computed = ("payload",) if "payload" in observations.covariates and recorded != columns else ()
    return (*computed, *recorded)
