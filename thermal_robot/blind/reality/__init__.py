"""A robot on springs in MuJoCo, with its faults and instrument: knows neither Pinocchio nor the effects' formulas."""

from thermal_robot.blind.reality.campaign import make
from thermal_robot.blind.reality.fault import Fault
from thermal_robot.blind.reality.faults import FAULTS
from thermal_robot.blind.reality.unlisted import UNLISTED
from thermal_robot.blind.reality.world import Body, World

__all__ = ["FAULTS", "UNLISTED", "Body", "Fault", "World", "make"]
