"""Causes that no library knows, as nasty as life: frozen before anything that looks for them was tuned."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from thermal_robot.blind.reality.elusive import ELUSIVE, INTERPLAY
from thermal_robot.blind.reality.fault import Fault, Place, clock, joints, milli, one, own_position, part, within
from thermal_robot.blind.reality.rigid import rpy_matrix
from thermal_robot.blind.reality.setting import Setting
from thermal_robot.blind.reality.world import Body, World

Array = NDArray[np.float64]


GRAVITY = ("gravity.x", "gravity.y", "gravity.z")
"""Gravity's direction in the tool frame: a quantity that nobody records and anybody can compute."""


def _slip(body: Body, setting: Setting, values: Array) -> None:
    """A toothed belt jumps: from one moment on the joint is elsewhere."""
    late = setting.time[:, None] > values[:, 1] * setting.time[-1]
    body.joints += values[:, 0] * late


def _cable(body: Body, setting: Setting, values: Array) -> None:
    """A cable comes taut where the joint has turned far enough, and pulls it back the more the farther it goes."""
    body.joints -= values[:, 0] * np.maximum(setting.q - values[:, 1], 0.0)


def _hose(body: Body, setting: Setting, values: Array) -> None:
    """A hose along the arm: the joint before bends it, and it pushes this one."""
    before = np.roll(setting.q, 1, axis=1)
    body.joints += values[:, 0] * (before - values[:, 1]) ** 2


def _hot_motor(body: Body, setting: Setting, values: Array) -> None:
    """A gearbox that stiffens and leans when its motor is hot: grows with the square of what a column records."""
    heat = setting.extra["motor_temperature"] - 20.0
    body.joints += values[:, 0] * ((heat / 25.0) ** 2)[:, None]


def _nest(body: Body, setting: Setting, values: Array) -> None:
    """A magnetic nest with play: the target falls to the side where gravity pulls it, along one axis only."""
    axis = int(values[0, 1])
    down = -setting.poses[:, 2, axis]
    twist = np.zeros((setting.samples, 6))
    twist[:, axis] = values[0, 0] * np.tanh(down / 0.15)
    body.move("tool", twist)


def _remounted(body: Body, setting: Setting, values: Array) -> None:
    """The target is taken off between two sessions, and does not come back to where it was."""
    assert setting.session is not None  # the fault asks for sessions
    twist = np.zeros((setting.samples, 6))
    twist[:, :3] = values[setting.session, :3]
    body.move("tool", twist)


def _bolt(body: Body, setting: Setting, values: Array) -> None:
    """A bolt gives way: from one moment on a link's far end is tilted against it."""
    late = setting.time > values[:, 6].max() * setting.time[-1]
    body.placements = body.placements + late[:, None, None] * values[None, :, :6]


def _draw_bolt(setting: Setting, rng: np.random.Generator) -> Array:
    movable = [k for k, j in enumerate(setting.world.chain) if j.movable][1:-1]
    values = np.zeros((len(setting.world.chain), 7))
    k = int(rng.choice(movable))
    joint = setting.world.chain[k]
    across = np.cross(joint.axis, rng.normal(size=3))  # about the joint's own axis it would be a slip
    values[k, 3:6] = 1e-3 * across / np.linalg.norm(across)
    values[k, 6] = rng.uniform(0.35, 0.65)
    return values


def _tooth(body: Body, setting: Setting, values: Array) -> None:
    """A damaged stretch of a gear: off only while the joint stands there."""
    body.joints += values[:, 0] * np.exp(-0.5 * ((setting.q - values[:, 1]) / np.maximum(values[:, 2], 1e-3)) ** 2)


def _droop(body: Body, setting: Setting, values: Array) -> None:
    """An axis that has not settled when it came fast: the error grows with the square of the commanded speed."""
    body.joints += values[:, 0] * (setting.speed**2)[:, None]


def _platform(body: Body, setting: Setting, values: Array) -> None:
    """A wooden platform that swells with the air's humidity and tilts the base."""
    damp = (setting.extra["humidity"] - setting.extra["humidity"][0]) / 10.0
    body.move("base", damp[:, None] * values[0, :6])


def _brake(body: Body, setting: Setting, values: Array) -> None:
    """A joint that creeps back to its place after each switching on: it depends on how long it has been running."""
    assert setting.session is not None
    first = np.array([setting.time[setting.session == s][0] for s in range(setting.session.max() + 1)])
    run = setting.time - first[setting.session]
    body.joints += values[:, 0] * np.exp(-run / (values[:, 1].max() * setting.time[-1]))[:, None]


def _base(setting: Setting) -> list[Place]:
    return [("base", "base")]


def _tool(setting: Setting) -> list[Place]:
    return [("tool", "tool")]


def _before(setting: Setting, places: Sequence[Place]) -> list[str]:
    names = setting.world.names
    return [names[names.index(name) - 1] for _, name in places]


def _tilt(setting: Setting, rng: np.random.Generator) -> Array:
    return np.concatenate([np.zeros(3), rng.normal(size=2), [0.2 * rng.normal()]])[None] * 1e-3


UNLISTED: dict[str, Fault] = {
    fault.name: fault
    for fault in (
        Fault("slip", one(milli, part(0.35, 0.65)), _slip, joints, few=True, quantities=clock, fixed=((1, (0.5,)),)),
        Fault(
            "cable_pull",
            one(milli, within(0.35, 0.75)),
            _cable,
            joints,
            few=True,
            quantities=own_position,
            fixed=((1, (0.0,)),),
        ),
        Fault("hose", one(milli, within(0.3, 0.7)), _hose, joints, few=True, quantities=_before, fixed=((1, (0.0,)),)),
        Fault(
            "hot_motor",
            one(milli),
            _hot_motor,
            joints,
            few=True,
            wants=("motor_temperature",),
            quantities=lambda s, places: ["motor_temperature"],
        ),
        Fault(
            "loose_nest",
            lambda s, rng: np.array([[1e-4, float(rng.integers(3))]]),
            _nest,
            _tool,
            quantities=lambda s, places: GRAVITY,
            fixed=((1, (0.0,)),),
        ),
        Fault(
            "remounted_target",
            lambda s, rng: rng.normal(size=(4, 3)) * 1e-4,
            _remounted,
            lambda s: [("tool", "tool")] * 4,
            wants=("sessions",),
            quantities=lambda s, places: ["session", "time", "order"],
        ),
        Fault(
            "yielding_bolt",
            _draw_bolt,
            _bolt,
            lambda s: [("link", j.parent) for j in s.world.chain],
            few=True,
            quantities=clock,
            fixed=((6, (0.5,)),),
        ),
        Fault(
            "damaged_teeth",
            one(milli, within(0.25, 0.75), part(0.2, 0.4)),
            _tooth,
            joints,
            few=True,
            quantities=own_position,
            fixed=((1, (0.0,)), (2, (0.3,))),
        ),
        Fault(
            "speed_droop",
            one(milli),
            _droop,
            joints,
            few=True,
            wants=("speed",),
            quantities=lambda s, places: ["speed"],
        ),
        Fault(
            "damp_platform",
            _tilt,
            _platform,
            _base,
            wants=("humidity",),
            quantities=lambda s, places: ["humidity"],
        ),
        Fault(
            "relaxing_joint",
            one(milli, part(0.03, 0.1)),
            _brake,
            joints,
            few=True,
            wants=("sessions",),
            quantities=lambda s, places: ["time", "order", "session"],
            fixed=((1, (0.05,)),),
        ),
        *INTERPLAY,
        *ELUSIVE,
    )
}
"""Eleven kinds of one quantity at one place, and those of the two other modules, by name."""


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
