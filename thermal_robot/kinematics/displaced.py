"""Small errors in the four places where error enters a chain, made ready for a batch of configurations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal_robot.arrays import Array
from thermal_robot.errors import RobotError
from thermal_robot.kinematics.lie import exp6
from thermal_robot.kinematics.model import Chain


class Chained(Protocol):
    """A chain with a name; a :class:`~thermal_robot.Robot` is one."""

    @property
    def name(self) -> str:
        """Name of the robot, for messages."""

    @property
    def n(self) -> int:
        """Number of joints that can be driven."""

    @property
    def segments(self) -> Sequence[Any]:
        """The placements that may be displaced, from the root on."""

    @property
    def chain(self) -> Chain:
        """Constant arrays of its elements."""


class Weighted(Chained, Protocol):
    """A chain on which gravity pulls; a :class:`~thermal_robot.Robot` is one."""

    @property
    def gravity(self) -> NDArray[np.float64]:
        """(3,) m/s² in the root frame."""


@dataclass(frozen=True, eq=False)
class Displacement:
    """Small errors in the four places where error enters a chain; ``None`` means none there.

    The displaced tool pose is ``exp(base) · Π_k [P_k · exp(segment_k) · motion_k(q_k + joint_k)] ·
    exp(tool)``; every array may have a row for each configuration or be one row for all. Twists are ordered
    (linear m, angular rad). A joint that mimics another follows it where that one really is: ``q + joint``.

    Parameters
    ----------
    joint
        (N, n) or (n,) rad or m, added to the joint positions.
    segment
        (N, S, 6) or (S, 6): twist of each segment's placement, in its own frame (a right perturbation,
        ``LOCAL`` in Pinocchio).
    base
        (N, 6) or (6,) in the root frame.
    tool
        (N, 6) or (6,) in the tool frame.
    """

    joint: ArrayLike | None = None
    segment: ArrayLike | None = None
    base: ArrayLike | None = None
    tool: ArrayLike | None = None


@dataclass(frozen=True, eq=False)
class Displaced:
    """A displacement made ready: joint offsets (1 or N, n), twists as rigid motions (4, 4, 1 or N)."""

    joint: Array | None
    segment: dict[int, Array]
    base: Array | None
    tool: Array | None

    @staticmethod
    def of(robot: Chained, displacement: Displacement | None, rows: int) -> Displaced:
        """Make a displacement ready for that many rows."""
        if displacement is None:
            displacement = Displacement()
        joint = _channel(robot, "joint", displacement.joint, (robot.n,), rows)
        segment = _channel(robot, "segment", displacement.segment, (len(robot.segments), 6), rows)
        base = _channel(robot, "base", displacement.base, (6,), rows)
        tool = _channel(robot, "tool", displacement.tool, (6,), rows)
        twists = {} if segment is None else {int(k): segment[:, s] for s, k in enumerate(robot.chain.placed)}
        twists = {k: own for k, own in twists.items() if np.any(own)}
        ends = {k: own for k, own in ((_BASE, base), (_TOOL, tool)) if own is not None}
        motions = _motions({**twists, **ends})
        return Displaced(joint, {k: motions[k] for k in twists}, motions.get(_BASE), motions.get(_TOOL))


_BASE, _TOOL = -2, -1
"""Numbers of the ends of the chain beside those of its elements."""
NOWHERE = Displaced(None, {}, None, None)
"""Nothing displaced."""


def _channel(robot: Chained, name: str, value: ArrayLike | None, shape: tuple[int, ...], rows: int) -> Array | None:
    if value is None:
        return None
    array = np.asarray(value, dtype=float)
    if array.shape == shape:
        return array[None]
    if array.shape == (rows, *shape):
        return array
    raise RobotError(
        f"displacement {name!r} of shape {array.shape} does not fit: expected {shape} or {(rows, *shape)}",
        name=robot.name,
    )


def _motions(twists: dict[int, Array]) -> dict[int, Array]:
    """(4, 4, N) of each of (N, 6) twists, (4, 4, 1) where all rows are the same, as most errors of an arm are."""
    same = [k for k, own in twists.items() if (own == own[:1]).all()]
    alike = exp6(np.array([twists[k][0] for k in same]).reshape(-1, 6))
    motions = {k: motion[:, :, None] for k, motion in zip(same, alike, strict=True)}
    for k in twists.keys() - motions.keys():
        motions[k] = np.ascontiguousarray(np.moveaxis(exp6(twists[k]), 0, -1))
    return motions
