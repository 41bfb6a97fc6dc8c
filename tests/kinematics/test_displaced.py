"""Displacements made ready: one for all rows or one for each, nothing where nothing is displaced."""

import numpy as np
import pytest
import reference

from thermal_robot.errors import RobotError
from thermal_robot.kinematics.frames import tool_poses
from thermal_robot.kinematics.walk import Displaced, Displacement


def test_nothing_displaced_is_nothing_to_apply(rv_m2):
    ready = Displaced.of(rv_m2, None, 9)
    assert (ready.joint, ready.segment, ready.base, ready.tool) == (None, {}, None, None)
    assert Displaced.of(rv_m2, Displacement(segment=np.zeros((len(rv_m2.segments), 6))), 9).segment == {}


def test_only_displaced_segments_are_applied(rv_m2):
    twists = np.zeros((9, len(rv_m2.segments), 6))
    twists[4, 2, 3] = 1e-3
    assert list(Displaced.of(rv_m2, Displacement(segment=twists), 9).segment) == [rv_m2.segments[2].index]


def test_one_for_all_is_the_same_as_one_for_each_row_repeated(arm, configurations):
    q, rng = configurations(arm, 30), np.random.default_rng(0)
    one = [rng.normal(0.0, 0.2, shape) for shape in (arm.n, (len(arm.segments), 6), 6, 6)]
    each = [np.tile(value, (30, *[1] * np.ndim(value))) for value in one]
    alike = tool_poses(arm, q, Displacement(*one))
    np.testing.assert_allclose(tool_poses(arm, q, Displacement(*each)), alike, rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(reference.tool_poses(arm, q, Displacement(*one)), alike, rtol=0.0, atol=1e-12)


def test_a_shape_that_does_not_fit_is_said(rv_m2):
    with pytest.raises(RobotError, match=r"displacement 'tool' of shape \(7,\) does not fit: expected \(6,\) or"):
        Displaced.of(rv_m2, Displacement(tool=np.zeros(7)), 9)
