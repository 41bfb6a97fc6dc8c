"""What kinematics ask of a robot."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from thermal_robot.kinematics.model import Chain


class Chained(Protocol):
    """A chain with a name; a :class:`~thermal_robot.Robot` is one."""

    @property
    def name(self) -> str:
        """Name of the robot, for messages."""

    @property
    def n(self) -> int:
        """Number of joints that can be driven."""

    @property
    def segments(self) -> Sequence[Any]:
        """The placements that may be displaced, from the root on."""

    @property
    def chain(self) -> Chain:
        """Constant arrays of its elements."""


class Weighted(Chained, Protocol):
    """A chain on which gravity pulls; a :class:`~thermal_robot.Robot` is one."""

    @property
    def gravity(self) -> NDArray[np.float64]:
        """(3,) m/s² in the root frame."""
