"""Joint zero error (mastering)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from thermal_robot.arrays import Array
from thermal_robot.effects.effect import UNSOURCED, Driver, Effect, Parameter, at_joint
from thermal_robot.effects.quantities import position_of, unit

if TYPE_CHECKING:
    from thermal_robot.observations import Observations


@dataclass(frozen=True)
class JointOffset(Effect):
    """Every joint's zero is off by a constant: q_actual = q_command + o_j.

    Expected size 1 mrad (0.5 mm for a prismatic joint), the order that mastering with a gauge leaves
    (Mooring, Roth and Driels, *Fundamentals of Manipulator Calibration*, 1991).

    The first joint's offset is exactly a turn of the base about that joint's axis, and the last one's a turn of the
    tool: with unknown frames neither can be told. All offsets are contained in :class:`Geometric`; where that
    was found, they are what a controller's zeros can take of it.
    """

    name: ClassVar[str] = "joint_offset"
    title: ClassVar[str] = "joint zero offsets"
    singular: ClassVar[str] = "a zero offset"
    size_spread: ClassVar[float] = UNSOURCED
    constant: ClassVar[bool] = True
    contained_in: ClassVar[tuple[str, ...]] = ("geometric",)
    told_inside: ClassVar[bool] = True

    def parameters(self, observations: Observations) -> tuple[Parameter, ...]:
        """One offset a joint; rad or m."""
        robot, sizes = observations.robot, {"rad": 1e-3, "m": 5e-4}
        units = [unit(robot, joint) for joint in robot.joint_names]
        return tuple(
            Parameter("zero offset", units[j], sizes[units[j]], "joint", joint, (at_joint(j, 1.0),))
            for j, joint in enumerate(robot.joint_names)
        )

    def driver(self, observations: Observations, parameters: Sequence[Parameter], error: Array) -> Driver | None:
        """Return the joint's own position."""
        return position_of(observations, parameters[0].place)
