"""A robot whose zeros and play are known, measured for a long time, and the diagnosis of its first rows."""

import numpy as np
import pytest
from updating_cases import ALL, OLD, measured

from thermal_robot.diagnosis.updated import fixed_point

ASKED = ["joint_offset", "backlash", "joint_gain"]


@pytest.fixture(scope="session")
def whole():
    """1100 rows, three in a hundred of them gross errors."""
    return measured(ALL, seed=3, gross=0.03)


@pytest.fixture(scope="session")
def found(whole, diagnosed_once):
    """The diagnosis of the first 900."""
    return diagnosed_once(whole.take(np.arange(OLD)), only=ASKED)


@pytest.fixture(scope="session")
def fresh(whole, diagnosed_once):
    """The diagnosis of all."""
    return diagnosed_once(whole, only=ASKED)


@pytest.fixture(scope="session")
def grown(found):
    return fixed_point(found.fit)
