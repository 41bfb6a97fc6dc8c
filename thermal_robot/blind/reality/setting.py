"""Conditions of a campaign: commands, their order, and temperatures of robot and hall."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from thermal_robot.blind.reality.world import Array, World

_PAUSE = 1.0  # s between two steps in which warmth is integrated
_HOLDS = (2.4e6, 3.8e6)  # J/(m³ K), heat capacity by volume: aluminium 2.4e6, cast iron 3.3e6, steel 3.8e6
_WALL = (0.004, 0.015)  # m, of a cast link
_FILM = (7.0, 15.0)  # W/(m² K): a wall in a still room loses 7.7 (ISO 6946: 0.13 m² K/W); twice that as it moves
_MOTOR = (300.0, 3000.0)  # s for a motor to reach its temperature, from a wrist's to a base's


def time_constant(rng: np.random.Generator) -> float:
    """Draw a link's thermal time constant, s: heat capacity by volume × wall thickness / heat transfer coefficient."""
    return float(rng.uniform(*_HOLDS) * rng.uniform(*_WALL) / rng.uniform(*_FILM))


def hall(time: Array, rng: np.random.Generator) -> Array:
    """Draw the hall's air temperature (N,), °C, over time (s): a constant, a sine wave and a linear drift."""
    swing = rng.uniform(1.0, 4.0) * np.sin(time / time[-1] * rng.uniform(1.5, 9.0) + rng.uniform(0, 6.0))
    return np.asarray(21.0 + swing + rng.uniform(-1.0, 5.0) * time / time[-1])


def warmed(world: World, time: Array, air: Array, session: NDArray[np.int64] | None, rng: np.random.Generator) -> Array:
    """Draw the temperature (N, S), °C, of each segment's link: a first-order lag behind the air plus its motor's heat.

    Motors warm up exponentially from the start of each session; without sessions they are warm throughout.
    """
    since = np.full_like(time, np.inf)  # without sessions the motors have been on for long
    for s in np.unique(session) if session is not None else ():  # cold at the start of each session
        rows = session == s
        since[rows] = time[rows] - time[rows][0]
    working = -np.expm1(-since / rng.uniform(*_MOTOR))
    warmth = {}
    for link in dict.fromkeys(world.links):
        motor = rng.uniform(2.0, 10.0) * working
        warmth[link] = followed(time, air + motor, time_constant(rng), start=float(air[0]))
    return np.column_stack([warmth[link] for link in world.links])


def followed(time: Array, drive: Array, constant: float, start: float | None = None) -> Array:
    """Response (N,), °C, of a first-order lag T' = (drive − T) / constant to a piecewise linear drive, in 1 s steps.

    Time, increasing, and constant are in s; ``start`` is the temperature at the first row, the drive's where absent.
    """
    fine = np.arange(time[0], time[-1] + _PAUSE, _PAUSE)
    # the mean of the drive over each step, so that a ramp is followed to second order
    driven = np.interp(fine + _PAUSE / 2.0, time, drive)
    kept, first = np.exp(-_PAUSE / constant), drive[0] if start is None else start
    passed = lfilter([1.0 - kept], [1.0, -kept], driven[:-1], zi=[kept * first])[0]
    return np.asarray(np.interp(time, fine, np.append(first, passed)))


_WIDEST = 2.4  # rad: cables keep a real robot from its whole range
_SHARE = 0.75
_WANDERS = 9.0  # %


@dataclass
class Setting:
    """Commands and conditions of N rows, in the order of measurement.

    Attributes
    ----------
    given
        (N,) whether a row is measured; the others, scattered among them in time, are commands whose positions are to be
        predicted. Either kind is visited as if the other were not there.
    q, velocity, acceleration
        (N, n) joint positions at the instant of measurement, and how they change there (zero where it stands still).
    time, payload, speed
        (N,) s, kg, and fraction of the maximum.
    approach
        (N, n) sign of the last move of each joint; 0 where it has not moved yet.
    air, links
        (N,) temperature of the hall and (N, S) of each segment's link, °C.
    sensor
        Temperature that is recorded: ``robot`` (one sensor on the robot), ``links`` (one on each) or ``air``.
    moving
        Whether poses are measured in passing.
    pose, session
        (N,) number of the commanded pose where poses are repeated, and of the session, or ``None``.
    extra
        Further columns by name, (N,) each.
    torque, poses
        (N, n) static torques that hold the sound robot's joints, N·m or N, and (N, 4, 4) poses of its tool frame.
    """

    world: World
    given: NDArray[np.bool_]
    q: Array
    velocity: Array
    acceleration: Array
    time: Array
    approach: Array
    payload: Array
    air: Array
    links: Array
    sensor: str
    moving: bool
    pose: NDArray[np.int64] | None
    session: NDArray[np.int64] | None
    speed: Array
    extra: dict[str, Array]
    torque: Array
    poses: Array

    @property
    def samples(self) -> int:
        """Number of rows N."""
        return len(self.time)

    @cached_property
    def overturning(self) -> Array:
        """Overturning moment (N, 3) of the sound robot's weight and payload about the root frame's origin, N·m."""
        return self.world.overturning(self.q, self.payload)

    @property
    def before(self) -> NDArray[np.int64]:
        """Index (N,) of the row visited before, among the measured or among the other rows.

        The first one's is itself.
        """
        before = np.empty(self.samples, dtype=np.int64)
        for rows in (np.flatnonzero(self.given), np.flatnonzero(~self.given)):
            before[rows] = np.append(rows[:1], rows[:-1])
        return before


def draw_setting(
    world: World,
    samples: int,
    rng: np.random.Generator,
    *,
    fresh: int = 0,
    moving: bool = False,
    visits: tuple[int, int] = (1, 1),
    sensor: str | None = None,
    sessions: bool = False,
) -> Setting:
    """Draw commands and conditions of one campaign, with ``fresh`` rows scattered among the measured ones.

    Each pose is measured so many ``visits``, drawn between the two, in mixed order; in ``sessions`` the robot is
    switched off once or twice. The sensor, as in :class:`Setting`, is drawn where absent.
    """
    given, q, label = _visits(world, samples, fresh, visits, rng)
    samples += fresh
    time, session = _clock(samples, sessions, rng)
    heaviest = float(np.clip(0.15 * sum(world.tree.mass.values()), 0.5, 8.0))  # kg: what suits a robot of its weight
    payload = rng.choice([0.0, heaviest / 2, heaviest], samples).round(2)
    speed = rng.choice([0.1, 0.3, 0.6, 1.0], samples)
    velocity, acceleration = np.zeros_like(q), np.zeros_like(q)
    if moving:
        velocity = rng.uniform(0.05, 0.8, q.shape) * rng.choice([-1.0, 1.0], q.shape) * speed[:, None]
        acceleration = rng.normal(0.0, 1.5, q.shape) * speed[:, None]
    air = hall(time, rng)
    links = warmed(world, time, air, session, rng)
    extra = {"humidity": humidity(samples, rng)} if rng.random() < 0.5 else {}
    sensor = sensor or str(rng.choice(["robot", "links", "air"], p=[0.45, 0.4, 0.15]))
    links = _as_sensed(sensor, time, air, links, rng)
    poses, torque = world.poses(q, payload, world.sound(samples))
    setting = Setting(
        world=world,
        given=given,
        q=q,
        velocity=velocity,
        acceleration=acceleration,
        time=time,
        approach=np.sign(velocity),
        payload=payload,
        air=air,
        links=links,
        sensor=sensor,
        moving=moving,
        pose=label,
        session=session,
        speed=speed,
        extra=extra,
        torque=torque,
        poses=poses,
    )
    if not moving:
        setting.approach = np.sign(q - q[setting.before])
    return setting


def humidity(samples: int, rng: np.random.Generator) -> Array:
    """Draw the air's relative humidity (N,), %: 45 plus a random walk with standard deviation 9 at the last row."""
    return np.round(45.0 + np.cumsum(rng.normal(0.0, _WANDERS / np.sqrt(samples), samples)), 1)


def _visits(
    world: World, samples: int, fresh: int, visits: tuple[int, int], rng: np.random.Generator
) -> tuple[NDArray[np.bool_], Array, NDArray[np.int64] | None]:
    """Draw the mask (N,) of measured rows, the commands (N, n) of all, and pose numbers (N,), ``None`` without repeats.

    The first row is measured: from it drift counts. No pose to be predicted is measured, too.
    """
    given = np.zeros(samples + fresh, dtype=bool)
    given[np.append(0, 1 + rng.permutation(samples + fresh - 1)[: samples - 1])] = True
    times = rng.integers(visits[0], visits[1] + 1, samples)
    label = np.empty(samples + fresh, dtype=np.int64)
    label[given] = rng.permuted(np.repeat(np.arange(samples), times)[:samples])
    label[~given] = np.arange(samples, samples + fresh)
    q = _commands(world, samples + fresh, rng)[label]
    return given, q, None if visits == (1, 1) else label


def _clock(samples: int, sessions: bool, rng: np.random.Generator) -> tuple[Array, NDArray[np.int64] | None]:
    """Draw times (N,), s from the first row on, over 1.5 to 6 hours, and session numbers, ``None`` without sessions."""
    length = rng.uniform(1.5, 6.0) * 3600.0
    steps = rng.gamma(4.0, 1.0, samples)
    time = np.cumsum(steps) - steps[0]
    session = None
    if sessions:
        breaks = np.sort(rng.choice(np.arange(samples // 5, samples - samples // 5), rng.integers(1, 3), replace=False))
        session = np.searchsorted(breaks, np.arange(samples), side="right")
        time = time + session * rng.uniform(0.3, 1.0) * time[-1]
    return np.round(time / time[-1] * length, 1), session


def _as_sensed(sensor: str, time: Array, air: Array, links: Array, rng: np.random.Generator) -> Array:
    """Replace link temperatures (N, S), °C, by such as the recorded sensor determines.

    One sensor on the robot: nearly the mean in all links; in the air: one lag behind it; on each link: unchanged.
    """
    if sensor == "robot":  # one casting: its links warm nearly alike, or one sensor would be of no use
        common = links.mean(axis=1, keepdims=True)
        return np.asarray(common + 0.06 * (links - common))
    if sensor == "air":  # nothing heats the links but the air, after which they lag
        return np.repeat(followed(time, air, time_constant(rng))[:, None], links.shape[1], axis=1)
    return links


def _commands(world: World, count: int, rng: np.random.Generator) -> Array:
    """Draw uniform commands (count, n) within 75 % of the ranges, without the 30 % whose tool is nearest the root."""
    lower, upper = np.maximum(world.lower, -_WIDEST), np.minimum(world.upper, _WIDEST)
    middle, half = (lower + upper) / 2, _SHARE * (upper - lower) / 2
    drawn = rng.uniform(middle - half, middle + half, (2 * count + 60, world.n))
    place = world.poses(drawn, np.zeros(len(drawn)), world.sound(len(drawn)))[0][:, :3, 3]
    reach = np.linalg.norm(place, axis=1)
    usable = drawn[reach >= np.quantile(reach, 0.3)]
    return np.asarray(usable[:count])
