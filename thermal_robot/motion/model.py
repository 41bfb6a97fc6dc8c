"""The servo model of a whole log: its residual on every joint, and the derivative by every parameter."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.compiling import threads
from thermal_robot.kinematics.frames import frame_jacobians, tool_poses
from thermal_robot.kinematics.loads import Dynamics, Loads
from thermal_robot.motion import settings
from thermal_robot.motion.effects import EFFECTS, size
from thermal_robot.motion.following import parts
from thermal_robot.motion.log import MotionLog
from thermal_robot.motion.servo import PARAMETERS, simulate

if TYPE_CHECKING:
    import pandas as pd

Mask = NDArray[np.bool_]
SHARED = -1
"""Joint of a parameter that all joints share."""


@dataclass(frozen=True)
class Parameter:
    """Parameter to be fitted: the model's ``number`` that it changes in a joint, or the weight of a load all share.

    ``of`` tells parameters apart that belong to one effect of all joints.
    """

    effect: str
    joint: int
    label: str
    unit: str
    size: float
    spread: float
    positive: bool
    number: str
    of: str = ""


@dataclass(frozen=True, eq=False)
class Rows:
    """Residual (N,) of a joint, rad, the model's derivatives (N, P') by parameters ``columns`` (P',), clusters (N,)."""

    residual: Array
    derivative: Array
    columns: NDArray[np.int64]
    motion: NDArray[np.int64]


class JointModel(ABC):
    """Base class of models of a log's joints: parameters by name, and functions of every joint run in threads."""

    parameters: tuple[Parameter, ...] = ()
    motions: list[NDArray[np.int64]]  # of each joint the motions (N,) of its readings
    unit = "rad"

    def __init__(self, log: MotionLog) -> None:
        self.log, self.joints = log, range(len(log.joints))
        self.servos = [log.servo(name) for name in log.joints]
        payload, robot = log.payload[1] if log.payload else np.zeros(3), log.robot
        self.dynamics = Dynamics(robot.urdf, log.joints, robot.tool_frame, robot.model.gravity.linear, payload)

    @cached_property
    def _pool(self) -> ThreadPoolExecutor:
        """Pool of threads, the same in all calls: each new thread would take memory of its own and keep it."""
        return ThreadPoolExecutor(threads())

    @cached_property
    def sizes(self) -> Array:
        """(P,) expected sizes of the parameters: one sigma of their priors."""
        return np.array([one.size for one in self.parameters])

    @cached_property
    def clusters(self) -> int:
        """Number of clusters taken as independent: motions, or the pieces into which few motions are cut."""
        return len(self.log.motions) * parts(self.log)

    def cluster_of(self, motion: NDArray[np.int64]) -> NDArray[np.int64]:
        """(N,) index of each reading's cluster, from the motions (N,), in order, of the readings."""
        counts = np.bincount(motion, minlength=len(self.log.motions))
        place = np.arange(len(motion)) - (np.cumsum(counts) - counts)[motion]
        pieces = parts(self.log)
        return np.asarray(motion * pieces + place * pieces // np.maximum(counts[motion], 1))

    @cached_property
    def keys(self) -> list[tuple[str, str]]:
        """Unique key of each parameter: its effect, and its joint or, where all joints share it, its ``of``."""
        return [(one.effect, self.joint_of(one) or one.of) for one in self.parameters]

    def joint_of(self, parameter: Parameter) -> str:
        """Return the name of a parameter's joint, empty where all share it."""
        return "" if parameter.joint == SHARED else self.log.joints[parameter.joint]

    def index(self, effect: str, joint: int = SHARED) -> int | None:
        """Return the index of the first parameter of an effect in a joint, ``None`` where there is none."""
        return next((p for p, one in enumerate(self.parameters) if (one.effect, one.joint) == (effect, joint)), None)

    def own(self, joint: int, wanted: Mask | None = None) -> NDArray[np.int64]:
        """Return indices of a joint's parameters and of those that all joints share, within the mask ``wanted``."""
        places = [p for p, one in enumerate(self.parameters) if one.joint in (joint, SHARED)]
        return np.array([p for p in places if wanted is None or wanted[p]], dtype=np.int64)

    def payload(self, torque: Array) -> Parameter:
        """Return the payload's parameter: prior a share of the least mass that takes a joint to its torque limit."""
        most = np.abs(torque).max(axis=0)
        limits = np.array([servo.limit or settings.TORQUE_LIMIT for servo in self.servos])
        size = settings.PAYLOAD * float(np.min(limits[most > 0.0] / most[most > 0.0], initial=settings.MOST_PAYLOAD))
        return Parameter("payload", SHARED, "mass", "kg", size, 1.0, False, "payload")

    def start(self) -> Array:
        """(P,) starting values of the fit of all effects; zero by default, as for a nearly linear problem."""
        return np.zeros(len(self.parameters))

    @abstractmethod
    def refreshed(self, values: Array) -> None:
        """Recompute the loads along the positions that the parameters (P,) give."""

    @abstractmethod
    def residuals(self, joint: int, values: Array) -> Array:
        """(S, N) measured minus model of a joint for S sets (S, P) of all parameters."""

    @abstractmethod
    def rows(self, joint: int, values: Array, wanted: Mask | None = None) -> Rows:
        """Return residual and model derivatives of a joint at the parameters (P,), by those of ``wanted``."""

    @abstractmethod
    def noise(self, joint: int) -> float:
        """Return the standard deviation of the readings of a joint."""

    @abstractmethod
    def readings(self, joint: int) -> dict[str, Array]:
        """(N,) time, s, command and what was measured, and position, velocity and load there, of a joint, by name."""

    def motion_of(self, joint: int) -> NDArray[np.int64]:
        """(N,) index of the cluster of each reading of a joint."""
        return self.cluster_of(self.motions[joint])

    def quantities(self, joint: int) -> dict[str, Array]:
        """(N,) position, velocity, load and time by name, on which the residual of a joint may depend."""
        told = self.readings(joint)
        rest = {name: told[name] for name in ("velocity", "load", "time")}
        return {f"the position of {self.log.joints[joint]}": told["position"], **rest}

    def curves(self, joint: int, values: Array) -> pd.DataFrame:
        """Table of a joint's command, measurement, load and simulations; ``nominal`` is without any effect."""
        import pandas as pd

        told = self.readings(joint)
        nominal, simulated = told["measured"] - self.residuals(joint, np.stack([np.zeros_like(values), values]))
        given = {name: told[name] for name in ("time", "command", "measured")}
        more = {"nominal": nominal, "simulated": simulated, "load": told["load"]}
        return pd.DataFrame({"motion": self.motions[joint], **given, **more})

    def moves(self, values: Array) -> dict[tuple[str, str], float]:
        """Local sensitivity: rms change of each joint's simulation as one effect is set to zero, in the gap's unit.

        Keys are effect and joint; a shared effect has every joint. Parameters at zero in the values (P,) are left out.
        """

        def of_joint(joint: int) -> dict[tuple[str, str], float]:
            own = self.own(joint, values != 0.0)
            effects = list(dict.fromkeys(self.parameters[p].effect for p in own))
            sets = np.tile(values, (1 + len(effects), 1))
            for p in own:
                sets[1 + effects.index(self.parameters[p].effect), p] = 0.0
            left = self.residuals(joint, sets)
            sizes = np.sqrt(np.mean((left[1:] - left[0]) ** 2, axis=1))
            return {(name, self.log.joints[joint]): float(x) for name, x in zip(effects, sizes, strict=True)}

        return {key: size for one in self.each(of_joint) for key, size in one.items()}

    def each(self, function: Callable[[int], Any]) -> list[Any]:
        """Apply a function to every joint's index in parallel threads; return the results in order."""
        return list(self._pool.map(function, self.joints))

    def all_residuals(self, values: Array) -> list[Array]:
        """Residual (N,) of every joint at the parameters (P,)."""
        return self.each(lambda joint: self.residuals(joint, values[None])[0])


class ServoModel(JointModel):
    """Residual and derivative of a log's encoder readings by the parameters of the servo model.

    Parameters of one joint are independent of those of another, but for the loads that masses bring.
    """

    def __init__(self, log: MotionLog) -> None:
        super().__init__(log)
        self.coupled = all(servo.kp for servo in self.servos)
        self._grids()
        self.measured = np.concatenate([motion.position.values for motion in log.motions])
        self.reach = np.nanmin(self.measured, axis=0), np.nanmax(self.measured, axis=0)
        self.commanded = np.stack([self._held(j) for j in self.joints], axis=1)
        self.about = np.clip(self.commanded, *self.reach)
        self.loads = self.dynamics.along(self.about)
        self.moving = False
        self.lowest = float(self._heights(self.commanded)[0].min())
        self.motions = [samples[3] for samples in self._samples]
        self.parameters = self._parameters()
        self._press(np.zeros(len(self.parameters)))

    def _grids(self) -> None:
        motions = self.log.motions
        self.step = float(np.median(np.concatenate([np.diff(m.position.time) for m in motions])))
        if self.coupled:
            self.step /= max(1, int(np.ceil(self.step / settings.STEP)))
        self.substeps = max(1, int(np.ceil(self.step / settings.STEP)))
        counts = [int(np.ceil((m.position.time[-1] - m.position.time[0]) / self.step - 1e-9)) + 1 for m in motions]
        self.begins = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
        self.first = np.array([m.position.time[0] for m in motions])
        self.grid = np.concatenate([t + self.step * np.arange(n) for t, n in zip(self.first, counts, strict=True)])

    def _held(self, joint: int) -> Array:
        """(n,) command of a joint on the grid, by zero-order hold of its samples."""
        parts = []
        for k, motion in enumerate(self.log.motions):
            grid = self.grid[self.begins[k] : self.begins[k + 1]]
            time, command = motion.command.of(joint)
            parts.append(command[np.clip(np.searchsorted(time, grid + 1e-9, side="right") - 1, 0, None)])
        return np.concatenate(parts)

    @cached_property
    def _commands(self) -> list[tuple[Array, Array, NDArray[np.int64]]]:
        """Of each joint: stamps of all motions, the command's cumulative integral and value, and motions' begins."""
        found = []
        for j in self.joints:
            each = [motion.command.of(j) for motion in self.log.motions]
            parts = [np.column_stack([np.concatenate([[0.0], np.cumsum(u[:-1] * np.diff(t))]), u]) for t, u in each]
            begins = np.concatenate([[0], np.cumsum([len(t) for t, _ in each])]).astype(np.int64)
            times = np.concatenate([t for t, _ in each])
            found.append((times, np.ascontiguousarray(np.concatenate(parts)), begins))
        return found

    @cached_property
    def _samples(self) -> list[tuple[Array, NDArray[np.int64], Array, NDArray[np.int64]]]:
        """Of each joint: readings (N,), index of the grid point before, fraction of a step beyond it, and motion."""
        found = []
        for j in self.joints:
            parts = []
            for k, motion in enumerate(self.log.motions):
                q, t = motion.position.values[:, j], motion.position.time
                x = (t - self.first[k]) / self.step
                i = np.clip(np.floor(x).astype(np.int64), 0, self.begins[k + 1] - self.begins[k] - 2)
                parts.append(np.column_stack([q, i + self.begins[k], x - i, np.full(len(q), k)])[np.isfinite(q)])
            rows = np.concatenate(parts)
            found.append((rows[:, 0], rows[:, 1].astype(np.int64), rows[:, 2], rows[:, 3].astype(np.int64)))
        return found

    def _parameters(self) -> tuple[Parameter, ...]:
        found = [
            Parameter(e.name, j, e.label, e.unit, size(e, servo), e.spread, e.positive, e.number)
            for j, servo in enumerate(self.servos)
            for e in EFFECTS
            if e.number not in (("droop",) if servo.kp else ("kp",))
        ]
        if self.log.robot.has_masses:
            height = "height above the lowest command"
            found.append(self.payload(self.loads.torque[1]))
            found.append(Parameter("contact", SHARED, height, "m", 0.1, 1.5, True, "contact"))
        return tuple(found)

    def start(self) -> Array:
        """(P,) starting values: half a prior size, 0 if signed; stops, limit and contact from ends of the motion."""
        values = np.array([0.5 * one.size if one.positive else 0.0 for one in self.parameters])
        for joint in self.joints:
            command, (low, high) = self.commanded[:, joint], (end[joint] for end in self.reach)
            values[self.index("low_stop", joint)] = max(low - command.min(), 0.0)
            values[self.index("high_stop", joint)] = max(command.max() - high, 0.0)
            measured, place, _, _ = self._samples[joint]
            error = np.abs(command[place] - measured)
            limit = 1.0 / np.quantile(error, settings.FEW) if error.any() else 0.0
            values[self.index("torque_limit", joint)] = limit
        if (p := self.index("contact")) is not None:
            height, _ = self._heights(self.measured[np.isfinite(self.measured).all(axis=1)])
            values[p] = max(float(np.quantile(height, 1.0 - settings.FEW)) - self.lowest, 0.0)
        return values

    def _heights(self, q: Array) -> tuple[Array, Array]:
        """Height of the tool (n,), m, against gravity, and its gradient (n, J) by joints; others are held at zero."""
        robot, names = self.log.robot, self.log.joints
        own = [j for j, name in enumerate(names) if name in robot.joint_names]
        at = [robot.joint_names.index(names[j]) for j in own]
        whole, slope = np.zeros((len(q), robot.n)), np.zeros(q.shape)
        whole[:, at] = q[:, own]
        up = -robot.gravity / max(float(np.linalg.norm(robot.gravity)), 1e-12)
        slope[:, own] = (up @ frame_jacobians(robot, whole)[:, :3])[:, at]
        return tool_poses(robot, whole)[:, :3, 3] @ up, slope

    def numbers(self, joint: int, values: Array) -> tuple[Array, Array]:
        """(S, 14) inputs of the simulation and (S, 3) weights of load, payload, contact, for S sets (S, P)."""
        servo, x = self.servos[joint], dict.fromkeys((*PARAMETERS, "kp"), np.zeros(len(values)))
        weights = np.zeros((len(values), 3))
        weights[:, 0] = 1.0
        for p, parameter in enumerate(self.parameters):
            if parameter.joint == joint:
                x[parameter.number] = values[:, p]
            elif parameter.number == "payload":
                weights[:, 1] = values[:, p]
            elif parameter.number == "contact":
                weights[:, 2] = values[:, p] - self.touching
        if servo.kp:  # a servo whose gain is stated is one with another stiffness, not one that follows its command
            stiffness = servo.kp * np.maximum(1.0 + x["kp"], settings.LEAST_STIFFNESS)
            x["droop"], x["derivative"] = 1.0 / stiffness, (servo.kd or 0.0) / stiffness
            x["saturation"] = x["saturation"] + (stiffness / servo.limit if servo.limit else 0.0)
            for name, torque in (("coulomb", servo.friction), ("lag", servo.damping), ("inertia", servo.armature)):
                x[name] = x[name] + (torque or 0.0) / stiffness
        for name in ("dead_band", "gain", "zero", "delay"):
            number = {"dead_band": "dead_zone"}.get(name, name)
            x[number] = x[number] + (getattr(servo, name) or 0.0)
        reach = self.commanded[:, joint].min(), self.commanded[:, joint].max()
        x["low"] = np.where(x["low"] > 0.0, reach[0] + x["low"], -np.inf)
        x["high"] = np.where(x["high"] > 0.0, reach[1] - x["high"], np.inf)
        return np.column_stack([x[name] for name in PARAMETERS]), weights

    def positions(self, joint: int, values: Array, free: bool = False) -> Array:
        """(S, n) simulated positions of a joint on the grid for S sets (S, P); ``free``: without contact."""
        numbers, weights = self.numbers(joint, values)
        parts = self.loads.torque[:2, :, joint]
        contact, pressing = (0.0 if free else 1.0) * np.stack([self.contact[:, joint], self.pressing[:, joint]])
        loads = np.stack([parts[0] + pressing, parts[1], contact])
        inertias = np.vstack([self.loads.inertia[:2, :, joint], np.zeros((1, len(self.grid)))])
        around = loads, self.loads.slope[:, joint].copy(), self.about[:, joint].copy(), inertias
        begun = [motion.position.of(joint)[1][0] for motion in self.log.motions]
        start = np.where(np.isfinite(begun), begun, self.commanded[self.begins[:-1], joint])
        return simulate(
            numbers, weights, (self.begins, self.first), self._commands[joint], around, start, self.step, self.substeps
        )

    def residuals(self, joint: int, values: Array) -> Array:
        """(S, N) measured minus simulated positions of a joint, rad, at the encoder's own stamps."""
        measured, at, beyond, _ = self._samples[joint]
        simulated, left = self.positions(joint, values), np.empty((len(values), len(measured)))
        for one, own in zip(left, simulated, strict=True):  # one by one, as of all together each term would be large
            one[:] = measured - (1.0 - beyond) * own[at] - beyond * own[at + 1]
        return left

    def rows(self, joint: int, values: Array, wanted: Mask | None = None) -> Rows:
        """Return residual and forward-difference derivatives of the simulation at the parameters (P,)."""
        own = self.own(joint, wanted)
        steps = np.array([settings.DIFFERENCE * self.parameters[p].size for p in own])
        sets = np.tile(values, (1 + len(own), 1))
        sets[1 + np.arange(len(own)), own] += steps
        found = self.residuals(joint, sets)
        found[1:] = (found[0] - found[1:]) / steps[:, None]
        return Rows(found[0].copy(), found[1:].T, own, self.motion_of(joint))

    def noise(self, joint: int) -> float:
        """Return a joint's encoder noise, rad: median spacing of distinct readings over √12, at least LEAST_NOISE."""
        steps = np.abs(np.diff(np.unique(np.round(self._samples[joint][0], 9))))
        return max(float(np.median(steps)) / np.sqrt(12.0) if len(steps) else 0.0, settings.LEAST_NOISE)

    def readings(self, joint: int) -> dict[str, Array]:
        """(N,) by name: time, s, command and measurement of each reading; simulated state and load just before."""
        measured, at, beyond, motion = self._samples[joint]
        return {
            "time": self.grid[at] + beyond * self.step - self.first[motion],
            "command": self.commanded[np.where(beyond > 0.5, at + 1, at), joint],
            "measured": measured,
            "position": self.about[at, joint],
            "velocity": np.gradient(self.about[:, joint], self.step)[at],
            "load": self.loads.torque[0, at, joint],
        }

    def refreshed(self, values: Array) -> None:
        """Recompute the loads along the simulated positions; where joints are coupled, with inertial torques.

        Joints wait for each other's accelerations: Jacobi's iteration, relaxed by 2/(J + 1), as the eigenvalues of a
        positive mass matrix that is scaled by its diagonal lie between 0 and J.
        """
        share, rounds = (2.0 / (len(self.joints) + 1), settings.WAVES) if self.coupled else (1.0, 1)
        for _ in range(rounds):
            about = np.stack(self.each(lambda joint: self.positions(joint, values[None], free=True)[0]), axis=1)
            loads = self._loads(about)
            if self.moving:
                about, loads = self.about + share * (about - self.about), self.loads.towards(loads, share)
            self.moving, moved = self.coupled, float(np.abs(about - self.about).max())
            self.about, self.loads = about, loads
            if moved < min(self.noise(joint) for joint in self.joints):
                break
        self._press(values)

    def _loads(self, about: Array) -> Loads:
        """Return the loads along positions (n, J) on the grid; with speeds and accelerations where coupled."""
        if not self.coupled:
            return self.dynamics.along(about)
        speed, rate = np.zeros_like(about), np.zeros_like(about)
        for a, b in zip(self.begins[:-1], self.begins[1:], strict=True):
            if b - a > 2:
                speed[a:b] = np.gradient(about[a:b], self.step, axis=0)
                rate[a:b] = np.gradient(speed[a:b], self.step, axis=0)
        return self.dynamics.along(about, speed, rate)

    def _press(self, values: Array) -> None:
        """Compute the frictionless force that keeps the tool on a plane, to which the joints' springs yield.

        The force λ ≥ 0 along the vertical solves z(q) + λ Σ c_j (∂z/∂q_j)² = z₀; the torque of each joint is λ ∂z/∂q_j.
        """
        p = self.index("contact")
        self.touching, self.pressing, self.contact = 0.0, np.zeros_like(self.about), np.zeros_like(self.about)
        if p is None or values[p] <= 0.0:
            return
        height, slope = self._heights(self.about)
        compliance = np.array([self.numbers(j, values[None])[0][0, PARAMETERS.index("droop")] for j in self.joints])
        yields = np.maximum((np.maximum(compliance, settings.LEAST_COMPLIANCE) * slope**2).sum(axis=1), 1e-12)
        self.touching = float(values[p])
        into = self.lowest + self.touching - height
        self.contact = np.where(into > 0.0, 1.0, 0.0)[:, None] * -slope / yields[:, None]
        self.pressing = self.contact * np.maximum(into, 0.0)[:, None]
