"""Faults of the data, before faults of the robot: columns exchanged, turned round, shifted, or in another unit."""

from thermal_robot.diagnosis.data_faults.find import data_fault

__all__ = ["data_fault"]
