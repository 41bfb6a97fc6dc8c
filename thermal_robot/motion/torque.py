"""Torque channel: what joint torques along a measured motion differ by from the rigid-body model's.

Per joint, from measured positions and their derivatives,

    τ = (1 + κ) [Y(q, q̇, q̈) π + f stop(q) + f_s e^{−(q̇/v_s)²} stop(q) + b q̇ + I_a q̈ + μ |Y π| stop(q)] + o ,

stop a Prandtl element: the sign of the motion that a spring of a few mrad smooths and remembers at rest (Armstrong-
Hélouvry, Dupont and Canudas de Wit, *Automatica* 30, 1994). All but κ is linear.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from thermal_robot.arrays import Array
from thermal_robot.motion import settings
from thermal_robot.motion.following import at
from thermal_robot.motion.log import MotionLog, Servo
from thermal_robot.motion.model import SHARED, JointModel, Parameter, Rows
from thermal_robot.motion.servo import STRIBECK_VELOCITY


class TorqueModel(JointModel):
    """Residual and derivative of a log's joint torques by the parameters of the torque channel."""

    unit = "N·m"

    def __init__(self, log: MotionLog) -> None:
        super().__init__(log)
        dynamics = self.dynamics_of(log, masses=True)
        parts = [_derivatives(m.position.time, m.position.values) for m in log.motions]
        self._q, self._v, self._a = (np.concatenate([one[k] for one in parts]) for k in range(3))
        self._loads = dynamics.along(self._q, self._v, self._a, whole=True)
        self._bodies = dynamics.bodies
        self._masses = [dynamics.model.inertias[dynamics.model.getJointId(name)].mass for name in dynamics.bodies]
        lengths = [len(m.position.time) for m in log.motions]
        self._motion = np.repeat(np.arange(len(log.motions)), lengths)
        self._time = np.concatenate([m.position.time - m.position.time[0] for m in log.motions])
        self._measured = np.concatenate([at(m.torque, m.position.time) for m in log.motions if m.torque])
        self._used = [np.flatnonzero(np.isfinite(self._measured[:, j])) for j in self.joints]
        self.parameters = self._parameters()

    def _limit(self, joint: int) -> float:
        servo = self.log.servos.get(self.log.joints[joint], Servo())
        return servo.limit or settings.TORQUE_LIMIT

    def _parameters(self) -> tuple[Parameter, ...]:
        found = []
        for j in self.joints:
            limit, fastest = self._limit(j), max(float(np.abs(self._v[:, j]).max()), 1e-6)
            for name, label, unit, size, spread, positive in (
                ("offset", "offset", "N·m", 0.02 * limit, 1.0, False),
                ("coulomb", "half width", "N·m", 0.02 * limit, 1.0, True),
                ("stribeck", "breakaway", "N·m", 0.01 * limit, 1.5, True),
                ("viscous", "damping", "N·m·s/rad", 0.02 * limit / fastest, 1.5, True),
                ("armature", "inertia", "kg·m²", 0.005 * limit, 1.0, True),
                ("load_friction", "share of the load", "", 0.15, 1.0, True),
                ("torque_constant", "change of the torque constant", "", 0.1, 1.0, False),
            ):
                found.append(Parameter(name, j, label, unit, size, spread, positive, name))
        if self.log.robot.has_masses:
            found.append(
                Parameter("payload", SHARED, "mass", "kg", self.rated(self._loads.torque[1]), 1.0, False, "payload")
            )
            for k, name in enumerate(self._bodies):
                found.append(Parameter("masses", SHARED, f"mass of {name}", "", 0.1, 1.0, False, f"mass {4 * k}"))
                moment = 0.1 * self._masses[k] * settings.LINK
                found += [
                    Parameter(
                        "masses",
                        SHARED,
                        f"moment of {name} along {axis}",
                        "kg·m",
                        moment,
                        1.0,
                        False,
                        f"mass {4 * k + i}",
                    )
                    for i, axis in enumerate("xyz", 1)
                ]
        return tuple(found)

    @cached_property
    def _columns(self) -> list[dict[str, Array]]:
        """Of each joint the torque (N,) that one unit of each number brings, before the torque constant."""
        found = []
        for j in self.joints:
            rows, load = self._used[j], self._loads.torque[:, :, j]
            sign = _prandtl(self._q[:, j], self._motion)
            slow = np.exp(-((self._v[:, j] / STRIBECK_VELOCITY) ** 2))
            own = {
                "offset": np.ones(len(self._q)),
                "coulomb": sign,
                "stribeck": sign * slow,
                "viscous": self._v[:, j],
                "armature": self._a[:, j],
                "load_friction": sign * np.abs(load[0]),
                "payload": load[1],
                **{f"mass {k}": load[2 + k] for k in range(4 * len(self._bodies))},
                "nominal": load[0],
            }
            found.append({name: values[rows] for name, values in own.items()})
        return found

    def residuals(self, joint: int, values: Array) -> Array:
        """(S, N) measured torque minus the model's, N·m."""
        columns = self._columns[joint]
        found = []
        for one in values:
            told, factor = columns["nominal"].copy(), 1.0
            for p, parameter in enumerate(self.parameters):
                if parameter.joint in (joint, SHARED) and one[p]:
                    if parameter.number == "torque_constant":
                        factor = 1.0 + one[p]
                    elif parameter.number != "offset":
                        told += one[p] * columns[parameter.number]
            offset = self.index("offset", joint)
            found.append(
                self._measured[self._used[joint], joint] - factor * told - (one[offset] if offset is not None else 0)
            )
        return np.array(found)

    def rows(self, joint: int, values: Array, wanted: NDArray[np.bool_] | None = None) -> Rows:
        """Residual and derivatives of a joint at the parameters (P,); of those ``wanted``."""
        columns, own, found = self._columns[joint], self.own(joint, wanted), []
        constant = self.index("torque_constant", joint)
        factor = 1.0 + (values[constant] if constant is not None else 0.0)
        left = self.residuals(joint, values[None])[0]
        measured = self._measured[self._used[joint], joint]
        offset = self.index("offset", joint)
        inside = (measured - left - (values[offset] if offset is not None else 0.0)) / factor
        for p in own:
            number = self.parameters[p].number
            if number == "torque_constant":
                found.append(inside)
            else:
                found.append(columns[number] * (1.0 if number == "offset" else factor))
        derivative = np.stack(found, axis=1) if found else np.zeros((len(left), 0))
        return Rows(left, derivative, own, self.motion_of(joint))

    def start(self) -> Array:
        """(P,) values from which all effects are fitted: the problem is nearly linear."""
        return np.zeros(len(self.parameters))

    def refreshed(self, values: Array) -> None:
        """Nothing: loads are those of the measured motion."""

    def motion_of(self, joint: int) -> NDArray[np.int64]:
        """(N,) number of the cluster of each reading of a joint."""
        return self.cluster_of(self._motion[self._used[joint]])

    def noise(self, joint: int) -> float:
        """One sigma of a joint's torque, N·m: the scatter of neighbouring readings about a straight line."""
        values = self._measured[self._used[joint], joint]
        bend = values[2:] - 2.0 * values[1:-1] + values[:-2]
        return max(float(np.median(np.abs(bend))) / (0.6745 * np.sqrt(6.0)), settings.LEAST_NOISE) if len(bend) else 1.0

    def quantities(self, joint: int) -> dict[str, Array]:
        """(N,) what a joint's residual may follow: position, velocity, load and time."""
        rows = self._used[joint]
        return {
            f"the position of {self.log.joints[joint]}": self._q[rows, joint],
            "velocity": self._v[rows, joint],
            "load": self._loads.torque[0, rows, joint],
            "time": self._time[rows],
        }

    def drawn(self, joint: int, values: Array) -> dict[str, Array]:
        """Measured and modelled torques at the readings of a joint."""
        left = self.residuals(joint, np.stack([np.zeros_like(values), values]))
        rows = self._used[joint]
        measured = self._measured[rows, joint]
        return {
            "motion": self._motion[rows], "time": self._time[rows], "command": self._q[rows, joint],
            "measured": measured, "nominal": measured - left[0], "simulated": measured - left[1],
            "load": self._loads.torque[0, rows, joint],
        }  # fmt: skip


def _derivatives(time: Array, q: Array) -> tuple[Array, Array, Array]:
    """Position, velocity and acceleration (N, J) by local cubics over a tenth of a second (Savitzky and Golay)."""
    step = float(np.median(np.diff(time)))
    width = max(2 * round(settings.SMOOTHED / step / 2) + 1, 5)
    if len(q) <= width:
        return q, np.gradient(q, time, axis=0), np.zeros_like(q)
    return tuple(savgol_filter(q, width, 3, deriv=k, delta=step, axis=0) for k in range(3))


def _prandtl(q: Array, motion: NDArray[np.int64]) -> Array:
    """(N,) the state in −1…1 of an elastoplastic element that the joint drags: its sign once it slid over its reach."""
    move = np.diff(q, prepend=q[:1]) / settings.PRANDTL
    move[np.flatnonzero(np.diff(motion, prepend=-1))] = 0.0
    found, state = np.empty(len(q)), 0.0
    for n, step in enumerate(move.tolist()):
        state = min(max(state + step, -1.0), 1.0)
        found[n] = state
    return found
