"""Plane constraint: the tip on the tool touches a plane whose normal and offset nobody measured.

Of a row one component is read, along the normal (Zhuang, Motaghedi and Roth, *Robot calibration with planar
constraints*, ICRA 1999). The radius of a ball at the tip is part of the offset. With ``height`` a row says how far
above the plane the tip is, as a dial gauge reads it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.observables.observable import Along, Artefact, Seen, in_mm


@dataclass(frozen=True, eq=False)
class Plane:
    """A plane: unit ``normal`` (3,) and ``offset`` m of the points p on it, normal · p = offset, measurement frame."""

    normal: Array
    offset: float

    width: ClassVar[int] = 3

    @cached_property
    def tangents(self) -> Array:
        """(2, 3) orthonormal vectors that span the plane."""
        return np.asarray(np.linalg.svd(self.normal[None])[2][1:])

    @property
    def words(self) -> str:
        """Position in words: the plane's point nearest to the origin, mm, and its unit normal."""
        return (
            f"through {in_mm(self.offset * self.normal)}, normal to {tuple((np.round(self.normal, 2) + 0.0).tolist())}"
        )

    def moved(self, step: Array) -> Plane:
        """Return the plane after a step (3,): tilt of the normal along both tangents, rad, and of the offset, m."""
        normal = self.normal + step[:2] @ self.tangents
        length = float(np.linalg.norm(normal))
        return replace(self, normal=normal / length, offset=(self.offset + float(step[2])) / length)


class OnPlane(Along):
    """Plane constraint: the target touches a plane, or stands at a height above it."""

    kind: ClassVar[str] = "plane"
    says: ClassVar[str] = "a tip on a plane"
    label: ClassVar[str] = "plane"
    fewest: ClassVar[int] = 3

    def has_length(self, seen: Seen) -> bool:
        """Whether any height read above the plane is not zero; contact alone defines no length."""
        return bool(np.any(self._heights(seen)))

    @staticmethod
    def _heights(seen: Seen) -> Array:
        own = seen.campaign.readings.get("height")
        return np.zeros(len(seen.position)) if own is None else np.asarray(seen.own(own))

    def start(self, seen: Seen, here: NDArray[np.bool_], name: str) -> Artefact:
        """Return the plane through predicted positions by total least squares, or by regression of heights on them."""
        places, heights = seen.where[here], self._heights(seen)[here]
        middle, above = places.mean(axis=0), heights - heights.mean()
        normal = np.linalg.svd(places - middle)[2][-1]
        if np.any(above):  # heights vary as n · p does: a linear fit tells n
            normal = np.linalg.lstsq(places - middle, above, rcond=None)[0]
        normal = normal / np.linalg.norm(normal)
        return Plane(normal, float(np.median(places @ normal - heights)))

    def read(self, seen: Seen, artefacts: Mapping[str, Any]) -> tuple[Array, Array]:
        """(n,) predicted − read height above the plane, m, and (n, 3) its unit normal, measurement frame."""
        names, number = seen.shared(self.label)
        normals = np.array([artefacts[name].normal for name in names])[number]
        offsets = np.array([artefacts[name].offset for name in names])[number]
        return (normals * seen.where).sum(axis=1) - offsets - self._heights(seen), normals

    def slopes(self, seen: Seen, artefacts: Mapping[str, Any], name: str) -> Array:
        """(n, 3) derivative of predicted − read height by the plane's tilt (two components) and offset."""
        own: Plane = artefacts[name]
        return np.column_stack([seen.where @ own.tangents.T, -np.ones(len(seen.position))])
