"""Elongations from displacements (Eq 12): exact data, noise, and what the poses cannot say."""

import dataclasses

import numpy as np
import pytest

from thermal_robot import kinematics as kin
from thermal_robot.assembly.repeatability import tool_covariance
from thermal_robot.assembly.thermal import displacement, identify_elongations, segment_names
from thermal_robot.errors import EstimationError

EQUATION_12 = ("x", "x", "x", "x", "z")
PAPER = 1e-6 * np.array([14, 5, 9, 7, 8])
GOOD = np.deg2rad(
    [[90, 0, 0, 0, 0], [90, 90, -60, 60, 0], [90, 60, -120, 110, 0], [90, 90, -90, -90, 0], [0, 60, -10, 0, 0]]
)


def test_equation_12_gives_the_elongations_back(rv_m2):
    found = identify_elongations(rv_m2, GOOD, displacement(rv_m2, GOOD, PAPER), axes=EQUATION_12, sigma=3e-6)
    np.testing.assert_allclose(found.values, PAPER, rtol=0.0, atol=1e-15)
    assert found.names == segment_names(rv_m2)
    assert found.identified.all()
    assert np.isfinite(found.residuals).sum() == 5
    # Five equations, five unknowns: the covariance is σ² times the inverse of the square system, twice.
    jacobian = kin.elongation_jacobian(rv_m2, GOOD)
    square = np.vstack([jacobian[:4, 0], jacobian[4:, 2]])
    inverse = np.linalg.inv(square)
    np.testing.assert_allclose(found.covariance, 9e-12 * inverse @ inverse.T, rtol=1e-9, atol=1e-22)
    np.testing.assert_allclose(found.standard_errors**2, np.diag(found.covariance), rtol=1e-12)
    assert found.condition == pytest.approx(np.linalg.cond(square), rel=1e-9)
    with pytest.raises(dataclasses.FrozenInstanceError):
        found.rank = 3


def test_equation_12_over_random_poses(rv_m2, configurations):
    # facts: condition median 59, best ≈ 4; over sets of five poses drawn evenly within the limits.
    jacobian = kin.elongation_jacobian(rv_m2, configurations(rv_m2, 100_000, seed=1)).reshape(20_000, 5, 3, 5)
    square = np.concatenate([jacobian[:, :4, 0], jacobian[:, 4:, 2]], axis=1)
    condition = np.linalg.cond(square)
    assert np.median(condition) == pytest.approx(59.0, abs=3.0)
    assert 3.0 < condition.min() < 4.5
    # Standard errors of 2–4 µm at best, as facts says, and 15–36 µm typically (facts: 13–31) belong to 3 µm a
    # component, which is 30 µm averaged over 100 repetitions; a single reading of 30 µm has errors ten times as large.
    errors = 3.0 * np.sqrt(np.sum(np.linalg.inv(square) ** 2, axis=2))
    best = errors[np.argmin(errors.max(axis=1))]
    assert 1.5 < best.min() < best.max() < 4.5
    typical = np.median(errors, axis=0)
    assert 13.0 < typical.min() < typical.max() < 38.0


@pytest.mark.parametrize("arm", ["rv_m2", "ur10", "panda"], indirect=True)
def test_what_is_identified_comes_back_and_what_is_not_is_never_a_number(arm, configurations):
    q, names = configurations(arm, 12), segment_names(arm)
    true = np.random.default_rng(0).uniform(5e-6, 3e-5, len(names))
    found = identify_elongations(arm, q, displacement(arm, q, true), sigma=2e-6)
    np.testing.assert_allclose(found.values[found.identified], true[found.identified], rtol=1e-9)
    np.testing.assert_allclose(found.residuals, 0.0, atol=1e-15)
    unknown = ~found.identified
    for array in (found.values, found.standard_errors, found.covariance, found.covariance.T):
        assert np.all(np.isnan(array[unknown]))
    assert np.all(np.isfinite(found.covariance[np.ix_(found.identified, found.identified)]))
    # Along parallel axes that no joint turns against each other, only the sum moves the tool: the UR10's shoulder
    # and wrist offsets. Everything else is determined.
    lost = {"ur10": {"shoulder_lift_joint", "wrist_2_joint"}}.get(arm.name, set())
    assert {name for name, known in zip(names, found.identified, strict=True) if not known} == lost
    assert (found.condition == np.inf) == bool(lost)
    assert str(found).count("not identified by these poses") == len(lost)
    for line in str(found).splitlines()[1:-1]:
        assert ("±" in line) != ("not identified" in line)


def test_too_few_poses_say_so(rv_m2):
    found = identify_elongations(rv_m2, GOOD[1:2], displacement(rv_m2, GOOD[1:2], PAPER), sigma=2e-6)
    assert found.rank == 2
    assert not found.identified.any()
    assert "±" not in str(found)
    assert np.all(np.isnan(found.values))


def test_standard_errors_are_the_scatter_of_repeated_experiments(rv_m2, configurations):
    rng, q = np.random.default_rng(1), configurations(rv_m2, 6)
    # Noise of the robot itself, correlated between the axes of a pose: the mean of 100 repetitions.
    noise = tool_covariance(rv_m2, q, 1e-6 * np.array([33, 38, 62, 49, 0])) / 100 + 1e-14 * np.eye(3)
    factor, moved = np.linalg.cholesky(noise), displacement(rv_m2, q, PAPER)
    drawn = [
        identify_elongations(
            rv_m2, q, moved + np.einsum("nij,nj->ni", factor, rng.standard_normal((6, 3))), covariance=noise
        )
        for _ in range(600)
    ]
    values = np.array([found.values for found in drawn])
    ratio = values.std(axis=0) / drawn[0].standard_errors
    np.testing.assert_allclose(ratio, 1.0, atol=0.12)  # the error of a standard deviation of 600 is 2.9 %
    offset = (values.mean(axis=0) - PAPER) / drawn[0].standard_errors
    np.testing.assert_allclose(offset, 0.0, atol=0.17)


def test_unknown_noise_is_taken_from_the_residuals(rv_m2, configurations):
    rng, q = np.random.default_rng(2), configurations(rv_m2, 300)
    moved = displacement(rv_m2, q, PAPER) + rng.normal(0.0, 4e-6, (300, 3))
    unknown, known = identify_elongations(rv_m2, q, moved), identify_elongations(rv_m2, q, moved, sigma=4e-6)
    np.testing.assert_allclose(unknown.values, known.values, rtol=1e-9)
    np.testing.assert_allclose(unknown.standard_errors, known.standard_errors, rtol=0.1)
    assert not np.array_equal(unknown.standard_errors, known.standard_errors)
    square = identify_elongations(rv_m2, GOOD, displacement(rv_m2, GOOD, PAPER), axes=EQUATION_12)
    assert np.all(np.isnan(square.standard_errors))
    assert "(noise unknown)" in str(square)


def test_a_noisy_component_counts_less(rv_m2, configurations):
    q = configurations(rv_m2, 20)
    moved = displacement(rv_m2, q, PAPER)
    moved[:, 1] += 1e-3
    sigma = np.array([1e-6, 1.0, 1e-6])
    np.testing.assert_allclose(identify_elongations(rv_m2, q, moved, sigma=sigma).values, PAPER, atol=1e-8)
    np.testing.assert_allclose(identify_elongations(rv_m2, q, moved, axes="xz").values, PAPER, atol=1e-14)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"axes": ("x", "y")}, "given for 2 poses, but there are 5"),
        ({"axes": "xq"}, "not 'xq'"),
        ({"axes": "xx"}, "not 'xx'"),
        ({"axes": ""}, "not ''"),
        ({"sigma": [1.0, 2.0]}, r"sigma of shape \(2,\)"),
        ({"covariance": np.eye(2)}, r"covariance of shape \(2, 2\)"),
        ({"covariance": np.zeros((3, 3))}, "not positive definite"),
        ({"covariance": np.full((3, 3), np.nan)}, "not a finite number"),
        ({"sigma": 1.0, "covariance": np.eye(3)}, "not as both"),
    ],
)
def test_what_does_not_fit_is_said(rv_m2, options, words):
    with pytest.raises(EstimationError, match=words):
        identify_elongations(rv_m2, GOOD, np.zeros((5, 3)), **options)


def test_a_component_that_is_missing_must_not_be_asked_for(rv_m2):
    moved = displacement(rv_m2, GOOD, PAPER)
    moved[2, 1] = np.nan
    with pytest.raises(EstimationError, match="not a finite number"):
        identify_elongations(rv_m2, GOOD, moved)
    assert identify_elongations(rv_m2, GOOD, moved, axes=("xyz", "xyz", "xz", "xyz", "xyz")).identified.all()
    with pytest.raises(EstimationError, match=r"\(4, 3\) do not fit"):
        identify_elongations(rv_m2, GOOD, moved[:4])
