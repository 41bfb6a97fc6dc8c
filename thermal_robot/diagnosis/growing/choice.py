"""What an update holds of a diagnosis: effects in their settings, prior sizes, how rows are weighed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.effects import Effect
from thermal_robot.inference.columns import Block
from thermal_robot.inference.robust import Noise
from thermal_robot.observations import Frames


@dataclass(frozen=True, eq=False)
class Point:
    """Frames, and the (P,) values of all parameters, SI, at which rows are linearised."""

    frames: Frames
    values: Array


@dataclass(frozen=True, eq=False)
class Judge:
    """The diagnosis's model, by which new rows are weighed: (m,) one sigma of what it leaves, m and rad, its rows."""

    point: Point
    sigma: Array
    rows: int


@dataclass(frozen=True, eq=False)
class Choice:
    """Effects with their prior sizes; what would be asked of a fresh fit that chooses nothing.

    ``blocks`` are without columns; ``rivals`` are further effects of combinations that were nearly as probable;
    ``measures`` is m, 3 for positions, 6 for poses; ``position`` and ``orientation`` the noise that the campaign
    states, m and rad. With a ``judge`` rows keep the weight that they had, and new ones get theirs by the model of the
    diagnosis; without, every row is weighed by its distance from the model of the moment.
    """

    blocks: tuple[Block, ...]
    rivals: tuple[Block, ...]
    measures: int
    position: float | None
    orientation: float | None
    judge: Judge | None

    @cached_property
    def ends(self) -> list[int]:
        """Where the parameters of each chosen effect end among all P."""
        return [int(end) for end in np.cumsum([len(item.sizes) for item in self.blocks])]

    @property
    def judged(self) -> bool:
        """Whether rows are weighed anew in every fit."""
        return self.judge is None

    @property
    def count(self) -> int:
        """P."""
        return self.ends[-1] if self.ends else 0

    @property
    def effects(self) -> list[Effect]:
        """The chosen effects."""
        return [item.effect for item in self.blocks]

    def split(self, values: Array) -> list[tuple[Effect, Array]]:
        """Return each chosen effect with its part of (P,) values."""
        return list(zip(self.effects, np.split(values, self.ends[:-1]), strict=True)) if self.blocks else []

    def noise(self, rows: Campaign) -> Noise:
        """Return the stated noise, with how that of each row differs."""
        return Noise(self.position, self.orientation, rows.relative_noise)


def without_columns(item: Block, effect: Effect, measures: int) -> Block:
    """Return a block with no rows, of the effect as a model holds it."""
    return Block(effect, item.bare, np.zeros((0, measures, len(item.sizes))), item.sizes, item.spread)


def together(parts: Sequence[Array]) -> Array:
    """Return (P,) arrays end to end, of length 0 where there are none."""
    return np.concatenate([*parts, np.zeros(0)])
