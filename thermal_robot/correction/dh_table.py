"""The calibrated robot as parameters of Denavit and Hartenberg: what many controllers hold instead of a URDF.

From the axis of a joint to the next one four numbers lead where the two are not parallel: a turn θ about the axis, a
shift d along it, the distance a along the common normal and the twist α about it (Denavit and Hartenberg, *J. Appl.
Mech.* 22, 1955). Of nearly parallel axes the common normal lies anywhere; there d is left out and a turn β across both
comes after α (Hayati and Mirmirani, *Journal of Robotic Systems* 2, 1985):

    base · Π_i [Rz(θ_i + q_i) Tz(d_i) Tx(a_i) Rx(α_i) Ry(β_i)] · tool

with q_i added to d_i where the joint slides. In Craig's modified convention a, α and β stand in the row of the joint
that they lead to: base · Π_i [Tx(a_i) Rx(α_i) Ry(β_i) Rz(θ_i + q_i) Tz(d_i)] · tool, which is the same product.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.campaign import Units
from thermal_robot.correction.calibrated import Calibrated
from thermal_robot.errors import CampaignError
from thermal_robot.kinematics import Displacement, rotation_to_rpy
from thermal_robot.kinematics.model import PRISMATIC

if TYPE_CHECKING:
    import pandas as pd

Convention: TypeAlias = Literal["standard", "modified"]

CONVENTIONS = ("standard", "modified")
"""Of the table: Denavit and Hartenberg's own, and Craig's (*Introduction to Robotics*, 1986)."""
NEARLY_PARALLEL = 0.1
"""Sine of the angle of two axes below which β takes the place of d: as where the errors of axes are told."""
_DUST = 1e-14
"""rad, m."""
_ANGLES, _LENGTHS = ("theta", "alpha", "beta", "roll", "pitch", "yaw"), ("d", "a", "x", "y", "z")


def dh_table(robot: Calibrated, convention: Convention = "standard", units: Units | None = None) -> pd.DataFrame:
    """Return the parameters of Denavit and Hartenberg of the calibrated robot.

    Parameters
    ----------
    robot
        The calibrated robot.
    convention
        ``standard`` or ``modified``; the module's docstring has the equation of each.
    units
        Of the angles and lengths; rad and m where absent.

    Returns
    -------
    pandas.DataFrame
        A row for the base, one for each joint that moves, from the root on, and one for the tool, which leads to the
        measured target. ``joint`` is its name; ``type`` is ``base``, ``tool``, ``revolute`` or ``prismatic``;
        ``follows`` and ``multiplier`` say of which joint's command q is how many times, a joint that mimics another
        included. Angles ``theta``, ``alpha``, ``beta`` and lengths ``d``, ``a`` belong to joints, ``x y z`` and ``roll
        pitch yaw`` (about fixed axes, as in a URDF) to base and tool. Each name has its unit, as ``a [mm]``.

    Raises
    ------
    CampaignError
        If there is no such convention.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> from thermal_robot.correction import calibrated, dh_table
    >>> table = dh_table(calibrated(tr.diagnose(tr.demo_campaign()).model, temperature=26.0))
    >>> list(table["joint"])
    ['base_link', 'joint_1', 'joint_2', 'joint_3', 'joint_4', 'joint_5', 'tool0']
    """
    import pandas as pd

    if convention not in CONVENTIONS:
        raise CampaignError("convention", "is unknown", found=repr(convention), expected=" or ".join(CONVENTIONS))
    units = units or Units()
    nominal = replace(
        robot, displacement=Displacement(np.zeros(robot.robot.n), np.zeros((len(robot.robot.segments), 6)))
    )
    base, joints, tool = _parameters(robot, _parameters(nominal)[1])
    if convention == "modified":
        # (a, α, β) lead to the next joint; nothing leads to the first one, and nothing comes behind the last
        joints[:, 2:] = np.vstack([np.zeros(3), joints[:-1, 2:]])
    chain, coupling = robot.robot.chain, robot.robot.chain.coupling
    rows: list[dict[str, object]] = [{"joint": robot.robot.root_frame, "type": "base", **_as_pose(base)}]
    for j, k in enumerate(chain.movable):
        leader = coupling.leader(j)
        kind = "prismatic" if chain.kinds[k] == PRISMATIC else "revolute"
        follows = "" if leader is None else robot.robot.joint_names[leader]
        times = 0.0 if leader is None else float(coupling.matrix[j, leader])
        numbers = dict(zip(("theta", "d", "a", "alpha", "beta"), joints[j].tolist(), strict=True))
        rows.append({"joint": chain.names[k], "type": kind, "follows": follows, "multiplier": times, **numbers})
    rows.append({"joint": robot.robot.tool_frame, "type": "tool", **_as_pose(tool)})
    order = ["joint", "type", "follows", "multiplier", "theta", "d", "a", "alpha", "beta"]
    table = pd.DataFrame(rows)[[*order, "x", "y", "z", "roll", "pitch", "yaw"]]
    scales = {**dict.fromkeys(_ANGLES, units.angle_scale), **dict.fromkeys(_LENGTHS, units.length_scale)}
    names = {**dict.fromkeys(_ANGLES, units.angle), **dict.fromkeys(_LENGTHS, units.length)}
    for name, scale in scales.items():
        # what rounding leaves of a zero is no figure of a robot
        table[name] = table[name].where(~(table[name].abs() < _DUST), 0.0) / scale
    table.insert(0, "convention", convention)
    return table.rename(columns={name: f"{name} [{unit}]" for name, unit in names.items()})


def _parameters(robot: Calibrated, like: Array | None = None) -> tuple[Array, Array, Array]:
    """Return (4, 4) the base, (M, 5) θ, d, a, α, β of each joint, and (4, 4) the tool; m and rad.

    A common normal has two senses: that of the table ``like``, or that with the distance a not negative.
    """
    chain, rest = robot.robot.chain, robot.robot.chain.coupling.offset
    poses, pose = [], np.eye(4)
    for placement in robot.placements:
        pose = pose @ placement
        poses.append(pose)
    end = pose @ robot.target
    lines = [(poses[k][:3, 3], poses[k][:3, :3] @ chain.axes[k]) for k in chain.movable]
    frame = _first(*lines[0])
    base, rows = frame, []
    for j in range(len(lines)):
        slides = chain.kinds[chain.movable[j]] == PRISMATIC
        offset = np.array([0.0 if slides else rest[j], rest[j] if slides else 0.0, 0.0, 0.0, 0.0])
        if j + 1 == len(lines):
            row = _last(frame, end)
        else:
            row = _to_next(frame, lines[j + 1])
            if like is not None and np.cos(row[0] + offset[0] - like[j, 0]) < 0.0:
                # the same link by the other sense of the common normal
                row = np.array([row[0] + np.pi, row[1], -row[2], -row[3], -row[4]])
        frame = frame @ link(*row)
        rows.append(row + offset)
    return base, np.array(rows), np.linalg.inv(frame) @ end


def link(theta: float, d: float, a: float, alpha: float, beta: float) -> Array:
    """(4, 4) motion from one axis to the next: Rz(θ) Tz(d) Tx(a) Rx(α) Ry(β)."""
    pose = _turned(2, theta)
    pose[:3, 3] = pose[:3, :3] @ np.array([a, 0.0, d])
    pose[:3, :3] = (pose @ _turned(0, alpha) @ _turned(1, beta))[:3, :3]
    return pose


def _turned(axis: int, angle: float) -> Array:
    pose, (one, other) = np.eye(4), [k % 3 for k in (axis + 1, axis + 2)]
    pose[one, one] = pose[other, other] = np.cos(angle)
    pose[other, one] = np.sin(angle)
    pose[one, other] = -np.sin(angle)
    return pose


def _first(point: Array, axis: Array) -> Array:
    """(4, 4) frame on the first axis, z along it: at the foot of the root frame's origin, x as the root's is."""
    frame = np.eye(4)
    along = np.eye(3)[0] if abs(axis[0]) < 1.0 - NEARLY_PARALLEL else np.eye(3)[1]
    x = along - (along @ axis) * axis
    x /= np.linalg.norm(x)
    frame[:3, :3] = np.column_stack([x, np.cross(axis, x), axis])
    frame[:3, 3] = point - (point @ axis) * axis
    return frame


def _to_next(frame: Array, line: tuple[Array, Array]) -> Array:
    """(5,) θ, d, a, α, β from a frame on one axis to the axis after it, a point and a direction in the root frame."""
    origin = frame[:3, :3].T @ (line[0] - frame[:3, 3])
    axis = frame[:3, :3].T @ line[1]
    across = float(np.hypot(axis[0], axis[1]))
    if across < NEARLY_PARALLEL:
        # where the axis goes through the plane across this one; then α and β turn z to it
        foot = origin - axis * (origin[2] / axis[2])
        a = float(np.hypot(foot[0], foot[1]))
        theta = float(np.arctan2(foot[1], foot[0])) if a > 0.0 else 0.0
        seen = _turned(2, theta)[:3, :3].T @ axis
        # Rx(α) Ry(β) z = (sin β, −sin α cos β, cos α cos β)
        alpha = float(np.arctan2(-seen[1], seen[2]))
        beta = float(np.arctan2(seen[0], np.hypot(seen[1], seen[2])))
        return np.array([theta, 0.0, a, alpha, beta])
    # the common normal is along z × axis; of its two senses that with the distance a not negative
    normal = np.array([-axis[1], axis[0], 0.0]) / across
    a = float(origin @ normal)
    normal, a = (-normal, -a) if a < 0.0 else (normal, a)
    theta = float(np.arctan2(normal[1], normal[0]))
    d = float(origin[2] - axis[2] * (origin[:2] @ axis[:2]) / across**2)
    seen = _turned(2, theta)[:3, :3].T @ axis
    return np.array([theta, d, a, float(np.arctan2(-seen[1], seen[2])), 0.0])


def _last(frame: Array, end: Array) -> Array:
    """(5,) θ and d of the last joint, which bring its frame to the foot of the target, x turned as the target's is."""
    seen = np.linalg.inv(frame) @ end
    across = seen[:2, 0] if np.linalg.norm(seen[:2, 0]) > NEARLY_PARALLEL else seen[:2, 1]
    return np.array([float(np.arctan2(across[1], across[0])), seen[2, 3], 0.0, 0.0, 0.0])


def _as_pose(pose: Array) -> dict[str, float]:
    numbers = [*pose[:3, 3].tolist(), *rotation_to_rpy(pose[:3, :3]).tolist()]
    return dict(zip(("x", "y", "z", "roll", "pitch", "yaw"), numbers, strict=True))
