"""Measured campaigns; they lie in the folder that THERMAL_ROBOT_DATA names."""

import os
from pathlib import Path

import numpy as np
import pytest

from thermal_robot.campaign import read_campaign


@pytest.fixture(scope="session")
def measured_campaigns():
    """The folder of measured campaigns."""
    data = os.environ.get("THERMAL_ROBOT_DATA")
    if not data:
        pytest.skip("THERMAL_ROBOT_DATA names no folder of measured campaigns")
    return Path(data)


@pytest.fixture(scope="session")
def ur5(measured_campaigns):
    """The first rows that were measured on a UR5."""
    return read_campaign(measured_campaigns / "ur5_jacobi").take(np.arange(300))
