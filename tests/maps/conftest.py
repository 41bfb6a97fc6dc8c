"""Arms whose postures are known, and a small question."""

import pytest

from thermal_robot.maps import Positions, Question
from thermal_robot.robot import load_robot


@pytest.fixture(scope="session")
def ur10():
    pytest.importorskip("example_robot_data", reason="the extra robots is not installed")
    return load_robot("example-robot-data:ur10", "tool0")


@pytest.fixture
def plane():
    """Places that an RV-M2 reaches and such that it does not."""
    return Positions((-0.5, 0.5, 9), (-0.5, 0.5, 9), (0.2, 0.2, 1))


@pytest.fixture
def question():
    return Question(axis=(0.0, 1.0, 0.0))
