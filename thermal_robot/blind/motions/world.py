"""Worlds of the trial: MuJoCo simulates an arm with position actuators, and its encoders are read."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.blind.motions import sizes
from thermal_robot.blind.motions.arm import TOOL, Arm, draw_arm
from thermal_robot.blind.motions.fault import Fault, Sound, draw_fault
from thermal_robot.correction.mujoco_models import mujoco_or_error
from thermal_robot.motion import Channel, Motion, MotionLog
from thermal_robot.motion.write import stick
from thermal_robot.robot import load_robot


class Unseen(Exception):
    """Error: no size drawn for a fault moves the encoders of its arm visibly."""


@dataclass(frozen=True, eq=False)
class World:
    """Arm, commands (M, n, J), rad, of M motions, and settings of their simulation and of the encoders.

    ``kinds`` (M,) of the motions; sampling ``rate``, Hz; time ``step``, s; ``explicit`` Runge-Kutta integration, else
    implicit; ``count``, the encoders' resolution, rad; ``sticks`` whether dry friction holds a joint at rest, instead
    of letting it creep, as MuJoCo's usual friction does.
    """

    arm: Arm
    commands: Array
    kinds: tuple[str, ...]
    rate: float
    step: float
    explicit: bool
    count: float
    sticks: bool = False

    def spec(self, fault: Fault) -> Any:
        """Build the ``mujoco.MjSpec`` of the arm with its position servos and a fault."""
        mujoco = mujoco_or_error()
        spec = mujoco.MjSpec.from_string(self.arm.urdf)
        spec.compiler.fusestatic, spec.compiler.boundmass, spec.compiler.boundinertia = False, 1e-9, 1e-12
        rule = mujoco.mjtIntegrator
        spec.option.integrator = rule.mjINT_RK4 if self.explicit else rule.mjINT_IMPLICITFAST
        spec.option.timestep = self.step
        for name, servo in self.arm.servos.items():
            if self.sticks:
                stick(spec, spec.joint(name))
            spec.joint(name).limited, spec.joint(name).actfrclimited = False, False
            actuator = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
            actuator.set_to_position(kp=servo.kp, kv=servo.kd)
            actuator.forcelimited, actuator.forcerange = True, np.array([-1.0, 1.0]) * (servo.limit or 0.0)
        fault.built(spec, self.arm)
        return spec

    def mjcf(self) -> str:
        """Return the sound arm as MJCF text, with its time step."""
        spec = self.spec(Fault("nothing"))
        spec.compile()
        return str(spec.to_xml())

    def simulated(self, fault: Fault) -> Sound:
        """Simulate all motions with a fault, each from rest: positions and torques (M n, J), heights of the tool."""
        mujoco, model = mujoco_or_error(), self.spec(fault).compile()
        held = round(1.0 / (self.rate * self.step))
        before = round(sizes.SETTLE * self.rate)
        shape = self.commands.shape
        position, torque, height = np.empty(shape), np.empty(shape), np.empty(shape[:2])
        for m, commands in enumerate(self.commands):
            data = mujoco.MjData(model)
            data.qpos[:] = commands[0]
            times = np.arange((before + len(commands)) * held) * self.step - before / self.rate - fault.delay
            rows = np.clip(np.floor(times * self.rate + 1e-9).astype(int), 0, None)
            for k, row in enumerate(rows):
                n, rest = divmod(k, held)
                if rest == 0 and n >= before:
                    position[m, n - before], torque[m, n - before] = data.qpos, data.actuator_force
                    height[m, n - before] = data.body(TOOL).xpos[2]
                data.ctrl[:] = fault.commanded(commands[row], data.qpos)
                fault.acts(model, data.qpos, data.qfrc_applied)
                mujoco.mj_step(model, data)
        flat = shape[0] * shape[1]
        return Sound(position.reshape(flat, -1), torque.reshape(flat, -1), height.ravel())

    def log(self, found: Sound, stated: bool = True) -> MotionLog:
        """Return the log of commands and of positions rounded to encoder counts, with servo gains if ``stated``."""
        read = (self.count * np.round(found.position / self.count)).reshape(self.commands.shape)
        time = np.arange(self.commands.shape[1]) / self.rate
        motions = tuple(
            Motion(f"m{m}", kind, Channel(time, command), Channel(time, q))
            for m, (kind, command, q) in enumerate(zip(self.kinds, self.commands, read, strict=True))
        )
        servos = self.arm.servos if stated else {}
        return MotionLog("drawn", load_robot(self.arm.urdf, TOOL), self.arm.joints, motions, servos)


def draw_world(rng: np.random.Generator, joints: int, motions: int) -> World:
    """Draw an arm, its commands, kinds of motion in turn, and settings of encoders, integrator and friction."""
    arm, rate = draw_arm(rng, joints), float(rng.choice(sizes.RATES))
    kinds = tuple(list(MOVES)[m % len(MOVES)] for m in range(motions))
    time = np.arange(round(sizes.SECONDS * rate)) / rate
    commands = np.stack([np.stack([MOVES[kind](rng, time) for _ in range(joints)], axis=1) for kind in kinds])
    count = 2.0 * np.pi / 2.0 ** rng.integers(*sizes.BITS, endpoint=True)
    world = World(arm, commands, kinds, rate, float(rng.choice(sizes.STEPS)), False, float(count))
    fastest = _fastest(world, commands[:, :: round(rate)].reshape(-1, joints))
    explicit = bool(rng.random() < 0.5 and fastest * world.step < sizes.STIFF)
    return replace(world, explicit=explicit, sticks=bool(rng.random() < 0.5))


def _fastest(world: World, q: Array) -> float:
    """Fastest rate, 1/s, at which the servos' damping acts in configurations (n, J): largest eigenvalue of M⁻¹ D."""
    mujoco, model = mujoco_or_error(), world.spec(Fault("nothing")).compile()
    data, mass = mujoco.MjData(model), np.empty((len(q), model.nv, model.nv))
    for one, out in zip(q, mass, strict=True):
        data.qpos[:] = one
        mujoco.mj_forward(model, data)
        mujoco.mj_fullM(model, data, out)
    damping = np.diag([float(servo.kd or 0.0) for servo in world.arm.servos.values()])
    return float(np.linalg.eigvals(np.linalg.solve(mass, damping)).real.max())


def draw_log(rng: np.random.Generator, world: World, name: str, stated: bool = True) -> tuple[MotionLog, Fault]:
    """Draw a visible fault of a name, and return the log of the world with it, and the fault.

    Raises
    ------
    Unseen
        If in no draw the largest rms displacement of a joint lies between an encoder count and 0.8 rad.
    """
    sound = world.simulated(Fault("nothing"))
    if name == "nothing":
        return world.log(sound, stated), Fault(name)
    for number in range(sizes.DRAWS):
        fault = draw_fault(rng, name, world.arm, sound, 1.5**number)
        found = world.simulated(fault)
        moved = np.sqrt(np.mean((found.position - sound.position) ** 2, axis=0)).max()
        if np.isfinite(moved) and sizes.VISIBLE * world.count <= moved < sizes.REACH:
            return world.log(found, stated), fault
    raise Unseen(name)


def _sines(rng: np.random.Generator, time: Array) -> Array:
    size = rng.uniform(0.1, 0.4, 3)[:, None] * sizes.REACH
    rate = rng.uniform(*sizes.SPEED, 3)[:, None] / size / 3.0
    phase = rng.uniform(0.0, 2.0 * np.pi, 3)[:, None]
    return _centre(rng) + np.asarray((size * np.sin(rate * time + phase)).sum(axis=0))


def _centre(rng: np.random.Generator) -> float:
    return float(rng.uniform(-sizes.CENTRE, sizes.CENTRE))


def _points(rng: np.random.Generator, time: Array) -> tuple[Array, Array]:
    """Draw waypoints: instants from 0 to beyond the last of ``time``, s, and positions, rad."""
    at = np.concatenate([[0.0], np.cumsum(rng.uniform(0.5, 1.5, 2 * int(time[-1]) + 2))])
    return at, _centre(rng) + sizes.REACH * rng.uniform(-1.0, 1.0, len(at))


def _steps(rng: np.random.Generator, time: Array) -> Array:
    at, places = _points(rng, time)
    return np.asarray((places[0] + 0.5 * (places - places[0]))[np.searchsorted(at, time, side="right") - 1])


def _ramps(rng: np.random.Generator, time: Array) -> Array:
    return np.interp(time, *_points(rng, time))


def _random(rng: np.random.Generator, time: Array) -> Array:
    """Position (n,), rad, of a motion through random waypoints by minimum-jerk (quintic) steps."""
    at, places = _points(rng, time)
    return _joined(at, places, time, lambda s: s**3 * (10.0 - 15.0 * s + 6.0 * s**2))


def _trapezoids(rng: np.random.Generator, time: Array) -> Array:
    """Position (n,), rad, of trapezoidal velocity profiles (thirds: accelerate, cruise, decelerate), with pauses."""
    at, places = _points(rng, time)
    places[1::2] = places[:-1:2][: len(places[1::2])]
    third = lambda s: np.where(s < 1 / 3, 2.25 * s**2, np.where(s > 2 / 3, 1 - 2.25 * (1 - s) ** 2, 1.5 * s - 0.25))  # noqa: E731
    return _joined(at, places, time, third)


def _joined(at: Array, places: Array, time: Array, shape: Callable[[Array], Array]) -> Array:
    k = np.searchsorted(at, time, side="right") - 1
    return np.asarray(places[k] + (places[k + 1] - places[k]) * shape((time - at[k]) / (at[k + 1] - at[k])))


MOVES: dict[str, Callable[[np.random.Generator, Array], Array]] = {
    "sines": _sines,
    "steps": _steps,
    "ramps": _ramps,
    "points": _random,
    "trapezoids": _trapezoids,
}
"""Kinds of commands: functions from instants (n,), s, to positions (n,), rad."""
