"""Units of a file, their SI factors, and the SI unit of every recorded quantity."""

from __future__ import annotations

import math
from dataclasses import dataclass

from thermal_robot.campaign import names
from thermal_robot.errors import CampaignError
from thermal_robot.robot import Robot

ANGLE_UNITS: dict[str, float] = {"rad": 1.0, "deg": math.pi / 180.0}  # Radians in one of the unit
LENGTH_UNITS = {"m": 1.0, "mm": 1e-3, "um": 1e-6, "cm": 1e-2, "inch": 0.0254, "in": 0.0254, "ft": 0.3048}
"""Metres in one of the unit; inch and foot are the international ones of 1959, exact."""

_OF_ITS_OWN = {"time": "s", "temperature": "°C", "payload": "kg"}
"""Quantities whose unit neither the file nor a joint chooses."""
_OF_A_JOINT = {"velocity": "{}/s", "acceleration": "{}/s²", "encoder": "{}"}
"""Quantities in the unit of their joint's own column."""


@dataclass(frozen=True)
class Units:
    """Units of a file: SI value = value in the file × scale.

    Parameters
    ----------
    angle
        ``"rad"`` or ``"deg"``.
    length
        ``"m"``, ``"mm"``, ``"um"``, ``"cm"``, ``"inch"`` (or ``"in"``) or ``"ft"``.

    Raises
    ------
    CampaignError
        A word that is not one of these.
    """

    angle: str = "rad"
    length: str = "m"

    def __post_init__(self) -> None:
        for key, word, known in (("angle_unit", self.angle, ANGLE_UNITS), ("length_unit", self.length, LENGTH_UNITS)):
            if not isinstance(word, str) or word not in known:
                expected = " or ".join(known)
                raise CampaignError("<units>", "unknown unit", column=key, found=repr(word), expected=expected)

    @property
    def angle_scale(self) -> float:
        """Radians per angle unit."""
        return ANGLE_UNITS[self.angle]

    @property
    def length_scale(self) -> float:
        """Metres per length unit."""
        return LENGTH_UNITS[self.length]

    def joint_scale(self, joint_type: str) -> float:
        """Radians, or metres for a prismatic joint, per unit of its column."""
        return self.length_scale if joint_type == "prismatic" else self.angle_scale

    def joint_unit(self, joint_type: str) -> str:
        """Name of the unit of a joint's column."""
        return self.length if joint_type == "prismatic" else self.angle


SI = Units()  # What everything is in once it has been read


def unit_of(column: str, robot: Robot, units: Units = SI) -> str:
    """Return the unit symbol of a table column: angles and lengths in ``units`` of a file, SI by default.

    It is empty for a dimensionless column (direction of approach, share of the speed, order, part of a quaternion) and
    for one that the format does not define.
    """
    kinds = dict(zip(robot.joint_names, robot.joint_types, strict=True))
    if column in kinds:
        return units.joint_unit(kinds[column])
    if column in (*names.POSITION, *names.SIMULATED_POSITION, names.NOISE) or names.target_of(column):
        return units.length
    if names.tilted(column) is not None:
        return units.angle
    quantity, place = names.split_name(column)
    if quantity not in names.PER_JOINT:
        return _OF_ITS_OWN.get(quantity if quantity in names.PER_LINK else column, "")
    if place not in kinds:
        return ""
    if quantity == "torque":
        return "N" if kinds[place] == "prismatic" else "N·m"
    return _OF_A_JOINT.get(quantity, "").format(units.joint_unit(kinds[place]))


def scale_of(column: str, robot: Robot, units: Units) -> float:
    """SI value of one unit of a table column; 1 where it is in SI, in °C, or dimensionless."""
    word = unit_of(column, robot, units).partition("/")[0]
    return (ANGLE_UNITS | LENGTH_UNITS).get(word, 1.0)
