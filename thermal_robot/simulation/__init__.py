"""Simulated campaigns: a robot with effects of known size, measured with known noise."""

from thermal_robot.simulation.simulate import simulate

__all__ = ["simulate"]
