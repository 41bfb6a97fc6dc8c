"""Kinds of measurement by name, and rows of several kinds side by side."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.kinematics import tool_poses
from thermal_robot.observables.distance import Distance
from thermal_robot.observables.observable import Observable, Rows, Seen
from thermal_robot.observables.pixel import Pixel
from thermal_robot.observables.plane import OnPlane
from thermal_robot.observables.position import Controller, Pose, Position
from thermal_robot.observables.socket import Socket
from thermal_robot.observables.spacing import Spacing

KINDS: dict[str, Observable] = {
    own.kind: own for own in (Position(), Pose(), Socket(), Spacing(), OnPlane(), Distance(), Pixel(), Controller())
}
"""Every kind of measurement by its name; those that tell where an artefact is stand before those that only read it."""


def kinds_of(campaign: Campaign) -> list[tuple[Observable, Rows | None]]:
    """Return the kinds of measurement of a campaign with the numbers of their rows, ``None`` for all."""
    if len(campaign.kinds) == 1:
        return [(KINDS[campaign.kinds[0]], None)]
    label = campaign.labels["kind"]
    return [(own, np.flatnonzero(label == kind)) for kind, own in KINDS.items() if kind in campaign.kinds]


def components(campaign: Campaign) -> int:
    """Return the number m of components of a row's gap: 3 of position, 6 if any kind of row sees rotation."""
    return 6 if any(KINDS[kind].turns for kind in campaign.kinds) else 3


def tool_width(campaign: Campaign) -> int:
    """Return on how many tool-frame components rows depend: 3, its position, or 6 if any kind needs its rotation."""
    return 6 if any(KINDS[kind].turns or KINDS[kind].turned for kind in campaign.kinds) else 3


def seen_components(campaign: Campaign) -> NDArray[np.int64] | None:
    """(N, m/3) numbers of position and of rotation components that each row sees; ``None`` where all are 3."""
    found = np.zeros((campaign.samples, components(campaign) // 3), dtype=np.int64)
    for own, rows in kinds_of(campaign):
        found[slice(None) if rows is None else rows] = (own.places, 3 if own.turns else 0)[: found.shape[1]]
    return None if (found == 3).all() else found


def figures_of_a_row(campaign: Campaign) -> tuple[float, float]:
    """Return the mean number per row of position components, and of position and rotation components, that are seen."""
    seen = seen_components(campaign)
    if seen is None:
        return 3.0, float(components(campaign))
    return float(seen[:, 0].mean()), float(seen.sum(axis=1).mean())


@dataclass(frozen=True, eq=False)
class Size:
    """Root-mean-square spread of the target's positions, the free scale (gauge) of rows that measure no own length.

    All lengths of the robot together, with what stands beside it, may be of any size as far as these rows tell: a
    smaller robot spreads less about its sockets. So their gaps are told as shares of the size (an invariant of that
    gauge group), in metres of the robot as it is declared, and the change of size has no derivative. Other rows tell
    the scale, as well as their own noise allows.
    """

    middle: Array  # (N, 3) places of the target about their mean, root frame, m
    free: Array  # (N, 1) 1 in rows without a length of their own, else 0
    relative: Array  # (N, 1) size as declared over size as predicted; 1 in rows with a length of their own

    @classmethod
    def of(cls, campaign: Campaign, pose: tuple[Array, Array], tool: Array, free: Array) -> Size:
        """Compare the spread of predicted tool positions with that of the commands as declared; ``free`` (N, 1) rows.

        Places are those of the tool frame: how far from it the target sits is no size of the robot. ``pose`` is the
        target's, (N, 3) m and (N, 3, 3), ``tool`` (4, 4) that of the target in the tool frame.
        """
        predicted = pose[0] - pose[1] @ (tool[:3, :3].T @ tool[:3, 3])
        declared = tool_poses(campaign.robot, campaign.q)[:, :3, 3]
        before, now, middle = (places - places.mean(axis=0) for places in (declared, predicted, pose[0]))
        return cls(middle, free, np.sqrt((before**2).sum() / (now**2).sum()) ** free)

    def grows(self, moved: Array) -> Array:
        """Return the relative growth (K,) of the rms spread as the target's positions move by (N, 3, K)."""
        return np.asarray(np.einsum("ni,nik->k", self.middle, moved) / (self.middle**2).sum())


@dataclass(frozen=True, eq=False)
class Sight:
    """Gap and Jacobian of all rows of a campaign, stacked over kinds of measurement, with the artefacts they share."""

    parts: tuple[tuple[Observable, Seen], ...]
    artefacts: Mapping[str, Any]
    samples: int
    measures: int
    size: Size | None
    shared: Mapping[str, tuple[str, ...]]

    @classmethod
    def of(
        cls,
        campaign: Campaign,
        pose: tuple[Array, Array],
        frames: tuple[Array, Array],
        instrument: Array | None,
        artefacts: Mapping[str, Any],
    ) -> Sight:
        """Evaluate rows at predicted poses of the target, which also place artefacts not given or lacking parts.

        ``frames`` (4, 4) are the poses of the root frame in the measurement frame and of the target in the tool frame.
        """
        parts = []
        for own, rows in kinds_of(campaign):
            position, rotation, added = (
                values if rows is None or values is None else values[rows] for values in (*pose, instrument)
            )
            parts.append((own, Seen(campaign, rows, np.asarray(position), np.asarray(rotation), frames[0], added)))
        known, shared, free = dict[str, Any](), dict[str, tuple[str, ...]](), np.zeros((campaign.samples, 1))
        for own, seen in parts:
            names = own.shares(seen)
            given = {name: each for name, each in {**artefacts, **known}.items() if name in names}
            given = {name: each for name, each in given.items() if own.covers(seen, name, each)}
            begun = {} if len(given) == len(names) else own.artefacts(seen, {**known, **given})
            known |= {name: given.get(name, begun.get(name)) for name in names}
            shared[own.kind] = names
            free[slice(None) if seen.rows is None else seen.rows] = not own.has_length(seen)
        size = Size.of(campaign, pose, frames[1], free) if free.any() else None
        return cls(tuple(parts), known, campaign.samples, components(campaign), size, shared)

    @property
    def gap(self) -> Array:
        """(N, m) measured − predicted of all rows, times the size ratio; zero in components that a row does not see."""
        gap = self._gap
        return gap if self.size is None else gap * self.size.relative

    @cached_property
    def _gap(self) -> Array:
        if len(self.parts) == 1:
            own, seen = self.parts[0]
            return own.gap(seen, self.artefacts)
        whole = np.zeros((self.samples, self.measures))
        for own, seen in self.parts:
            found = own.gap(seen, self.artefacts)
            whole[seen.rows, : found.shape[1]] = found
        return whole

    def sees(self, twists: Array, there: bool = False) -> Array:
        """(N, 6, K) components of target twists that rows observe; ``there`` takes them at the predicted position."""
        found = self._sees(twists, there)
        if self.size is None:
            return found
        found = found.copy() if found is twists else found
        found[:, : self.measures] += (self.size.free * self._gap)[:, :, None] * self.size.grows(twists[:, :3])
        return found * self.size.relative[:, :, None]

    def _sees(self, twists: Array, there: bool) -> Array:
        looks = [(own, seen, own.sees_there if there else own.sees) for own, seen in self.parts]
        if len(looks) == 1:
            _, seen, look = looks[0]
            return look(seen, self.artefacts, twists)
        whole = np.zeros_like(twists)
        for own, seen, look in looks:
            found = look(seen, self.artefacts, twists[seen.rows])
            whole[seen.rows] = found if own.turns else np.concatenate([found[:, :3], 0.0 * found[:, 3:]], axis=1)
        return whole

    def columns(self) -> tuple[Array, tuple[str, ...]]:
        """(N, m, w) Jacobian of predicted − measured by the parameters of all artefacts, and whose each column is."""
        found = dict[str, Array]()
        for own, seen in self.parts:
            for name in self.shared[own.kind]:
                column = own.column(seen, self.artefacts, name)
                whole = found.setdefault(name, np.zeros((self.samples, self.measures, column.shape[2])))
                whole[seen.own(np.arange(self.samples)), :3] = column
        columns = np.concatenate([np.zeros((self.samples, self.measures, 0)), *found.values()], axis=2)
        names = tuple(name for name, own in found.items() for _ in range(own.shape[2]))
        return columns if self.size is None else columns * self.size.relative[:, :, None], names


def of_model(campaign: Campaign) -> bool:
    """Whether every row is another model's output and no measurement, so that no robot can cause a difference."""
    return all(own.of_model for own, _ in kinds_of(campaign))


def instrument_rows(campaign: Campaign) -> NDArray[np.bool_]:
    """(N,) mask of the rows that an instrument with a frame of its own measured."""
    seen = np.zeros(campaign.samples, dtype=bool)
    for own, rows in kinds_of(campaign):
        seen[slice(None) if rows is None else rows] = own.locates
    return seen
