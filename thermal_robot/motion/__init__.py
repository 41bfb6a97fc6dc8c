"""Motion in time: what a robot's joints were commanded, and what they did."""

from thermal_robot.motion.faults import Fault, Sound, find_faults
from thermal_robot.motion.log import Channel, Motion, MotionLog, Servo
from thermal_robot.motion.read import motion_from_table, read_motion

__all__ = [
    "Channel",
    "Fault",
    "Motion",
    "MotionLog",
    "Servo",
    "Sound",
    "find_faults",
    "motion_from_table",
    "read_motion",
]
