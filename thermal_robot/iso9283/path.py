"""Path accuracy AT and path repeatability RT: the worst of the points of a path (ISO 9283:1998, 8.2 and 8.3).

The standard cuts the attained paths with planes across the commanded one. Here a point of the path is a command, and
what was measured for it in each cycle belongs to it: how far the robot lags behind counts in AT.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from thermal_robot.iso9283.accuracy import Accuracy
from thermal_robot.iso9283.attained import Three, three
from thermal_robot.iso9283.repeatability import Repeatability


@dataclass(frozen=True)
class AlongPath:
    """The worst of a path's points.

    Attributes
    ----------
    position
        AT_p or RT_p, m.
    angles
        AT_a, AT_b, AT_c, or RT_a, RT_b, RT_c (±), each the largest of all points, rad; ``None`` where only positions
        are known.
    """

    position: float
    angles: Three | None = None


def along_path(points: Sequence[Accuracy] | Sequence[Repeatability]) -> AlongPath:
    """Return the path accuracy of the accuracies of its points; the path repeatability of their repeatabilities."""
    turns = [np.abs(point.angles) for point in points if point.angles is not None]
    return AlongPath(max(point.position for point in points), three(np.max(turns, axis=0)) if turns else None)
