"""Joint scatter and tool scatter: round trips, and what cannot be known; figures of the paper are in its ledger."""

import dataclasses

import numpy as np
import pytest

from thermal_robot import kinematics as kin
from thermal_robot.assembly.repeatability import joint_sigmas, tool_covariance
from thermal_robot.errors import EstimationError, RobotError
from thermal_robot.robot import load_robot

Q = np.array([[0.5235, 0.8726, -1.3962, -1.0471, 0.0], [1.3963, 0.3839, -1.2217, -0.7330, 0.0]])
THEORETICAL = 1e-6 * np.array([[16, 17, 17], [21, 16, 16]])
EXPERIMENTAL = 1e-6 * np.array([[14, 18, 17], [23, 16, 18]])
SIGMA_Q = 1e-6 * np.array([33, 38, 62, 49, 0])
on_arms = pytest.mark.parametrize("arm", ["rv_m2", "awkward", "ur10", "panda"], indirect=True)


def spread(covariance):
    return np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))


@on_arms
def test_covariance_is_that_of_simulated_repetitions(arm, configurations):
    rng, q, point = np.random.default_rng(0), configurations(arm, 2), (0.02, -0.05, 0.1)
    sigma = rng.uniform(1e-5, 9e-5, arm.n)
    for row in q:
        drawn = row + sigma * rng.standard_normal((40_000, arm.n))
        poses, home = kin.tool_poses(arm, drawn), kin.tool_poses(arm, row)[0]
        places = poses[:, :3, 3] + poses[:, :3, :3] @ point
        turns = kin.log3(poses[:, :3, :3] @ home[:3, :3].T)
        simulated = np.cov(np.hstack([places, turns]).T)
        covariance = tool_covariance(arm, row, sigma, measures="pose", point=point)[0]
        size = np.sqrt(np.outer(np.diag(covariance), np.diag(covariance)))
        # The standard error of an entry is at most 1/√20 000 of its size; up to 42 entries at 5 of them.
        assert np.abs(simulated - covariance).max() < 1e-8
        np.testing.assert_array_less(np.abs(simulated - covariance), 5.0 * size / np.sqrt(20_000) + 1e-16)
        np.testing.assert_allclose(tool_covariance(arm, row, sigma, point=point)[0], covariance[:3, :3], rtol=1e-15)


def test_sigmas_behind_table_1(rv_m2):
    found = joint_sigmas(rv_m2, Q, THEORETICAL, rounding=0.5e-6)
    assert found.compatible
    assert found.status == ("determined", "determined", "determined", "only bounded", "not limited")
    assert np.isnan(found.sigma[4])
    assert found.upper[4] == np.inf
    np.testing.assert_allclose(1e6 * found.fitted, [[15.644, 16.798, 16.648], [21.298, 16.271, 16.206]], atol=1e-3)
    assert found.misfit < 0.5e-6
    text = str(found)
    assert "joint_4  only bounded: anything from 0 to 76.9" in text
    assert "joint_5  not limited by what was measured" in text
    assert "49.4" not in text
    with pytest.raises(dataclasses.FrozenInstanceError):
        found.needed = 0.0


def test_bounds_are_reached_by_compatible_sigmas(rv_m2):
    found = joint_sigmas(rv_m2, Q, THEORETICAL, rounding=0.5e-6)
    design = (kin.frame_jacobians(rv_m2, Q)[:, :3] ** 2).reshape(6, 5)[:, :4]
    low, high = ((THEORETICAL.ravel() + sign * 0.5e-6) ** 2 for sign in (-1, 1))
    rng = np.random.default_rng(2)
    drawn = rng.uniform(found.lower[:4], found.upper[:4], (400_000, 4)) ** 2
    fits = np.all((drawn @ design.T >= low) & (drawn @ design.T <= high), axis=1)
    assert fits.sum() > 1000
    reached = np.sqrt(drawn[fits])
    width = (found.upper - found.lower)[:4]
    # Corners of a polytope are thinly filled by chance: the sample comes within a tenth or so of each.
    assert np.all(reached.min(axis=0) < found.lower[:4] + 0.15 * width)
    assert np.all(reached.max(axis=0) > found.upper[:4] - 0.15 * width)
    outside = drawn.copy()
    outside[:, 3] = (1.01 * found.upper[3]) ** 2
    assert not np.any(np.all((outside @ design.T >= low) & (outside @ design.T <= high), axis=1))


def test_no_sigma_gives_the_experimental_column(rv_m2):
    found = joint_sigmas(rv_m2, Q, EXPERIMENTAL, rounding=0.5e-6)
    assert not found.compatible
    assert set(found.status[:4]) == {"incompatible"}
    assert np.all(np.isnan(found.lower))
    assert "no non-negative value is compatible" in str(found)
    # But the sampling error of a standard deviation at n = 100 covers it.
    sampled = joint_sigmas(rv_m2, Q, EXPERIMENTAL, rounding=0.5e-6, sample_size=100)
    assert sampled.compatible
    assert sampled.status[3] == "only bounded"
    assert 1e6 * sampled.misfit < 1.3


def test_another_hand_gives_other_sigmas(rv_m2):
    def with_hand(length):
        urdf = rv_m2.urdf.replace('<origin xyz="0 0.15 0" rpy="0 0 0"/>', f'<origin xyz="0 {length} 0"/>')
        robot = load_robot(urdf, "tool0")
        assert robot.segments[-1].length == pytest.approx(length)
        return joint_sigmas(robot, Q, THEORETICAL, rounding=0.5e-6)

    assert 1e6 * with_hand(0.13).upper[3] == pytest.approx(102.7, abs=0.05)
    # With a short hand the fourth joint is determined; Table 1 has no σ_q for a hand of 200 mm or more.
    assert with_hand(0.08).status[3] == "determined"
    assert with_hand(0.199).compatible
    assert not with_hand(0.2).compatible


@on_arms
@pytest.mark.parametrize("kind", ["deviations", "covariances", "poses"])
def test_exact_scatter_gives_its_sigmas_back(arm, configurations, kind):
    rng, q, point = np.random.default_rng(3), configurations(arm, 8), (0.02, -0.05, 0.1)
    sigma = rng.uniform(1e-5, 9e-5, arm.n)
    covariance = tool_covariance(arm, q, sigma, point=point, measures="pose" if kind == "poses" else "position")
    found = joint_sigmas(arm, q, spread(covariance) if kind == "deviations" else covariance, point=point)
    assert found.compatible
    assert found.status == ("determined",) * arm.n
    np.testing.assert_allclose(found.sigma, sigma, rtol=1e-9)
    assert np.all((found.lower < sigma * (1 + 1e-12)) & (sigma * (1 - 1e-12) < found.upper))
    np.testing.assert_allclose(found.fitted, spread(covariance), rtol=1e-9)


def test_intervals_hold_the_truth_as_often_as_they_say(rv_m2, configurations):
    rng, q, truth = np.random.default_rng(4), configurations(rv_m2, 6), SIGMA_Q + 1e-5
    true = tool_covariance(rv_m2, q, truth, point=(0.03, 0.0, 0.0))
    factor, trials, held = np.linalg.cholesky(true), 30, 0
    for _ in range(trials):
        drawn = np.einsum("nij,nkj->nki", factor, rng.standard_normal((6, 30, 3)))
        found = joint_sigmas(rv_m2, q, drawn.std(axis=1, ddof=1), sample_size=30, point=(0.03, 0.0, 0.0))
        held += found.compatible and bool(np.all((found.lower <= truth) & (truth <= found.upper)))
    # At least 95 %, so that fewer than 24 of 30 have a probability below 1 in 1000.
    assert held >= 24


def test_an_axis_that_was_not_measured_is_left_out(rv_m2):
    flat = THEORETICAL.copy()
    flat[:, 2] = np.nan
    found = joint_sigmas(rv_m2, Q, flat, rounding=0.5e-6)
    assert np.all(np.isnan(found.fitted[:, 2]))
    whole = joint_sigmas(rv_m2, Q, THEORETICAL, rounding=0.5e-6)
    assert np.all(found.upper[:4] >= whole.upper[:4] - 1e-12)
    assert found.upper[3] > 1.5 * whole.upper[3]


def test_sigmas_may_be_given_by_name_or_once(rv_m2):
    by_name = dict(zip(rv_m2.joint_names, SIGMA_Q, strict=True))
    np.testing.assert_array_equal(tool_covariance(rv_m2, Q, by_name), tool_covariance(rv_m2, Q, SIGMA_Q))
    np.testing.assert_array_equal(tool_covariance(rv_m2, Q, 2e-5), tool_covariance(rv_m2, Q, np.full(5, 2e-5)))


@pytest.mark.parametrize(
    ("call", "error", "words"),
    [
        (lambda r: tool_covariance(r, Q, [1e-5] * 4), RobotError, "each of the 5 joints"),
        (lambda r: tool_covariance(r, Q, -1e-5), RobotError, "≥ 0"),
        (lambda r: tool_covariance(r, Q, {"joint_1": 1e-5}), RobotError, "differ in joint_2, joint_3"),
        (lambda r: tool_covariance(r, Q, 1e-5, measures="both"), RobotError, "not 'both'"),
        (lambda r: joint_sigmas(r, Q, THEORETICAL[:1]), EstimationError, r"\(1, 3\) does not fit 2 poses"),
        (lambda r: joint_sigmas(r, Q, np.full((2, 3), np.nan)), EstimationError, "at least one"),
        (lambda r: joint_sigmas(r, Q, -THEORETICAL), EstimationError, "≥ 0"),
        (lambda r: joint_sigmas(r, Q, np.full((2, 3, 3), np.nan)), EstimationError, "finite"),
        (lambda r: joint_sigmas(r, Q, THEORETICAL, sample_size=1), EstimationError, "at least 2"),
        (lambda r: joint_sigmas(r, Q, THEORETICAL, rounding=-1.0), EstimationError, "rounding ≥ 0"),
        (lambda r: joint_sigmas(r, Q, THEORETICAL, point=[np.nan] * 3), EstimationError, "finite numbers"),
        (lambda r: joint_sigmas(r, Q, THEORETICAL, point=[0.0, np.inf, 0.0]), EstimationError, "finite numbers"),
    ],
)
def test_what_makes_no_sense_is_said(rv_m2, call, error, words):
    with pytest.raises(error, match=words):
        call(rv_m2)
