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
    """Bias torques (2, n, J), N·m, mass matrices, and derivatives of the torques by position and by velocity.

    The first of the two is of the model, the second of 1 kg of payload. ``inertia``, kg·m², ``slope``, N·m/rad, and
    ``drag``, N·m·s/rad, are (2, n, J, J), or (2, n, J) where they hold the matrices' diagonals alone.
    """

    torque: Array
    inertia: Array
    slope: Array
    drag: Array


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
        self.models = [model, model.copy()]
        self.models[1].inertias[frame.parentJoint] += pin.Inertia(1.0, com, np.zeros((3, 3)))
        self._pools = [pin.ModelPool(one, threads()) for one in self.models]

    def configurations(self, q: Array) -> Array:
        """(nq, n) Pinocchio's configurations of the joints' positions (n, J)."""
        whole = np.repeat(pin.neutral(self.model)[:, None], len(q), axis=1)
        for value, (at, width) in zip(q.T, self._q, strict=True):
            whole[at : at + width] = value if width == 1 else (np.cos(value), np.sin(value))
        return np.asfortranarray(whole)

    def along(self, q: Array, v: Array) -> Loads:
        """Return what loads the joints at configurations and velocities (n, J) without acceleration."""
        shape = 2, len(q), len(self.at)
        found = Loads(np.empty(shape), *(np.empty((*shape, shape[-1])) for _ in range(3)))
        own, still = np.ix_(self.at, self.at), np.zeros(self.model.nv)
        every, speed = self.configurations(q), np.zeros((self.model.nv, len(q)), order="F")
        speed[self.at] = v.T
        for k, model in enumerate(self.models):
            data = model.createData()
            for n in range(len(q)):
                slope, drag, mass = pin.computeRNEADerivatives(model, data, every[:, n], speed[:, n], still)
                found.torque[k, n], found.inertia[k, n] = data.tau[self.at], mass[own]
                found.slope[k, n], found.drag[k, n] = slope[own], drag[own]
        found.inertia[:] = np.triu(found.inertia) + np.triu(found.inertia, 1).swapaxes(2, 3)  # the upper half is set
        for one in (found.torque, found.inertia, found.slope, found.drag):
            one[1] -= one[0]
        return found

    def at_rest(self, q: Array) -> Loads:
        """Return what loads the joints at rest along configurations (n, J), of matrices the diagonals.

        They are computed a small turn apart, and linear between. In memory a joint's follow each other.
        """
        way = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(q, axis=0)).max(axis=1))])
        apart = np.flatnonzero(np.diff(np.floor(way / settings.LOAD_STEP), prepend=-1.0, append=np.inf)[:-1])
        apart = np.union1d(np.union1d(apart, np.maximum(apart - 1, 0)), [len(q) - 1])
        few = self.along(q[apart], np.zeros((len(apart), q.shape[1])))
        own = (few.torque, *(np.diagonal(one, axis1=2, axis2=3) for one in (few.inertia, few.slope)))
        torque, inertia, slope = (_between(way, way[apart], one) for one in own)
        return Loads(torque, inertia, slope, np.zeros(slope.shape))

    def torques(self, q: Array, v: Array, a: Array) -> Array:
        """(2, n, J) torques, N·m, of the model and of 1 kg of payload, at positions, velocities and accelerations."""
        first, second = (self._torques(k, q, v, a) for k in (0, 1))
        return np.stack([first, second - first])

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
    """Linear interpolation of values (k, n', J) known at places ``at`` of a way (n,), rising."""
    found = np.empty((len(values), values.shape[2], len(way)))
    for row, known in zip(found, values, strict=True):
        for one, column in zip(row, known.T, strict=True):
            one[:] = np.interp(way, at, column)
    return found.transpose(0, 2, 1)


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
