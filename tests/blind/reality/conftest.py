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


BEAM = """<robot name="beam"><link name="wall"/>
  <link name="arm"><inertial><origin xyz="0.4 0 0"/><mass value="4"/></inertial></link><link name="end"/>
  <joint name="turn" type="revolute"><parent link="wall"/><child link="arm"/><axis xyz="0 -1 0"/>
    <limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
  <joint name="tip" type="fixed"><parent link="arm"/><child link="end"/><origin xyz="0.8 0 0"/></joint></robot>"""


@pytest.fixture(scope="session")
def beam_urdf():
    """The arm of :func:`beam`."""
    return BEAM


@pytest.fixture(scope="session")
def beam():
    """A uniform arm of 4 kg and 0.8 m that turns about a level axis."""
    from thermal_robot.blind.reality import World

    return World(BEAM, "end", payload_com=(0.0, 0.0, 0.0))
