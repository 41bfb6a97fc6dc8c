"""Independent simulation of a robot on springs in MuJoCo, with faults and an instrument.

It imports of the package only what a case is and the exception for a user's file. What it shares with the program
nevertheless (formats.md, Newton's law of cooling, Hooke's) is listed in docs/blind.md.
"""

from thermal_robot.blind.reality.campaign import make
from thermal_robot.blind.reality.fault import FAULTS, Fault
from thermal_robot.blind.reality.unlisted import UNLISTED
from thermal_robot.blind.reality.world import Body, World

__all__ = ["FAULTS", "UNLISTED", "Body", "Fault", "World", "make"]
