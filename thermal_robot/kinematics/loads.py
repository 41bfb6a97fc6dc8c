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
    """Joint torques and own inertias (2, n, J) of J joints along n configurations, N·m and kg·m², and slopes, N·m/rad.

    The first of the two is of the model, the second of 1 kg of payload; ``slope`` (n, J): derivative of the model's
    static torque by the joint's own position.
    """

    torque: Array
    inertia: Array
    slope: Array

    def towards(self, other: Loads, share: float) -> Loads:
        """Interpolate linearly: the loads a ``share`` of the way from these to the others."""
        pairs = ((self.torque, other.torque), (self.inertia, other.inertia), (self.slope, other.slope))
        return Loads(*(one + share * (two - one) for one, two in pairs))


class Dynamics:
    """Rigid-body dynamics of some joints of a URDF, the others held at zero.

    ``payload`` (3,) m is the centre of mass of a payload in the tool frame.
    """

    def __init__(self, urdf: str, joints: Sequence[str], tool_frame: str, gravity: Array, payload: Array) -> None:
        model = pin.buildModelFromXML(urdf)
        others = [j for j, name in enumerate(model.names) if j and name not in joints]
        model = held_at(model, others, pin.neutral(model))
        model.gravity.linear = np.asarray(gravity)
        self.model, self.data = model, model.createData()
        ids = [model.getJointId(name) for name in joints]
        self.at = [model.joints[j].idx_v for j in ids]
        self._q = [(model.joints[j].idx_q, model.joints[j].nq) for j in ids]
        frame = model.frames[model.getFrameId(tool_frame, pin.FrameType.BODY)]
        com = frame.placement.act(payload)
        bodies = {model.names[j]: model.inertias[j] for j in range(1, model.njoints) if model.inertias[j].mass > 0.0}
        self.bodies: dict[str, Array] = {name: one.toDynamicParameters() for name, one in bodies.items()}
        models = [model, model.copy()]
        models[1].inertias[frame.parentJoint] += pin.Inertia(1.0, com, np.zeros((3, 3)))
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

    def inertial(self, q: Array, v: Array, a: Array) -> Array:
        """Regressor (n, J, bodies, 10) of joint torques by the inertial parameters of bodies, in Pinocchio's order.

        Mass, first moment, and second moment about the joint's frame: xx, xy, yy, xz, yz, zz. All torques are linear in
        them.
        """
        speed, rate = (np.zeros((len(q), self.model.nv)) for _ in range(2))
        speed[:, self.at], rate[:, self.at] = v, a
        found = np.empty((len(q), len(self.at), self.model.njoints - 1, 10))
        for out, one, *motion in zip(found, self.configurations(q).T, speed, rate, strict=True):
            whole: Any = pin.computeJointTorqueRegressor(self.model, self.data, one, *motion)
            out[:] = whole[self.at].reshape(out.shape)
        return found[:, :, [self.model.getJointId(name) - 1 for name in self.bodies]]


def _between(way: Array, at: Array, values: Array) -> Array:
    """Linear interpolation of values (…, n', J) known at places ``at`` of a way (n,), rising."""
    right = np.clip(np.searchsorted(at, way), 1, len(at) - 1)
    width = at[right] - at[right - 1]
    part = np.clip((way - at[right - 1]) / np.where(width > 0.0, width, 1.0), 0.0, 1.0)[:, None]
    return np.asarray((1.0 - part) * values[..., right - 1, :] + part * values[..., right, :])


def pseudo_inertia(mass: float, centre: Array, inertia: Array) -> Array:
    """(4, 4) pseudo-inertia of a mass, kg, with its centre (3,), m, and inertia about it (3, 3), kg·m²."""
    return np.asarray(pin.PseudoInertia.FromInertia(pin.Inertia(mass, np.asarray(centre), inertia)).toMatrix())


def pseudo_inertia_of(numbers: Array) -> Array:
    """(4, 4) pseudo-inertia of ten inertial parameters (10,) about the frame's origin, in Pinocchio's order."""
    return np.asarray(pin.PseudoInertia.FromDynamicParameters(numbers).toMatrix())


def at_centre(whole: Array) -> tuple[float, Array, Array]:
    """Return mass, kg, centre (3,), m, and inertia about it (3, 3), kg·m², of a pseudo-inertia (4, 4)."""
    found = pin.PseudoInertia.FromMatrix(whole).toInertia()
    return float(found.mass), np.asarray(found.lever), np.asarray(found.inertia)
