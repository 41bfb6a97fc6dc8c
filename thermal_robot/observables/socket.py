"""Point constraint: a ball on the tool sits in a socket, whose place nobody measured (closed-loop calibration).

Each socket is an unknown point that all its rows share (Wampler, Hollerbach and Arai, *IEEE Transactions on Robotics
and Automation* 11, 1995, on implicit loops). How far two of a stand are apart is measured by rows of another kind
(:mod:`~thermal_robot.observables.spacing`).

The twist of the target is taken about the socket, not about the predicted point, which it should meet: what moves all
sockets like a rigid body is then exactly an alias of the points, whatever is left of the rows. What turns the target
about the tool, as the last joint's zero does, is an alias of its place about the predicted point instead
(:meth:`Socket.sees_there`); both are where a row leaves nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.observables.observable import Artefact, Observable, Seen, in_mm


@dataclass(frozen=True, eq=False)
class Stand:
    """Sockets of a stand that stays in one place; ``points`` (S, 3) m, measurement frame."""

    sockets: tuple[str, ...]
    points: Array

    @property
    def width(self) -> int:
        """Number of free parameters: three coordinates a socket."""
        return int(self.points.size)

    @property
    def words(self) -> str:
        """Positions of its sockets in words, mm."""
        return ", ".join(f"socket {s} at {in_mm(p)}" for s, p in zip(self.sockets, self.points, strict=True))

    def moved(self, step: Array) -> Stand:
        """Return the stand after a step (3 S,) of its points, m."""
        return replace(self, points=self.points + step.reshape(-1, 3))


class Socket(Observable):
    """Closed-loop point constraint: the target sits in a socket of a stand."""

    kind: ClassVar[str] = "socket"
    says: ClassVar[str] = "a ball in its socket"
    label: ClassVar[str] = "stand"

    def has_length(self, seen: Seen) -> bool:
        """Return false: sockets define no length, as a smaller robot spreads less about them."""
        return False

    def artefacts(self, seen: Seen, known: Mapping[str, Any]) -> dict[str, Artefact]:
        """Return the stands by name, each socket at the median of the target positions predicted in it."""
        (stands, number), sockets, where = seen.shared(self.label), seen.labels("socket"), seen.where
        found: dict[str, Artefact] = {}
        for k, stand in enumerate(stands):
            own = tuple(np.unique(sockets[number == k]).tolist())
            points = [np.median(where[(number == k) & (sockets == socket)], axis=0) for socket in own]
            found[stand] = Stand(own, np.array(points))
        return found

    def covers(self, seen: Seen, name: str, artefact: Stand) -> bool:
        """Whether the stand has every socket in which these rows sit."""
        (names, number), sockets = seen.shared(self.label), seen.labels("socket")
        return {*np.unique(sockets[number == names.index(name)]).tolist()} <= {*artefact.sockets}

    def points(self, seen: Seen, artefacts: Mapping[str, Any], end: str) -> Array:
        """(n, 3) position of the socket that column ``end`` names, measurement frame, m; NaN if the stand lacks it."""
        points = np.full_like(seen.position, np.nan)
        (names, number), sockets = seen.shared(self.label), seen.labels(end)
        for k, name in enumerate(names):
            own = artefacts[name]
            for socket, point in zip(own.sockets, own.points, strict=True):
                points[(number == k) & (sockets == socket)] = point
        return points

    def at_socket(self, seen: Seen, artefacts: Mapping[str, Any], name: str, end: str) -> Array:
        """(n, 3, w) derivative of :meth:`points` by the points of a stand, root frame axes."""
        names, number = seen.shared(self.label)
        here, own = number == names.index(name), artefacts[name]
        columns = np.zeros((len(here), 3, own.width))
        for k, socket in enumerate(own.sockets):
            columns[here & (seen.labels(end) == socket), :, 3 * k : 3 * k + 3] = seen.base[:3, :3].T
        return columns

    def gap(self, seen: Seen, artefacts: Mapping[str, Any]) -> Array:
        """(n, 3) socket − predicted target position, root frame axes, m."""
        return seen.in_root(self.points(seen, artefacts, "socket") - seen.where)

    def sees(self, seen: Seen, artefacts: Mapping[str, Any], twists: Array) -> Array:
        """(n, 6, K) twists with the displacement taken at the socket, where the target should be: v + ω × gap."""
        moved = twists.copy()
        moved[:, :3] += np.cross(twists[:, 3:], self.gap(seen, artefacts)[:, :, None], axis=1)
        return moved

    def sees_there(self, seen: Seen, artefacts: Mapping[str, Any], twists: Array) -> Array:
        """Return the twists (n, 6, K) unchanged: their displacement v is that of the predicted target position."""
        return twists

    def column(self, seen: Seen, artefacts: Mapping[str, Any], name: str) -> Array:
        """(n, 3, w) derivative of predicted target − socket by the sockets' positions in one stand, root frame axes."""
        return -self.at_socket(seen, artefacts, name, "socket")
