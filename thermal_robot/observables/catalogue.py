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

KINDS: dict[str, Observable] = {
    own.kind: own for own in (Position(), Pose(), Socket(), OnPlane(), Distance(), Pixel(), Controller())
}
"""Every kind of measurement by its name."""


def kinds_of(campaign: Campaign) -> list[tuple[Observable, Rows | None]]:
    """Return the kinds of measurement of a campaign with the numbers of their rows, ``None`` for all."""
    if len(campaign.kinds) == 1:
        return [(KINDS[campaign.kinds[0]], None)]
    label = campaign.labels["kind"]
    return [(KINDS[kind], np.flatnonzero(label == kind)) for kind in campaign.kinds]


def components(campaign: Campaign) -> int:
    """Return m, the components of a row: 3 of place, 6 where any row sees turns."""
    return 6 if any(KINDS[kind].turns for kind in campaign.kinds) else 3


def tool_width(campaign: Campaign) -> int:
    """Return how many components of the tool frame matter: three of its place, and its turn where rows see that."""
    return 6 if any(KINDS[kind].turns or KINDS[kind].turned for kind in campaign.kinds) else 3


def seen_components(campaign: Campaign) -> NDArray[np.int64] | None:
    """(N, m/3) how many components of place, and of turn, each row sees; ``None`` where it is all in all."""
    found = np.zeros((campaign.samples, components(campaign) // 3), dtype=np.int64)
    for own, rows in kinds_of(campaign):
        found[slice(None) if rows is None else rows] = (own.places, 3 if own.turns else 0)[: found.shape[1]]
    return None if (found == 3).all() else found


def figures_of_a_row(campaign: Campaign) -> tuple[float, float]:
    """Mean numbers of components that a row sees: of place, and of place and turn."""
    seen = seen_components(campaign)
    if seen is None:
        return 3.0, float(components(campaign))
    return float(seen[:, 0].mean()), float(seen.sum(axis=1).mean())


@dataclass(frozen=True, eq=False)
class Size:
    """Size of the volume through which a target is led, the gauge where no row and no fact carries a length.

    All lengths of the robot together, with what stands beside it, may then be of any size: a smaller robot spreads less
    about its sockets. So gaps are told as shares of the size (an invariant of that gauge group), in metres of the
    robot as it is declared, and the change of size has no derivative.
    """

    middle: Array  # (N, 3) places of the target about their mean, root frame, m
    relative: float  # size as declared over size as predicted

    @classmethod
    def of(cls, campaign: Campaign, position: Array) -> Size:
        """Compare predicted places (N, 3) with those of the commands as declared."""
        poses = tool_poses(campaign.robot, campaign.q)
        declared = poses[:, :3, 3] + poses[:, :3, :3] @ campaign.target
        middle, before = (places - places.mean(axis=0) for places in (position, declared))
        return cls(middle, float(np.sqrt((before**2).sum() / (middle**2).sum())))

    def grows(self, moved: Array) -> Array:
        """(K,) relative growth of the size as the target moves by (N, 3, K)."""
        return np.asarray(np.einsum("ni,nik->k", self.middle, moved) / (self.middle**2).sum())


@dataclass(frozen=True, eq=False)
class Sight:
    """What all rows of a campaign say: of each kind its rows, and what they share."""

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
        base: Array,
        instrument: Array | None,
        artefacts: Mapping[str, Any],
    ) -> Sight:
        """Look at the rows from predicted poses; artefacts that are not given are put where these say."""
        parts = []
        for own, rows in kinds_of(campaign):
            position, rotation, added = (
                values if rows is None or values is None else values[rows] for values in (*pose, instrument)
            )
            parts.append((own, Seen(campaign, rows, np.asarray(position), np.asarray(rotation), base, added)))
        known, shared = dict[str, Any](), dict[str, tuple[str, ...]]()
        for own, seen in parts:
            names = own.shares(seen)
            given = {name: artefacts[name] for name in names if name in artefacts}
            given = {name: each for name, each in given.items() if own.covers(seen, name, each)}
            begun = {} if len(given) == len(names) else own.artefacts(seen)
            known |= {name: given.get(name, begun.get(name)) for name in names}
            shared[own.kind] = names
        size = None if any(own.has_length(seen) for own, seen in parts) else Size.of(campaign, pose[0])
        return cls(tuple(parts), known, campaign.samples, components(campaign), size, shared)

    @property
    def gap(self) -> Array:
        """(N, m) measured − predicted of all rows; zero along what one does not see."""
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

    def sees(self, twists: Array) -> Array:
        """(N, 6, K) what rows see of twists (N, 6, K) of the target."""
        found = self._sees(twists)
        if self.size is None:
            return found
        found = found.copy() if found is twists else found
        found[:, : self.measures] += self._gap[:, :, None] * self.size.grows(twists[:, :3])
        return found * self.size.relative

    def _sees(self, twists: Array) -> Array:
        if len(self.parts) == 1:
            own, seen = self.parts[0]
            return own.sees(seen, self.artefacts, twists)
        whole = np.zeros_like(twists)
        for own, seen in self.parts:
            found = own.sees(seen, self.artefacts, twists[seen.rows])
            whole[seen.rows] = found if own.turns else np.concatenate([found[:, :3], 0.0 * found[:, 3:]], axis=1)
        return whole

    def columns(self) -> tuple[Array, tuple[str, ...]]:
        """(N, m, w) derivative of the gap by all that rows share, and the artefact of each column."""
        parts, names = [], []
        for own, seen in self.parts:
            for name in self.shared[own.kind]:
                found, rows = own.column(seen, self.artefacts, name), seen.own(np.arange(self.samples))
                whole = np.zeros((self.samples, self.measures, found.shape[2]))
                whole[rows, :3] = found
                parts.append(whole)
                names += [name] * found.shape[2]
        empty = np.zeros((self.samples, self.measures, 0))
        whole = np.concatenate([empty, *parts], axis=2)
        return whole if self.size is None else whole * self.size.relative, tuple(names)


def of_model(campaign: Campaign) -> bool:
    """Whether the rows are a model's word alone, so that no robot can be the cause of what differs."""
    return all(own.of_model for own, _ in kinds_of(campaign))


def instrument_rows(campaign: Campaign) -> NDArray[np.bool_]:
    """(N,) the rows that an instrument with a frame of its own measured."""
    seen = np.zeros(campaign.samples, dtype=bool)
    for own, rows in kinds_of(campaign):
        seen[slice(None) if rows is None else rows] = own.locates
    return seen
