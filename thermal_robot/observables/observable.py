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
        """Where it is, mm."""

    def moved(self, step: Array) -> Any:
        """Return it after a step (width,) of its parameters."""


def in_mm(point: Array) -> str:
    """Coordinates of a point (3,) m, in words."""
    return f"({', '.join(f'{round(1e3 * part)}' for part in point)}) mm"


@dataclass(frozen=True, eq=False)
class Seen:
    """Rows of one kind with what is predicted of them.

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
        """Return the rows of this kind of an array over all rows."""
        return values if self.rows is None else values[self.rows]

    def labels(self, name: str) -> NDArray[np.str_]:
        """(n,) labels of a column."""
        return np.asarray(self.own(self.campaign.labels[name]))

    def shared(self, label: str) -> tuple[list[str], NDArray[np.int64]]:
        """Return what rows of a label share, by name, and (n,) the number of that of each row."""
        values, number = self.campaign.numbered[label]
        number = self.own(number)
        there = np.unique(number)
        return [f"{label} {values[k]}" for k in there], np.searchsorted(there, number)

    def readings(self, *names: str) -> Array:
        """(n, k) figures of columns, SI."""
        return np.column_stack([self.own(self.campaign.readings[name]) for name in names])

    @property
    def where(self) -> Array:
        """(n, 3) predicted position of the target in the measurement frame, m."""
        return np.asarray(self.position @ self.base[:3, :3].T + self.base[:3, 3])

    def in_root(self, vectors: Array) -> Array:
        """(..., 3) vectors of the measurement frame in the axes of the root frame."""
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
        """Whether a gap of these rows is told in metres that something else than the robot defines."""
        return True

    def per_metre(self, seen: Seen, artefacts: Mapping[str, Any]) -> Array:
        """(n,) units of a reading to a metre of the gap."""
        return np.ones(len(seen.position))

    def shares(self, seen: Seen) -> tuple[str, ...]:
        """Return the names of what the rows share; nothing without a ``label``."""
        return tuple(seen.shared(self.label)[0]) if self.label else ()

    def artefacts(self, seen: Seen, known: Mapping[str, Any]) -> dict[str, Artefact]:
        """Return by name what the rows share, where the predicted poses put it; nothing by default.

        ``known`` are those that need none: artefacts of before, and those that rows of other kinds have told.
        """
        return {}

    def unplaced(self, seen: Seen, known: Mapping[str, Any]) -> Iterator[tuple[str, NDArray[np.bool_]]]:
        """Yield the artefacts that nothing has placed yet, by name, with the mask (n,) of their rows.

        Raises :class:`EstimationError` where these are fewer than ``fewest``: they would place it anywhere.
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
        """Whether an artefact of this name holds all that the rows have to do with; that of fewer rows may not."""
        return True

    @abstractmethod
    def gap(self, seen: Seen, artefacts: Mapping[str, Any]) -> Array:
        """Gap, measured − predicted, (n, 3) or (n, 6): displacement, m, and turn, rad, root frame axes."""

    @abstractmethod
    def sees(self, seen: Seen, artefacts: Mapping[str, Any], twists: Array) -> Array:
        """(n, 6, K) what rows see of twists (n, 6, K) of the target, root frame axes."""

    def sees_there(self, seen: Seen, artefacts: Mapping[str, Any], twists: Array) -> Array:
        """:meth:`sees` of the target where it is predicted, for a kind that looks where it should be."""
        return self.sees(seen, artefacts, twists)

    def column(self, seen: Seen, artefacts: Mapping[str, Any], name: str) -> Array:
        """(n, 3, w) derivative of predicted − measured by the w parameters of one artefact, root frame axes."""
        raise NotImplementedError(f"{self.kind} has no artefact {name}")


class Along(Observable):
    """A reading of one component, along a line that what it shares defines.

    A member says where what its rows share starts, what is read, and its derivative.
    """

    places: ClassVar[int] = 1

    def artefacts(self, seen: Seen, known: Mapping[str, Any]) -> dict[str, Artefact]:
        """Return what the rows share, where the predicted poses put it."""
        return {name: self.start(seen, here, name) for name, here in self.unplaced(seen, known)}

    @abstractmethod
    def start(self, seen: Seen, here: NDArray[np.bool_], name: str) -> Artefact:
        """Return one artefact, from the rows (n,) that have to do with it."""

    @abstractmethod
    def read(self, seen: Seen, artefacts: Mapping[str, Any]) -> tuple[Array, Array]:
        """(n,) predicted − read, m, and (n, 3) the unit vector along which, measurement frame."""

    @abstractmethod
    def slopes(self, seen: Seen, artefacts: Mapping[str, Any], name: str) -> Array:
        """(n, w) derivative of predicted − read by the parameters of an artefact, as if all rows had to do with it."""

    def gap(self, seen: Seen, artefacts: Mapping[str, Any]) -> Array:
        """(n, 3) read − predicted along its line, m."""
        beyond, along = self.read(seen, artefacts)
        return seen.in_root(-beyond[:, None] * along)

    def sees(self, seen: Seen, artefacts: Mapping[str, Any], twists: Array) -> Array:
        """(n, 6, K) the displacement along the line."""
        along = seen.in_root(self.read(seen, artefacts)[1])
        moved = np.zeros_like(twists)
        moved[:, :3] = along[:, :, None] * np.einsum("ni,nik->nk", along, twists[:, :3])[:, None]
        return moved

    def column(self, seen: Seen, artefacts: Mapping[str, Any], name: str) -> Array:
        """(n, 3, w) what the parameters of one artefact do to the rows that have to do with it."""
        names, number = seen.shared(self.label)
        here = number == names.index(name)
        along = seen.in_root(self.read(seen, artefacts)[1])
        return np.asarray(here[:, None, None] * along[:, :, None] * self.slopes(seen, artefacts, name)[:, None])
