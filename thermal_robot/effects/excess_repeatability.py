"""Joints that no longer come back to the same place."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np

from thermal_robot.effects.random_effect import RandomEffect

if TYPE_CHECKING:
    from thermal_robot.observations import Observations

_SAME = 1e-6  # rad or m: commands nearer than this repeat each other


@dataclass(frozen=True)
class ExcessRepeatability(RandomEffect):
    """Every joint scatters anew at each visit to a pose, by more than the instrument: σ_j, rad or m.

    Only repeats of a pose show it: rows with the same label ``pose``, or, without that column, the same command again.
    """

    name: ClassVar[str] = "excess_repeatability"
    title: ClassVar[str] = "joints that scatter more than the instrument"
    needs: ClassVar[tuple[str, ...]] = ("pose",)
    component: ClassVar[Literal["pose", "visit"]] = "visit"
    label: ClassVar[str] = "standard deviation"
    factor: ClassVar[float] = 1.0

    def missing(self, observations: Observations) -> tuple[str, ...]:
        """Return ``pose`` unless a pose is repeated; rows without a label stand alone."""
        labels = observations.campaign.pose_labels
        visits = np.round(observations.q / _SAME) if labels is None else labels[labels != ""]
        return () if len(np.unique(visits, axis=0)) < len(visits) else self.needs
