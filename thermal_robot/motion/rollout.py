"""Rollout of held-out motions by MuJoCo itself, with the MJCF that was written, from the commands alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.correction.mujoco_models import compiled, mujoco_or_error
from thermal_robot.errors import CampaignError
from thermal_robot.motion import settings
from thermal_robot.motion.log import Motion, MotionLog
from thermal_robot.motion.mjcf import position_actuators
from thermal_robot.motion.model import ServoModel
from thermal_robot.motion.result import MotionDiagnosis, rms


@dataclass(frozen=True)
class Rollout:
    """Rms of each joint's gap in motions not fitted, rad: nominal, of the fitted servo model, and of MuJoCo.

    Attributes
    ----------
    nominal
        The joint follows its command, or its stated servo.
    told
        The fitted servo model.
    simulated
        MuJoCo with the MJCF that was written.
    """

    joints: tuple[str, ...]
    nominal: tuple[float, ...]
    told: tuple[float, ...]
    simulated: tuple[float, ...]

    @property
    def shrinkage_told(self) -> float:
        """Share of the gap's mean square, over all joints, that the fitted servo model removes."""
        return _shrinkage(self.nominal, self.told)

    @property
    def shrinkage(self) -> float:
        """Share of the gap's mean square, over all joints, that MuJoCo's simulation removes."""
        return _shrinkage(self.nominal, self.simulated)

    @property
    def agrees(self) -> bool:
        """Whether MuJoCo's shrinkage differs from the fitted model's by at most a tenth of the latter."""
        return abs(self.shrinkage - self.shrinkage_told) <= settings.AGREE * abs(self.shrinkage_told)


def _shrinkage(before: Sequence[float], after: Sequence[float]) -> float:
    return 1.0 - float(np.square(after).sum() / max(float(np.square(before).sum()), 1e-300))


def rollout(found: MotionDiagnosis, mjcf: str | Path, log: MotionLog) -> Rollout:
    """Forward simulation of a log's motions by MuJoCo from the commands alone, beside the fitted servo model's.

    Parameters
    ----------
    found
        Diagnosis of other motions of the robot.
    mjcf
        What :func:`~thermal_robot.motion.write.motion_mjcf` wrote, as a path or as its text.
    log
        Motions that were not fitted, of the same joints.

    Raises
    ------
    CampaignError
        If MuJoCo is not installed or does not take the model, if the log has other joints, or a joint no servo, or if
        the diagnosis is one of torques.
    """
    if found.unit != "rad":
        problem = "the diagnosis explains torques, and says nothing of what follows a command"
        raise CampaignError(found.log.name, problem, expected="a log of commands")
    if log.joints != found.log.joints:
        raise CampaignError(log.name, "has other joints", found=str(log.joints), expected=str(found.log.joints))
    model = ServoModel(log)
    values = values_in(found, model)
    zero = np.zeros_like(values)
    model.refreshed(zero)
    nominal = tuple(map(rms, model.all_residuals(zero)))
    for _ in range(settings.REFRESHES):
        model.refreshed(values)
    told = tuple(map(rms, model.all_residuals(values)))
    left = (model.measured - np.concatenate(simulated(mjcf, log))).T
    return Rollout(log.joints, nominal, told, tuple(rms(one[np.isfinite(one)]) for one in left))


def values_in(found: MotionDiagnosis, model: ServoModel) -> Array:
    """(P,) parameters of a diagnosis in another log's model; stops and contact relative to that log's commands."""
    values, first = np.zeros(len(model.parameters)), ServoModel(found.log)
    for p, (effect, joint) in enumerate(model.keys):
        value, j = found.values.get((effect, joint), 0.0), model.parameters[p].joint
        if not value:
            continue
        if effect == "low_stop":
            value = max(value + first.commanded[:, j].min() - model.commanded[:, j].min(), 0.0)
        elif effect == "high_stop":
            value = max(value - first.commanded[:, j].max() + model.commanded[:, j].max(), 0.0)
        elif model.parameters[p].number == "contact":
            value = max(value + first.lowest - model.lowest, 0.0)
        values[p] = value
    return values


def simulated(mjcf: str | Path, log: MotionLog) -> list[Array]:
    """Simulate every motion by MuJoCo from its first position at rest: (N, J) rad at the encoder's stamps.

    Joints that are not in the log are held at zero.
    """
    mujoco = mujoco_or_error()
    file, model, _ = compiled(mjcf)
    actuators = position_actuators(model)
    for name in log.joints:
        if name not in actuators:
            raise CampaignError(file, f"has no position actuator of a joint {name!r}")
    servos, numbers = [actuators[name] for name in log.joints], [model.joint(name).id for name in log.joints]
    at, own = model.jnt_qposadr[numbers], set(model.jnt_dofadr[numbers].tolist())
    held = [d for d in range(model.nv) if d not in own]
    return [_motion(mujoco, model, motion, at, servos, held) for motion in log.motions]


def _motion(mujoco: Any, model: Any, motion: Motion, at: Array, servos: Sequence[Any], held: list[int]) -> Array:
    data, step = mujoco.MjData(model), float(model.opt.timestep)
    q, times = motion.position.values, motion.position.time
    rest, others = data.qpos.copy(), model.jnt_qposadr[model.dof_jntid[held]]
    data.qpos[at] = [column[np.isfinite(column)][0] for column in q.T]
    gears = model.actuator_gear[servos, 0]
    steps = int(np.ceil((times[-1] - times[0]) / step)) + 1
    clock = times[0] + step * np.arange(steps)
    rows = np.clip(np.searchsorted(motion.command.time, clock + 1e-9, side="right") - 1, 0, None)
    _rest(mujoco, model, data, servos, gears * motion.command.values[rows[0]])
    path = np.empty((steps, len(at)))
    for n, row in enumerate(rows):
        path[n] = data.qpos[at]
        data.ctrl[servos] = gears * motion.command.values[row]
        mujoco.mj_step(model, data)
        data.qpos[others], data.qvel[held] = rest[others], 0.0
    return np.column_stack([np.interp(times, clock, each) for each in path.T])


def _rest(mujoco: Any, model: Any, data: Any, servos: Sequence[Any], command: Array) -> None:
    """Fill the control histories of delayed actuators with the first command, as if the arm had rested there."""
    for k, value in zip(servos, command, strict=True):
        if getattr(model, "nhistory", 0) and model.actuator_delay[k] > 0.0:
            mujoco.mj_initCtrlHistory(model, data, k, None, np.full(int(model.actuator_history[k, 0]), value))
