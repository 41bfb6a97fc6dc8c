"""Workspace maps: scatter, thermal shift and joining probability of a robot at each place, in every posture.

This package depends on robots and on assembly probabilities, not on campaigns.
"""

from thermal_robot.maps.figures import plot_map
from thermal_robot.maps.question import Joints, Positions, Question
from thermal_robot.maps.stores import Map, workspace_map

__all__ = ["Joints", "Map", "Positions", "Question", "plot_map", "workspace_map"]
