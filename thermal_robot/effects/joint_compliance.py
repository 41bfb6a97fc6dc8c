"""Elastic joints: they yield to the torque that gravity, payload or contact puts on them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from thermal_robot.effects.effect import Effect, Parameter, at_joint

if TYPE_CHECKING:
    from thermal_robot.observations import Observations

_WIND_UP = 1e-3


@dataclass(frozen=True)
class JointCompliance(Effect):
    """Every joint yields to its torque: q_actual = q_command − c_j τ_j.

    τ_j is the torque that holds the joint against gravity (Pinocchio's sign): from the URDF's inertias and the
    payload, or ``torque.<joint>`` where the robot reports it. Expected size: a wind-up of 1 mrad at the largest torque
    that the campaign puts on any joint, which is what harmonic drives are rated for.

    A joint whose torque does not vary cannot be told from its offset.
    """

    name: ClassVar[str] = "joint_compliance"

    def missing(self, observations: Observations) -> tuple[str, ...]:
        """Return what would give torques, where neither masses, payload nor torque sensors are there."""
        torque = observations.torque
        if torque is None or not np.any(np.ptp(torque, axis=0) > 1e-9):
            return ("torque.<joint>", "payload", "masses in the URDF")
        return ()

    def reads(self, observations: Observations) -> tuple[str, ...]:
        """Return the torques of the chain's joints that were recorded, and the payload where one was not."""
        columns = tuple(f"torque.{joint}" for joint in observations.robot.joint_names)
        recorded = tuple(column for column in columns if column in observations.covariates)
        computed = ("payload",) if "payload" in observations.covariates and recorded != columns else ()
        return (*computed, *recorded)

    def parameters(self, observations: Observations) -> tuple[Parameter, ...]:
        """One compliance a joint; rad/(N·m), or m/N for a prismatic joint."""
        robot, torque = observations.robot, observations.torque
        if torque is None:
            return ()
        size = _WIND_UP / max(float(np.abs(torque).max()), 1e-9)
        units = {"prismatic": "m/N"}
        return tuple(
            Parameter("compliance", units.get(kind, "rad/(N·m)"), size, "joint", joint, (at_joint(j, -torque[:, j]),))
            for j, (joint, kind) in enumerate(zip(robot.joint_names, robot.joint_types, strict=True))
        )
