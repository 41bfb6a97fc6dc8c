"""The instrument's scale: it measures every distance a little too long."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.effects.effect import UNSOURCED, Driver, Effect, Parameter, at_instrument

if TYPE_CHECKING:
    from thermal_robot.observations import Observations


@dataclass(frozen=True)
class InstrumentScale(Effect):
    """Measured = (1 + s) · true, about the instrument's origin.

    Expected size 1e-4: a tracker whose refraction is corrected with a wrong temperature errs by 1e-6 per
    kelvin, a camera or a photogrammetric scale bar by a hundred times that. All link lengths wrong by the same share
    look exactly alike, so :class:`Geometric` contains it, unless a joint slides or the target stands off a known tool
    frame; with an unknown base the place of the origin does not matter.
    """

    name: ClassVar[str] = "instrument_scale"
    title: ClassVar[str] = "a scale error of the instrument"
    size_spread: ClassVar[float] = UNSOURCED
    contained_in: ClassVar[tuple[str, ...]] = ("geometric",)

    def parameters(self, observations: Observations) -> tuple[Parameter, ...]:
        """One scale error; dimensionless."""
        response = at_instrument(observations.predicted_position)
        return (Parameter("scale error", "1", 1e-4, "instrument", "instrument", (response,)),)

    def driver(self, observations: Observations, parameters: Sequence[Parameter], error: Array) -> Driver | None:
        """Return the distance from the instrument."""
        return "distance from the instrument", "m", np.linalg.norm(observations.predicted_position, axis=1)
