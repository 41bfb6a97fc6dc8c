"""Joint compliance: gears and servos yield to the torque of gravity, payload or contact."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.effects.arguments import Index
from thermal_robot.effects.effect import Driver, Effect, Parameter, at_joint
from thermal_robot.effects.quantities import torque_columns, unit
from thermal_robot.kinematics import static_regressor

if TYPE_CHECKING:
    from thermal_robot.observations import Observations
    from thermal_robot.robot import Robot

_WIND_UP = 1e-3  # rad or m, at the largest torque
_LEVER = 0.1  # m: how far a body's centre may lie from the next joint
_LARGE = 0.5  # of a shape's largest weight: no rounding makes it change its sign
_FEW = 0.1  # of the strongest shape of any joint: weaker ones are left out
_DRAWN = 300  # configurations
_PER_TORQUE = {"rad": "rad/(N·m)", "m": "m/N"}


@dataclass(frozen=True)
class JointCompliance(Effect):
    """Joint compliance: q_actual = q_command − c_j τ_j.

    τ_j (N·m) is the torque that holds the joint against gravity (Pinocchio's sign): from the URDF's inertias and the
    payload, or ``torque.<joint>`` where the robot reports it. c_j in rad/(N·m). Expected size: a wind-up of 1 mrad at
    the largest torque that the campaign puts on any joint. Reducers' catalogues state 1e4 to 1e6 N·m/rad for the sizes
    of industrial arms, 1 to 100 µrad/(N·m). A servo without integral part droops by the same law, by up to 30 mrad on
    light arms.

    Where the URDF has no masses and no torque is reported, the weights are free. Holding torques are linear in the
    bodies' masses and first moments, so that c_j τ_j = Σ_k w_jk s_jk(q), with shapes s_jk known from the kinematics
    alone: the principal components of the static regressor's row of joint j over the robot's range, for bodies of one
    weight with a centre 0.1 m about the next joint (Gautier and Khalil, *Direct calculation of minimum set of inertial
    parameters*, 1990, on why few suffice). A unit of w_jk (rad) is a unit at the largest shape of any joint. ``joints``
    and ``weights`` are the joint of each of K shapes, and K·4n weights: what it takes of the mass and first moment of
    each body. A recorded payload adds its own torque with c_j.

    A joint whose torque does not vary cannot be told from its offset. A free shape that goes with one joint's sine and
    cosine alone (one joint between the base and a heavy body) is :class:`TransmissionError` of order 1 in that joint;
    several joints with parallel axes tell the two apart.
    """

    joints: tuple[Index, ...] = ()
    weights: tuple[float, ...] = ()

    name: ClassVar[str] = "joint_compliance"
    title: ClassVar[str] = "joints that yield to load (gear or servo)"
    singular: ClassVar[str] = "a yielding to load"
    sided_by: ClassVar[tuple[str, ...]] = ("torque", "gravity")
    size_spread: ClassVar[float] = 1.0

    def missing(self, observations: Observations) -> tuple[str, ...]:
        """Columns that would give torques; none where a known torque or a shape of gravity's torque varies."""
        torque = observations.torque
        known = torque is not None and bool(np.any(np.ptp(torque, axis=0) > 1e-9))
        if known or any(np.ptp(shape) > 1e-9 for _, shape in self._set(observations)._shapes(observations)):
            return ()
        return ("torque.<joint>", "payload", "masses in the URDF")

    def reads(self, observations: Observations) -> tuple[str, ...]:
        """Return the recorded torques of the chain's joints, and the payload where one is not recorded."""
        return torque_columns(observations)

    def variants(self, observations: Observations) -> tuple[Effect, ...]:
        """Return the settings: known torques, or free weights where masses are unknown."""
        return (self._set(observations),)

    def _set(self, observations: Observations) -> JointCompliance:
        robot, recorded = observations.robot, observations.covariates
        if robot.has_masses or any(f"torque.{joint}" in recorded for joint in robot.joint_names):
            return replace(self, joints=(), weights=())
        few = _few_weights(robot)
        flat = tuple(float(weight) for _, weights in few for weight in weights)
        return replace(self, joints=tuple(j for j, _ in few), weights=flat)

    def _shapes(self, observations: Observations) -> list[tuple[int, Array]]:
        """Joint and values (N,) of each shape of gravity's torque."""
        if not self.joints:
            return []
        regressor = _weighed(observations.robot, observations.q)
        each = np.reshape(self.weights, (len(self.joints), -1))
        return [(j, regressor[:, j] @ weights) for j, weights in zip(self.joints, each, strict=True)]

    def parameters(self, observations: Observations) -> tuple[Parameter, ...]:
        """One compliance a joint, rad/(N·m), or m/N for a prismatic joint; free weights in rad or m."""
        robot, torque, found = observations.robot, observations.torque, []
        names, units = robot.joint_names, [unit(robot, joint) for joint in robot.joint_names]
        for k, (j, shape) in enumerate(self._shapes(observations)):
            label = f"yield to gravity, shape {self.joints[: k + 1].count(j)}"
            found.append(Parameter(label, units[j], _WIND_UP, "joint", names[j], (at_joint(j, -shape),)))
        if torque is not None:
            size = _WIND_UP / max(float(np.abs(torque).max()), 1e-9)
            for j, joint in enumerate(names):
                own, response = _PER_TORQUE[units[j]], (at_joint(j, -torque[:, j]),)
                found.append(Parameter("compliance", own, size, "joint", joint, response, positive=True))
        return tuple(found)

    def driver(self, observations: Observations, parameters: Sequence[Parameter], error: Array) -> Driver | None:
        """Torque of the joint; where masses are unknown, the fitted error scaled to 1 at its largest."""
        joint, robot = parameters[0].place, observations.robot
        if observations.torque is None:
            return f"fitted torque of {joint}", "relative", -error / max(float(np.abs(error).max()), 1e-300)
        name = f"torque of {joint}"
        return name, unit(robot, f"torque.{joint}"), observations.torque[:, robot.joint_names.index(joint)]


def _weighed(robot: Robot, q: Array) -> Array:
    """Regressor of statics (N, n, 4 n): joint torques by gravity per unit weight of each body, and per its moments.

    The moments are those of a unit weight 0.1 m from the next joint, along each axis.
    """
    regressor = static_regressor(robot, q) * np.array([1.0, _LEVER, _LEVER, _LEVER])
    return np.asarray(regressor.reshape(len(q), robot.n, -1))


def _few_weights(robot: Robot) -> list[tuple[int, Array]]:
    """Principal components of each joint's static regressor over the joint ranges: joint and weights (4n,) of each.

    Kept are those with at least a tenth of the largest singular value; all are scaled so that the largest torque is 1.
    """
    rng = np.random.default_rng(0)
    lower, upper = np.maximum(robot.lower, -np.pi), np.minimum(robot.upper, np.pi)
    drawn = _weighed(robot, rng.uniform(lower, upper, (_DRAWN, robot.n)))
    found = []
    for j in range(robot.n):
        _, strength, components = np.linalg.svd(drawn[:, j], full_matrices=False)
        # a component has no sign of its own: the first of its large weights is positive
        size = np.abs(components)
        first = (size > _LARGE * size.max(axis=1, keepdims=True)).argmax(axis=1)
        components = components * np.sign(components[np.arange(len(first)), first])[:, None]
        found += [(float(s), j, weights) for s, weights in zip(strength, components, strict=True)]
    strongest = max(s for s, _, _ in found)
    kept = [(j, weights) for s, j, weights in found if s > max(_FEW * strongest, 1e-9)]
    largest = max((float(np.abs(drawn[:, j] @ weights).max()) for j, weights in kept), default=1.0)
    return [(j, weights / largest) for j, weights in kept]
