"""All postures at many places: as many as geometry allows, each where it should be."""

import numpy as np
import pytest

from thermal_robot.kinematics import tool_poses
from thermal_robot.maps.quantities import Task, all_postures
from thermal_robot.robot import load_robot

DOWN = np.array([0.0, 0.0, -1.0])


@pytest.fixture(scope="module")
def ur10():
    pytest.importorskip("example_robot_data", reason="the extra robots is not installed")
    return load_robot("example-robot-data:ur10", "tool0")


def task(robot, axis=(0.0, 0.0, 1.0), tip=(0.0, 0.0, 0.0), approach=DOWN):
    return Task(robot, np.asarray(approach), np.asarray(axis), np.asarray(tip), np.zeros(robot.n))


def square(side, count, z):
    x, y = np.meshgrid(np.linspace(-side, side, count), np.linspace(-side, side, count))
    return np.stack([x.ravel(), y.ravel(), np.full(x.size, z)], axis=1)


@pytest.mark.parametrize("tilt", [0.0, 0.3])
def test_a_ur10_with_its_tool_down_has_eight_postures_where_it_bends(ur10, tilt):
    approach, tip = np.array([0.0, np.sin(tilt), -np.cos(tilt)]), np.array([0.0, 0.0, 0.05])
    targets = square(0.8, 12, 0.2)
    places, q = all_postures(task(ur10, tip=tip, approach=approach), targets)
    poses = tool_poses(ur10, q)
    np.testing.assert_allclose(poses[:, :3, 3] + poses[:, :3, :3] @ tip, targets[places], rtol=0.0, atol=1e-10)
    np.testing.assert_allclose(poses[:, :3, 2], np.tile(approach, (len(q), 1)), rtol=0.0, atol=1e-10)
    assert np.all((q >= ur10.lower) & (q <= ur10.upper))
    count = np.bincount(places, minlength=len(targets))
    radius = np.hypot(targets[:, 0], targets[:, 1])
    assert np.all(count[(radius > 0.35) & (radius < 0.75)] == 8)
    assert count.max() == 8


def test_postures_of_a_place_differ_the_nearest_to_home_first_and_free_joints_stay_there(ur10):
    targets = square(0.6, 6, 0.3)
    places, q = all_postures(task(ur10), targets)
    for place in np.unique(places):
        own = q[places == place]
        apart = np.abs(np.angle(np.exp(1j * (own[:, None] - own[None])))).max(axis=2)
        assert np.all(apart[~np.eye(len(own), dtype=bool)] > 1e-3)
        assert np.all(np.diff(np.linalg.norm(own, axis=1)) >= -1e-12)
    np.testing.assert_allclose(q[:, 5], 0.0, atol=1e-6)  # it turns about the tool, which the task leaves free
    for first, again in zip((places, q), all_postures(task(ur10), targets), strict=True):
        np.testing.assert_array_equal(first, again)


def test_five_joints_have_the_postures_that_their_limits_leave(rv_m2):
    targets = square(0.5, 11, 0.2)
    places, q = all_postures(task(rv_m2, axis=(0.0, 1.0, 0.0)), targets)
    radius = np.hypot(targets[:, 0], targets[:, 1])
    reached = np.isin(np.arange(len(targets)), places)
    assert len(np.unique(places)) == len(places), "the elbow bends one way"
    # the arm is one of revolution: what it reaches is a ring, less the sector that its base cannot turn to
    azimuth = np.arctan2(targets[:, 0], targets[:, 1])
    ring = radius[reached].min(), radius[reached].max()
    inside = (radius >= ring[0]) & (radius <= ring[1]) & (np.abs(azimuth) < rv_m2.upper[0])
    np.testing.assert_array_equal(reached, inside)
    assert np.all((q >= rv_m2.lower) & (q <= rv_m2.upper))


def test_nothing_is_found_out_of_reach(ur10):
    places, q = all_postures(task(ur10), square(0.2, 3, 5.0))
    assert (len(places), q.shape) == (0, (0, 6))
