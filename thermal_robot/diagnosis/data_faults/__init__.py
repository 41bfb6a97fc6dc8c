"""Data faults: columns exchanged, reversed, shifted or in another unit; tested before faults of the robot."""

from thermal_robot.diagnosis.data_faults.find import data_fault

__all__ = ["data_fault"]
