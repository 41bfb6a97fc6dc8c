"""Rows in units in which all are equally sure."""

import numpy as np
import pytest
from inference.problems import small_problem

from thermal_robot.inference.problem import generalised

NOISE = np.array([2e-5, 3e-5, 5e-5])


def covariances(rng, rows):
    """(rows, 3, 3) positive definite, the smallest and largest axis apart by orders of magnitude."""
    turned = np.linalg.qr(rng.normal(size=(rows, 3, 3)))[0]
    return (turned * 10.0 ** rng.uniform(-10, -6, (rows, 1, 3))) @ turned.transpose(0, 2, 1)


def test_rows_have_the_covariance_of_the_noise():
    rng = np.random.default_rng(0)
    linear = small_problem(0)[0]
    covariance = np.repeat(covariances(rng, 1), 12, axis=0)
    gaps = []
    for _ in range(2000):
        gap = rng.multivariate_normal(np.zeros(3), covariance[0], size=12)
        gaps.append(generalised(type(linear)(gap, linear.frames, ()), covariance, NOISE).gap)
    rows = np.concatenate(gaps)
    spread = rows.T @ rows / len(rows) / np.outer(NOISE, NOISE)
    np.testing.assert_allclose(spread, np.eye(3), atol=4.0 * np.sqrt(2.0 / len(rows)))


@pytest.mark.parametrize("only", [False, True], ids=["with its values", "its columns alone"])
def test_squared_lengths_are_those_of_the_covariance(only):
    """Of the gap and of every column: |x|² in noise is xᵀ S⁻¹ x."""
    rng = np.random.default_rng(1)
    linear = small_problem(1)[0]
    covariance = covariances(rng, 12)
    white = generalised(linear, covariance, NOISE)
    inverse = np.linalg.inv(covariance)
    pairs = [(linear.frames, white.frames)]
    pairs += [(a.columns, b.columns) for a, b in zip(linear.blocks, white.blocks, strict=True)]
    pairs += [] if only else [(linear.gap[:, :, None], white.gap[:, :, None])]
    for plain, own in pairs:
        expected = np.einsum("nik,nij,njl->nkl", plain, inverse, plain)
        own = own / NOISE[:, None]
        found = np.einsum("nik,nil->nkl", own, own)
        np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6 * np.abs(expected).max())


def test_the_fit_is_that_of_weighted_least_squares():
    """The parameters of the normal equations Xᵀ S⁻¹ X θ = Xᵀ S⁻¹ y (Aitken)."""
    rng = np.random.default_rng(2)
    linear = small_problem(2)[0]
    # rows that differ by a factor of three
    covariance = covariances(rng, 12) / 1e-8 + 0.3 * np.eye(3)
    columns = linear.stack[:, :, :-1]
    inverse = np.linalg.inv(covariance)
    expected = np.linalg.solve(
        np.einsum("nik,nij,njl->kl", columns, inverse, columns),
        np.einsum("nik,nij,nj->k", columns, inverse, linear.gap),
    )
    white = generalised(linear, covariance, NOISE)
    root = (white.stack / NOISE[:, None]).reshape(36, -1)
    np.testing.assert_allclose(np.linalg.lstsq(root[:, :-1], root[:, -1], rcond=None)[0], expected, rtol=1e-7)


def test_the_noise_itself_changes_nothing():
    linear = small_problem(3)[0]
    same = generalised(linear, np.broadcast_to(np.diag(NOISE**2), (12, 3, 3)), NOISE)
    np.testing.assert_allclose(same.stack, linear.stack, rtol=1e-12)
    assert [b.sizes is o.sizes for b, o in zip(same.blocks, linear.blocks, strict=True)] == [True] * 3
