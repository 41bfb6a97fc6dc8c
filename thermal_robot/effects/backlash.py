"""Lost motion: where a joint stops depends on the side it came from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from thermal_robot.effects.effect import Effect, Parameter, at_joint

if TYPE_CHECKING:
    from thermal_robot.observations import Observations


@dataclass(frozen=True)
class Backlash(Effect):
    """Every joint stops short by half its play: q_actual = q_command − ½ b_j · approach_j.

    approach is +1 where the joint was increasing, −1 where it was decreasing, 0 where that is not known. Expected
    size 0.5 mrad (about two minutes of arc, a worn gear of an industrial joint).
    """

    name: ClassVar[str] = "backlash"

    def missing(self, observations: Observations) -> tuple[str, ...]:
        """Return the approach columns, unless at least one of them varies."""
        columns = tuple(f"approach.{joint}" for joint in observations.robot.joint_names)
        return () if any(observations.varies(column) for column in columns) else columns

    def reads(self, observations: Observations) -> tuple[str, ...]:
        """Return the approach columns of the chain's joints that were recorded."""
        columns = (f"approach.{joint}" for joint in observations.robot.joint_names)
        return tuple(column for column in columns if column in observations.covariates)

    def parameters(self, observations: Observations) -> tuple[Parameter, ...]:
        """One lost motion a joint whose direction of approach is recorded; rad or m."""
        robot, covariates = observations.robot, observations.covariates
        return tuple(
            Parameter(
                "lost motion",
                "m" if kind == "prismatic" else "rad",
                5e-4,
                "joint",
                joint,
                (at_joint(j, -0.5 * np.asarray(covariates[f"approach.{joint}"])),),
            )
            for j, (joint, kind) in enumerate(zip(robot.joint_names, robot.joint_types, strict=True))
            if f"approach.{joint}" in covariates
        )
