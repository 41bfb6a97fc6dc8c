"""Arms drawn at random: a URDF, and the position servos of its joints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.blind.motions import sizes
from thermal_robot.motion import Servo

GRAVITY = 9.81
TOOL = "tool"
_LINK = """<link name="link_{k}"><inertial><origin xyz="{x} {y} {half}" rpy="0 0 0"/><mass value="{mass}"/>
<inertia ixx="{across}" iyy="{across}" izz="{along}" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="joint_{k}" type="revolute"><parent link="{parent}"/><child link="link_{k}"/>
<origin xyz="0 0 {at}" rpy="0 0 0"/><axis xyz="{axis}"/>
<limit lower="-3.2" upper="3.2" effort="{effort}" velocity="10"/></joint>"""
_TOOL = """<link name="tool"/><joint name="to_tool" type="fixed"><parent link="{parent}"/><child link="tool"/>
<origin xyz="0 0 {at}" rpy="0 0 0"/></joint>"""


@dataclass(frozen=True, eq=False)
class Arm:
    """Serial arm that points straight up at zero joint angles, with its servos, SI.

    ``urdf`` its text; ``servos`` by joint; ``rated`` the largest payload at the tool, kg, that the torque limits of all
    joints hold with the arm stretched out level.
    """

    urdf: str
    servos: dict[str, Servo]
    rated: float

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints in the order of the chain."""
        return tuple(self.servos)


def draw_arm(rng: np.random.Generator, joints: int) -> Arm:
    """Draw a serial arm of cylindrical links; stiffness and torque limits are proportional to gravity's torques."""
    length, radius = rng.uniform(*sizes.LENGTH, joints), rng.uniform(*sizes.RADIUS, joints)
    mass = np.sort(_geometric(rng, sizes.MASS, joints))[::-1]
    beside = radius[:, None] * rng.uniform(-1.0, 1.0, (joints, 2))
    axes = _axes(rng, joints)
    torque, reach = _stretched(length, mass)
    kp = torque / _geometric(rng, sizes.DROOP, joints)
    kd, limit = kp * _geometric(rng, sizes.LAG, joints), torque * rng.uniform(*sizes.LIMIT, joints)
    parts, parent, at = ['<robot name="drawn"><link name="base"/>'], "base", 0.0
    for k in range(joints):
        inertia = {
            "across": mass[k] * (3 * radius[k] ** 2 + length[k] ** 2) / 12,
            "along": mass[k] * radius[k] ** 2 / 2,
        }
        place = {"x": beside[k, 0], "y": beside[k, 1], "half": length[k] / 2, "at": at}
        parts.append(
            _LINK.format(
                k=k + 1, mass=mass[k], parent=parent, effort=limit[k], axis=" ".join(axes[k]), **inertia, **place
            )
        )
        parent, at = f"link_{k + 1}", length[k]
    parts.append(f"{_TOOL.format(parent=parent, at=at)}</robot>")
    names = [f"joint_{k + 1}" for k in range(joints)]
    servos = {n: Servo(float(p), float(d), float(most)) for n, p, d, most in zip(names, kp, kd, limit, strict=True)}
    rated = float(np.min((limit - torque) / (GRAVITY * reach)))
    return Arm("\n".join(parts), servos, rated)


def _geometric(rng: np.random.Generator, between: tuple[float, float], count: int) -> Array:
    """Draw log-uniform random numbers (count,) between two bounds."""
    low, high = np.log(between)
    return np.asarray(np.exp(rng.uniform(float(low), float(high), count)))


def _axes(rng: np.random.Generator, joints: int) -> list[str]:
    """Draw joint axes as text, ``100``, ``010`` or ``001``: never z (along the links) twice in a row, nor z for all."""
    found: list[str] = []
    for _ in range(joints):
        allowed = ("100", "010") if found and found[-1] == "001" else ("100", "010", "001")
        found.append(str(rng.choice(allowed)))
    if all(axis == "001" for axis in found):
        found[-1] = "100"
    return found


def _stretched(length: Array, mass: Array) -> tuple[Array, Array]:
    """Gravity's torque (J,) on each joint of an arm stretched out level, N·m, and its distance to the tool (J,), m."""
    starts = np.concatenate([[0.0], np.cumsum(length)])
    middles = starts[:-1] + length / 2
    levers = np.clip(middles - starts[:-1, None], 0.0, None)
    return GRAVITY * (levers * mass).sum(axis=1), starts[-1] - starts[:-1]
