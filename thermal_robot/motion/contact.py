"""Quasi-static contact of the tool with a plane, along which it slides against Coulomb friction.

The force λ ≥ 0 along the plane's normal n holds the tool above it, less the flex κλ of plane and links: joints with
friction find it together, step by step (:func:`~thermal_robot.motion.servo.plane_forces`). It turns joints, springs of
the servos' compliances C = diag(c), by C Jᵀn λ, and a plane that is higher by d adds about d / (nᵀJ C Jᵀn + κ) to it.
Friction f in the plane, |f| ≤ μ λ, grows as the tool's compliance along the plane lets it, T C Tᵀ Δf = T Δ(q + C Jᵀn λ)
with T = (1 − n nᵀ) J, and returns to its circle where it would leave it (radial return: Simo and Hughes, *Computational
Inelasticity*, 1998). The joints yield by C (λ Jᵀn − Tᵀf).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.compiling import compiled
from thermal_robot.errors import RobotError
from thermal_robot.kinematics.frames import frame_jacobians, tool_poses
from thermal_robot.kinematics.model import leaf_links
from thermal_robot.robot import Robot, load_robot


class Ends:
    """Forward kinematics of what may touch a plane: the tool, and each leaf link that some ``joints`` move."""

    def __init__(self, robot: Robot, joints: Sequence[str]) -> None:
        self.up = -robot.gravity / max(float(np.linalg.norm(robot.gravity)), 1e-12)
        self._chains = [(robot, *_places(robot, joints))]
        for leaf in leaf_links(robot.urdf, robot.name):
            if leaf == robot.tool_frame:
                continue
            with suppress(RobotError):  # a link may have a chain that is no robot
                other = load_robot(robot.urdf, leaf, root_frame=robot.root_frame, gravity=robot.gravity)
                if (places := _places(other, joints))[0]:
                    self._chains.append((other, *places))

    def _each(self, q: Array) -> Array:
        """Heights (E, n), m, of all ends at positions (n, J); joints that are not in the log are at zero."""
        each = [tool_poses(robot, _whole(robot, own, at, q))[:, :3, 3] @ self.up for robot, own, at in self._chains]
        return np.array(each)

    def heights(self, q: Array) -> Array:
        """Height of the lowest end (n,), m, against gravity, at positions (n, J)."""
        return np.asarray(self._each(q).min(axis=0))

    def lowest(self, q: Array) -> tuple[Array, Array]:
        """Height of the lowest end (n,), m, and Jacobian (n, 3, J) of its position, at positions (n, J)."""
        found, each = np.zeros((len(q), 3, q.shape[1])), self._each(q)
        lowest = each.argmin(axis=0)
        for k, (robot, own, at) in enumerate(self._chains):
            rows = np.flatnonzero(lowest == k)
            told = np.zeros((len(rows), *found.shape[1:]))
            told[:, :, own] = frame_jacobians(robot, _whole(robot, own, at, q[rows]))[:, :3, at]
            found[rows] = told
        return each.min(axis=0), found


def _places(robot: Robot, joints: Sequence[str]) -> tuple[list[int], list[int]]:
    """Joints of a log that move an end, and their places in its chain."""
    own = [j for j, name in enumerate(joints) if name in robot.joint_names]
    return own, [robot.joint_names.index(joints[j]) for j in own]


def _whole(robot: Robot, own: list[int], at: list[int], q: Array) -> Array:
    found = np.zeros((len(q), robot.n))
    found[:, at] = q[:, own]
    return found


def _returned(grown, most, first, found, way, last):  # type: ignore[no-untyped-def]
    """Radial return: sum what friction has ``grown`` (n, 2) within circles (n,), and tell where it slid ``last`` (n,).

    And which ``way`` (n, 2) there.
    """
    for k in range(len(most)):
        x, y = grown[k, 0], grown[k, 1]
        if not first[k]:
            x, y, last[k] = x + found[k - 1, 0], y + found[k - 1, 1], last[k - 1]
            way[k, 0], way[k, 1] = way[k - 1, 0], way[k - 1, 1]
        size = math.hypot(x, y)
        if size > most[k]:
            way[k, 0], way[k, 1], last[k] = x / size, y / size, k
            x, y = most[k] * way[k, 0], most[k] * way[k, 1]
        found[k, 0], found[k, 1] = x, y


@cache
def _kernel() -> Any:
    return compiled(_returned)


def contact_yields(
    q: Array, tool: Array, up: Array, force: Array, first: NDArray[np.bool_], soft: Array, friction: float, flex: float,
) -> tuple[Array, ...]:  # fmt: skip
    """Return what J joints yield to contact in n instants, rad, and its derivatives by height, friction and flex.

    Parameters
    ----------
    q
        (n, J) rad: where the joints would be without the plane.
    tool
        (n, 3, J) Jacobian of the tool's position.
    up
        (3,) normal of the plane, away from it.
    force
        (n,) N along the normal.
    first
        (n,) instants in which the tool begins to touch; the others follow the one before.
    soft
        (J,) compliances, rad/(N·m).
    friction
        Coulomb's coefficient.
    flex
        Compliance of plane and links together, m/N.
    """
    slope = up @ tool
    stiff = 1.0 / np.maximum((soft * slope**2).sum(axis=1) + flex, 1e-12)
    plane = np.linalg.svd(up[None])[2][1:]  # two directions along it
    along = plane @ tool
    turned = along * np.sqrt(soft)
    yielding = turned @ np.swapaxes(turned, 1, 2) + 1e-12 * np.eye(2)
    rested = q + soft * slope * force[:, None]
    step = np.einsum("nij,nj->ni", along, np.diff(rested, axis=0, prepend=rested[:1]))
    step[first] = 0.0
    rubbed, way, last = np.zeros_like(step), np.zeros_like(step), np.zeros(len(force), dtype=np.int64)
    _kernel()(np.linalg.solve(yielding, step[:, :, None])[:, :, 0], friction * force, first, rubbed, way, last)

    def yielded(push: Array, drag: Array) -> Array:
        return np.asarray(soft * (np.einsum("ni,nij->nj", drag, along) - push[:, None] * slope))

    return (
        yielded(force, rubbed),
        yielded(stiff, friction * stiff[last, None] * way),
        yielded(np.zeros_like(force), force[last, None] * way),
        yielded(-force * stiff, -friction * (force * stiff)[last, None] * way),
    )
