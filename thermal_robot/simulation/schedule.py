"""Schedule of a campaign: time, temperature, payload, repeats, and an order balanced in approaches."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array

ROWS = 60
"""Rows of a campaign of which nobody says how long it is: an hour's work, as :data:`SECONDS_A_ROW` has it."""
SECONDS_A_ROW = 60.0
"""s: an arm moves, settles and is measured in less; slower, so that the arm warms while it is measured."""
SECONDS_COLD = 15.0
"""s: what an arm takes to move, settle and be measured, where it need not warm."""
COLD, RISE = 20.0, 6.0
"""°C at the start, the temperature to which lengths refer; and K by which an arm at work warms in an hour or two."""
WARMING, CONSTANT = 0.6, 0.2
"""Shares of the campaign: how long the arm warms, before it cools; and the time constant of either."""
BLOCKS = 3
"""How often each payload comes round: so it is not confounded with time, and nobody changes it at each pose."""
SWAPS = 3000
"""Exchanges of two poses that are tried to balance an order."""
BALANCED = 0.1
"""Share by which the approaches from one side may differ from half in an order that is taken as balanced."""


Rows = NDArray[np.int64]


def conditions(rows: int, rise: float, loads: Sequence[float] = ()) -> dict[str, Array]:
    """Columns (N,) of time (s), temperature (°C) and, with loads, payload (kg).

    The arm warms exponentially by nearly ``rise``, K, then cools; without a rise, rows follow each other faster.
    Payloads come round in blocks of rows, no payload first.
    """
    share = np.arange(rows) / max(rows - 1, 1)
    warm = -np.expm1(-np.minimum(share, WARMING) / CONSTANT)
    left = np.exp(-np.maximum(share - WARMING, 0.0) / CONSTANT)
    found: dict[str, Array] = {
        "time": (SECONDS_A_ROW if rise else SECONDS_COLD) * np.arange(rows, dtype=np.float64),
        "temperature": np.asarray(COLD + rise * warm * left),
    }
    if loads:
        levels = np.array([0.0, *loads])
        blocks = min(BLOCKS * len(levels), rows)
        found["payload"] = levels[(np.arange(rows) * blocks // rows) % len(levels)]
    return found


def visits(rows: int, repeats: int) -> Rows:
    """Row indices (P, K) of K visits to each of P poses: once a round, every second round in reverse order.

    The last pose stays the last, so that no pose follows itself: a repeat requires leaving the pose.
    """
    poses = rows // repeats
    place = np.tile(np.arange(poses), (repeats, 1))
    place[1::2] = (poses - 2 - place[1::2]) % poses
    return np.asarray(place + poses * np.arange(repeats)[:, None]).T


def balanced(poses: Array, places: Rows, rng: np.random.Generator) -> Rows:
    """Order (P,) of poses (P, n), by random exchanges, in which each joint moves up and down about equally often.

    An exchange of two is kept unless the least balanced joint moves away from one half; it stops once all are within
    :data:`~thermal_robot.simulation.schedule.BALANCED`, or after :data:`~thermal_robot.simulation.schedule.SWAPS`.
    """
    order = np.arange(len(poses))
    worst = _unbalanced(poses, places, order)
    for _ in range(SWAPS):
        if worst <= BALANCED or len(poses) < 2:
            break
        one, other = rng.choice(len(poses), 2, replace=False)
        order[[one, other]] = order[[other, one]]
        now = _unbalanced(poses, places, order)
        if now <= worst:
            worst = now
        else:
            order[[one, other]] = order[[other, one]]
    return order


def _unbalanced(poses: Array, places: Rows, order: Rows) -> float:
    """Largest deviation from one half, over joints, of the share of moves that raise the joint's position."""
    moved = np.diff(poses[order][_pose_of(places)], axis=0)
    return float(np.abs((moved > 0.0).sum(axis=0) / np.maximum((moved != 0.0).sum(axis=0), 1) - 0.5).max())


def _pose_of(places: Rows) -> Rows:
    """Pose number (N,) of each row, from the row indices (P, K) of each pose."""
    found = np.empty(places.size, dtype=np.int64)
    found[places] = np.arange(len(places))[:, None]
    return found


def in_turn(poses: Array, places: Rows) -> tuple[Array, dict[str, NDArray[np.str_]]]:
    """Joint positions (N, n) of all rows in their order, and, if poses repeat, their numbers as labels ``pose``."""
    which = _pose_of(places)
    labels = {"pose": np.array([str(k + 1) for k in which])} if places.shape[1] > 1 else {}
    return np.asarray(poses[which]), labels
