"""Hysteresis of joints: distance since the last reversal, and the strains of Prandtl–Ishlinskii stop operators."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign.names import CLOCK
from thermal_robot.campaign.settings import STILL

SLIPS = tuple(2.0 ** (k / 4) for k in range(-28, 9))
"""rad or m: how far a joint goes before an element slips; from 8 mm, a twentieth of a short stroke, to more than half a
turn, four a factor of two: a sum of two neighbours is within 2 % of an element that slips between them. They are the
same for every campaign, so that a law that was found in one can be told in another."""


def moves(q: Array) -> NDArray[np.bool_]:
    """Mask (n,) of the joints whose positions (N, n) span more than 1e-4 rad or m; one boolean for one joint's (N,).

    The limit is :data:`~thermal_robot.campaign.settings.STILL`, above the jitter of an encoder at rest.
    """
    return np.asarray(np.ptp(q, axis=0) > STILL if len(q) else np.zeros(q.shape[1:], dtype=bool))


def since_turns(
    q: Array, names: tuple[str, ...], covariates: Mapping[str, Array], sessions: NDArray[np.str_] | None
) -> dict[str, Array]:
    """Signed distance since the last reversal (N,), by joint, rad or m; strains of Prandtl–Ishlinskii stop operators.

    The distance is negative while the joint decreases. Before a session's first reversal it counts from the first row.
    The strains (N,), rad or m, under the names of :func:`strained`, are of springs that follow the joint until they
    slip at each of :data:`SLIPS` (Kuhnen, *Modeling, identification and compensation of complex hysteretic
    nonlinearities*, 2003); zero at the first row of a session.

    ``q`` are (N, n) commanded positions of n joints, rad or m: the robot goes straight on to the next. ``time`` or
    ``order`` among the covariates says which row comes after which; without either the answer is empty. ``sessions``
    are (N,) labels of the uninterrupted run that a row belongs to; ``None`` where there is one.
    """
    since, strain = np.zeros_like(q), np.zeros((*q.shape, len(SLIPS)))
    runs = list(_runs(covariates, sessions, len(q)))
    for rows in runs:
        since[rows] = np.apply_along_axis(_since_turn, 0, q[rows])
        strain[rows] = _strains(q[rows])
    if not runs:
        return {}
    held = {strained(name, r): strain[:, j, k] for j, name in enumerate(names) for k, r in enumerate(SLIPS)}
    return {**dict(zip(names, since.T, strict=True)), **held}


def arrivals(
    q: Array, names: tuple[str, ...], covariates: Mapping[str, Array], sessions: NDArray[np.str_] | None
) -> dict[str, Array]:
    """Directions of approach (N,) by ``approach.<joint>``, from the order of rows: sign of each joint's last move.

    +1 where the joint increased on its way from the row before, −1 where it decreased; a joint that did not move keeps
    its direction. 0 where it is unknown: at the first row of a session, and after rows that ``order`` shows to be
    missing (:func:`_whole`). This holds for a robot that goes straight from pose to pose. The arguments are those of
    :func:`since_turns`.
    """
    side, order = np.zeros_like(q), covariates.get("order")
    runs = [part for run in _runs(covariates, sessions, len(q)) for part in _whole(run, order)]
    for rows in runs:
        side[rows] = np.sign(np.apply_along_axis(_since_turn, 0, q[rows]))
    return {f"approach.{name}": side[:, j] for j, name in enumerate(names)} if runs else {}


def clock_of(covariates: Mapping[str, Array]) -> Array | None:
    """Clock column (N,) by which rows are ordered; ``None`` without one."""
    return next((covariates[name] for name in CLOCK if name in covariates), None)


def _runs(
    covariates: Mapping[str, Array], sessions: NDArray[np.str_] | None, samples: int
) -> Iterator[NDArray[np.int64]]:
    """Yield the row indices of each session, sorted by time or order; none where neither is recorded or varies."""
    clock = clock_of(covariates)
    if clock is None or not samples or not np.ptp(clock) > 0.0:
        return
    for run in np.unique(sessions) if sessions is not None else [None]:
        rows = np.arange(samples) if sessions is None else np.flatnonzero(sessions == run)
        yield rows[np.argsort(clock[rows], kind="stable")]


def _whole(run: NDArray[np.int64], order: Array | None) -> list[NDArray[np.int64]]:
    """Split a run (row numbers in order) where poses are missing: where the counter ``order`` leaves out a number.

    ``order`` is a counter if its numbers are whole and its smallest step is the most frequent; a time in seconds has
    steps of any size, and the run stays whole.
    """
    if order is None or len(run) < 2 or (order != np.round(order)).any():
        return [run]
    steps, often = np.unique(np.diff(np.unique(order)), return_counts=True)
    if not len(steps) or often[0] < often.max():
        return [run]
    return np.split(run, np.flatnonzero(np.diff(order[run]) > steps[0]) + 1)


def strained(joint: str, slip: float) -> str:
    """Name of the strain of a joint's stop operator that slips at a distance, rad or m."""
    return f"{joint}, slips at {slip:.6g}"


def _strains(path: Array) -> Array:
    """Prandtl–Ishlinskii stop operators: strains (N, n, K) of joints that pass positions (N, n) in this order."""
    most = np.array(SLIPS)
    found = np.zeros((*path.shape, len(most)))
    for row, move in enumerate(np.diff(path, axis=0)):
        np.clip(found[row] + move[:, None], -most, most, out=found[row + 1])
    return found


def _since_turn(path: Array) -> Array:
    """Signed distance (N,) of one joint from its last reversal, from positions (N,) in order."""
    moved = np.diff(path)
    if not len(moved):
        return np.zeros(len(path))
    steps = np.arange(len(moved))
    way = np.where(np.abs(moved) > STILL, np.sign(moved), 0.0)
    # a joint that rests keeps the direction that it had
    way = way[np.maximum.accumulate(np.where(way != 0.0, steps, 0))]
    turned = np.concatenate([[False], way[1:] * way[:-1] < 0.0])
    start = np.maximum.accumulate(np.where(turned, steps, 0))
    return np.concatenate([[0.0], np.where(way != 0.0, path[1:] - path[start], 0.0)])
