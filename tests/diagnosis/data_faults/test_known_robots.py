"""A robot at hand that fits a table is named, and none that does not."""

from dataclasses import replace

import pytest
from other_robots import measured, read_with

from thermal_robot.diagnosis.data_faults.faults import Readings
from thermal_robot.diagnosis.data_faults.misfit import fitting
from thermal_robot.robot import load_robot

pytest.importorskip("example_robot_data")


def fitted(campaign, near=5e-3):
    return fitting(replace(Readings.of(campaign), base_known=False, tool_known=False), near)


def test_the_robot_that_was_measured_is_named():
    own, other = (load_robot(f"example-robot-data:{name}", "tool0") for name in ("ur5", "ur10"))
    name, remains = fitted(read_with(measured(own, 1, geometric=2e-4), other))
    assert name == "example-robot-data:ur5"
    assert remains < 2e-3


def test_columns_go_to_the_joints_of_their_names():
    ur5 = load_robot("example-robot-data:ur5", "tool0")
    campaign = measured(ur5, 2)
    turned = load_robot(ur5.urdf.replace("shoulder_pan_joint", "a_joint"), "tool0")
    assert fitted(read_with(campaign, turned))[0] == "example-robot-data:ur5"


def test_no_robot_is_named_where_none_fits(rv_m2):
    ur5 = load_robot("example-robot-data:ur5", "tool0")
    shrunk = measured(ur5, 3)
    assert fitted(replace(shrunk, position=0.5 * shrunk.position)) is None


def test_a_robot_of_the_package_is_at_hand(rv_m2):
    name, _ = fitted(measured(rv_m2, 4, geometric=2e-4))
    assert name == "builtin:rv_m2"
