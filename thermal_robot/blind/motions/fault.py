"""Fault models of a servo arm: each changes the MuJoCo model, the command, or the torques of a step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.blind.motions import sizes
from thermal_robot.blind.motions.arm import TOOL, Arm
from thermal_robot.correction.mujoco_models import set_damping

FAULTS: dict[str, tuple[str, ...]] = {
    "delay": ("delay",),
    "coulomb": ("coulomb",),
    "armature": ("armature",),
    "payload": ("payload",),
    "viscous": ("lag",),
    "kp": ("kp",),
    "zero": ("zero",),
    "gain": ("gain",),
    "dead zone": ("dead_zone",),
    "torque limit": ("torque_limit",),
    "end stop": ("low_stop", "high_stop"),
    "table": ("contact",),
}
"""Faults, and the effects that are their right names."""
UNLISTED = ("ripple", "spring", "uneven friction")
"""Faults that no effect knows: a torque ripple, a spring between two joints, friction that depends on position."""
NOTHING = "nothing"
EVERYTHING = (*FAULTS, NOTHING, *UNLISTED)
_WHOLE = ("delay", "payload", "table")


@dataclass(frozen=True, eq=False)
class Sound:
    """Simulated motion of an arm: joint positions and torques (n, J), rad and N·m, and heights of the tool (n,), m."""

    position: Array
    torque: Array
    height: Array


@dataclass(frozen=True, eq=False)
class Fault:
    """Fault with its size (SI) and the index of its joint; -1 for a fault of the whole arm.

    ``turn`` is the number of cycles a turn of a ripple, the phase (rad) of uneven friction, the sign of an end stop.
    """

    name: str
    joint: int = -1
    size: float = 0.0
    turn: float = 0.0

    def built(self, spec: Any, arm: Arm) -> None:
        """Put a fault of friction, inertia, gain, limit, payload or table into ``spec``; other faults change nothing.

        ``spec`` is a ``mujoco.MjSpec`` whose actuators are the arm's servos, in the order of its joints.
        """
        joint, servo = spec.joint(arm.joints[self.joint]), spec.actuators[self.joint]
        match self.name:
            case "coulomb" | "uneven friction":
                joint.frictionloss = self.size
            case "armature":
                joint.armature = self.size
            case "viscous":
                set_damping(joint, self.size)
            case "kp":
                servo.gainprm[0] *= 1.0 + self.size
                servo.biasprm[1] *= 1.0 + self.size
            case "torque limit":
                servo.forcerange = [-self.size, self.size]
            case "end stop":
                joint.limited = True
                joint.range = [-10.0, self.size] if self.turn > 0.0 else [self.size, 10.0]
            case "payload":
                load = spec.body(TOOL).add_body(name="load")
                load.explicitinertial, load.mass, load.inertia = True, self.size, [1e-9, 1e-9, 1e-9]
            case "table":
                _add_table(spec, self.size)

    def commanded(self, command: Array, position: Array) -> Array:
        """Return the command (J,) that the servos receive: changed by a zero offset, a gain error or a dead zone.

        The dead zone acts on the difference between the command and ``position``, the joints' positions (J,), rad.
        """
        own, j = command.copy(), self.joint
        match self.name:
            case "zero":
                own[j] += self.size
            case "gain":
                own[j] *= 1.0 + self.size
            case "dead zone":
                error = own[j] - position[j]
                own[j] = position[j] + np.sign(error) * max(abs(error) - self.size, 0.0)
        return own

    def acts(self, model: Any, position: Array, torque: Array) -> None:
        """Write a ripple's or spring's torque at a position (J,) into ``torque`` (J,), or set friction in ``model``."""
        j = self.joint
        match self.name:
            case "ripple":
                torque[j] = self.size * np.sin(round(self.turn) * position[j])
            case "spring":
                torque[j - 1] = self.size * (position[j] - position[j - 1])
                torque[j] = -torque[j - 1]
            case "uneven friction":
                model.dof_frictionloss[j] = self.size * (1.0 + np.sin(3.0 * position[j] + self.turn))

    @property
    def delay(self) -> float:
        """Dead time of the command, s; 0 unless the fault is a delay."""
        return self.size if self.name == "delay" else 0.0


def _add_table(spec: Any, height: float) -> None:
    """Add a table plane and a tool-tip sphere, in contact where the sphere's centre is at ``height`` (m)."""
    import mujoco

    own = {"condim": 3, "friction": [sizes.FRICTION, 0.0, 0.0]}
    plane, tip = mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_SPHERE
    spec.worldbody.add_geom(name="table", type=plane, size=[5, 5, 1], pos=[0, 0, height - 1e-3], **own)
    spec.body(TOOL).add_geom(name="tip", type=tip, size=[1e-3, 0, 0], **own)


def draw_fault(rng: np.random.Generator, name: str, arm: Arm, sound: Sound, larger: float = 1.0) -> Fault:
    """Draw a fault's joint, and its size: lognormal about the usual size times ``larger``, or from the sound motion.

    Table, torque limit and end stop are placed at a quantile of the sound arm's heights, torques and positions.
    """
    first = 1 if name == "spring" else 0
    j = -1 if name in (*_WHOLE, NOTHING) else int(rng.integers(first, len(arm.joints)))
    factor = larger * float(np.exp(sizes.SPREAD * rng.normal()))
    sign = float(rng.choice((-1.0, 1.0)))
    servo = arm.servos[arm.joints[j]]
    if name in sizes.SHARE:
        turn = rng.integers(*sizes.RIPPLES) if name == "ripple" else rng.uniform(0.0, 6.28)
        return Fault(name, j, factor * sizes.SHARE[name] * float(servo.limit or 0.0), float(turn))
    if name in sizes.USUAL:
        unit = {"payload": arm.rated, "viscous": servo.kd, "spring": servo.kp}.get(name) or 1.0
        size = factor * sizes.USUAL[name] * unit
        if name == "kp":  # as likely too soft as too stiff
            return Fault(name, j, float((1.0 + size) ** sign - 1.0))
        return Fault(name, j, size * sign if name in ("zero", "gain") else size)
    share = float(rng.uniform(*(sizes.ABOVE if name == "table" else sizes.BEYOND)))
    match name:
        case "table":
            return Fault(name, j, float(np.quantile(sound.height, share)))
        case "torque limit":
            return Fault(name, j, float(np.quantile(np.abs(sound.torque[:, j]), 1.0 - share)))
        case "end stop":
            return Fault(name, j, float(np.quantile(sound.position[:, j], 1.0 - share if sign > 0.0 else share)), sign)
    return Fault(name)
