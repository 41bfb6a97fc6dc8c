"""Pinocchio engine for small batches: one call for each configuration, on a cached model."""

from __future__ import annotations

import threading
from collections.abc import Iterable
from weakref import WeakKeyDictionary

import numpy as np
import pinocchio as pin

from thermal_robot.arrays import Array
from thermal_robot.kinematics.lanes import Chained, arm_of
from thermal_robot.kinematics.model import FIXED, REVOLUTE, Chain

_ALONG = {
    (True, 0): pin.JointModelRX,
    (True, 1): pin.JointModelRY,
    (True, 2): pin.JointModelRZ,
    (False, 0): pin.JointModelPX,
    (False, 1): pin.JointModelPY,
    (False, 2): pin.JointModelPZ,
}


_UPRIGHT = 1e-14
"""rad; angle to gravity below which an axis counts as parallel, so that its torque, else a rounding error, is zero."""


class _Own:
    """Pinocchio model of a chain with its work data; its world is the root frame, every joint has one coordinate.

    Where it is ``placed`` every segment is a joint, fixed ones too, which stay at zero: Pinocchio's kinematic regressor
    knows the placements of joints only.
    """

    def __init__(self, chain: Chain, placed: bool) -> None:
        self.model, self.plain, self.coupling = pin.Model(), arm_of(chain).plain, chain.coupling
        joint, here = 0, pin.SE3.Identity()
        joint_of = {int(k): j for j, k in enumerate(chain.movable)}
        segments = set(chain.placed.tolist())
        places = [pin.SE3(r, t) for r, t in zip(chain.rotations, chain.translations, strict=True)]
        for k, place in enumerate(places):
            here = here * place
            if k in joint_of or (placed and k in segments):
                joint = self.model.addJoint(joint, _joint(chain, k), here, str(k))
                here = pin.SE3.Identity()
            if k in joint_of:
                body = pin.Inertia(float(chain.masses[joint_of[k]]), chain.mass_centres[joint_of[k]], np.zeros((3, 3)))
                after = places[k + 1] if k + 1 < len(places) else pin.SE3.Identity()
                self.model.appendBodyToJoint(joint, body, after)
        self.end = here
        self.tool, self.point = (
            self.model.addFrame(pin.Frame(name, joint, 0, here, pin.FrameType.OP_FRAME)) for name in ("tool", "point")
        )
        self.data = self.model.createData()
        self.moves = np.flatnonzero(np.isin(chain.placed, chain.movable)) if placed else np.arange(len(chain.movable))
        self.pull: Array | None = None
        self.idle = False

    def joints(self, q: Array) -> Array:
        """Pinocchio configurations (N, nq) from joint positions (N, n): mimics follow, fixed segments are at zero."""
        if not self.plain:
            q = self.coupling.positions(q)
        if self.model.nq == q.shape[1]:
            return q
        rows = np.zeros((len(q), self.model.nq))
        rows[:, self.moves] = q
        return rows

    def frames_at(self, point: Array | None, rows: int) -> Iterable[int]:
        """Index of an operational frame for each row: the tool's, or one moved to the row's point, (3,) or (N, 3) m."""
        if point is None:
            return [self.tool] * rows
        if point.ndim == 2:
            return map(self._placed_at, point)
        return [self._placed_at(point)] * rows

    def _placed_at(self, point: Array) -> int:
        self.model.frames[self.point].placement = self.end * pin.SE3(np.eye(3), point)
        number: int = self.point
        return number


class _Kept(threading.local):
    """Per-thread cache of models by chain, with movable joints only and with all segments as joints."""

    def __init__(self) -> None:
        self.models: tuple[WeakKeyDictionary[Chain, _Own], ...] = (WeakKeyDictionary(), WeakKeyDictionary())


_kept = _Kept()


def _own(chain: Chain, placed: bool = False) -> _Own:
    models = _kept.models[placed]
    found = models.get(chain)
    if found is None:
        found = models[chain] = _Own(chain, placed)
    return found


def _joint(chain: Chain, k: int) -> pin.JointModel:
    axis = chain.axes[k] if chain.kinds[k] != FIXED else np.array([1.0, 0.0, 0.0])
    turns = chain.kinds[k] == REVOLUTE
    w = int(np.argmax(axis))
    if axis[w] == 1.0 and np.count_nonzero(axis) == 1:
        return _ALONG[turns, w]()
    return pin.JointModelRevoluteUnaligned(axis) if turns else pin.JointModelPrismaticUnaligned(axis)


def poses(robot: Chained, q: Array, out: Array) -> None:
    """Write the forward kinematics of the tool, homogeneous matrices (N, 4, 4)."""
    own = _own(robot.chain)
    model, data, tool = own.model, own.data, own.tool
    for i, row in enumerate(own.joints(q)):
        pin.forwardKinematics(model, data, row)
        out[i] = pin.updateFramePlacement(model, data, tool).homogeneous


def jacobians(robot: Chained, q: Array, out: Array, point: Array | None) -> None:
    """Write the geometric Jacobian (N, 6, n) at a point of the tool, linear rows first, root axes."""
    own = _own(robot.chain)
    model, data, plain = own.model, own.data, own.plain
    frames = own.frames_at(point, len(q))
    for i, (row, frame) in enumerate(zip(own.joints(q), frames, strict=True)):
        found = pin.computeFrameJacobian(model, data, row, frame, pin.LOCAL_WORLD_ALIGNED)
        if found.ndim == 1:  # of one joint Pinocchio gives a vector
            found = found[:, None]
        out[i] = found if plain else found @ own.coupling.matrix


def placements(robot: Chained, q: Array, out: Array, point: Array | None) -> None:
    """Write the kinematic regressor (N, 6, S, 6): twist of a point of the tool per unit twist of each placement."""
    own = _own(robot.chain, placed=True)
    model, data, shape = own.model, own.data, out.shape[1:]
    for i, (row, frame) in enumerate(zip(own.joints(q), own.frames_at(point, len(q)), strict=True)):
        pin.forwardKinematics(model, data, row)
        found = pin.computeFrameKinematicRegressor(model, data, frame, pin.LOCAL_WORLD_ALIGNED)
        out[i] = found.reshape(shape)


def gravity(robot: Chained, q: Array, out: Array, com: Array, mass: Array) -> None:
    """Write generalized gravity (N, n), N·m or N, of arm and payload of mass () or (N,) kg at ``com`` on the tool."""
    own = _own(robot.chain)
    model, data = own.model, own.data
    if own.pull is not robot.gravity:
        model.gravity.linear = own.pull = robot.gravity
        own.idle = _turning_about(own, robot)
    for i, row in enumerate(own.joints(q)):
        found = pin.computeGeneralizedGravity(model, data, row)
        out[i] = found if own.plain else found @ own.coupling.matrix
    if mass.ndim or mass:
        lift = np.empty((len(q), 6, robot.n))
        jacobians(robot, q, lift, com)
        out -= mass[..., None] * (robot.gravity @ lift[:, :3])
    if own.idle:
        out[:, 0] = 0.0


def _turning_about(own: _Own, robot: Chained) -> bool:
    """Whether the first joint is revolute and its axis parallel to gravity, so that its torque is exactly zero."""
    chain = robot.chain
    first = int(chain.movable[0])
    if not own.plain or chain.kinds[first] != REVOLUTE:
        return False
    axis = own.model.jointPlacements[1].rotation @ chain.axes[first]
    return bool(np.linalg.norm(np.cross(axis, robot.gravity)) <= _UPRIGHT * np.linalg.norm(robot.gravity))
