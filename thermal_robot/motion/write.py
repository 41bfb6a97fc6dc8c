"""Parameters of a diagnosis of motions written into the user's simulator: MJCF by MuJoCo's MjSpec, and URDF.

The servo model divides torques by the servo's stiffness K, the model of the torque channel does not; a robot file has
N·m, and K is the stated stiffness with its fitted change, or one over the fitted droop. In MuJoCo a position
actuator's force is that of Hooke's law with offset and gain, and acts on its joint times its gear:

    f = g₀ u + b₀ + b₁ q + b₂ q̇ ,   g₀ = K (1 + g) ,  b₀ = K z ,  b₁ = −K ,  b₂ = −k_d .
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from lxml import etree

from thermal_robot.arrays import Array
from thermal_robot.correction.mujoco_models import compiled, mujoco_or_error, set_damping
from thermal_robot.errors import CampaignError
from thermal_robot.kinematics import homogeneous
from thermal_robot.kinematics.urdf import text_of, tree
from thermal_robot.motion import settings
from thermal_robot.motion.log import Servo
from thermal_robot.motion.masses import into_body, into_link, links
from thermal_robot.motion.mjcf import add_joint, position_actuators, set_mass
from thermal_robot.motion.result import MotionDiagnosis

_FAR = 1e3
"""rad: end of a range that nothing limits."""
_POINT = 1e-9
"""kg·m²: inertia of a payload of which only the mass is known; MuJoCo wants one."""
_CANNOT = {
    "dead_zone": "no joint and no actuator has a dead zone or a starting force",
    "load_friction": "its friction does not grow with load",
    "stribeck": "its friction does not fall with speed",
    "acceleration_limit": "no joint and no actuator limits the acceleration of its set point",
    "contact": "it is the surroundings' and not the robot's",
    "offset": "it is the torque channel's and not the robot's",
    "torque_constant": "it is the torque channel's and not the robot's",
}
"""Effects that neither an MJCF nor a URDF holds, and why."""
_OF_THE_URDF = {"speed_limit": "no actuator limits the speed of its set point; a URDF holds it, as velocity"}
_OF_A_JOINT = (
    ("frictionloss", "friction", "coulomb", "N·m"),
    ("damping", "damping", "lag", "N·m·s/rad"),
    ("damping", "damping", "viscous", "N·m·s/rad"),
)
"""What an MJCF and a URDF call a joint's friction and damping, the effects that are these, and the unit."""
_STATED = {"coulomb": "friction", "lag": "damping", "armature": "armature"}
"""Effects that are told beyond what a servo states, by its name there."""
_OF_THE_SERVO = dict.fromkeys(("armature", "delay", "gain", "zero", "kp", "droop"), "a URDF describes no servo")


@dataclass
class Written:
    """A robot file, and in sentences what of the diagnosis it holds, and what it cannot hold with the reason."""

    text: str = ""
    held: list[str] = field(default_factory=list)
    kept: list[str] = field(default_factory=list)


@dataclass(frozen=True, eq=False)
class Cause:
    """Values fitted to one joint's effects, with its servo as stated, SI.

    Attributes
    ----------
    name
        Of the joint.
    servo
        As it is stated.
    values
        Of its effects, by name.
    reach
        rad, lowest and highest command.
    torques
        Whether the values of friction, damping and inertia are torques, and not over the stiffness.
    """

    name: str
    servo: Servo
    values: dict[str, float]
    reach: tuple[float, float]
    torques: bool = False

    @property
    def stiffness(self) -> float | None:
        """K of the position servo, N·m/rad: the stated one with its change, or one over the droop; ``None`` unknown."""
        if self.servo.kp:
            return float(self.servo.kp * np.exp(self.values.get("kp", 0.0)))
        droop = self.values.get("droop", 0.0)
        return 1.0 / droop if droop > 0.0 else None

    @property
    def limit(self) -> float | None:
        """Torque limit, N·m: stiffness over fitted plus, with kp, stated inverse limit; else the stated one."""
        if self.stiffness is None or "torque_limit" not in self.values:
            return self.servo.limit
        return self.servo.saturation(self.stiffness, self.values["torque_limit"])

    @property
    def stops(self) -> tuple[float | None, float | None]:
        """Lower and upper end stop, rad; ``None`` where none was found."""
        low, high = (self.values.get(name) for name in ("low_stop", "high_stop"))
        return None if low is None else self.reach[0] + low, None if high is None else self.reach[1] - high

    def torque(self, name: str) -> float | None:
        """Return an effect as torque, N·m, N·m·s/rad or kg·m², with what the servo states of it; ``None`` if not found.

        ``None`` also where the stiffness is needed for it and unknown.
        """
        factor = 1.0 if self.torques else self.stiffness
        if factor is None or name not in self.values:
            return None
        stated = getattr(self.servo, _STATED[name]) if name in _STATED and self.servo.kp and not self.torques else None
        return factor * self.values[name] + (stated or 0.0)


def causes(found: MotionDiagnosis) -> tuple[Cause, ...]:
    """Return the fitted values of each joint of the log, in its order."""
    log, told = found.log, []
    commands = np.concatenate([motion.command.values for motion in log.motions])
    for name, low, high in zip(log.joints, np.nanmin(commands, axis=0), np.nanmax(commands, axis=0), strict=True):
        values = {effect: value for (effect, joint), value in found.values.items() if joint == name}
        told.append(Cause(name, log.servo(name), values, (float(low), float(high)), found.unit == "N·m"))
    return tuple(told)


def motion_mjcf(found: MotionDiagnosis, mjcf: str | Path) -> Written:
    """Joint friction, damping, armature, servo gains, limits, delay and masses written into an MJCF by MjSpec.

    Parameters
    ----------
    found
        Of :func:`~thermal_robot.motion.diagnose.diagnose_motion`.
    mjcf
        The user's model, as a path or as its text, with the log's names of joints. What the diagnosis does not tell
        stays; ``frictionloss``, ``damping``, ``armature`` and ``delay`` are replaced where it tells them, by what the
        servos of the log state of them and what was found beyond.

    Raises
    ------
    CampaignError
        If MuJoCo is not installed or does not take the model, or if that lacks a joint of the log.
    """
    mujoco = mujoco_or_error()
    name, model, path = compiled(mjcf)  # refused in words
    spec = mujoco.MjSpec.from_file(str(path)) if path else mujoco.MjSpec.from_string(str(mjcf))
    written, joints = Written(), {joint.name: joint for joint in spec.joints}
    servos = {joint: spec.actuators[k] for joint, k in position_actuators(model).items()}
    for cause in causes(found):
        if cause.name not in joints:
            raise CampaignError(name, f"has no joint {cause.name!r}", found=", ".join(joints) or "no joint")
        _into_joint(joints[cause.name], cause, written)
        if cause.torque("coulomb") is not None:
            stick(spec, joints[cause.name], found.values.get(("creep", ""), 0.0))
        _into_servo(spec, servos.get(cause.name), cause, written)
        needed = "coulomb", "armature", "lag", "torque_limit", "zero", "gain", "delay"
        _tell_kept(cause, written, _CANNOT | _OF_THE_URDF, *needed)
    _into_masses(model, spec, found, written)
    spec.compile()
    written.text = spec.to_xml()
    return written


def stick(spec: Any, joint: Any, creep: float = 0.0) -> None:
    """Stiffen the friction of a ``mujoco.MjsJoint`` so that it holds at rest, or gives way by the share ``creep``."""
    if creep > 0.0:
        joint.solimp_friction[0] = 1.0 - creep
        return
    joint.solref_friction = [settings.STIFFEST * float(spec.option.timestep), 1.0]
    joint.solimp_friction = list(settings.STICKING)


def _said(written: Written, cause: Cause, what: str, value: float, unit: str) -> None:
    written.held.append(f"{what} of {cause.name}: {value:.4g} {unit}".rstrip())


def _tell_kept(cause: Cause, written: Written, reasons: dict[str, str], *torques: str) -> None:
    """Record a joint's effects that cannot be written: for ``reasons``, and ``torques`` where no stiffness is known."""
    if cause.stiffness is None and not cause.torques:
        unknown = "its stiffness is not stated, and no droop tells it, so that no torque follows"
        reasons = dict.fromkeys(torques, f"{unknown}; state [servo.{cause.name}] kp") | reasons
    written.kept += [f"{effect} of {cause.name}: {reasons[effect]}" for effect in cause.values if effect in reasons]


def _into_joint(joint: Any, cause: Cause, written: Written) -> None:
    for what, _, effect, unit in (*_OF_A_JOINT, ("armature", "", "armature", "kg·m²")):
        value = cause.torque(effect)
        if value is not None:
            set_damping(joint, value) if what == "damping" else setattr(joint, what, value)
            _said(written, cause, what, value, unit)
    if cause.stops != (None, None):
        limited = joint.limited != mujoco_or_error().mjtLimited.mjLIMITED_FALSE and joint.range[0] < joint.range[1]
        low, high = joint.range if limited else (-_FAR, _FAR)
        low, high = (own if own is not None else now for own, now in zip(cause.stops, (low, high), strict=True))
        joint.limited, joint.range = mujoco_or_error().mjtLimited.mjLIMITED_TRUE, [low, high]
        written.held.append(f"range of {cause.name}: {low:.4g} to {high:.4g} rad")


def _into_servo(spec: Any, actuator: Any, cause: Cause, written: Written) -> None:
    """Write stiffness, zero, gain, limit and delay into the position actuator of a joint, or into a new one."""
    stiffness, limit = cause.stiffness, cause.limit
    told = {"kp", "droop", "zero", "gain", "torque_limit", "delay"} & set(cause.values)
    if stiffness is None or not told:
        return
    if actuator is None:
        at = mujoco_or_error().mjtTrn.mjTRN_JOINT
        actuator = spec.add_actuator(name=f"{cause.name} servo", target=cause.name, trntype=at)
        actuator.set_to_position(kp=1.0)
        written.held.append(f"a position actuator of {cause.name}, which had none")
    gear = float(actuator.gear[0])
    gain, zero = (cause.values.get(name, 0.0) + (getattr(cause.servo, name) or 0.0) for name in ("gain", "zero"))
    actuator.gainprm[0] = stiffness * (1.0 + gain) / gear**2
    actuator.biasprm[0], actuator.biasprm[1] = stiffness * zero / gear, -stiffness / gear**2
    for name, value, unit in (("kp", stiffness, "N·m/rad"), ("zero", zero, "rad"), ("gain", gain, "")):
        if name in told or (name == "kp" and "droop" in told):
            _said(written, cause, name, value, unit)
    if "torque_limit" in told and limit is not None:
        actuator.forcelimited = mujoco_or_error().mjtLimited.mjLIMITED_TRUE
        actuator.forcerange = [-limit / abs(gear), limit / abs(gear)]
        _said(written, cause, "forcerange", limit, "N·m")
    delay = cause.values.get("delay", 0.0) + (cause.servo.delay or 0.0)
    if "delay" in told and hasattr(actuator, "delay"):  # with the samples that MuJoCo keeps for it
        actuator.delay, actuator.nsample = delay, int(np.ceil(delay / float(spec.option.timestep))) + 1
        _said(written, cause, "delay", delay, "s")
    elif "delay" in told:
        reason = f"this version of MuJoCo has no delay of actuators; command it {1e3 * delay:.0f} ms later"
        written.kept.append(f"delay of {cause.name}: {reason}")


def _into_masses(model: Any, spec: Any, found: MotionDiagnosis, written: Written) -> None:
    """Add fitted changes of mass to the links' bodies, and a payload as a body at the tool frame's body or site."""
    for joint, (link, added) in links(found).items():
        _tell_link(written, joint, added, into_body(model, spec, joint, link, added))
    tool, (mass, at) = found.log.robot.tool_frame, _payload(found, written)
    if not mass:
        return
    bodies, sites = ({one.name: one for one in own} for own in (spec.bodies, spec.sites))
    if tool not in bodies and tool not in sites:
        written.kept.append(f"payload: the MJCF has neither body nor site {tool!r}")
        return
    place = {} if tool in bodies else {"pos": sites[tool].pos, "quat": sites[tool].quat}
    body = (bodies.get(tool) or sites[tool].parent).add_body(name=f"{tool} payload", **place)
    body.explicitinertial, body.mass, body.ipos, body.inertia = True, mass, at, [_POINT] * 3
    written.held.append(f"payload at {tool}: {mass:.4g} kg")


def _tell_link(written: Written, joint: str, added: Array, why_not: str) -> None:
    told = f"masses of the link behind {joint}"
    if why_not:
        written.kept.append(f"{told}: {why_not}")
    else:
        written.held.append(f"{told}: {added[3, 3]:+.4g} kg, and its moments")


def _payload(found: MotionDiagnosis, written: Written) -> tuple[float, Array]:
    """Return the payload to add, kg, 0 if negative, and its centre in the tool frame, m; note what is not written."""
    mass = found.values.get(("payload", ""), 0.0)
    whole = dict.fromkeys(effect for effect, _ in found.values if effect == "contact")
    written.kept += [f"{effect}: {_CANNOT[effect]}" for effect in whole]
    if mass < 0.0:
        said = f"payload: {-mass:.4g} kg less than the masses say; which of them, no log of one load tells"
        written.kept.append(said)
    return max(mass, 0.0), np.zeros(3) if found.log.payload is None else np.asarray(found.log.payload[1])


def motion_urdf(found: MotionDiagnosis) -> Written:
    """Joint friction, damping, limits and masses written into the URDF of the log's robot (``<dynamics>``).

    Parameters
    ----------
    found
        Of :func:`~thermal_robot.motion.diagnose.diagnose_motion`.

    Raises
    ------
    CampaignError
        If the URDF lacks a joint of the log.
    """
    root, written = tree(found.log.robot.urdf), Written()
    joints = {joint.get("name"): joint for joint in root.iterfind("joint")}
    for cause in causes(found):
        if cause.name not in joints:
            raise CampaignError("the URDF", f"has no joint {cause.name!r}", found=", ".join(map(str, joints)))
        for _, key, effect, unit in _OF_A_JOINT:
            _attribute(joints[cause.name], "dynamics", key, cause.torque(effect), cause, written, unit)
        limit = cause.limit if "torque_limit" in cause.values and cause.stiffness is not None else None
        _attribute(joints[cause.name], "limit", "effort", limit, cause, written, "N·m")
        speed = 1.0 / cause.values["speed_limit"] if cause.values.get("speed_limit") else None
        _attribute(joints[cause.name], "limit", "velocity", speed, cause, written, "rad/s")
        for key, stop in zip(("lower", "upper"), cause.stops, strict=True):
            _attribute(joints[cause.name], "limit", key, stop, cause, written, "rad")
        _tell_kept(cause, written, _CANNOT | _OF_THE_SERVO, "coulomb", "lag", "torque_limit")
    _mass_of_link(root, found, written)
    notes = ["Written by thermal_robot from a diagnosis of motions:", *written.held, "Not written:", *written.kept]
    written.text = text_of(root, found.log.robot.urdf, notes)
    return written


def _attribute(
    joint: Any, child: str, key: str, value: float | None, cause: Cause, written: Written, unit: str
) -> None:
    if value is None:
        return
    element = joint.find(child)
    if element is None:
        usual = {"limit": {"effort": "0", "velocity": "0"}, "dynamics": {}}[child]
        element = etree.SubElement(joint, child, usual)
    element.set(key, repr(float(value)))
    _said(written, cause, key, value, unit)


def _mass_of_link(root: Any, found: MotionDiagnosis, written: Written) -> None:
    """Add fitted changes of mass to the links, and a payload as a link fixed to the tool frame."""
    children = {joint.get("name"): joint.find("child").get("link") for joint in root.iterfind("joint")}
    own = {link.get("name"): link for link in root.iterfind("link")}
    for joint, (_, added) in links(found).items():
        _tell_link(written, joint, added, into_link(own[children[joint]], added))
    tool, (mass, at) = found.log.robot.tool_frame, _payload(found, written)
    if not mass:
        return
    name = f"{tool}_payload"
    set_mass(etree.SubElement(root, "link", name=name), mass, homogeneous(np.eye(3), at), _POINT * np.eye(3))
    add_joint(root, f"{name}_joint", "fixed", (tool, name), np.eye(4))
    written.held.append(f"payload at {tool}: {mass:.4g} kg")
