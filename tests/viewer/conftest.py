"""A diagnosed campaign, and its scene."""

import pytest

from thermal_robot.datasets import demo_campaign
from thermal_robot.viewer.scene import scene_of_diagnosis


@pytest.fixture(scope="session")
def found(diagnosed_once):
    return diagnosed_once(demo_campaign())


@pytest.fixture(scope="session")
def scene(found):
    return scene_of_diagnosis(found)
