"""One arm of the trial and one day of it, that several tests look at."""

import numpy as np
import pytest

from thermal_robot.robot import load_robot


@pytest.fixture(scope="session")
def ur10():
    """The arm as the reality builds it."""
    pytest.importorskip("mujoco", reason='the blind trial needs "thermal-robot[blind]"')
    from thermal_robot.blind.reality import World

    return World(load_robot("example-robot-data:ur10", "tool0").urdf, "tool0")


@pytest.fixture(scope="session")
def setting(ur10):
    """Ninety rows in sessions, with a sensor on every link: nobody changes them."""
    from thermal_robot.blind.reality.setting import draw_setting

    return draw_setting(ur10, 90, np.random.default_rng(3), sensor="links", sessions=True)


@pytest.fixture(scope="session")
def gauge(setting):
    """All rows of that day, both frames unknown."""
    from thermal_robot.blind.reality.sizes import Gauge

    return Gauge(setting, np.arange(setting.samples), np.array([0.02, -0.01, 0.1]), True, True)


@pytest.fixture
def body(setting):
    """The arm without a fault, to be spoilt."""
    return setting.world.sound(setting.samples)
