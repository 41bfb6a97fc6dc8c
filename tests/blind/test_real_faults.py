"""Conditions put into a measured campaign do exactly what they say."""

from dataclasses import replace

import numpy as np
import pytest
from simulate import simulate

from thermal_robot.blind import real as faults
from thermal_robot.kinematics import exp6, placement_sensitivities
from thermal_robot.observations import Frames, observe


def test_lost_motion_follows_the_side_of_the_approach(ur5):
    with_sides = faults.with_approaches(ur5)
    for j, joint in enumerate(ur5.robot.joint_names):
        side = with_sides.covariates[f"approach.{joint}"]
        change = np.diff(ur5.q[:, j])
        assert side[0] == 0
        assert np.array_equal(side[1:], np.where(np.abs(change) > 1e-4, np.sign(change), 0))


def test_links_grow_along_their_segments(ur5):
    strains, warmer = np.linspace(1.2e-5, 2.3e-5, len(ur5.robot.segments)), np.linspace(0.0, 15.0, ur5.samples)
    grown = faults.with_growth(ur5, strains, warmer)
    moved = np.asarray(grown.position) - np.asarray(ur5.position)
    per_metre = placement_sensitivities(ur5.robot, ur5.q)[:, :3, :, :3]
    elongations = [strains[s] * warmer[:, None] * g.length * g.direction for s, g in enumerate(ur5.robot.segments)]
    expected = np.einsum("nisk,nsk->ni", per_metre, np.stack(elongations, axis=1))
    frames = faults.registered(ur5)
    np.testing.assert_allclose(moved, expected @ frames.base[:3, :3].T, atol=1e-12)
    assert 1e-4 < np.linalg.norm(moved, axis=1).max() < 1e-3


def test_frames_are_fitted_to_the_best(ur5):
    seen = observe(ur5, faults.registered(ur5))
    slope = np.einsum("nik,ni->k", faults.frame_columns(seen), seen.gap[:, :3])
    assert np.abs(slope).max() < 1e-9
    assert np.sqrt((seen.gap**2).sum(axis=1).mean()) == pytest.approx(0.72e-3, abs=0.05e-3)


def test_temperature_rises_by_some_ten_kelvin_and_falls_in_the_break():
    for seed in range(20):
        warm = faults.warm_up(np.random.default_rng(seed), 500)
        assert warm[0] == 0.0
        assert 10.0 <= warm.max() <= 20.0
        assert warm[180:320].min() >= 0.0
        assert np.diff(warm).min() < 0 < np.diff(warm).max()


# ---- on a campaign of the program's own model, so that they run without measured ones


@pytest.fixture(scope="module")
def made(rv_m2):
    return simulate(rv_m2, samples=40, seed=3)[0]


def test_a_joint_error_moves_the_prediction_as_the_joint_would(made):
    frames = Frames.declared(made)
    error = np.linspace(-2e-3, 1e-3, 40)
    changed = faults.with_joint_error(made, 2, error)
    assert np.array_equal(changed.position, made.position)
    assert np.array_equal(np.delete(changed.q, 2, axis=1), np.delete(made.q, 2, axis=1))
    # what the robot did is what the table says and the error
    change = observe(made, frames).joint_sensitivity[:, :3, 2] * error[:, None] @ frames.base[:3, :3].T
    moved = observe(made, frames).predicted_position - observe(changed, frames).predicted_position
    # to first order: the second is the lever times half the square of the angle
    assert moved == pytest.approx(change, abs=2e-6)
    assert np.abs(change).max() > 100e-6


def test_a_scale_keeps_directions_and_angles(made):
    scaled = faults.with_scale(made, 1e-3)
    assert faults.measured(scaled) == pytest.approx(1.001 * faults.measured(made))
    assert np.array_equal(scaled.q, made.q)


def test_the_recorded_temperature_is_that_above_the_reference(made):
    warmer = np.linspace(0.0, 12.0, 40)
    told = faults.with_temperature(made, warmer).covariates["temperature"]
    assert told - made.reference_temperature == pytest.approx(warmer)


def test_what_frames_can_do_leaves_nothing(made):
    seen = observe(made, faults.registered(made))
    columns = faults.frame_columns(seen)
    whole_shift = columns @ np.array([1e-3, 0, 0, 0, 2e-4, 0, 0, 0, -1e-3])
    assert faults.leaves(seen, whole_shift) < 1e-12
    one_row = np.zeros((40, 3))
    one_row[7, 1] = 1e-3
    # never more than there was, and of one row alone nearly all of it
    assert 0.7 * 1e-3 / np.sqrt(40.0) < faults.leaves(seen, one_row) <= 1e-3 / np.sqrt(40.0)


def test_registration_finds_frames_that_were_moved(made):
    frames = Frames.declared(made)
    true = Frames(frames.base @ exp6(np.array([0.2, -0.1, 0.3, 0.5, -1.0, 2.0])), frames.tool.copy())
    true.tool[:3, 3] += [5e-3, -8e-3, 12e-3]
    moved = replace(made, position=observe(made, true).predicted_position)
    found = faults.registered(moved)
    assert found.base == pytest.approx(true.base, abs=1e-8)
    assert found.tool[:3, 3] == pytest.approx(true.tool[:3, 3], abs=1e-8)
