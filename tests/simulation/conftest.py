"""An arm of two links that anybody can compute by hand."""

import pytest

from thermal_robot import load_robot

UPPER, FORE = 0.5, 0.4  # m

PLANAR = f"""
<robot name="planar">
  <link name="ground"/><link name="upper"/><link name="fore"/><link name="tip"/>
  <joint name="shoulder" type="revolute"><parent link="ground"/><child link="upper"/><axis xyz="0 0 1"/>
    <limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="fore"/><axis xyz="0 0 1"/>
    <origin xyz="{UPPER} 0 0"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
  <joint name="end" type="fixed"><parent link="fore"/><child link="tip"/><origin xyz="{FORE} 0 0"/></joint>
</robot>
"""


@pytest.fixture(scope="session")
def planar():
    return load_robot(PLANAR, "tip")
