"""Inertial parameters that torques tell, added to the links of a robot file as pseudo-inertias.

A body's mass m, first moment h and second moments Σ = ∫ x xᵀ dm are one symmetric matrix, J = [Σ h; hᵀ m], that moves
between frames as T J Tᵀ, and is that of a rigid body where it is positive (Wensing, Kim and Slotine, *IEEE Robotics and
Automation Letters* 3, 2018). Torques of joints tell sums of the links' numbers: what is added gives the torques that
were found, though the numbers of one link may be another's.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.correction.mujoco_models import mujoco_or_error
from thermal_robot.kinematics import exp3, homogeneous, quaternion_to_rotation
from thermal_robot.kinematics.loads import Dynamics, at_centre, pseudo_inertia, pseudo_inertia_of
from thermal_robot.motion import settings
from thermal_robot.motion.mjcf import set_mass
from thermal_robot.motion.result import MotionDiagnosis
from thermal_robot.motion.torque import INERTIAL

_NOT_RIGID = "no rigid body has the numbers that torques tell of it alone"


def rigid(whole: Array) -> bool:
    """Whether a pseudo-inertia (4, 4) is a rigid body's: positive definite."""
    return bool(np.linalg.eigvalsh(whole)[0] > 0.0)


def links(found: MotionDiagnosis) -> dict[str, tuple[Array, Array]]:
    """Return by joint its link's pseudo-inertia (4, 4) in the joint's frame, and the change of it that was fitted."""
    robot = found.log.robot
    told = {name: value for (effect, name), value in found.values.items() if effect == "masses"}
    if not told:
        return {}
    gravity = robot.model.gravity.linear
    bodies = Dynamics(robot.urdf, found.log.joints, robot.tool_frame, gravity, np.zeros(3)).bodies
    added = dict[str, tuple[Array, Array]]()
    for name, numbers in bodies.items():
        more = np.array([told.get(what.format(name), 0.0) for what in INERTIAL])
        if more.any():
            change = more[0] * numbers + np.concatenate([[0.0], more[1:]])
            added[name] = pseudo_inertia_of(numbers), pseudo_inertia_of(change)
    return added


def of_body(model: Any, body: int) -> Array:
    """(4, 4) pseudo-inertia of a body of a ``mujoco.MjModel`` in its own axes, without those that it carries."""
    turn = quaternion_to_rotation(model.body_iquat[body])
    inertia = turn @ np.diag(model.body_inertia[body]) @ turn.T
    return pseudo_inertia(float(model.body_mass[body]), model.body_ipos[body], inertia)


def carried(model: Any, body: int) -> Array:
    """(4, 4) pseudo-inertia of a body together with all bodies that are fixed to it, in the body's own axes."""
    whole = of_body(model, body)
    for other in range(body + 1, model.nbody):
        if model.body_parentid[other] == body and not model.body_jntnum[other]:
            place = homogeneous(quaternion_to_rotation(model.body_quat[other]), model.body_pos[other])
            whole = whole + place @ carried(model, other) @ place.T
    return np.asarray(whole)


def into_body(model: Any, spec: Any, joint: str, link: Array, added: Array) -> str:
    """Add a pseudo-inertia (4, 4) to the body of a joint in a ``mujoco.MjSpec``; return why not, or ""."""
    body = int(model.jnt_bodyid[model.joint(joint).id])
    place = homogeneous(np.eye(3), np.array(model.joint(joint).pos))
    nominal = place @ link @ place.T
    if not np.allclose(carried(model, body), nominal, atol=settings.SAME_LINK * np.abs(nominal).max()):
        return "the MJCF's link has other masses, or another frame, than the robot of the log"
    whole = of_body(model, body) + place @ added @ place.T
    if not rigid(whole):
        return _NOT_RIGID
    mass, centre, inertia = at_centre(whole)
    size, axes = np.linalg.eigh(inertia)
    quaternion = np.zeros(4)
    mujoco_or_error().mju_mat2Quat(quaternion, (axes * [1.0, 1.0, np.linalg.det(axes)]).ravel())
    own = spec.bodies[body]
    own.explicitinertial, own.iquat, own.inertia = True, quaternion, size
    own.mass, own.ipos = mass, centre
    return ""


def into_link(link: Any, added: Array) -> str:
    """Add a pseudo-inertia (4, 4) to the ``<inertial>`` of a URDF's link; return why not, or ""."""
    inertial = link.find("inertial")
    whole = added if inertial is None else added + _of_inertial(inertial)
    if not rigid(whole):
        return _NOT_RIGID
    mass, centre, inertia = at_centre(whole)
    set_mass(link, mass, homogeneous(np.eye(3), centre), inertia)
    return ""


def _of_inertial(inertial: Any) -> Array:
    """(4, 4) pseudo-inertia of an ``<inertial>`` in its link's frame."""

    def told(element: str) -> Mapping[str, str]:
        child = inertial.find(element)
        return {} if child is None else child.attrib

    origin, numbers = told("origin"), told("inertia")
    roll, pitch, yaw = np.diag([float(x) for x in origin.get("rpy", "0 0 0").split()])
    turn = exp3(yaw) @ exp3(pitch) @ exp3(roll)
    own = np.array([[float(numbers.get("i" + "".join(sorted(a + b)), 0.0)) for b in "xyz"] for a in "xyz"])
    centre = np.array([float(x) for x in origin.get("xyz", "0 0 0").split()])
    return pseudo_inertia(float(told("mass").get("value", 0.0)), centre, turn @ own @ turn.T)
