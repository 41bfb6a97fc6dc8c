"""A campaign whose truth is known: a robot with effects of stated size, measured by an instrument of stated noise."""

from thermal_robot.simulation.simulate import simulate

__all__ = ["simulate"]
