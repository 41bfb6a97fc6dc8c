"""Workspace maps: scatter, thermal shift and joining probability of a robot, place by place, in every posture.

The room knows robots and the assembly's probabilities, no campaign.
"""

from thermal_robot.maps.figures import plot_map
from thermal_robot.maps.question import Joints, Positions, Question
from thermal_robot.maps.stores import Map, workspace_map

__all__ = ["Joints", "Map", "Positions", "Question", "plot_map", "workspace_map"]
