"""Distance of two sockets of a stand, measured beside the robot: a length standard with a noise of its own.

Points that nothing but the arm has told may be of any size together. A known length is one more equation of two of
them, so it is a row like any other, in which no robot is: how well it tells the scale follows from its noise.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.campaign.names import ENDS
from thermal_robot.observables.observable import Artefact, Seen
from thermal_robot.observables.socket import Socket, Stand


class Spacing(Socket):
    """Distance of two sockets of a stand, m, as a caliper, a measuring machine or a drawing has it."""

    kind: ClassVar[str] = "spacing"
    says: ClassVar[str] = "distance of two sockets"
    places: ClassVar[int] = 1

    def has_length(self, seen: Seen) -> bool:
        """Return true: the reading is itself a length."""
        return True

    def artefacts(self, seen: Seen, known: Mapping[str, Any]) -> dict[str, Artefact]:
        """Return the stands that rows of other kinds have placed; a stand without sockets for one that none has."""
        return {name: known.get(name, Stand((), np.zeros((0, 3)))) for name in self.shares(seen)}

    def covers(self, seen: Seen, name: str, artefact: Stand) -> bool:
        """Return true: a row that names a socket without a position has a zero gap and is no equation."""
        return True

    def _lines(self, seen: Seen, artefacts: Mapping[str, Any]) -> tuple[Array, Array]:
        """(n,) distance of a row's two sockets, m, and (n, 3) unit vector from the second to the first, root frame.

        Both are zero where one of the sockets has no position.
        """
        one, other = (self.points(seen, artefacts, end) for end in ENDS)
        apart = np.nan_to_num(one - other)
        far = np.linalg.norm(apart, axis=1)
        return far, seen.in_root(apart / np.where(far > 0.0, far, 1.0)[:, None])

    def gap(self, seen: Seen, artefacts: Mapping[str, Any]) -> Array:
        """(n, 3) read − fitted distance, m, as a vector along the line of the two sockets, root frame axes."""
        far, along = self._lines(seen, artefacts)
        return np.asarray((seen.readings("distance")[:, 0] - far)[:, None] * along)

    def sees(self, seen: Seen, artefacts: Mapping[str, Any], twists: Array) -> Array:
        """(n, 6, K) zeros: the reading does not depend on the robot."""
        return np.zeros_like(twists)

    sees_there = sees

    def column(self, seen: Seen, artefacts: Mapping[str, Any], name: str) -> Array:
        """(n, 3, w) derivative of fitted − read distance, along their line, by the sockets' positions in one stand."""
        along = self._lines(seen, artefacts)[1]
        one, other = (self.at_socket(seen, artefacts, name, end) for end in ENDS)
        return np.asarray(along[:, :, None] * np.einsum("ni,niw->nw", along, one - other)[:, None])
