"""Torque channel: what joint torques along a measured motion differ by from the rigid-body model's.

Per joint, from measured positions and their derivatives,

    τ = (1 + κ) [Y(q, q̇, q̈) π + f stop(q) + f_s e^{−(q̇/v_s)²} stop(q) + b q̇ + I_a q̈ + μ |Y π| stop(q)] + o ,

stop a Prandtl element: the sign of the motion that a spring of a few mrad smooths and remembers at rest (Armstrong-
Hélouvry, Dupont and Canudas de Wit, *Automatica* 30, 1994). All but κ is linear.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_coeffs, savgol_filter

from thermal_robot.arrays import Array
from thermal_robot.motion import settings
from thermal_robot.motion.effects import TORQUE_EFFECTS
from thermal_robot.motion.following import at, slope, usual_step
from thermal_robot.motion.log import Channel, MotionLog
from thermal_robot.motion.model import SHARED, JointModel, Mask, Parameter, Rows
from thermal_robot.motion.servo import STRIBECK_VELOCITY

_SECOND = tuple(f"second moment of {{}}, {axes}" for axes in ("xx", "xy", "yy", "xz", "yz", "zz"))
INERTIAL = ("mass of {}", *(f"moment of {{}} along {axis}" for axis in "xyz"), *_SECOND)
"""Labels of a link's ten numbers, in Pinocchio's order; of its mass the share that all of them grow by."""


class TorqueModel(JointModel):
    """Residual and derivative of a log's joint torques by the parameters of the torque channel."""

    unit = "N·m"

    def __init__(self, log: MotionLog) -> None:
        super().__init__(log)
        parts = [_sampled(motion.position, motion.torque) for motion in log.motions if motion.torque]
        self._time, self._q, self._v, self._a, *others = (np.concatenate(one) for one in zip(*parts, strict=True))
        self._sign, self._slow, self._measured, self._scatter = others
        self._loads = self.dynamics.torques(self._q, self._v, self._a)
        self._inertial, self._bodies = self.dynamics.inertial(self._q, self._v, self._a), self.dynamics.bodies
        self._motion = np.repeat(np.arange(len(parts)), [len(one[0]) for one in parts])
        self._used = [np.flatnonzero(np.isfinite(self._measured[:, j])) for j in self.joints]
        self.motions = [self._motion[rows] for rows in self._used]
        self.parameters = self._parameters()

    def _parameters(self) -> tuple[Parameter, ...]:
        found, left = [], np.nan_to_num(np.abs(self._measured - self._loads[0])).max(axis=0)
        for j, servo in enumerate(self.servos):
            # sizes go by the torque limit: as stated, else no less than the masses leave
            limit = servo.limit or max(settings.TORQUE_LIMIT, float(left[j]))
            fastest = max(float(np.abs(self._v[:, j]).max()), 1e-6)
            for e in TORQUE_EFFECTS:
                size = e.size * (limit if e.of_limit else 1.0) / (fastest if e.of_speed else 1.0)
                found.append(Parameter(e.name, j, e.label, e.unit, size, e.spread, e.least, e.name))
        if self.log.robot.has_masses:
            found.append(self.payload(self._loads[1]))
            for k, (name, numbers) in enumerate(self._bodies.items()):
                first = 0.1 * numbers[0] * settings.LINK
                known = (0.1, ""), *[(first, "kg·m")] * 3, *[(first * settings.LINK, "kg·m²")] * 6
                for i, (what, (size, unit)) in enumerate(zip(INERTIAL, known, strict=True), 10 * k):
                    label = what.format(name)
                    found.append(Parameter("masses", SHARED, label, unit, size, 1.0, -np.inf, f"mass {i}", label))
        return tuple(found)

    @cached_property
    def _columns(self) -> list[dict[str, Array]]:
        """Regressors of each joint: torque (N,) per unit of each number, before the torque constant."""
        found = []
        for j in self.joints:
            rows, load, sign = self._used[j], self._loads[:, :, j], self._sign[:, j]
            bodies = self._inertial[:, j].copy()
            bodies[:, :, 0] = np.einsum("nbi,bi->nb", bodies, np.array(list(self._bodies.values())))
            own = {
                "coulomb": sign,
                "stribeck": self._slow[:, j],
                "viscous": self._v[:, j],
                "armature": self._a[:, j],
                "load_friction": sign * np.abs(load[0]),
                "payload": load[1],
                **{f"mass {k}": one for k, one in enumerate(bodies.reshape(len(sign), -1).T)},
                "nominal": load[0],
            }
            found.append({name: values[rows] for name, values in own.items()})
        return found

    def residuals(self, group: Sequence[int], values: Array) -> list[Array]:
        """Residual (S, N) of each joint, N·m, measured torque minus the model's, for S sets (S, P)."""
        return [self._residuals(joint, values) for joint in group]

    def _residuals(self, joint: int, values: Array) -> Array:
        columns, found = self._columns[joint], []
        for one in values:
            told = columns["nominal"].copy()
            for p in self.own((joint,), one != 0.0):
                if self.parameters[p].number in columns:
                    told += one[p] * columns[self.parameters[p].number]
            bias = one[self.index("offset", joint)]
            found.append(self._measured[self._used[joint], joint] - self._factor(joint, one) * told - bias)
        return np.array(found)

    def _factor(self, joint: int, values: Array) -> float:
        return 1.0 + float(values[self.index("torque_constant", joint)])

    def rows(self, group: Sequence[int], values: Array, wanted: Mask | None = None, secant: bool = False) -> list[Rows]:
        """Return residual and model derivatives of each joint at the parameters (P,), which are its secants, too."""
        return [self._rows(joint, values, wanted) for joint in group]

    def _rows(self, joint: int, values: Array, wanted: Mask | None) -> Rows:
        own, factor = self.own((joint,), wanted), self._factor(joint, values)
        left = self._residuals(joint, values[None])[0]
        bare = self._measured[self._used[joint], joint] - left - values[self.index("offset", joint)]
        apart, columns = {"offset": np.ones(len(left)), "torque_constant": bare / factor}, self._columns[joint]
        numbers = [self.parameters[p].number for p in own]
        found = [apart[name] if name in apart else columns[name] * factor for name in numbers]
        derivative = np.ascontiguousarray(np.reshape(found, (len(own), len(left))).T)
        return Rows(left, derivative, own, self.motion_of(joint))

    def refreshed(self, values: Array) -> None:
        """Do nothing: the loads are those of the measured motion."""

    def signs(self) -> tuple[Array, Array]:
        """Regression of the measured torques on the rigid-body model's: slope (J,) and its standard error.

        Offsets do not count: of both, what a motion has in the mean is subtracted.
        """
        cluster, found = self.cluster_of(self._motion), []
        there = np.isfinite(self._measured)
        for values in (self._loads[0], self._measured):
            values, count = np.where(there, values, 0.0), np.maximum(_sums(self._motion, there), 1.0)
            found.append(np.where(there, values - (_sums(self._motion, values) / count)[self._motion], 0.0))
        told, measured = found
        return slope(_sums(cluster, told**2), _sums(cluster, told * measured))

    def noise(self, joint: int) -> float:
        """Return the standard deviation of a joint's smoothed torque, N·m: median of motions, at least LEAST_NOISE."""
        return max(float(np.nanmedian(self._scatter[:, joint])), settings.LEAST_NOISE)

    def readings(self, joint: int) -> dict[str, Array]:
        """(N,) by name: time, s, position, in place of a command, too, and its velocity, measured torque and load."""
        names = "command", "position", "velocity", "measured", "load"
        every = self._q, self._q, self._v, self._measured, self._loads[0]
        rows = self._used[joint]
        return {"time": self._time[rows], **{n: one[rows, joint] for n, one in zip(names, every, strict=True)}}


def _sums(labels: NDArray[np.int64], values: Array) -> Array:
    """(labels, J) column sums of the rows (N, J) that have each label."""
    return np.stack([np.bincount(labels, column) for column in values.T], axis=1)


def _sampled(position: Channel, torque: Channel) -> tuple[Array, ...]:
    """Time (n,), then (n, J) q, q̇, q̈, stop, stop where slow, and torque, all by local cubics (Savitzky and Golay).

    On an even clock; what the model does in a step passes the filter as what was measured does (Gautier's parallel
    filtering), so that vibrations of the arm, which no rigid body has, are in neither. Then ends are cut and rows are
    left out. Last one sigma (1, J) of the torque, by the scatter of neighbouring readings about a straight line.
    """
    step = usual_step(position)
    grid = np.arange(position.time[0], position.time[-1], step)
    width = max(2 * round(settings.SMOOTHED / step / 2) + 1, 5)
    kept = slice(width // 2, len(grid) - width // 2, max(width // settings.KEPT, 1))
    q, measured = at(position, grid), at(torque, grid)

    def smooth(values: Array, order: int = 0) -> Array:
        return np.asarray(savgol_filter(values, width, 3, deriv=order, delta=step, axis=0))

    speed, sign = smooth(q, 1), _prandtl(q)
    slow = sign * np.exp(-((speed / STRIBECK_VELOCITY) ** 2))
    bend = np.abs(measured[2:] - 2.0 * measured[1:-1] + measured[:-2])
    noise = np.median(bend, axis=0) / (0.6745 * np.sqrt(6.0)) * np.linalg.norm(savgol_coeffs(width, 3))
    smoothed = smooth(q), speed, smooth(q, 2), smooth(sign), smooth(slow), smooth(measured)
    return (grid - grid[0])[kept], *(one[kept] for one in smoothed), noise[None]


def _prandtl(q: Array) -> Array:
    """(N, J) output in −1…1 of a Prandtl (elastoplastic) element on each joint, at ±1 once it slides."""
    found, state = np.zeros_like(q), np.zeros(q.shape[1])
    for n, move in enumerate(2.0 / settings.PRANDTL * np.diff(q, axis=0), 1):
        found[n] = state = np.clip(state + move, -1.0, 1.0)
    return found
