"""Where a map asks, and what makes two maps the same."""

from dataclasses import replace

import numpy as np
import pytest

from thermal_robot.errors import RobotError
from thermal_robot.maps import Joints, Positions, Question
from thermal_robot.maps.question import Spec, within
from thermal_robot.robot import load_robot


def test_places_run_along_x_first():
    grid = Positions((0.0, 1.0, 3), (2.0, 4.0, 2), (7.0, 7.0, 1))
    at = grid.place(np.arange(grid.count))
    np.testing.assert_allclose(at[:4], [[0.0, 2.0, 7.0], [0.5, 2.0, 7.0], [1.0, 2.0, 7.0], [0.0, 4.0, 7.0]])
    assert grid.count == 6


def test_joint_positions_fill_the_limits_and_do_not_depend_on_where_one_begins(rv_m2):
    every = Joints(512).drawn(np.arange(512), rv_m2)
    np.testing.assert_array_equal(every[100:], Joints(512).drawn(np.arange(100, 512), rv_m2))
    low, high = within(rv_m2)
    assert np.all((every >= low) & (every <= high))
    np.testing.assert_allclose((every.mean(axis=0) - low) / (high - low), 0.5, atol=0.01)


def test_limits_are_needed_where_a_slide_has_none():
    text = """<robot name="rail"><link name="a"/><link name="b"/>
      <joint name="j" type="prismatic"><parent link="a"/><child link="b"/><axis xyz="1 0 0"/>
      <limit lower="-1e400" upper="1" effort="1" velocity="1"/></joint></robot>"""
    rail = load_robot(text.replace("-1e400", "-1"), "b")
    assert within(rail, (-0.5,), (0.5,))[0] == -0.5
    with pytest.raises(RobotError, match="limits of 1 joints"):
        within(rail, (-0.5, 0.1), (0.5, 0.2))


@pytest.mark.parametrize(
    "other",
    [
        {"over": Joints(9)},
        {"over": Positions((0.0, 1.0, 2), (0.0, 0.0, 1), (0.0, 0.0, 1))},
        {"question": Question(rise=4.0)},
        {"question": Question({"joint_1": 1e-5})},
    ],
)
def test_a_fingerprint_is_that_of_all_settings(rv_m2, other):
    spec = Spec(rv_m2, Joints(8))
    assert spec.fingerprint == Spec(rv_m2, Joints(8)).fingerprint
    assert replace(spec, **other).fingerprint != spec.fingerprint
