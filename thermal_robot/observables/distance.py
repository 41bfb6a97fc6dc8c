"""Distance to a point: a draw wire, a ballbar; the point and the zero of the instrument are unknown.

Of a row one component is read, along the line to the point (Driels and Swayze, *IEEE Transactions on Robotics and
Automation* 10, 1994, on a ballbar).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.observables.observable import Along, Artefact, Seen, in_mm


@dataclass(frozen=True, eq=False)
class Anchor:
    """Anchor point of a wire or ballbar: ``place`` (3,) m, measurement frame; its reading at no length, ``zero`` m."""

    place: Array
    zero: float = 0.0

    width: ClassVar[int] = 4

    @property
    def words(self) -> str:
        """Position of the anchor point in words, mm."""
        return f"at {in_mm(self.place)}"

    def moved(self, step: Array) -> Anchor:
        """Return the anchor after an additive step (4,) of its place and its zero, m."""
        return replace(self, place=self.place + step[:3], zero=self.zero + float(step[3]))


class Distance(Along):
    """Distance of the target from an anchor point of unknown position, m."""

    kind: ClassVar[str] = "distance"
    says: ClassVar[str] = "distance to a point"
    label: ClassVar[str] = "anchor"
    fewest: ClassVar[int] = 5  # unknowns of its linear start, one a row

    def start(self, seen: Seen, here: NDArray[np.bool_], name: str) -> Artefact:
        """Return the anchor by trilateration: |p|² − L² = 2 p·a − 2 z L − (|a|² − z²), linear but for the last term."""
        places, lengths = seen.where[here], seen.readings("distance")[here, 0]
        middle = places.mean(axis=0)
        off = places - middle
        design = np.column_stack([2.0 * off, -2.0 * lengths, -np.ones(len(off))])
        told = (off**2).sum(axis=1) - lengths**2
        found = np.linalg.lstsq(design, told, rcond=None)[0]
        return Anchor(found[:3] + middle, float(found[3]))

    def read(self, seen: Seen, artefacts: Mapping[str, Any]) -> tuple[Array, Array]:
        """(n,) predicted − read distance, m, and (n, 3) unit vectors from anchor to target, measurement frame."""
        names, number = seen.shared(self.label)
        lines = seen.where - np.array([artefacts[name].place for name in names])[number]
        far = np.linalg.norm(lines, axis=1)
        zeros = np.array([artefacts[name].zero for name in names])[number]
        return far + zeros - seen.readings("distance")[:, 0], lines / far[:, None]

    def slopes(self, seen: Seen, artefacts: Mapping[str, Any], name: str) -> Array:
        """(n, 4) derivative of predicted − read distance by the anchor's place and zero."""
        return np.column_stack([-self.read(seen, artefacts)[1], np.ones(len(seen.position))])
