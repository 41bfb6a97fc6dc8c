"""Campaigns and diagnoses that several tests look at."""

import pytest
from conftest import load_arm
from simulate import simulate


@pytest.fixture(scope="session")
def clean():
    """A sound UR10: noise alone."""
    return simulate(load_arm("ur10"), [], samples=60, seed=11, noise=20e-6)[0]


@pytest.fixture(scope="session")
def hall(rv_m2, diagnosed_once):
    """A diagnosis of links that grow and joints with play, some rows spoilt."""
    return diagnosed_once(simulate(rv_m2, ["thermal_elongation", "backlash"], seed=1, outliers=0.03)[0])
