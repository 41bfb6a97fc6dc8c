"""Loads of the joints along a motion, by Pinocchio: gravity, the other joints' motion, and what masses add."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin

from thermal_robot.arrays import Array
from thermal_robot.compiling import threads
from thermal_robot.kinematics import settings
from thermal_robot.kinematics.model import held_at


@dataclass(frozen=True, eq=False)
class Loads:
    """Joint torques and inertias (k, n, J) along n configurations, N·m and kg·m²; slope (n, J) of the first, N·m/rad.

    The first of the k is that of the model; then that of 1 kg of payload; then, where asked for, of each link that of
    its whole mass and of 1 kg·m along each of its axes.
    """

    torque: Array
    inertia: Array
    slope: Array

    def towards(self, other: Loads, share: float) -> Loads:
        """Return loads a share of the way to others."""
        pairs = ((self.torque, other.torque), (self.inertia, other.inertia), (self.slope, other.slope))
        return Loads(*(one + share * (two - one) for one, two in pairs))


class Dynamics:
    """Rigid-body dynamics of some joints of a URDF, the others held at zero.

    ``payload`` (3,) m is the centre of mass of a payload in the tool frame; with ``masses`` those of links count, too.
    """

    def __init__(
        self, urdf: str, joints: Sequence[str], tool_frame: str, gravity: Array, payload: Array, masses: bool
    ) -> None:
        model = pin.buildModelFromXML(urdf)
        others = [j for j, name in enumerate(model.names) if j and name not in joints]
        model = held_at(model, others, pin.neutral(model))
        model.gravity.linear = np.asarray(gravity)
        self.model, self.data = model, model.createData()
        ids = [model.getJointId(name) for name in joints]
        self.at = [model.joints[j].idx_v for j in ids]
        self._q = [(model.joints[j].idx_q, model.joints[j].nq) for j in ids]
        self.frame = model.getFrameId(tool_frame, pin.FrameType.BODY)
        frame = model.frames[self.frame]
        com = frame.placement.act(payload)
        self.bodies = [model.names[j] for j in range(1, model.njoints) if model.inertias[j].mass > 0.0]
        models = [model, model.copy()]
        models[1].inertias[frame.parentJoint] += pin.Inertia(1.0, com, np.zeros((3, 3)))
        for name in self.bodies if masses else ():
            j = model.getJointId(name)
            heavier = model.copy()
            heavier.inertias[j] += model.inertias[j]
            models.append(heavier)
            for axis in np.eye(3):  # two opposite masses a metre apart each way: a first moment alone
                moved = model.copy()
                moved.inertias[j] = _with_moment(model.inertias[j], axis)
                models.append(moved)
        self._pools = [pin.ModelPool(one, threads()) for one in models]

    def configurations(self, q: Array) -> Array:
        """(nq, n) Pinocchio's configurations of the joints' positions (n, J)."""
        whole = np.repeat(pin.neutral(self.model)[:, None], len(q), axis=1)
        for value, (at, width) in zip(q.T, self._q, strict=True):
            whole[at : at + width] = value if width == 1 else (np.cos(value), np.sin(value))
        return np.asfortranarray(whole)

    def along(self, q: Array, v: Array | None = None, a: Array | None = None, whole: bool = False) -> Loads:
        """Return the loads along configurations (n, J), at rest unless velocities and accelerations are given.

        At rest they are computed a small turn apart, and linear between. A joint's own acceleration is not in them, as
        it is the servo's business, unless they are ``whole``.
        """
        if v is None and len(q) > 1:
            way = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(q, axis=0)).max(axis=1))])
            apart = np.flatnonzero(np.diff(np.floor(way / settings.LOAD_STEP), prepend=-1.0, append=np.inf)[:-1])
            apart = np.union1d(np.union1d(apart, np.maximum(apart - 1, 0)), [len(q) - 1])
            if len(apart) < len(q) // 2:
                few, at = self.along(q[apart]), way[apart]
                return Loads(*(_between(way, at, one) for one in (few.torque, few.inertia, few.slope)))
        rest, joints = np.zeros_like(q), range(q.shape[1])
        v, a = rest if v is None else v, rest if a is None else a
        units = [np.broadcast_to(np.arange(len(joints)) == j, q.shape).astype(float) for j in joints]
        each = [self._torques(k, q, v, a) for k in range(len(self._pools))]
        torque = np.stack([each[0], *(one - each[0] for one in each[1:])])
        if whole:
            return Loads(torque, np.zeros_like(torque), rest)
        inertia, still = np.zeros_like(torque), [self._torques(k, q, rest, rest) for k in (0, 1)]
        for j in joints:
            one, more = (self._torques(k, q, rest, units[j])[:, j] - still[k][:, j] for k in (0, 1))
            inertia[0, :, j], inertia[1, :, j] = one, more - one
        torque[:2] -= inertia[:2] * a
        step = settings.ANGLE_STEP
        moved = [self._torques(0, q + step * units[j], rest, rest)[:, j] - still[0][:, j] for j in joints]
        return Loads(torque, inertia, np.stack(moved, axis=1) / step)

    def _torques(self, k: int, q: Array, v: Array, a: Array) -> Array:
        """(n, J) torques of the k-th model by the recursive Newton-Euler algorithm."""
        speed, rate, found = (np.zeros((self.model.nv, len(q)), order="F") for _ in range(3))
        speed[self.at], rate[self.at] = v.T, a.T
        pin.rneaInParallel(threads(), self._pools[k], self.configurations(q), speed, rate, found)
        return found[self.at].T.copy()

    def heights(self, q: Array, up: Array) -> tuple[Array, Array]:
        """Height of the tool (n,), m, along ``up``, and its derivative (n, J) by each joint, m/rad."""
        model, data = self.model, self.data
        height, slope = np.empty(len(q)), np.empty(q.shape)
        for i, whole in enumerate(self.configurations(q).T):
            jacobian: Any = pin.computeFrameJacobian(model, data, whole, self.frame, pin.LOCAL_WORLD_ALIGNED)
            height[i] = up @ data.oMf[self.frame].translation
            slope[i] = up @ jacobian[:3, self.at]
        return height, slope


def _with_moment(inertia: pin.Inertia, moment: Array) -> pin.Inertia:
    """Return an inertia with a first moment more, kg·m, its mass and its second moment about the origin as before."""
    numbers = inertia.toDynamicParameters()
    numbers[1:4] += moment
    return pin.Inertia.FromDynamicParameters(numbers)


def _between(way: Array, at: Array, values: Array) -> Array:
    """Linear interpolation of values (…, n', J) known at places ``at`` of a way (n,), rising."""
    right = np.clip(np.searchsorted(at, way), 1, len(at) - 1)
    width = at[right] - at[right - 1]
    part = np.clip((way - at[right - 1]) / np.where(width > 0.0, width, 1.0), 0.0, 1.0)[:, None]
    return np.asarray((1.0 - part) * values[..., right - 1, :] + part * values[..., right, :])
