"""One plan that several tests look at."""

import pytest

from thermal_robot.planning import plan

TARGET = (0.05, 0.03, 0.1)


@pytest.fixture(scope="session")
def planned(rv_m2):
    return plan(rv_m2, 60, target=TARGET, loads=(1.5,), seed=5)
