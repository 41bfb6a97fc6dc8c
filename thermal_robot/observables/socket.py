"""Point constraint: a ball on the tool sits in a socket, whose place nobody measured (closed-loop calibration).

Each socket is an unknown point that all its rows share (Wampler, Hollerbach and Arai, *IEEE Transactions on Robotics
and Automation* 11, 1995, on implicit loops). Sockets of one stand may have known distances: its points then move along
the null space of these constraints.

The twist of the target is taken about the socket, not about the predicted point, which it should meet: what moves all
sockets like a rigid body is then exactly an alias of the points, whatever is left of the rows.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.observables import settings
from thermal_robot.observables.observable import Artefact, Observable, Seen, in_mm


@dataclass(frozen=True, eq=False)
class Stand:
    """Sockets of a stand that stays in one place.

    ``points`` (S, 3) m, measurement frame; ``lengths``: (one, other, distance in m) of pairs of sockets by number.
    """

    sockets: tuple[str, ...]
    points: Array
    lengths: tuple[tuple[int, int, float], ...] = ()

    @property
    def width(self) -> int:
        """Three a socket, less one for each known distance."""
        return int(self.basis.shape[1])

    @cached_property
    def _slopes(self) -> Array:
        """(F, 3 S) derivative of the known distances by the points."""
        slopes = np.zeros((len(self.lengths), *self.points.shape))
        for slope, (one, other, _) in zip(slopes, self.lengths, strict=True):
            apart = self.points[one] - self.points[other]
            slope[one] = apart / np.linalg.norm(apart)
            slope[other] = -slope[one]
        return slopes.reshape(len(self.lengths), self.points.size)

    @cached_property
    def basis(self) -> Array:
        """(3 S, w) orthonormal directions in which the points may move."""
        if not self.lengths:
            return np.eye(self.points.size)
        return np.asarray(np.linalg.svd(self._slopes)[2][len(self.lengths) :].T)

    @property
    def words(self) -> str:
        """Where its sockets are, mm."""
        return ", ".join(f"socket {s} at {in_mm(p)}" for s, p in zip(self.sockets, self.points, strict=True))

    def moved(self, step: Array) -> Stand:
        """Return the stand after a step, its known distances kept."""
        return replace(self, points=self.points + (self.basis @ step).reshape(-1, 3)).held()

    def held(self) -> Stand:
        """Return the stand with its known distances, by least movement of its points."""
        stand = self
        for _ in range(settings.HELD_ROUNDS if self.lengths else 0):
            far = [np.linalg.norm(stand.points[a] - stand.points[b]) - length for a, b, length in self.lengths]
            back = np.linalg.lstsq(stand._slopes, np.array(far), rcond=None)[0]
            stand = replace(stand, points=stand.points - back.reshape(-1, 3))
        return stand


class Socket(Observable):
    """Closed-loop point constraint: the target sits in a socket of a stand."""

    kind: ClassVar[str] = "socket"
    says: ClassVar[str] = "a ball in its socket"
    label: ClassVar[str] = "stand"

    def has_length(self, seen: Seen) -> bool:
        """Whether distances of sockets are known: nothing else of them is a length."""
        return bool(seen.campaign.facts.get("socket", {}).get("distances"))

    def artefacts(self, seen: Seen) -> dict[str, Artefact]:
        """Return the stands, their sockets in the middle of where the target is predicted."""
        (stands, number), sockets, where = seen.shared("stand"), seen.labels("socket"), seen.where
        found: dict[str, Artefact] = {}
        for k, stand in enumerate(stands):
            own = tuple(np.unique(sockets[number == k]).tolist())
            points = [np.median(where[(number == k) & (sockets == socket)], axis=0) for socket in own]
            known = seen.campaign.facts.get("socket", {}).get("distances", ())
            lengths = ((a, b, float(length)) for a, b, length in known if a in own and b in own)
            pairs = tuple((own.index(a), own.index(b), length) for a, b, length in lengths)
            found[stand] = Stand(own, np.array(points), pairs).held()
        return found

    def covers(self, seen: Seen, name: str, artefact: Stand) -> bool:
        """Whether the stand has all sockets of these rows."""
        (names, number), sockets = seen.shared(self.label), seen.labels("socket")
        return {*np.unique(sockets[number == names.index(name)]).tolist()} <= {*artefact.sockets}

    def _points(self, seen: Seen, artefacts: Mapping[str, Any]) -> Array:
        """(n, 3) the socket of each row, measurement frame, m."""
        points = np.empty_like(seen.position)
        (names, number), sockets = seen.shared("stand"), seen.labels("socket")
        for k, name in enumerate(names):
            own = artefacts[name]
            for socket, point in zip(own.sockets, own.points, strict=True):
                points[(number == k) & (sockets == socket)] = point
        return points

    def gap(self, seen: Seen, artefacts: Mapping[str, Any]) -> Array:
        """(n, 3) socket − predicted target, m."""
        return seen.in_root(self._points(seen, artefacts) - seen.where)

    def sees(self, seen: Seen, artefacts: Mapping[str, Any], twists: Array) -> Array:
        """(n, 6, K) displacement at the socket, where the target should be: v + ω × gap."""
        moved = twists.copy()
        moved[:, :3] += np.cross(twists[:, 3:], self.gap(seen, artefacts)[:, :, None], axis=1)
        return moved

    def column(self, seen: Seen, artefacts: Mapping[str, Any], name: str) -> Array:
        """(n, 3, w) what the stand's free directions do to predicted − socket."""
        own: Stand = artefacts[name]
        names, number = seen.shared("stand")
        here = number == names.index(name)
        columns = np.zeros((len(here), 3, own.width))
        directions = own.basis.reshape(len(own.sockets), 3, -1)
        for socket, direction in zip(own.sockets, directions, strict=True):
            columns[here & (seen.labels("socket") == socket)] = -seen.base[:3, :3].T @ direction
        return columns
