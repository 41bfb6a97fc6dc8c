"""Which columns a joint's torque is read from."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from thermal_robot.observations import Observations


def torque_columns(observations: Observations) -> tuple[str, ...]:
    """Return the torques of the chain's joints that were recorded, and the payload where one was not."""
    columns = tuple(f"torque.{joint}" for joint in observations.robot.joint_names)
    recorded = tuple(column for column in columns if column in observations.covariates)
    computed = ("payload",) if "payload" in observations.covariates and recorded != columns else ()
    return (*computed, *recorded)
