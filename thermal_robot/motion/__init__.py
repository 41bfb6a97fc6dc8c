"""Motion in time: what a robot's joints were commanded, and what they did."""

from thermal_robot.motion.log import Channel, Motion, MotionLog, Servo
from thermal_robot.motion.read import motion_from_table, read_motion

__all__ = ["Channel", "Motion", "MotionLog", "Servo", "motion_from_table", "read_motion"]
