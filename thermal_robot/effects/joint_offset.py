"""Joint zero error (mastering)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from thermal_robot.effects.effect import Effect, Parameter, at_joint

if TYPE_CHECKING:
    from thermal_robot.observations import Observations


@dataclass(frozen=True)
class JointOffset(Effect):
    """Every joint's zero is off by a constant: q_actual = q_command + o_j.

    Expected size 1 mrad (0.5 mm for a prismatic joint), the order that mastering with a gauge leaves
    (Mooring, Roth and Driels, *Fundamentals of Manipulator Calibration*, 1991).

    The first joint's offset is exactly a turn of the base about that joint's axis, and the last one's a turn of the
    tool: with unknown frames neither can be told. All offsets are contained in :class:`Geometric`.
    """

    name: ClassVar[str] = "joint_offset"

    def parameters(self, observations: Observations) -> tuple[Parameter, ...]:
        """One offset a joint; rad or m."""
        robot = observations.robot
        return tuple(
            Parameter("zero offset", unit, size, "joint", joint, (at_joint(j, 1.0),))
            for j, (joint, unit, size) in enumerate(
                (joint, "m", 5e-4) if kind == "prismatic" else (joint, "rad", 1e-3)
                for joint, kind in zip(robot.joint_names, robot.joint_types, strict=True)
            )
        )
