"""Where a map asks, what makes two maps the same, and its columns: what the functions of the assembly say."""

from dataclasses import replace

import numpy as np
import pytest

from thermal_robot.assembly.probability import capability, failing_probability, plane_axes, required_clearance
from thermal_robot.assembly.probability import zonotope as zonotope_of
from thermal_robot.assembly.repeatability import tool_covariance
from thermal_robot.assembly.thermal import displacement, elongation
from thermal_robot.errors import RobotError
from thermal_robot.kinematics import elongation_jacobian, tool_poses
from thermal_robot.maps import Joints, Positions, Question
from thermal_robot.maps.quantities import UNITS, Task, all_postures, columns, polygon
from thermal_robot.maps.question import Spec, within
from thermal_robot.robot import load_robot


@pytest.mark.parametrize("law", ["shift", "uniform"])
def test_each_row_is_what_single_functions_say(rv_m2, law):
    question = Question(4e-5, 1.5e-5, 5.0, 1.5e-4, 1.2, law, axis=(0.0, 1.0, 0.0), point=(0.0, 0.02, 0.0))
    found = columns(Spec(rv_m2, Joints(6), question), np.arange(6))
    q = np.stack([found[name] for name in rv_m2.joint_names], axis=1)
    grown = elongation(rv_m2, 5.0, coefficients=1.5e-5, reference=0.0)
    for k in range(6):
        pose = tool_poses(rv_m2, q[k])[0]
        tip = pose[:3, 3] + pose[:3, :3] @ question.point
        np.testing.assert_allclose([found[a][k] for a in "xyz"], tip, atol=1e-15)
        plane = plane_axes(pose[:3, :3] @ question.axis)
        covariance = tool_covariance(rv_m2, q[k], 4e-5, point=question.point)[0]
        moved = displacement(rv_m2, q[k], grown)[0]
        np.testing.assert_allclose([found[f"std.{a}"][k] for a in "xyz"], np.sqrt(np.diag(covariance)), rtol=1e-12)
        np.testing.assert_allclose([found[f"shift.{a}"][k] for a in "xyz"], moved, atol=1e-18)
        scatter, off = plane @ covariance @ plane.T, plane @ moved
        heated = {"mean": off} if law == "shift" else {"segments": off}
        fails = failing_probability(scatter, 1.5e-4, **heated)
        assert found["capability_warm"][k] == pytest.approx(float(capability(failing=fails)), rel=1e-9)
        assert found["probability_warm"][k] == pytest.approx(1.0 - float(fails), abs=1e-13)
        assert found["required"][k] == pytest.approx(required_clearance(scatter, capability=1.2), rel=1e-10)
        warm = required_clearance(scatter, capability=1.2, **heated)
        assert found["required_warm"][k] == pytest.approx(warm, rel=1e-10)
        share = np.minimum(q[k] - rv_m2.lower, rv_m2.upper - q[k]) / (rv_m2.upper - rv_m2.lower)
        assert found["margin"][k] == pytest.approx(share.min(), rel=1e-12)
    assert set(found) == {*UNITS, *rv_m2.joint_names}


def test_a_polygon_is_that_of_its_corners(rv_m2):
    q = np.random.default_rng(0).uniform(-0.4, 0.4, (5, 5))
    edges = 1e-5 * elongation_jacobian(rv_m2, q)[:, :2]
    area, width = polygon(edges)
    for k in range(5):
        corners = zonotope_of(edges[k], 0.0, 1.0).vertices
        x, y = corners.T
        shoelace = 0.5 * abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))
        assert area[k] == pytest.approx(shoelace, rel=1e-10)
        apart = np.linalg.norm(corners[:, None] - corners[None], axis=2)
        assert width[k] == pytest.approx(apart.max(), rel=1e-12)


def test_a_polygon_of_too_many_segments_is_refused():
    with pytest.raises(RobotError, match="too many corners"):
        polygon(np.zeros((1, 2, 13)))


RAIL = """<robot name="rail"><link name="a"/><link name="b"/>
  <joint name="j" type="prismatic"><parent link="a"/><child link="b"/><axis xyz="1 0 0"/></joint></robot>"""


def test_a_slide_without_limits_is_mapped_within_those_that_are_given():
    rail = load_robot(RAIL, "b")
    assert not np.isfinite(rail.lower).any()
    found = columns(Spec(rail, Joints(8, (-0.5,), (0.5,)), Question(coefficients=0.0)), np.arange(8))
    assert np.all(np.abs(found["j"]) <= 0.5)
    np.testing.assert_allclose(found["margin"], 0.5)  # of no range
    for limits in ((), ((-0.5, 0.1), (0.5, 0.2))):
        with pytest.raises(RobotError, match="limits of 1 joints"):
            within(rail, *limits)


def test_the_margin_is_a_share_of_the_whole_range():
    pytest.importorskip("example_robot_data", reason="the extra robots is not installed")
    ur10 = load_robot("example-robot-data:ur10", "tool0")
    found = columns(Spec(ur10, Joints(16)), np.arange(16))
    q = np.stack([found[name] for name in ur10.joint_names], axis=1)
    share = np.minimum(q - ur10.lower, ur10.upper - q) / (ur10.upper - ur10.lower)
    np.testing.assert_allclose(found["margin"], share.min(axis=1), rtol=1e-12)
    assert found["margin"].max() <= 0.5


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


def test_a_fingerprint_is_that_of_all_settings(rv_m2):
    spec = Spec(rv_m2, Joints(8))
    assert spec.fingerprint == Spec(rv_m2, Joints(8)).fingerprint
    line = Positions((0.0, 1.0, 2), (0.0, 0.0, 1), (0.0, 0.0, 1))
    others = [{"over": over} for over in (Joints(9), line)]
    others += [{"question": asked} for asked in (Question(rise=4.0), Question({"joint_1": 1e-5}))]
    assert len({spec.fingerprint, *(replace(spec, **other).fingerprint for other in others)}) == 5


# ---- all postures at many places


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
