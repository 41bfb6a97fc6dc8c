"""Tracking error of joints that are measured in motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.effects.effect import UNSOURCED, Driver, Effect, Parameter, at_joint
from thermal_robot.effects.quantities import driving, unit

if TYPE_CHECKING:
    from thermal_robot.observations import Observations


@dataclass(frozen=True)
class TrackingLag(Effect):
    """Tracking error of the servo: q_actual = q_command − T_j q̇_j − f_j sign(q̇_j) + a_j q̈_j.

    T (s) is the servo's delay, or that between the command's clock and the instrument's; f (rad or m) the error that
    dry friction leaves in a loop without integral part; a (s²) what inertia and interpolation add: ½ T² for a pure
    delay. a only where ``acceleration.<joint>`` is recorded. Expected sizes 1 ms, 0.1 mrad (0.1 mm) and 1e-6 s²
    (Siciliano et al., *Robotics: Modelling, Planning and Control*, 2009, chapter 8). ``moving`` and ``accelerating``
    joints are taken from the observations where absent.

    Where each pose is passed in the direction of approach, :class:`Backlash` is exactly this f, and is preferred where
    it suffices. The delay, which grows with speed, is only here: measure the same poses at several speeds.
    """

    moving: tuple[str, ...] | None = None
    accelerating: tuple[str, ...] | None = None

    name: ClassVar[str] = "tracking_lag"
    title: ClassVar[str] = "joints that trail their command"
    singular: ClassVar[str] = "a trailing of the command"
    size_spread: ClassVar[float] = UNSOURCED

    def missing(self, observations: Observations) -> tuple[str, ...]:
        """Velocity columns, unless at least one of them varies."""
        columns = tuple(f"velocity.{joint}" for joint in observations.robot.joint_names)
        return () if any(observations.varies(column) for column in columns) else columns

    def reads(self, observations: Observations) -> tuple[str, ...]:
        """Return the velocity and acceleration columns of the joints that move."""
        moving, accelerating = self._joints(observations)
        return (*(f"velocity.{joint}" for joint in moving), *(f"acceleration.{joint}" for joint in accelerating))

    def variants(self, observations: Observations) -> tuple[Effect, ...]:
        """Return the setting for the joints that move in the campaign, which a model keeps at standstill, too."""
        moving, accelerating = self._joints(observations)
        return (replace(self, moving=moving, accelerating=accelerating),)

    def _joints(self, observations: Observations) -> tuple[tuple[str, ...], tuple[str, ...]]:
        names, recorded = observations.robot.joint_names, observations.covariates
        moving, accelerating = self.moving, self.accelerating
        if moving is None:
            moving = tuple(n for n in names if np.any(recorded.get(f"velocity.{n}", 0.0)))
        if accelerating is None:
            accelerating = tuple(n for n in moving if np.any(recorded.get(f"acceleration.{n}", 0.0)))
        return moving, accelerating

    def parameters(self, observations: Observations) -> tuple[Parameter, ...]:
        """Delay (s), friction (rad or m) and effect of acceleration (s²) of each joint that moves."""
        robot, recorded = observations.robot, observations.covariates
        moving, accelerating = self._joints(observations)
        found = []
        for j, joint in enumerate(robot.joint_names):
            if joint not in moving:
                continue
            velocity = np.asarray(recorded[f"velocity.{joint}"])
            told = [("delay", "s", 1e-3, -velocity), ("friction", unit(robot, joint), 1e-4, -np.sign(velocity))]
            if joint in accelerating:
                told.append(("effect of acceleration", "s²", 1e-6, recorded[f"acceleration.{joint}"]))
            for label, measured, size, values in told:
                found.append(Parameter(label, measured, size, "joint", joint, (at_joint(j, values),)))
        return tuple(found)

    def driver(self, observations: Observations, parameters: Sequence[Parameter], error: Array) -> Driver | None:
        """Velocity of the joint."""
        return driving(observations, f"velocity.{parameters[0].place}")
