"""What a table tells of the robot that was measured, where that is not the URDF's."""

from __future__ import annotations

from dataclasses import dataclass

from thermal_robot.campaign.plausible import in_another_unit

UNIT = 30.0
"""Times too long or too short that all links are where a unit is wrong, not the model: inches read as m are 39, cm a
hundred, mm a thousand; sisters differ by three."""


@dataclass(frozen=True)
class AnotherModel:
    """The robot that was measured, as far as a table tells it from that of the URDF.

    Attributes
    ----------
    factor
        How many times as long as in the URDF its links are; ``None`` where they have no common factor.
    joint, off
        The joint that sits farthest from where the URDF has it, and how far, m.
    fits, remains
        A robot at hand that fits the table, as :func:`~thermal_robot.load_robot` takes it, and the median distance that
        it leaves, m; ``None`` where none fits.
    """

    factor: float | None = None
    joint: str = ""
    off: float = 0.0
    fits: str | None = None
    remains: float = 0.0

    @property
    def in_another_unit(self) -> bool:
        """Whether the URDF's lengths stand in another unit than m."""
        return self.factor is not None and not 1.0 / UNIT < self.factor < UNIT

    @property
    def unit(self) -> str:
        """In which unit the URDF's lengths stand, in words; empty where it is m."""
        return in_another_unit(self.factor) if self.factor is not None and self.in_another_unit else ""
