"""Who measures: positions or poses, with a noise of stated size."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.campaign import Campaign
from thermal_robot.errors import CampaignError
from thermal_robot.kinematics import exp3, rotation_to_quaternion
from thermal_robot.schema import fitted, number, word
from thermal_robot.simulation.commanded import CALL

Array = NDArray[np.float64]
_MEASURES = ("position", "pose")


@dataclass(frozen=True)
class Instrument:
    """An instrument with normal noise, the same along and about each axis.

    Attributes
    ----------
    turns
        Whether it measures orientations, too.
    noise, noise_orientation
        One sigma per axis, m and rad.
    """

    turns: bool
    noise: float
    noise_orientation: float

    def awaiting(self, plan: Campaign) -> Campaign:
        """Return rows that tell effects what will be measured: orientations, not yet turned, where they are."""
        turned = np.tile([1.0, 0.0, 0.0, 0.0], (plan.samples, 1)) if self.turns else None
        return replace(plan, orientation=turned)

    def reading(self, position: Array, rotation: Array, rng: np.random.Generator) -> tuple[Array, Array | None]:
        """Return one reading of poses in the measurement frame.

        Parameters
        ----------
        position, rotation
            (N, 3) m and (N, 3, 3).
        rng
            Source of the noise.

        Returns
        -------
        position
            (N, 3) m.
        orientation
            (N, 4) quaternions wxyz; ``None`` where it does not measure them.
        """
        read = position + self.noise * rng.normal(size=position.shape)
        if not self.turns:
            return read, None
        turn = exp3(self.noise_orientation * rng.normal(size=position.shape))
        return read, rotation_to_quaternion(turn @ rotation)


def instrument(measures: Any, noise: Any, noise_orientation: Any) -> Instrument:
    """Return the instrument that a user asks for; see :func:`thermal_robot.simulate`.

    Raises
    ------
    CampaignError
        A word that it does not know, a noise that is none, or one of what is not measured.
    """
    sigma = number(least=0.0, expected="one sigma per axis, 0 for none", problem="a noise cannot be negative")
    shift, turn = fitted(sigma, noise, CALL, "noise"), fitted(sigma, noise_orientation, CALL, "noise_orientation")
    what = fitted(word(_MEASURES), _MEASURES[0] if measures is None else measures, CALL, "measures")
    if turn > 0.0 and what != "pose":
        expected = 'measures="pose", or no noise of orientations'
        raise CampaignError(CALL, "only positions are measured", column="noise_orientation", expected=expected)
    return Instrument(what == "pose", shift, turn)
