"""The values behind figures: what one effect of a diagnosis explains, place by place, and the arm in some rows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.effects.effect import in_words
from thermal_robot.shapes.visuals import Solid


@dataclass(frozen=True, eq=False)
class Place:
    """One place where an effect acts, n rows.

    Attributes
    ----------
    kind, name
        ``joint`` and its name, and so on.
    share
        Share of the effect's contribution that enters here, 0..1.
    quantity, quantity_unit
        What drives the effect here.
    values
        (n,) of that quantity, SI.
    levels
        Whether it takes a few values only.
    unit
        Of the error: ``rad`` or ``m`` at the place; ``m at the tool`` where the error both shifts and turns.
    before, after, spread
        (n,) the error with the effect left in, without it, and one sigma of noise of both.
    line
        (2, k) the fitted law: quantity and error.
    centred
        Whether errors are told less their mean, which the unknown frames take up as well.
    """

    kind: str
    name: str
    share: float
    quantity: str
    quantity_unit: str
    values: Array
    levels: bool
    unit: str
    before: Array
    after: Array
    spread: Array
    line: Array
    centred: bool = False

    @property
    def words(self) -> str:
        """The place with its kind, unless its name says it already."""
        return in_words(self.kind, self.name)


@dataclass(frozen=True, eq=False)
class Explained:
    """What one effect explains.

    Attributes
    ----------
    effect
        Its name.
    places
        Places with a share worth drawing, largest first.
    left_out
        Number of further places.
    """

    effect: str
    places: tuple[Place, ...]
    left_out: int


@dataclass(frozen=True, eq=False)
class Arm:
    """L links of a chain in R postures.

    Attributes
    ----------
    links
        L names, from the root frame to the tool frame.
    link_shares
        (L,) share 0..1 of the gap's mean square that enters in each.
    poses
        (R, L, 4, 4) of each in the root frame, as the model has it at what was commanded; m.
    joints
        Names of the J movable joints, those that mimic another too.
    joint_shares
        (J,) share that enters at each.
    moves
        (J,) which of the links each joint moves first.
    hulls
        What links look like; nothing of those without a shape.
    base_share, tool_share, instrument_share
        Share that enters where the robot stands, between tool frame and target, and at the instrument.
    """

    links: tuple[str, ...]
    link_shares: Array
    poses: Array
    joints: tuple[str, ...]
    joint_shares: Array
    moves: NDArray[np.int64]
    hulls: tuple[Solid, ...]
    base_share: float = 0.0
    tool_share: float = 0.0
    instrument_share: float = 0.0
