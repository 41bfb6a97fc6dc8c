"""Which engine works on a batch: Pinocchio for few configurations, NumPy for many, compiled lanes for very many."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from thermal_robot.arrays import Array
from thermal_robot.kinematics import compiled, lanes, settings, thin

if TYPE_CHECKING:
    from thermal_robot.kinematics.displaced import Chained, Weighted


class Engine(Protocol):
    """What every engine can do: write the results of N configurations ``q``, (N, n), into ``out``.

    A point of the tool is (3,) or (N, 3) m in its frame, ``None`` for its origin; the mass of a payload () or (N,) kg.
    """

    def poses(self, robot: Chained, q: Array, out: Array) -> None:
        """Write the poses of the tool, (N, 4, 4)."""

    def jacobians(self, robot: Chained, q: Array, point: Array | None, out: Array) -> None:
        """Write the Jacobians at the point, (N, 6, n)."""

    def placements(self, robot: Chained, q: Array, point: Array | None, out: Array) -> None:
        """Write the sensitivities of the point to every placement, (N, 6, S, 6)."""

    def gravity(self, robot: Weighted, q: Array, mass: Array, com: Array, out: Array) -> None:
        """Write the torques that hold the arm and the payload, (N, n)."""


def engine_for(robot: Chained, rows: int) -> Engine:
    """Return the engine that is fastest for that many configurations."""
    if rows <= settings.FEW and thin.covers(robot):
        return thin
    return compiled if rows >= settings.MANY and compiled.installed() else lanes
