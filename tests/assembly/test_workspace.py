"""Poses that hold a peg, and the clearance each place needs: what physics demands of them."""

import numpy as np
import pytest

from thermal_robot.assembly.repeatability import tool_covariance
from thermal_robot.assembly.workspace import assembly_map, grid, reach
from thermal_robot.errors import RobotError
from thermal_robot.kinematics import tool_poses
from thermal_robot.robot import load_robot

SEEDS = {
    "rv_m2": ([0.0, 0.9, -1.4, -1.07, 0.0], (0.0, 1.0, 0.0), np.linspace(0.42, 0.48, 5), 0.2),
    "ur10": ([0.0, -1.2, 1.8, -2.1, -1.57, 0.0], (0.0, 0.0, 1.0), np.linspace(0.4, 1.0, 7), 0.1),
    "panda": ([0.0, -0.5, 0.0, -2.2, 0.0, 1.8, 0.8], (0.0, 0.0, 1.0), np.linspace(0.3, 0.5, 4), 0.3),
}
"""A configuration with the tool down, the peg's direction in the tool frame, places ahead of the robot, a height."""

# Three slides with legs of 0.5 m: scatter and growth follow from one line each.
GANTRY = """
<robot name="gantry"><link name="base"/><link name="x"/><link name="y"/><link name="z"/><link name="tip"/>
  <joint name="jx" type="prismatic"><parent link="base"/><child link="x"/><origin xyz="0.5 0 0"/><axis xyz="1 0 0"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
  <joint name="jy" type="prismatic"><parent link="x"/><child link="y"/><origin xyz="0 0.5 0"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
  <joint name="jz" type="prismatic"><parent link="y"/><child link="z"/><origin xyz="0 0 0.5"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
  <joint name="hand" type="fixed"><parent link="z"/><child link="tip"/><origin xyz="0 0 0.1"/></joint>
</robot>
"""
WARM = {"coefficients": 12e-6, "rise": 3.0, "clearance": 2e-4}


@pytest.fixture(scope="module")
def gantry():
    return load_robot(GANTRY, "tip")


@pytest.fixture(scope="module")
def rv_m2_poses(rv_m2):
    seed, axis, xs, z = SEEDS["rv_m2"]
    return reach(rv_m2, grid(0.0, xs[::2], z), seed, axis=axis)


@pytest.mark.parametrize("arm", SEEDS, indirect=True)
@pytest.mark.parametrize("tilt", [0.0, 0.2])
def test_every_place_is_reached_along_the_approach(arm, tilt, request):
    seed, axis, ahead, z = SEEDS[request.node.callspec.params["arm"]]
    tip, approach = np.array([0.01, 0.02, 0.03]), np.array([0.0, np.sin(tilt), -np.cos(tilt)])
    places = grid(0.0, ahead, z)
    q = reach(arm, places, seed, approach=5.0 * approach, axis=axis, point=tip)
    poses = tool_poses(arm, q)
    np.testing.assert_allclose(poses[:, :3, 3] + poses[:, :3, :3] @ tip, places, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(poses[:, :3, :3] @ axis, np.tile(approach, (len(q), 1)), rtol=0.0, atol=1e-9)
    assert np.all((q >= arm.lower) & (q <= arm.upper))
    assert np.max(np.abs(np.diff(q, axis=0))) < 1.0, "the branch is kept"


@pytest.mark.parametrize("arm", ["ur10"], indirect=True)
@pytest.mark.parametrize("count", [11, 21])
def test_a_plane_around_the_base_keeps_its_branch(arm, count):
    xs = np.linspace(-1.0, 1.0, count)
    places = grid(xs, xs, 0.1)
    q = reach(arm, places, SEEDS["ur10"][0])
    radius, azimuth = np.hypot(*places[:, :2].T), np.arctan2(places[:, 1], places[:, 0])
    reached = np.isfinite(q[:, 0])
    np.testing.assert_array_equal(reached[(radius > 0.25) & (radius < 1.2)], True)
    assert not reached[radius < 0.16].any(), "the shoulder's offset keeps the tool from its own axis"
    # Seen from the base, the same arm: the first joint follows the azimuth, the last is free, the others see a radius.
    for ring in (reached & np.isclose(radius, size) for size in (0.4, np.hypot(0.4, 0.8), 1.0)):
        assert ring.sum() >= 4
        np.testing.assert_allclose(q[ring, 1:5] - q[ring][0, 1:5], 0.0, atol=1e-8)
        turned = np.exp(1j * (q[ring, 0] - azimuth[ring]))
        np.testing.assert_allclose(turned, turned[0], atol=1e-8)


def test_places_out_of_reach_and_beyond_limits_are_left_out(rv_m2, gantry):
    seed, axis, _, z = SEEDS["rv_m2"]
    places = np.array([[0.0, 0.4, z], [0.0, 5.0, z], [0.0, 0.4, 9.0]])
    np.testing.assert_array_equal(np.isnan(reach(rv_m2, places, seed, axis=axis)), [[0] * 5, [1] * 5, [1] * 5])
    assert np.isnan(reach(rv_m2, places[1:], seed, axis=axis)).all()
    places = grid(np.linspace(-1.0, 2.0, 13), 0.5, 0.6)
    q = reach(gantry, places, np.zeros(3), approach=(0, 0, 1))
    np.testing.assert_array_equal(np.isfinite(q[:, 0]), (places[:, 0] >= -0.5) & (places[:, 0] <= 1.5))
    assert np.isnan(reach(gantry, places, np.zeros(3), approach=(0, 0, -1))).all(), "slides turn nothing"


def test_a_grid_runs_along_x_first():
    np.testing.assert_array_equal(
        grid([1, 2], [3, 4], 5), [[1.0, 3.0, 5.0], [2.0, 3.0, 5.0], [1.0, 4.0, 5.0], [2.0, 4.0, 5.0]]
    )
    assert grid([1, 2], 0, [3, 4, 5]).shape == (6, 3)


def test_round_scatter_is_rayleighs(gantry):
    sigma = 2e-5
    found = assembly_map(gantry, np.zeros((1, 3)), sigma, **(WARM | {"rise": 0.0}), capability=1.0)
    fails = 0.0026997960632601866  # 2 Φ(−3)
    np.testing.assert_allclose(found.required, sigma * np.sqrt(-8.0 * np.log(fails)), rtol=1e-10)
    np.testing.assert_allclose(found.probability, -np.expm1(-((2e-4 / sigma) ** 2) / 8.0), rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(found.displacement, 0.0, atol=0.0)


def test_a_gantry_grows_by_its_legs_not_by_its_travel(gantry):
    q = np.array([[0.0, 0.0, 0.0], [0.7, -0.3, 0.2]])
    found = assembly_map(gantry, q, 1e-5, **WARM)
    np.testing.assert_allclose(found.displacement, np.tile(36e-6 * np.array([0.5, 0.5, 0.6]), (2, 1)), rtol=1e-12)
    np.testing.assert_allclose(found.cost[0], found.cost[1], rtol=1e-9)
    np.testing.assert_allclose(found.positions, [[0.5, 0.5, 0.6], [1.2, 0.2, 0.8]])


@pytest.mark.parametrize("law", ["shift", "uniform"])
def test_without_a_rise_warmth_costs_nothing(rv_m2, rv_m2_poses, law):
    axis = SEEDS["rv_m2"][1]
    cold = assembly_map(rv_m2, rv_m2_poses, 4e-5, **(WARM | {"rise": 0.0}), law=law, axis=axis)
    np.testing.assert_allclose(cold.cost, 0.0, atol=1e-15)
    np.testing.assert_array_equal(cold.probability, cold.probability_warm)
    warm = assembly_map(rv_m2, rv_m2_poses, 4e-5, **WARM, law=law, axis=axis)
    np.testing.assert_array_equal(warm.required, cold.required)
    assert np.all(warm.cost > 0.0)
    assert np.all(warm.probability_warm < warm.probability)


def test_a_known_shift_costs_more_than_an_uncertain_one(rv_m2, rv_m2_poses):
    # The temperature within ±3 K is mostly nearer than 3 K; and no displacement costs more than twice its length.
    axis = SEEDS["rv_m2"][1]
    shift, uniform = (
        assembly_map(rv_m2, rv_m2_poses, 4e-5, **WARM, law=law, axis=axis) for law in ("shift", "uniform")
    )
    assert np.all(uniform.cost < shift.cost)
    assert np.all(shift.cost < 2.0 * np.linalg.norm(shift.displacement[:, :2], axis=1))


def test_a_carrier_that_grows_with_the_robot_cancels_it(rv_m2, rv_m2_poses):
    found = assembly_map(rv_m2, rv_m2_poses, 4e-5, **WARM, carrier_strain=36e-6, axis=SEEDS["rv_m2"][1])
    np.testing.assert_allclose(found.displacement, 0.0, atol=1e-18)
    np.testing.assert_allclose(found.cost, 0.0, atol=1e-14)


def test_scatter_and_clearance_grow_together(rv_m2, rv_m2_poses):
    axis = SEEDS["rv_m2"][1]
    maps = [assembly_map(rv_m2, rv_m2_poses, s, **WARM, axis=axis) for s in (2e-5, 4e-5)]
    np.testing.assert_allclose(maps[1].required, 2.0 * maps[0].required, rtol=1e-9)
    assert np.all(maps[1].required_warm > maps[0].required_warm)
    assert np.all(maps[1].probability < maps[0].probability)
    np.testing.assert_array_equal(maps[0].covariance, tool_covariance(rv_m2, rv_m2_poses, 2e-5))
    assert np.all(assembly_map(rv_m2, rv_m2_poses, 2e-5, **WARM, axis=axis, capability=1.0).required < maps[0].required)


@pytest.mark.parametrize("law", ["shift", "uniform"])
def test_the_first_joint_turns_the_map_and_changes_nothing(rv_m2, rv_m2_poses, law):
    turned = rv_m2_poses[:1] + np.array([[0.0], [0.3], [1.9], [-2.4]]) * np.eye(5)[0]
    found = assembly_map(rv_m2, turned, 4e-5, **WARM, law=law, axis=SEEDS["rv_m2"][1])
    for values in (found.required, found.required_warm, found.probability, found.probability_warm):
        np.testing.assert_allclose(values, values[0], rtol=1e-9)
    np.testing.assert_allclose(np.hypot(*found.displacement[:, :2].T), 36e-6 * np.hypot(*found.positions[:, :2].T))


def test_best_and_worst_pass_over_what_was_not_reached(gantry):
    q = np.array([[np.nan] * 3, [0.5, 0.0, 0.0], [-0.4, 0.0, 0.0]])
    found = assembly_map(gantry, q, 1e-5, coefficients=0.0, rise=3.0, clearance=1e-4, carrier_strain=36e-6)
    assert (found.best, found.worst) == (2, 1)
    assert np.isnan(found.cost[0])
    assert np.isnan(found.probability[0])


def test_what_does_not_fit_is_said(gantry):
    with pytest.raises(RobotError, match=r"\(2,\) and \(3,\) do not fit: expected \(M, 3\)"):
        reach(gantry, [0.0, 0.0], np.zeros(3))
    with pytest.raises(RobotError, match="approach is three finite numbers, not all zero"):
        reach(gantry, [[0.0, 0.0, 0.0]], np.zeros(3), approach=(0, 0, 0))
    with pytest.raises(RobotError, match="point is three finite numbers"):
        assembly_map(gantry, np.zeros(3), 1e-5, **WARM, point=(0, 0))
    with pytest.raises(RobotError, match="law is 'shift' or 'uniform'"):
        assembly_map(gantry, np.zeros(3), 1e-5, **WARM, law="guess")
