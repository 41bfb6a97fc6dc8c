"""Inclinometers: columns ``tilt.x``, ``tilt.y`` of the base, and ``tilt.<link>.x``, ``tilt.<link>.y`` of a link."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.effects.effect import Driver
from thermal_robot.effects.quantities import driving

if TYPE_CHECKING:
    from thermal_robot.observations import Observations

BASE = ""
"""In place of a link."""


def columns(*links: str) -> tuple[str, ...]:
    """Return the names of the columns of some links, or of the base."""
    return tuple(f"tilt.{link}.{axis}" if link else f"tilt.{axis}" for link in links for axis in "xy")


def recorded(observations: Observations, *links: str) -> tuple[str, ...]:
    """Return those columns that the campaign has."""
    return tuple(column for column in columns(*links) if column in observations.covariates)


def turn(observations: Observations, link: str = BASE) -> Array:
    """(N, 3) turn that was read about x and y, rad; zero where nothing was."""
    read = np.zeros((observations.campaign.samples, 3))
    for k, column in enumerate(columns(link)):
        read[:, k] = observations.covariates.get(column, 0.0)
    return read


def varies(observations: Observations, *links: str) -> bool:
    """Whether any reading varies."""
    return any(observations.varies(column) for column in columns(*links))


def varying_most(observations: Observations, link: str = BASE) -> Driver | None:
    """Return the reading of one inclinometer that varies most as what drives an effect."""
    read = recorded(observations, link)
    return driving(observations, max(read, key=lambda column: float(np.ptp(observations.covariates[column]))))
