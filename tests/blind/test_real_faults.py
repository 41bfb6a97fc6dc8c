"""Conditions put into a measured campaign do exactly what they say."""

import numpy as np
import pytest

from thermal_robot.blind import real_faults as faults
from thermal_robot.kinematics import placement_sensitivities
from thermal_robot.observations import observe


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
