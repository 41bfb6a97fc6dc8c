"""Projections and least squares: in any units, and with what the data cannot see left alone."""

import numpy as np
import pytest

from thermal_robot.inference.algebra import equations_of, orthonormal, ridge, solve, whitener, without

UNITS = 10.0 ** np.array([-9.0, -3.0, 0.0, 2.0, 6.0])  # metres beside microradians beside counts


def columns(seed, rows=40, count=5):
    return np.random.default_rng(seed).normal(size=(rows, count))


@pytest.mark.parametrize("units", [np.ones(5), UNITS], ids=["alike", "of all sizes"])
def test_whitened_columns_are_orthonormal(units):
    for seed in range(5):
        own = columns(seed) * units
        root = whitener(own.T @ own)
        white = own @ root
        assert root.shape == (5, 5)
        np.testing.assert_allclose(white.T @ white, np.eye(5), atol=1e-9)


def test_exact_aliases_and_empty_columns_are_left_out():
    own = columns(2)
    alias = np.column_stack([own, 3.0 * own[:, 0] - 1e-4 * own[:, 3], np.zeros(40)])
    root = whitener(alias.T @ alias)
    assert root.shape == (7, 5)
    np.testing.assert_allclose((alias @ root).T @ (alias @ root), np.eye(5), atol=1e-9)
    np.testing.assert_array_equal(root[-1], 0.0)
    assert whitener(np.zeros((0, 0))).shape == (0, 0)
    assert whitener(np.zeros((2, 2))).shape == (2, 0)


@pytest.mark.parametrize(("share", "seen"), [(1e-3, 3), (1e-7, 2)])
def test_a_direction_is_left_out_where_it_is_only_rounding(share, seen):
    own = columns(3, count=3)
    own[:, 2] = own[:, 0] + share * own[:, 2]
    assert whitener(own.T @ own).shape == (3, seen)


@pytest.mark.parametrize("units", [np.ones(5), UNITS], ids=["alike", "of all sizes"])
def test_solve_is_the_least_squares_solution(units):
    own = columns(4) * units
    values = np.random.default_rng(4).normal(size=40)
    expected = np.linalg.lstsq(own / units, values, rcond=None)[0] / units
    np.testing.assert_allclose(solve(own.T @ own, own.T @ values), expected, rtol=1e-8)


def test_what_nothing_determines_is_zero_and_twins_share():
    own = columns(5, count=3)
    own = np.column_stack([own, own[:, 0], np.zeros(40)])
    values = own[:, :3] @ [2.0, -1.0, 0.5]
    found = solve(own.T @ own, own.T @ values)
    np.testing.assert_allclose(found, [1.0, -1.0, 0.5, 1.0, 0.0], atol=1e-9)


def test_an_orthonormal_basis_spans_what_its_columns_span():
    own = np.column_stack([columns(6) * UNITS, np.zeros(40)])
    own = np.column_stack([own, own[:, 1] * 7.0])
    basis = orthonormal(own)
    assert basis.shape == (40, 5)
    np.testing.assert_allclose(basis.T @ basis, np.eye(5), atol=1e-12)
    np.testing.assert_allclose(without(own / np.append(UNITS, [1.0, UNITS[1]]), basis), 0.0, atol=1e-8)


def test_projecting_out_once_is_enough_and_leaves_what_is_at_right_angles():
    basis = orthonormal(columns(7))
    values = columns(8, count=2)
    once = without(values, basis)
    np.testing.assert_allclose(without(once, basis), once, atol=1e-14)
    np.testing.assert_allclose(basis.T @ once, 0.0, atol=1e-14)
    residual = values - columns(7) @ np.linalg.lstsq(columns(7), values, rcond=None)[0]
    np.testing.assert_allclose(once, residual, atol=1e-12)


@pytest.mark.parametrize("units", [np.ones(5), UNITS], ids=["alike", "of all sizes"])
@pytest.mark.parametrize("flat", [0, 2, 5])
def test_ridge_is_the_posterior_mean(flat, units):
    """Least squares of the rows with one further row for each prior: the value zero, seen with the prior's sigma."""
    rng = np.random.default_rng(9)
    own, values = columns(9), rng.normal(size=40)
    sigma = rng.uniform(0.05, 2.0, 5 - flat)
    augmented = np.vstack([own, np.eye(5)[flat:] / sigma[:, None]])
    expected = np.linalg.lstsq(augmented, np.append(values, np.zeros(5 - flat)), rcond=None)[0] / units
    whole = np.column_stack([own * units, values])
    np.testing.assert_allclose(ridge(whole.T @ whole, flat, (units[flat:] / sigma) ** 2), expected, rtol=1e-8)


def test_a_firm_prior_holds_its_parameter_at_zero():
    """The others are as if it were not there."""
    own, values = columns(10), np.random.default_rng(10).normal(size=40)
    whole = np.column_stack([own, values])
    held = ridge(whole.T @ whole, 4, np.array([1e12]))
    assert abs(held[-1]) < 1e-10
    np.testing.assert_allclose(held[:-1], np.linalg.lstsq(own[:, :4], values, rcond=None)[0], rtol=1e-8)


def test_ridge_leaves_a_flat_column_that_nothing_determines_where_it_is():
    own, values = columns(11), np.random.default_rng(11).normal(size=40)
    own[:, 1] = 0.0
    whole = np.column_stack([own, values])
    found = ridge(whole.T @ whole, 2, np.ones(3))
    assert found[1] == 0.0
    rest = np.delete(own, 1, axis=1)
    other = np.column_stack([rest, values])
    np.testing.assert_allclose(np.delete(found, 1), ridge(other.T @ other, 1, np.ones(3)), rtol=1e-9)


@pytest.mark.parametrize("shape", [(4, 3, 2), (4, 3, 0), (0, 6, 2), (0, 3, 0)])
def test_every_component_of_a_row_is_an_equation_even_where_nothing_is_unknown(shape):
    own = np.arange(float(np.prod(shape))).reshape(shape)
    flat = equations_of(own)
    assert flat.shape == (shape[0] * shape[1], shape[2])
    assert [list(row) for row in flat] == [list(own[n, c]) for n in range(shape[0]) for c in range(shape[1])]
    assert orthonormal(flat).shape[0] == len(flat)
