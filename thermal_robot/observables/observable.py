"""Measurement models: what a row reads of the tool's pose, its derivative by the tool's twist, and its nuisances.

A row of whatever kind is told as a displacement of the target, m, and a turn, rad, in the root frame's axes: by how
much the target is off from where the reading puts it, along what the reading sees. What a reading does not see of a
twist is zero there, in the gap as in every column.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.errors import EstimationError

Rows = NDArray[np.int64]


class Artefact(Protocol):
    """Nuisance parameters of a thing beside the robot that readings share: a stand, a plane, an anchor, a camera."""

    @property
    def width(self) -> int:
        """Number of its free parameters."""

    @property
    def words(self) -> str:
        """Position of the artefact in words, mm."""

    def moved(self, step: Array) -> Any:
        """Return the artefact updated by a step (width,) of its parameters."""


def in_mm(point: Array) -> str:
    """Format a point (3,), m, as text with coordinates rounded to whole mm."""
    return f"({', '.join(f'{round(1e3 * part)}' for part in point)}) mm"


@dataclass(frozen=True, eq=False)
class Seen:
    """Rows of one kind of measurement, with the target's poses predicted for them.

    Attributes
    ----------
    campaign, rows
        Whose rows these are, and their (n,) numbers; ``None`` for all.
    position, rotation
        (n, 3) m and (n, 3, 3): the target's predicted pose in the root frame.
    base
        (4, 4) pose of the root frame in the measurement frame.
    instrument
        (n, 3) displacement that the instrument adds, measurement frame, m; ``None`` for none.
    """

    campaign: Campaign
    rows: Rows | None
    position: Array
    rotation: Array
    base: Array
    instrument: Array | None = None

    def own(self, values: Any) -> Any:
        """Select the rows of this kind from an array over all rows of the campaign."""
        return values if self.rows is None else values[self.rows]

    def labels(self, name: str) -> NDArray[np.str_]:
        """(n,) labels of these rows in one of the campaign's label columns."""
        return np.asarray(self.own(self.campaign.labels[name]))

    def shared(self, label: str) -> tuple[list[str], NDArray[np.int64]]:
        """Group rows by the value of a label: names "<label> <value>" of the groups, and (n,) index of each row's."""
        values, number = self.campaign.numbered[label]
        number = self.own(number)
        there = np.unique(number)
        return [f"{label} {values[k]}" for k in there], np.searchsorted(there, number)

    def readings(self, *names: str) -> Array:
        """(n, k) values of k columns of readings in these rows, SI."""
        return np.column_stack([self.own(self.campaign.readings[name]) for name in names])

    @property
    def where(self) -> Array:
        """(n, 3) predicted position of the target in the measurement frame, m."""
        return np.asarray(self.position @ self.base[:3, :3].T + self.base[:3, 3])

    def in_root(self, vectors: Array) -> Array:
        """Rotate vectors (..., 3) from the axes of the measurement frame into those of the root frame."""
        return np.asarray(vectors @ self.base[:3, :3])


class Observable(ABC):
    """One kind of measurement.

    Attributes
    ----------
    kind
        What the column ``kind`` says.
    says
        What a row of it says, for a reader; ``of`` its spread, ``about`` what.
    places
        How many components of the target's place a row sees.
    turns
        Whether it sees turns of the target beside its place.
    turned
        Whether the target's own turn on the tool matters to it, if but through what the target carries.
    locates
        Whether it says where the root frame is: readings are in a frame that something else than the arm defines.
    of_model
        Whether what is read is another model's word of the same joints: a difference is then the model's.
    label
        Column that says which rows share an artefact; empty where none do.
    unit
        In what it is read: gaps in metres times :meth:`per_metre`.
    fewest
        Rows that its linear start needs at least to place an artefact.
    """

    kind: ClassVar[str]
    says: ClassVar[str]
    places: ClassVar[int] = 3
    turns: ClassVar[bool] = False
    turned: ClassVar[bool] = False
    locates: ClassVar[bool] = False
    of_model: ClassVar[bool] = False
    label: ClassVar[str] = ""
    unit: ClassVar[str] = "m"
    fewest: ClassVar[int] = 1

    def has_length(self, seen: Seen) -> bool:
        """Whether something other than the robot defines the scale of these rows' gaps; true by default."""
        return True

    def per_metre(self, seen: Seen, artefacts: Mapping[str, Any]) -> Array:
        """(n,) factors from the gap in m to the unit of the reading; 1 by default."""
        return np.ones(len(seen.position))

    def shares(self, seen: Seen) -> tuple[str, ...]:
        """Return the names of the artefacts of these rows, one a value of ``label``; empty without a ``label``."""
        return tuple(seen.shared(self.label)[0]) if self.label else ()

    def artefacts(self, seen: Seen, known: Mapping[str, Any]) -> dict[str, Artefact]:
        """Return starting values of these rows' artefacts, by name, from the predicted poses; none by default.

        ``known`` are those that need none: given before, or placed by rows of other kinds.
        """
        return {}

    def unplaced(self, seen: Seen, known: Mapping[str, Any]) -> Iterator[tuple[str, NDArray[np.bool_]]]:
        """Yield name and mask of rows (n,) of each artefact that is not in ``known``.

        Raises :class:`EstimationError` where it has fewer than ``fewest`` rows, which do not determine it.
        """
        names, number = seen.shared(self.label)
        for k, name in enumerate(names):
            here = number == k
            if name not in known and here.sum() < self.fewest:
                rows = f"{here.sum()} row{'s' if here.sum() > 1 else ''}"
                raise EstimationError(
                    f"{name} has {rows} of kind {self.kind}, and at least {self.fewest} say where it is: measure more "
                    "there, or leave these out"
                )
            if name not in known:
                yield name, here

    def covers(self, seen: Seen, name: str, artefact: Any) -> bool:
        """Whether an artefact has all parts that these rows refer to (one of fewer rows may not); default true."""
        return True

    @abstractmethod
    def gap(self, seen: Seen, artefacts: Mapping[str, Any]) -> Array:
        """Gap, measured − predicted, (n, 3) or (n, 6): displacement, m, and turn, rad, root frame axes."""

    @abstractmethod
    def sees(self, seen: Seen, artefacts: Mapping[str, Any], twists: Array) -> Array:
        """(n, 6, K) components of target twists (n, 6, K) that rows observe, zero in the others, root frame axes."""

    def sees_there(self, seen: Seen, artefacts: Mapping[str, Any], twists: Array) -> Array:
        """:meth:`sees` with twists taken at the predicted target position, for a kind that takes them elsewhere."""
        return self.sees(seen, artefacts, twists)

    def column(self, seen: Seen, artefacts: Mapping[str, Any], name: str) -> Array:
        """(n, 3, w) derivative of predicted − measured by the w parameters of one artefact, root frame axes."""
        raise NotImplementedError(f"{self.kind} has no artefact {name}")


class Along(Observable):
    """Measurement of one scalar along a unit vector that an artefact defines: a plane's normal, a line to an anchor.

    A subclass gives the artefact's starting value, the reading and its derivative.
    """

    places: ClassVar[int] = 1

    def artefacts(self, seen: Seen, known: Mapping[str, Any]) -> dict[str, Artefact]:
        """Return starting values of the artefacts that are not in ``known``, from the predicted target poses."""
        return {name: self.start(seen, here, name) for name, here in self.unplaced(seen, known)}

    @abstractmethod
    def start(self, seen: Seen, here: NDArray[np.bool_], name: str) -> Artefact:
        """Return the starting value of one artefact, fitted to the rows of the mask ``here`` (n,)."""

    @abstractmethod
    def read(self, seen: Seen, artefacts: Mapping[str, Any]) -> tuple[Array, Array]:
        """(n,) predicted − read, m, and (n, 3) the unit vector along which it is read, measurement frame."""

    @abstractmethod
    def slopes(self, seen: Seen, artefacts: Mapping[str, Any], name: str) -> Array:
        """(n, w) derivative of predicted − read by an artefact's parameters, in all rows as if each referred to it."""

    def gap(self, seen: Seen, artefacts: Mapping[str, Any]) -> Array:
        """(n, 3) read − predicted, m, as a vector along the row's unit vector, root frame axes."""
        beyond, along = self.read(seen, artefacts)
        return seen.in_root(-beyond[:, None] * along)

    def sees(self, seen: Seen, artefacts: Mapping[str, Any], twists: Array) -> Array:
        """(n, 6, K) the target's displacement projected onto the row's unit vector; zero rotation."""
        along = seen.in_root(self.read(seen, artefacts)[1])
        moved = np.zeros_like(twists)
        moved[:, :3] = along[:, :, None] * np.einsum("ni,nik->nk", along, twists[:, :3])[:, None]
        return moved

    def column(self, seen: Seen, artefacts: Mapping[str, Any], name: str) -> Array:
        """(n, 3, w) derivative of predicted − read, along the unit vector, by one artefact; zero in other rows."""
        names, number = seen.shared(self.label)
        here = number == names.index(name)
        along = seen.in_root(self.read(seen, artefacts)[1])
        return np.asarray(here[:, None, None] * along[:, :, None] * self.slopes(seen, artefacts, name)[:, None])
