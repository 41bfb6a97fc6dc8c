"""The robot of an MJCF, by MuJoCo's compiler: its bodies and joints as a URDF, its position actuators as servos.

A joint turns about its anchor by qpos − qpos0 (MuJoCo, *Computation*, "Joints"); a URDF's link begins at its joint, so
each body's frame is shifted there. Geoms, tendons and equalities are left out; a free joint is held.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from lxml import etree

from thermal_robot.arrays import Array
from thermal_robot.correction.mujoco_models import compiled, digits, mujoco_or_error
from thermal_robot.errors import CampaignError
from thermal_robot.kinematics import exp3, homogeneous, quaternion_to_rotation
from thermal_robot.kinematics.urdf import xyz_rpy
from thermal_robot.motion.log import Servo

_FREE, _BALL, _SLIDE, _HINGE = range(4)  # mjtJoint
_FAR = 1e3  # m: limit of a joint that slides without one


def opened(file: Path) -> Any:
    """Return the compiled ``mujoco.MjModel`` of an MJCF."""
    if not file.is_file():
        raise CampaignError(str(file), "there is no such file", expected="the robot's MJCF")
    return compiled(file)[1]


def position_actuators(model: Any) -> dict[str, int]:
    """Return the index of each joint's first position actuator: positive gain and negative position feedback.

    Its force is g₀ u + b₀ + b₁ q + b₂ q̇ with g₀ > 0 > b₁, see :mod:`thermal_robot.motion.write`.
    """
    at_joint = model.actuator_trntype == mujoco_or_error().mjtTrn.mjTRN_JOINT
    pulls = at_joint & (model.actuator_gainprm[:, 0] > 0.0) & (model.actuator_biasprm[:, 1] < 0.0)
    found: dict[str, int] = {}
    for k in np.flatnonzero(pulls).tolist():
        found.setdefault(model.joint(model.actuator_trnid[k, 0]).name, k)
    return found


def servos_of_mjcf(model: Any) -> dict[str, Servo]:
    """Return by joint the servo that its position actuator and joint define, in joint units (times the gear)."""
    found = {}
    for name, k in position_actuators(model).items():
        joint, gear = model.joint(name).id, float(model.actuator_gear[k, 0])
        gain, (offset, stiff, damp) = model.actuator_gainprm[k, 0], model.actuator_biasprm[k, :3]
        limits = [abs(gear) * float(model.actuator_forcerange[k, 1])] if model.actuator_forcelimited[k] else []
        limits += [float(model.jnt_actfrcrange[joint, 1])] if model.jnt_actfrclimited[joint] else []
        numbers = (-stiff * gear**2, -damp * gear**2, min(limits, default=0.0), 0.0, -gain / stiff - 1.0)
        dof, delays = int(model.jnt_dofadr[joint]), getattr(model, "actuator_delay", np.zeros(model.nu))
        own = (model.dof_frictionloss[dof], damping_of(model, dof), model.dof_armature[dof], delays[k])
        found[name] = Servo(*(float(x) or None for x in (*numbers, -offset / stiff / gear, *own)))
    return found


def damping_of(model: Any, dof: int) -> float:
    """Return a joint's damping, N·m·s/rad; the linear part where MuJoCo has a polynomial."""
    return float(np.ravel(model.dof_damping[dof])[0])


def places(model: Any) -> tuple[dict[str, dict[str, tuple[int, float]]], float]:
    """Return each joint's index and scale to joint units in arrays of ``mjData``, by array, and the time step, s.

    Arrays are qpos, qvel, qfrc_actuator and, by position actuators, ctrl.
    """
    ctrl = {joint: (k, 1.0 / float(model.actuator_gear[k, 0])) for joint, k in position_actuators(model).items()}
    single = [k for k in range(model.njnt) if model.jnt_type[k] in (_SLIDE, _HINGE)]
    q = {model.joint(k).name: (int(model.jnt_qposadr[k]), 1.0) for k in single}
    v = {model.joint(k).name: (int(model.jnt_dofadr[k]), 1.0) for k in single}
    return {"ctrl": ctrl, "qpos": q, "qvel": v, "qfrc_actuator": v}, float(model.opt.timestep)


def urdf_of_mjcf(model: Any, file: Path) -> str:
    """Return the bodies, joints and sites of a ``mujoco.MjModel`` of a file as URDF text, with all digits.

    Raises
    ------
    CampaignError
        If a joint is a ball.
    """
    robot = etree.Element("robot", name=file.stem)
    anchors, links = {0: np.zeros(3)}, {0: "world"}
    etree.SubElement(robot, "link", name="world")
    for body in range(1, model.nbody):
        _body(robot, model, body, anchors, links, str(file))
    for site in range(model.nsite):
        name, body = model.site(site).name, int(model.site_bodyid[site])
        if name and name not in {link.get("name") for link in robot.iter("link")}:
            etree.SubElement(robot, "link", name=name)
            pose = _pose(model.site_pos[site] - anchors[body], model.site_quat[site])
            add_joint(robot, f"{name} is fixed", "fixed", (links[body], name), pose)
    return str(etree.tostring(robot, encoding="unicode"))


def _body(robot: Any, model: Any, body: int, anchors: dict[int, Array], links: dict[int, str], file: str) -> None:
    """Add a body to a URDF: a link for each of its joints, the last the body's own; without joints a fixed link."""
    parent, own = int(model.body_parentid[body]), model.body(body).name or f"body {body}"
    before = links[parent]
    pose = _pose(model.body_pos[body] - anchors[parent], model.body_quat[body])
    first = int(model.body_jntadr[body])
    joints = [k for k in range(first, first + int(model.body_jntnum[body])) if model.jnt_type[k] != _FREE]
    anchor = np.zeros(3)
    for joint in joints:
        if model.jnt_type[joint] == _BALL:
            raise CampaignError(file, f"joint {model.joint(joint).name!r} is a ball", expected="hinges and slides")
        link = own if joint == joints[-1] else f"{own} before joint {joint + 1}"
        pose = pose @ homogeneous(np.eye(3), model.jnt_pos[joint] - anchor)
        anchor = np.array(model.jnt_pos[joint])
        _moving(robot, model, joint, (before, link), pose)
        before, pose = link, np.eye(4)
        _link(robot, model, body if link == own else None, link, anchor)
    if not joints:
        add_joint(robot, f"{own} is fixed", "fixed", (before, own), pose)
        _link(robot, model, body, own, anchor)
    anchors[body], links[body] = anchor, own


def _moving(robot: Any, model: Any, joint: int, between: tuple[str, str], pose: Array) -> None:
    axis, zero = np.array(model.jnt_axis[joint]), float(model.qpos0[model.jnt_qposadr[joint]])
    slides, limited = model.jnt_type[joint] == _SLIDE, bool(model.jnt_limited[joint])
    turn, shift = (np.eye(3), -zero * axis) if slides else (exp3(-zero * axis), np.zeros(3))
    kind = "prismatic" if slides else "revolute" if limited else "continuous"
    name = model.joint(joint).name or f"joint {joint}"
    element = add_joint(robot, name, kind, between, pose @ homogeneous(turn, shift))
    etree.SubElement(element, "axis", xyz=digits(axis))
    low, high = model.jnt_range[joint] if limited else (-_FAR, _FAR)
    if kind != "continuous":
        etree.SubElement(element, "limit", lower=repr(float(low)), upper=repr(float(high)), effort="0", velocity="0")


def add_joint(robot: Any, name: str, kind: str, between: tuple[str, str], pose: Array) -> Any:
    """Add a joint to a URDF between two of its links, at a pose (4, 4) in the first, and return it."""
    element = etree.SubElement(robot, "joint", name=name, type=kind)
    for end, link in zip(("parent", "child"), between, strict=True):
        etree.SubElement(element, end, link=link)
    _origin(element, pose)
    return element


def _link(robot: Any, model: Any, body: int | None, name: str, anchor: Array) -> None:
    """Add a link to a URDF, with a body's mass and inertia unless ``body`` is ``None`` or has no mass."""
    link = etree.SubElement(robot, "link", name=name)
    if body is not None and model.body_mass[body] > 0.0:
        pose = _pose(model.body_ipos[body] - anchor, model.body_iquat[body])
        set_mass(link, model.body_mass[body], pose, np.diag(model.body_inertia[body]))


def set_mass(link: Any, mass: float, pose: Array, inertia: Array) -> None:
    """Set a URDF link's mass, kg, and inertia (3, 3), kg·m², about the origin and in the axes of a pose (4, 4)."""
    for old in link.findall("inertial"):
        link.remove(old)
    inertial = etree.SubElement(link, "inertial")
    _origin(inertial, pose)
    etree.SubElement(inertial, "mass", value=repr(float(mass)))
    moments = {f"i{'xyz'[i]}{'xyz'[j]}": repr(float(inertia[i, j])) for i in range(3) for j in range(i, 3)}
    etree.SubElement(inertial, "inertia", moments)


def _origin(element: Any, pose: Array) -> None:
    xyz, rpy = xyz_rpy(pose)
    etree.SubElement(element, "origin", xyz=xyz, rpy=rpy)


def _pose(place: Array, quaternion: Array) -> Array:
    return homogeneous(quaternion_to_rotation(quaternion), place)
