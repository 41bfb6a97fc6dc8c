"""How the target of a sound robot moves with each freedom that a fault may use, to first order: one pass a campaign."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from thermal_robot.blind.reality.rigid import rpy_matrix
from thermal_robot.blind.reality.world import Body, World

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Slopes:
    """Derivatives of the target's place in the root frame, M rows.

    Attributes
    ----------
    poses
        (M, 4, 4) of the sound robot's tool frame.
    target
        (3,) in it, m.
    joints
        (M, 3, n) by each joint that is commanded, with all that follow it.
    torque
        (M, n) what holds them, N·m.
    placements
        (M, 3, S', 6) by the placement of each joint of the chain, in its own frame.
    growth
        (M, 3, S) by the relative growth of each segment.
    bow, sag
        (M, 3, S, 2) by the curvature of each segment, 1/m, and by its bending compliance, 1/(N·m²).
    """

    poses: Array
    target: Array
    joints: Array
    torque: Array
    placements: Array
    growth: Array
    bow: Array
    sag: Array

    def place(self, body: Body) -> Array:
        """(M, 3) where the target is in the root frame as the instrument sees it, with what is wrong with the robot."""
        tool = body.tool[:, :3, :3] @ self.target + body.tool[:, :3, 3]
        seen = np.einsum("mij,mj->mi", self.poses[:, :3, :3], tool) + self.poses[:, :3, 3]
        seen += np.einsum("mij,mj->mi", self.joints, body.joints - body.springs * self.torque)
        seen += np.einsum("mis,ms->mi", self.growth, body.growth)
        seen += np.einsum("misk,msk->mi", self.bow, body.bow)
        seen += np.einsum("misk,sk->mi", self.sag, body.beams)
        twists = "sk" if body.placements.ndim == 2 else "msk"
        seen += np.einsum(f"misk,{twists}->mi", self.placements, body.placements)
        seen = np.einsum("mij,mj->mi", body.base[:, :3, :3], seen) + body.base[:, :3, 3]
        return np.asarray(seen * (1.0 + body.scale))


def slopes(world: World, q: Array, payload: Array, target: Array) -> Slopes:
    """Differentiate at (M, n) commands with (M,) payloads, kg; the target is in the tool frame, m."""
    model = copy(world.compile(True, None))  # its payload changes
    data = mujoco.MjData(model)
    address, nodes = world.address(model), world.nodes(model)
    tool, carried = model.body(f"link:{world.tool_frame}").id, model.body("payload").id
    rows, heaviness = [], np.nan
    for command, weight in zip(q, payload, strict=True):
        if weight != heaviness:
            heaviness = weight
            model.body_mass[carried] = weight
            mujoco.mj_setConst(model, data)
        data.qpos[:] = 0.0
        data.qpos[address] = world.coupling @ command + world.rest
        held = _held(model, data)
        point = data.xpos[tool] + data.xmat[tool].reshape(3, 3) @ target
        turn = np.empty((3, model.nv))
        mujoco.mj_jac(model, data, turn, None, point, tool)
        hinges = turn[:, nodes]
        rows.append(
            (
                _pose(data, tool),
                turn[:, address] @ world.coupling,
                held[address] @ world.coupling,
                *_placed(world, model, data, point),
                hinges.sum(axis=3) * world.pieces[:, None],
                -(hinges * held[nodes]).sum(axis=3) * world.pieces[:, None],
            )
        )
    poses, joints, torque, placements, growth, bow, sag = (np.stack(part) for part in zip(*rows, strict=True))
    return Slopes(poses, target, joints, torque, placements, growth, bow, sag)


def _held(model: mujoco.MjModel, data: mujoco.MjData) -> Array:
    """Return what holds every coordinate against gravity."""
    held = np.zeros(model.nv)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_rne(model, data, 0, held)
    return held


def _pose(data: mujoco.MjData, body: int) -> Array:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = data.xmat[body].reshape(3, 3), data.xpos[body]
    return pose


def _placed(world: World, model: mujoco.MjModel, data: mujoco.MjData, point: Array) -> tuple[Array, Array]:
    """(3, S', 6) and (3, S) by placements and by growth."""
    placements, growth = np.empty((3, len(world.chain), 6)), np.empty((3, len(world.segments)))
    for k, joint in enumerate(world.chain):
        carrier = _pose(data, model.body(f"link:{joint.parent}").id)
        frame = carrier[:3, :3] @ rpy_matrix(joint.rpy)
        lever = point - carrier[:3, 3] - carrier[:3, :3] @ joint.xyz
        placements[:, k, :3] = frame
        placements[:, k, 3:] = np.cross(frame.T, lever).T
        if k in world.segments:
            growth[:, world.segments.index(k)] = carrier[:3, :3] @ joint.xyz
    return placements, growth
