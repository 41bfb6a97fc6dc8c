"""What a joint remembers of its moves: how far it has gone since it last turned round, and what elements hold it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SLIPS = tuple(2.0 ** (k / 4) for k in range(-28, 9))
"""rad or m: how far a joint goes before an element slips; from 8 mm, a twentieth of a short stroke, to more than half a
turn, four a factor of two: a sum of two neighbours is within 2 % of an element that slips between them. They are the
same for every campaign, so that a law that was found in one can be told in another."""
_STILL = 1e-6  # rad or m: what a command differs by from the one before when the joint is not moved


def since_turns(
    q: Array, names: tuple[str, ...], covariates: Mapping[str, Array], sessions: NDArray[np.str_] | None
) -> dict[str, Array]:
    """Return (N,) by joint: the signed distance from its last turning point, rad or m; negative on the way down.

    At the first row of a session no turn is known: the distance is that from there. Beside it stands, by the name
    :func:`strained`, what elements of each of :data:`SLIPS` are strained by, rad or m: springs that follow the joint
    until they slip, the stop operators of Prandtl and Ishlinskii (Kuhnen, *Modeling, identification and compensation of
    complex hysteretic nonlinearities*, 2003). At the first row of a session they are slack.

    Parameters
    ----------
    q
        (N, n) commanded positions, rad or m: the robot goes straight from one to the next.
    names
        Of the n joints.
    covariates
        By name; ``time`` or ``order`` says which row comes after which. Without either the answer is empty.
    sessions
        (N,) label of the uninterrupted run that a row belongs to; ``None`` where there is one.
    """
    clock = covariates.get("time", covariates.get("order"))
    if clock is None or not len(q) or not np.ptp(clock) > 0.0:
        return {}
    since = np.zeros_like(q)
    strain = np.zeros((*q.shape, len(SLIPS)))
    for run in np.unique(sessions) if sessions is not None else [None]:
        rows = np.arange(len(q)) if sessions is None else np.flatnonzero(sessions == run)
        rows = rows[np.argsort(clock[rows], kind="stable")]
        for j in range(q.shape[1]):
            since[rows, j] = _since_turn(q[rows, j])
        strain[rows] = _strains(q[rows])
    held = {strained(name, r): strain[:, j, k] for j, name in enumerate(names) for k, r in enumerate(SLIPS)}
    return {**dict(zip(names, since.T, strict=True)), **held}


def strained(joint: str, slip: float) -> str:
    """Return the name of the strain of a joint's element that slips after so many rad or m."""
    return f"{joint}, slips at {slip:.6g}"


def _strains(path: Array) -> Array:
    """(N, n, K) strains of elements of joints that pass positions (N, n) in this order."""
    most = np.array(SLIPS)
    moved = np.diff(path, axis=0)
    found = np.zeros((*path.shape, len(most)))
    for row, move in enumerate(moved):
        np.clip(found[row] + move[:, None], -most, most, out=found[row + 1])
    return found


def _since_turn(path: Array) -> Array:
    """(N,) the same of one joint that passes positions (N,) in this order."""
    moved = np.diff(path)
    way = np.where(np.abs(moved) > _STILL, np.sign(moved), 0.0)
    # a joint that rests keeps the direction that it had
    moves = np.arange(len(way))
    way = way[np.maximum.accumulate(np.where(way != 0.0, moves, 0))] if len(way) else way
    turned = np.zeros(len(way), dtype=bool)
    turned[1:] = way[1:] * way[:-1] < 0.0
    start = np.maximum.accumulate(np.where(turned, moves, 0)) if len(way) else moves
    return np.concatenate([np.zeros(1), path[1:] - path[start]])
