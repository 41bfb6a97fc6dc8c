"""How warm the hall and the links become in the course of a day."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from thermal_robot.blind.reality.world import World

Array = NDArray[np.float64]

_PAUSE = 1.0  # s between two steps in which warmth is integrated
_HOLDS = (2.4e6, 3.8e6)  # J/(m³ K), heat capacity by volume: aluminium 2.4e6, cast iron 3.3e6, steel 3.8e6
_WALL = (0.004, 0.015)  # m, of a cast link
_FILM = (7.0, 15.0)  # W/(m² K): a wall in a still room loses 7.7 (ISO 6946: 0.13 m² K/W); twice that as it moves
_MOTOR = (300.0, 3000.0)  # s for a motor to reach its temperature, from a wrist's to a base's


def time_constant(rng: np.random.Generator) -> float:
    """Draw how fast a link follows its surroundings, s: ρ c d / h of a wall that is cooled on one side."""
    return float(rng.uniform(*_HOLDS) * rng.uniform(*_WALL) / rng.uniform(*_FILM))


def hall(time: Array, rng: np.random.Generator) -> Array:
    """(N,) °C: air that swings and rises."""
    swing = rng.uniform(1.0, 4.0) * np.sin(time / time[-1] * rng.uniform(1.5, 9.0) + rng.uniform(0, 6.0))
    return np.asarray(21.0 + swing + rng.uniform(-1.0, 5.0) * time / time[-1])


def warmed(world: World, time: Array, air: Array, session: NDArray[np.int64] | None, rng: np.random.Generator) -> Array:
    """(N, S) °C of each segment's link: it follows the air with a time constant of its own, and its motor warms it."""
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
    """Integrate T' = (drive − T) / constant, between rows in steps of a second on a drive that runs straight.

    Parameters
    ----------
    time, drive
        (N,) s, increasing, and °C.
    constant
        s.
    start
        °C at the first row; that of the drive where absent.

    Returns
    -------
    ndarray
        (N,) °C.
    """
    fine = np.arange(time[0], time[-1] + _PAUSE, _PAUSE)
    # the mean of the drive over each step, so that a ramp is followed to second order
    driven = np.interp(fine + _PAUSE / 2.0, time, drive)
    kept, first = np.exp(-_PAUSE / constant), drive[0] if start is None else start
    passed = lfilter([1.0 - kept], [1.0, -kept], driven[:-1], zi=[kept * first])[0]
    return np.asarray(np.interp(time, fine, np.append(first, passed)))
