"""What only a fleet needs is asked for by name where it is missing."""

import sys

import pytest

from thermal_robot.errors import ThermalRobotError
from thermal_robot.fleet.rows import needed


def test_a_module_that_is_missing_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ThermalRobotError, match=r"needs distributed.*pip install 'thermal-robot\[fleet\]'"):
        needed("distributed")


def test_one_that_is_there_is_returned():
    assert needed("json").loads("[1]") == [1]
