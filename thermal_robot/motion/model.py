"""The servo model of a whole log: its residual on every joint, and the derivative by every parameter."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property
from threading import current_thread
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from thermal_robot.arrays import Array
from thermal_robot.compiling import threads
from thermal_robot.kinematics.loads import Dynamics, Loads
from thermal_robot.motion import settings
from thermal_robot.motion.contact import Ends, contact_yields
from thermal_robot.motion.effects import EFFECTS, SIMULATOR, size
from thermal_robot.motion.following import parts
from thermal_robot.motion.log import MotionLog
from thermal_robot.motion.servo import NEAR, PARAMETERS, plane_forces, simulate

if TYPE_CHECKING:
    import pandas as pd

Mask = NDArray[np.bool_]
T = TypeVar("T")
_POOL = "joints"
"""Name of the threads of a model's pool, in which it asks for no more of them."""
SHARED = -1
"""Joint of a parameter that all joints share."""
RUBBING, FLEXING = ("contact", "friction"), ("contact", "compliance")
"""Keys of the parameters of a plane that the tool touches: its friction, and how far it and the links flex."""


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
    least: float
    number: str
    of: str = ""
    most: float = np.inf


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
    groups: tuple[tuple[int, ...], ...]  # of joints that move each other
    motions: list[NDArray[np.int64]]  # of each joint the motions (N,) of its readings
    unit = "rad"
    lowest = 0.0
    """Height of the tool in the lowest command, m, above which a plane's is fitted."""

    def __init__(self, log: MotionLog) -> None:
        self.log, self.joints = log, range(len(log.joints))
        self.groups = tuple((j,) for j in self.joints)
        self.servos = [log.servo(name) for name in log.joints]
        payload, robot = log.payload[1] if log.payload else np.zeros(3), log.robot
        self.dynamics = Dynamics(robot.urdf, log.joints, robot.tool_frame, robot.model.gravity.linear, payload)

    @cached_property
    def _pool(self) -> ThreadPoolExecutor:
        """Pool of threads, the same in all calls: each new thread would take memory of its own and keep it."""
        return ThreadPoolExecutor(threads(), _POOL)

    @cached_property
    def sizes(self) -> Array:
        """(P,) expected sizes of the parameters: one sigma of their priors."""
        return np.array([one.size for one in self.parameters])

    @cached_property
    def least(self) -> Array:
        """(P,) least values of the parameters, −∞ where they have none."""
        return np.array([one.least for one in self.parameters])

    @cached_property
    def bounds(self) -> Array:
        """(2, P) least and largest values of the parameters, infinite where they have none."""
        return np.array([self.least, [one.most for one in self.parameters]])

    @cached_property
    def placed(self) -> NDArray[np.int64]:
        """(P,) joint of each parameter; ``SHARED`` where all joints share it."""
        return np.array([one.joint for one in self.parameters])

    def of_effects(self, names: Collection[str]) -> Mask:
        """(P,) mask of the parameters of some effects."""
        return np.array([one.effect in names for one in self.parameters], dtype=bool)

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

    def own(self, joints: Collection[int], wanted: Mask | None = None) -> NDArray[np.int64]:
        """Return indices of the joints' parameters and of those that all joints share, within the mask ``wanted``."""
        places = [p for p, one in enumerate(self.parameters) if one.joint in (*joints, SHARED)]
        return np.array([p for p in places if wanted is None or wanted[p]], dtype=np.int64)

    def payload(self, torque: Array) -> Parameter:
        """Return the payload's parameter: prior a share of the least mass that takes a joint to its torque limit."""
        most = np.abs(torque).max(axis=0)
        limits = np.array([servo.limit or settings.TORQUE_LIMIT for servo in self.servos])
        size = settings.PAYLOAD * float(np.min(limits[most > 0.0] / most[most > 0.0], initial=settings.MOST_PAYLOAD))
        return Parameter("payload", SHARED, "mass", "kg", size, 1.0, -np.inf, "payload")

    def start(self) -> Array:
        """(P,) starting values of fits; zero by default, as for a nearly linear problem."""
        return np.zeros(len(self.parameters))

    @abstractmethod
    def refreshed(self, values: Array) -> None:
        """Recompute the loads along the positions that the parameters (P,) give."""

    @abstractmethod
    def residuals(self, group: Sequence[int], values: Array) -> list[Array]:
        """Residual (S, N) of each joint of a group, measured minus model, for S sets (S, P) of all parameters."""

    @abstractmethod
    def rows(self, group: Sequence[int], values: Array, wanted: Mask | None = None, secant: bool = False) -> list[Rows]:
        """Return residual and derivatives of each joint of a group at the parameters (P,), by those of ``wanted``.

        With ``secant`` what an expected size more of each changes, over that size.
        """

    @abstractmethod
    def noise(self, joint: int) -> float:
        """Return the standard deviation of the readings of a joint."""

    @cached_property
    def noises(self) -> Array:
        """(J,) standard deviation of the readings of each joint."""
        return np.array([self.noise(joint) for joint in self.joints])

    @abstractmethod
    def readings(self, joint: int) -> dict[str, Array]:
        """(N,) time, s, command and what was measured, and position, velocity and load there, of a joint, by name."""

    def motion_of(self, joint: int) -> NDArray[np.int64]:
        """(N,) index of the cluster of each reading of a joint."""
        return self.cluster_of(self.motions[joint])

    @cached_property
    def counts(self) -> list[NDArray[np.int64]]:
        """Number of each joint's readings in every cluster (M,)."""
        return [np.bincount(self.motion_of(j), minlength=self.clusters) for j in self.joints]

    def quantities(self, joint: int) -> dict[str, Array]:
        """(N,) position, velocity, load and time by name, on which the residual of a joint may depend."""
        told = self.readings(joint)
        rest = {name: told[name] for name in ("velocity", "load", "time")}
        return {f"the position of {self.log.joints[joint]}": told["position"], **rest}

    def curves(self, values: Array) -> dict[str, pd.DataFrame]:
        """Tables of each joint's command, measurement, load and simulations; ``nominal`` is without any effect."""
        import pandas as pd

        found, sets = {}, np.stack([np.zeros_like(values), values])
        for joint, left in zip(self.joints, self.by_joint(lambda group: self.residuals(group, sets)), strict=True):
            told = self.readings(joint)
            nominal, simulated = told["measured"] - left
            given = {name: told[name] for name in ("time", "command", "measured")}
            more = {"nominal": nominal, "simulated": simulated, "load": told["load"]}
            found[self.log.joints[joint]] = pd.DataFrame({"motion": self.motions[joint], **given, **more})
        return found

    def moved(self, values: Array, places: NDArray[np.int64]) -> Array:
        """Local sensitivity (K, J): rms change of each joint's model as each parameter of ``places`` (K,) is zero."""

        def of_group(group: Sequence[int]) -> list[Array]:
            own = np.flatnonzero(np.isin(places, self.own(group)))
            sets, found = np.tile(values, (1 + len(own), 1)), np.zeros((len(group), len(places)))
            sets[1 + np.arange(len(own)), places[own]] = 0.0
            for one, left in zip(found, self.residuals(group, sets), strict=True):
                one[own] = np.sqrt(np.mean((left[1:] - left[0]) ** 2, axis=1))
            return list(found)

        found = self.by_joint(of_group)
        return np.stack(found, axis=1)

    def moves(self, values: Array) -> dict[tuple[str, str], float]:
        """Rms change of each joint's model as an effect in it is set to zero, in the gap's unit, by effect and joint.

        A shared effect has every joint; of several parameters of an effect the largest counts.
        """
        places, found = np.flatnonzero(values), dict[tuple[str, str], float]()
        for p, sizes in zip(places, self.moved(values, places), strict=True):
            one = self.parameters[p]
            for joint in self.joints if one.joint == SHARED else (one.joint,):
                key = one.effect, self.log.joints[joint]
                found[key] = max(found.get(key, 0.0), float(sizes[joint]))
        return found

    def each(self, function: Callable[[Any], T], items: Sequence[Any]) -> list[T]:
        """Apply a function to every item in parallel threads, within one of these in turn; return results in order."""
        alone = len(items) == 1 or current_thread().name.startswith(_POOL)
        return [*map(function, items)] if alone else list(self._pool.map(function, items))

    def by_joint(
        self, function: Callable[[Sequence[int]], list[T]], groups: Sequence[Sequence[int]] | None = None
    ) -> list[T]:
        """Apply a function to groups of joints, by default all; return its results for the joints in their order."""
        groups = groups or self.groups
        found = self.each(function, groups)
        told = {j: one for group, each in zip(groups, found, strict=True) for j, one in zip(group, each, strict=True)}
        return [told[j] for j in sorted(told)]

    def all_residuals(self, values: Array) -> list[Array]:
        """Residual (N,) of every joint at the parameters (P,)."""
        return self.by_joint(lambda group: [one[0] for one in self.residuals(group, values[None])])


class ServoModel(JointModel):
    """Residual and derivative of a log's encoder readings by the parameters of the servo model.

    Joints whose servos are all stated move each other, as one multibody system. Else each goes its own way, and what
    loads it is the arm's weight.
    """

    def __init__(self, log: MotionLog) -> None:
        super().__init__(log)
        self.coupled = all(servo.kp for servo in self.servos)
        self._grids()
        self.measured = np.concatenate([motion.position.values for motion in log.motions])
        self.reach = np.nanmin(self.measured, axis=0), np.nanmax(self.measured, axis=0)
        self.commanded = np.stack([self._held(j) for j in self.joints], axis=1)
        self.held = self.coupled and len(self.joints) > 1  # by a plane, in the simulation itself
        if self.coupled:
            self.groups = (tuple(self.joints),)
        self.about = self._read() if self.coupled else np.clip(self.commanded, *self.reach)
        self.loads = self._loads()
        self.ends = Ends(log.robot, log.joints)
        self.lowest = float(self.ends.heights(self.commanded).min())
        self.motions = [samples[3] for samples in self._samples]
        self.parameters = self._parameters()
        self._press(np.zeros(len(self.parameters)))

    def _grids(self) -> None:
        motions = self.log.motions
        self.step = float(np.median(np.concatenate([np.diff(m.position.time) for m in motions])))
        if self.coupled:
            self.step /= max(1, int(np.ceil(self.step / settings.STEP)))
        self.substeps = 1 if self.coupled else max(1, int(np.ceil(self.step / settings.STEP_ALONE)))
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

    def _read(self) -> Array:
        """(n, J) measured positions, linear between readings; a joint without any is where its command is."""
        found = self.commanded.copy()
        for k, motion in enumerate(self.log.motions):
            rows = slice(self.begins[k], self.begins[k + 1])
            for j in self.joints:
                time, q = motion.position.of(j)
                if np.isfinite(q).any():
                    found[rows, j] = np.interp(self.grid[rows], time[np.isfinite(q)], q[np.isfinite(q)])
        return found

    @cached_property
    def _free(self) -> Array:
        """(J,) inertia of each joint at zero, the other joints free, kg·m²: MuJoCo's friction is as stiff as that."""
        zero = np.zeros((1, len(self.joints)))
        mass = self.dynamics.along(zero, zero).inertia[0, 0] + np.diag([one.armature or 0.0 for one in self.servos])
        return np.asarray(1.0 / np.diag(np.linalg.inv(mass)))

    @cached_property
    def _commands(self) -> list[tuple[Array, Array, NDArray[np.int64]]]:
        """Of each joint: stamps and values of the command in all motions, and the motions' begins."""
        found = []
        for j in self.joints:
            times, values = zip(*(motion.command.of(j) for motion in self.log.motions), strict=True)
            begins = np.concatenate([[0], np.cumsum([len(one) for one in times])]).astype(np.int64)
            found.append((np.concatenate(times), np.concatenate(values), begins))
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
            Parameter(e.name, j, e.label, e.unit, size(e, servo), e.spread, e.least, e.number, most=e.most)
            for j, servo in enumerate(self.servos)
            for e in EFFECTS
            if e.number not in (("droop",) if servo.kp else ("kp",))
        ]
        if self.coupled:
            found.append(Parameter("step", SHARED, "time step", "s", settings.TIME_STEP, 1.0, 0.0, "step"))
            found.append(Parameter("creep", SHARED, "creep of friction", "", settings.CREEP, 1.0, 0.0, "creep"))
        if self.log.robot.has_masses:
            found.append(self.payload(self.loads.torque[1]))
            found.append(Parameter("contact", SHARED, "height in the root frame", "m", 0.1, 1.5, 0.0, "contact"))
            if not self.held:
                usual = (RUBBING, "", settings.PLANE_FRICTION), (FLEXING, "m/N", settings.FLEX)
                found += [Parameter(name, SHARED, of, unit, one, 1.0, 0.0, of, of) for (name, of), unit, one in usual]
        return tuple(found)

    def start(self) -> Array:
        """(P,) starting values: half a prior size, 0 if signed; stops, limit and contact from ends of the motion."""
        values = np.where(self.least == 0.0, 0.5 * self.sizes, 0.0)
        for joint in self.joints:
            command, (low, high) = self.commanded[:, joint], (end[joint] for end in self.reach)
            values[self.index("low_stop", joint)] = max(low - command.min(), 0.0)
            values[self.index("high_stop", joint)] = max(command.max() - high, 0.0)
            values[self.index("torque_limit", joint)] = self._limits[joint]
            values[self.index("speed_limit", joint)] = 1.0 / self._fastest[0, joint]
            values[self.index("acceleration_limit", joint)] = 1.0 / self._fastest[1, joint]
        if (p := self.index("contact")) is not None:
            values[p] = self._raised
        return values

    @cached_property
    def _raised(self) -> float:
        """Height, m, above its lowest command to which the tool comes down."""
        height = self.ends.heights(self.measured[np.isfinite(self.measured).all(axis=1)])
        return max(float(np.quantile(height, 1.0 - settings.FEW)) - self.lowest, 0.0)

    @cached_property
    def _limits(self) -> Array:
        """(J,) inverse torque limits, 1/rad, to start from: by the largest torques of the motions (inverse dynamics).

        Of a servo that is not stated the largest error tells it, and of one whose limit is, what it has more.
        """
        if not self.coupled:
            error = [np.abs(self.commanded[place, j] - q) for j, (q, place, _, _) in enumerate(self._samples)]
            most = np.array([np.quantile(one, settings.FEW) for one in error])
            return np.asarray(np.divide(1.0, most, out=np.zeros_like(most), where=most > 0.0))
        most = np.quantile(np.abs(self.dynamics.torques(*self._moved)[0]), settings.FEW, axis=0)
        stiffness = np.array([servo.kp or 0.0 for servo in self.servos])
        stated = np.array([servo.limit or np.inf for servo in self.servos])
        return np.asarray(np.maximum(stiffness / np.maximum(most, 1e-12) - stiffness / stated, 0.0))

    @cached_property
    def _moved(self) -> tuple[Array, Array, Array]:
        """Measured positions (n, J) on the grid, and their first two derivatives, by local cubics (Savitzky, Golay)."""
        read, found = self._read(), list[list[Array]]()
        for a, b in zip(self.begins[:-1], self.begins[1:], strict=True):
            width = min(round(settings.STRIDE / self.step) // 2 * 2 + 1, (b - a - 1) // 2 * 2 + 1)
            found.append([savgol_filter(read[a:b], max(width, 5), 3, k, self.step, axis=0) for k in range(3)])
        q, v, a = (np.concatenate(one) for one in zip(*found, strict=True))
        return q, v, a

    @cached_property
    def _fastest(self) -> Array:
        """(2, J) largest measured speeds, rad/s, and accelerations, rad/s²; at least what stirs a joint."""
        most = [np.quantile(np.abs(one), settings.FEW, axis=0) for one in self._moved[1:]]
        return np.maximum(most, settings.STIRRED / settings.STRIDE)

    def numbers(self, joint: int, values: Array) -> tuple[Array, Array]:
        """(S, 18) inputs of the simulation and (S, 5) weights of payload and contact, for S sets (S, P)."""
        servo, x = self.servos[joint], dict.fromkeys((*PARAMETERS, "kp", "creep"), np.zeros(len(values)))
        weights = np.zeros((len(values), 5))
        for p, parameter in enumerate(self.parameters):
            if parameter.joint == joint:
                x[parameter.number] = values[:, p]
            elif parameter.effect in SIMULATOR:
                x[parameter.number] = values[:, p]
            elif parameter.number == "payload":
                weights[:, 0] = values[:, p]
            elif parameter.number == "contact":
                there = values[:, p]
                if self.held:
                    weights[:, 1] = np.where(there > 0.0, self.lowest + there, -np.inf)
                else:
                    weights[:, 1:3] = np.stack([there > 0.0, (there > 0.0) * (there - self.touching)], axis=1)
            elif parameter.number in self.touch:
                k = 3 + (*self.touch,).index(parameter.number)
                weights[:, k] = weights[:, 1] * (values[:, p] - self.touch[parameter.number])
        if servo.kp:  # a servo whose gain is stated is one with another stiffness, not one that follows its command
            stiffness = servo.kp * np.minimum(np.exp(x["kp"]), settings.SOFTER)
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
        if self.coupled:
            soft = np.minimum(x["creep"], settings.SOFTEST)
            x["hold"] = (1.0 - soft) / np.where(soft > 0.0, soft, np.inf) * self._free[joint] * x["droop"]
        return np.column_stack([x[name] for name in PARAMETERS]), weights

    def positions(self, group: Sequence[int], values: Array, free: bool = False) -> Array:
        """(S, n, J') simulated positions of a group's joints on the grid, S sets (S, P); ``free``: out of contact."""
        at = slice(group[0], group[-1] + 1)
        each = [self.numbers(j, values) for j in group]
        loads, parts, weights = self.given[:, :, at], self.loads, each[0][1]
        if free:
            weights[:, 1:] = 0.0
        matrices = [one if self.coupled else one[:, :, at, None] for one in (parts.inertia, parts.slope, parts.drag)]
        around = loads, *matrices, self.reference[0][:, at], self.reference[1][:, at], self.heights
        command, start = self._driven(group)
        numbers = np.ascontiguousarray(np.stack([one for one, _ in each], axis=1))
        grid = self.begins, self.first
        return simulate(numbers, weights, grid, command, around, start, self.step, self.substeps)

    def _driven(self, group: Sequence[int]) -> tuple[tuple[Array, Array, NDArray[np.int64]], Array]:
        """Stamps, values and begins (J', M + 1) of a group's commands, and where its joints start (M, J')."""
        at = slice(group[0], group[-1] + 1)
        start = np.empty((len(self.first), len(group)))
        for k, motion in enumerate(self.log.motions):
            begun = [motion.position.of(j)[1][0] for j in group]
            start[k] = np.where(np.isfinite(begun), begun, self.commanded[self.begins[k], at])
        commands = [self._commands[j] for j in group]
        offsets = np.cumsum([0, *(len(times) for times, _, _ in commands[:-1])])
        return (
            np.concatenate([times for times, _, _ in commands]),
            np.concatenate([values for _, values, _ in commands]),
            np.array([begins + offset for (_, _, begins), offset in zip(commands, offsets, strict=True)]),
        ), start

    def path(self, values: Array, free: bool = False) -> Array:
        """(n, J) simulated positions of all joints on the grid at the parameters (P,); ``free``: without contact."""
        found = self.by_joint(lambda group: list(self.positions(group, values[None], free)[0].T))
        return np.stack(found, axis=1)

    def residuals(self, group: Sequence[int], values: Array) -> list[Array]:
        """Residual (S, N) of each joint of a group, rad, measured minus simulated positions at the encoder's stamps."""
        parts = [slice(k, k + settings.TOGETHER) for k in range(0, len(values), settings.TOGETHER)]
        found = [np.empty((len(values), len(self._samples[joint][0]))) for joint in group]

        def simulated(part: slice) -> None:
            path = self.positions(group, values[part])
            for k, joint in enumerate(group):
                measured, at, beyond, _ = self._samples[joint]
                for left, own in zip(found[k][part], path[:, :, k], strict=True):  # together each term would be large
                    left[:] = measured - (1.0 - beyond) * own[at] - beyond * own[at + 1]

        self.each(simulated, parts)
        return found

    def rows(self, group: Sequence[int], values: Array, wanted: Mask | None = None, secant: bool = False) -> list[Rows]:
        """Return residual and forward-difference derivatives of the simulation at the parameters (P,)."""
        own = self.own(group, wanted)
        shares = np.where(self.of_effects(("kp", "delay")), settings.COARSE, settings.DIFFERENCE)
        steps = self.sizes[own] * (1.0 if secant else shares[own])
        sets = np.tile(values, (1 + len(own), 1))
        sets[1 + np.arange(len(own)), own] += steps
        rows = []
        for joint, found in zip(group, self.residuals(group, sets), strict=True):
            found[1:] = (found[0] - found[1:]) / steps[:, None]
            rows.append(Rows(found[0].copy(), found[1:].T, own, self.motion_of(joint)))
        return rows

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
        """Recompute the loads along the simulated positions; where joints are coupled, until these come to rest.

        These start from the measured ones, as from others far from a plane what is linear in its height does not end.
        """
        if self.coupled:
            self.about = self._read()
            self.loads = self._loads()
            self._press(values)
        for _ in range(settings.WAVES if self.coupled else 1):
            about = self.path(values, free=not self.held)
            moved, self.about = np.sqrt(np.mean((about - self.about) ** 2, axis=0)), about
            self.loads = self._loads()
            self._press(values)
            if (moved < self.noises).all():
                break

    def _loads(self) -> Loads:
        """Return the loads in the middle of the steps, and keep as ``reference`` (n, J) position and velocity there."""
        q, v = self._midway(self.about), np.zeros_like(self.about, order="C" if self.coupled else "F")
        for a, b in zip(self.begins[:-1], self.begins[1:], strict=True):
            v[a + 1 : b] = np.diff(self.about[a:b], axis=0) / self.step
        self.reference = q, v if self.coupled else np.zeros_like(v)
        return self.dynamics.along(q, v) if self.coupled else self.dynamics.at_rest(q)

    def _midway(self, path: Array) -> Array:
        """(n, J) positions in the middle of the steps to the points of a path (n, J)."""
        found = np.zeros_like(path, order="C" if self.coupled else "F")
        found[:] = path
        for a, b in zip(self.begins[:-1], self.begins[1:], strict=True):
            found[a + 1 : b] = 0.5 * (path[a : b - 1] + path[a + 1 : b])
        return found

    def _press(self, values: Array) -> None:
        """Compute the loads by contact of the tool with a plane, to which the joints' springs yield.

        Of joints that move each other the simulation itself finds the plane's force.
        """
        p, (q, _) = self.index("contact"), self.reference
        self.touching, self.heights, self.touch = 0.0, np.zeros(len(q)), dict[str, float]()
        # in memory a joint's follow each other
        self.given = np.zeros((8, *q.shape)) if self.coupled else np.zeros((8, *q.shape[::-1])).transpose(0, 2, 1)
        self.given[:2] = self.loads.torque
        self.loads = replace(self.loads, torque=self.given[:2])  # of a long log one copy is large
        if p is None:
            return
        if self.held:
            self.heights, tool = self.ends.lowest(q)
            self.given[2] = self.ends.up @ tool
            return
        # of a tool that touches nothing it tells what a plane would do where it is looked for
        values = np.where(self.of_effects(("contact",)) & (values[p] == 0.0), self.start(), values)
        self.touching = float(values[p])
        self.touch = {of: float(values[self.keys.index((effect, of))]) for effect, of in (RUBBING, FLEXING)}
        self._yield(values)

    def _yield(self, values: Array) -> None:
        """Write what joints that go their own ways yield to the plane, and its derivatives: loads over stiffness."""
        (q, _), plane, path = self.reference, self.lowest + self.touching, self.about
        each, (command, start) = [self.numbers(j, values[None]) for j in self.joints], self._driven(self.joints)
        numbers, drag = np.array([one[0] for one, _ in each]), np.zeros_like(q)
        soft = numbers[:, PARAMETERS.index("droop")]
        # the compliance of a joint that gravity does not load is thought to be the others'
        usual = float(np.median(soft[soft > 0.0])) if (soft > 0.0).any() else 1.0 / settings.STIFFNESS
        soft, weight = np.where(soft > 0.0, soft, usual), np.array([1.0, each[0][1][0, 0]])  # of payload
        # no servo gives more than its limit, and none is turned by more than what is near
        limits = np.minimum([one.limit or np.inf for one in self.servos], NEAR / soft)
        parts = self.given[:2], self.loads.inertia, self.loads.slope
        around = [np.tensordot(weight, one, 1).reshape(q.shape) for one in parts]
        for _ in range(settings.PRESSED):
            height, tool = self.ends.lowest(path)
            rise = self.ends.up @ tool
            gap = plane - height + (rise * path).sum(axis=1)
            force = plane_forces(
                numbers, soft, (self.begins, self.first), command, (drag, *around, q),
                (gap, rise, self.touch["compliance"], (limits / np.maximum(np.abs(rise), 1e-12)).min(axis=1)), start,
                self.step, self.substeps,
            )  # fmt: skip
            at = np.flatnonzero(force)
            first = np.isin(at, self.begins) | (np.diff(at, prepend=-2) > 1)
            yields = contact_yields(q[at], tool[at], self.ends.up, force[at], first, soft, *self.touch.values())
            # each joint alone sees the plane and the other joints' springs behind it
            own = soft * rise[at] ** 2
            whole = own.sum(axis=1, keepdims=True) + self.touch["compliance"]
            others = np.maximum(whole - own, settings.LEAST_SPRING * whole)
            self.given[2:] = 0.0
            for k, part in enumerate(yields, start=2):
                self.given[k][at] = part if k in (2, 4) else part * whole / others
            drag, path = self.given[2] + soft * rise * force[:, None], self.path(values)
        self.given[6][at], self.given[7] = own / others, path
