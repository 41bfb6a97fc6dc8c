"""What one effect of a diagnosis explains, place by place: the values behind a figure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from thermal_robot.effects.effect import in_words

Array = NDArray[np.float64]


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
