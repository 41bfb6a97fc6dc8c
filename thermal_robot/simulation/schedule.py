"""When each row is measured: time, temperature, payload, repeats, and the order that brings both approaches."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign.turning import arrivals
from thermal_robot.simulation import settings

Rows = NDArray[np.int64]


def conditions(rows: int, rise: float, loads: Sequence[float] = ()) -> dict[str, Array]:
    """Return (N,) time, s, temperature, °C, and, where loads are given, payload, kg, of each row in its turn.

    The arm warms by nearly ``rise``, K, then cools; payloads, none first, come round in blocks.
    """
    share = np.arange(rows) / max(rows - 1, 1)
    warm = -np.expm1(-np.minimum(share, settings.WARMING) / settings.CONSTANT)
    left = np.exp(-np.maximum(share - settings.WARMING, 0.0) / settings.CONSTANT)
    found: dict[str, Array] = {
        "time": settings.SECONDS_A_ROW * np.arange(rows, dtype=np.float64),
        "temperature": np.asarray(settings.COLD + rise * warm * left),
    }
    if loads:
        levels = np.array([0.0, *loads])
        blocks = min(settings.BLOCKS * len(levels), rows)
        found["payload"] = levels[(np.arange(rows) * blocks // rows) % len(levels)]
    return found


def visits(rows: int, repeats: int) -> Rows:
    """(P, K) rows in which each of P poses is measured: once a round, every second round the other way round.

    The last pose stays the last, so that no pose follows itself: a robot that does not leave repeats nothing.
    """
    poses = rows // repeats
    place = np.tile(np.arange(poses), (repeats, 1))
    place[1::2] = (poses - 2 - place[1::2]) % poses
    return np.asarray(place + poses * np.arange(repeats)[:, None]).T


def approaches(q: Array, names: tuple[str, ...], covariates: dict[str, Array]) -> dict[str, Array]:
    """Return (N,) ``approach.<joint>`` of rows in their order; where nothing is known, at the first, 0."""
    return arrivals(q, names, covariates, None)


def balanced(poses: Array, places: Rows, rng: np.random.Generator) -> Rows:
    """(P,) an order of poses (P, n) in which each joint comes from either side about equally often.

    Two poses are exchanged wherever that brings the least balanced joint nearer to half; it stops once all are within
    :data:`~thermal_robot.simulation.settings.BALANCED`.
    """
    order = np.arange(len(poses))
    worst = _unbalanced(poses, places, order)
    for _ in range(settings.SWAPS):
        if worst <= settings.BALANCED or len(poses) < 2:
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
    """How far the share of rising moves of any joint is from half."""
    moved = np.diff(poses[order][_pose_of(places)], axis=0)
    return float(np.abs((moved > 0.0).sum(axis=0) / np.maximum((moved != 0.0).sum(axis=0), 1) - 0.5).max())


def _pose_of(places: Rows) -> Rows:
    """(N,) which pose each row measures."""
    found = np.empty(places.size, dtype=np.int64)
    found[places] = np.arange(len(places))[:, None]
    return found


def in_turn(poses: Array, places: Rows) -> tuple[Array, Rows]:
    """Return (N, n) the poses (P, n) in the order of rows, and (N,) which pose each row measures."""
    which = _pose_of(places)
    return np.asarray(poses[which]), which
