"""Projections and least squares: in any units, and with what the data cannot see left alone."""

import numpy as np
import pytest

from thermal_robot.inference.algebra import equations_of, orthonormal, ridge, solve, whitener, without

UNITS = 10.0 ** np.array([-9.0, -3.0, 0.0, 2.0, 6.0])  # metres beside microradians beside counts
in_units = pytest.mark.parametrize("units", [np.ones(5), UNITS], ids=["alike", "of all sizes"])


def columns(seed, rows=40, count=5):
    return np.random.default_rng(seed).normal(size=(rows, count))


@in_units
def test_whitened_columns_are_orthonormal_without_aliases_and_empty_ones(units):
    own = columns(2) * units
    alias = np.column_stack([own, 3.0 * own[:, 0] - 1e-4 * own[:, 3], np.zeros(40)])
    for given in (own, alias):
        root = whitener(given.T @ given)
        assert root.shape == (given.shape[1], 5)
        np.testing.assert_allclose((given @ root).T @ (given @ root), np.eye(5), atol=1e-9)
    np.testing.assert_array_equal(root[-1], 0.0)
    for empty in (0, 2):
        assert whitener(np.zeros((empty, empty))).shape == (empty, 0)


@pytest.mark.parametrize(("share", "seen"), [(1e-3, 3), (1e-7, 2)])
def test_a_direction_is_left_out_where_it_is_only_rounding(share, seen):
    own = columns(3, count=3)
    own[:, 2] = own[:, 0] + share * own[:, 2]
    assert whitener(own.T @ own).shape == (3, seen)


@in_units
def test_solve_is_least_squares_where_twins_share_and_what_nothing_determines_is_zero(units):
    own, values = columns(4) * units, columns(4, count=6)[:, 5]
    expected = np.linalg.lstsq(own / units, values, rcond=None)[0] / units
    np.testing.assert_allclose(solve(own.T @ own, own.T @ values), expected, rtol=1e-8)
    twins = np.column_stack([own[:, :3], own[:, 0], np.zeros(40)])
    found = solve(twins.T @ twins, twins.T @ (own[:, :3] @ ([2.0, -1.0, 0.5] / units[:3])))
    np.testing.assert_allclose(found * units[[0, 1, 2, 0, 0]], [1.0, -1.0, 0.5, 1.0, 0.0], atol=1e-9)


def test_an_orthonormal_basis_spans_its_columns_and_projecting_it_out_once_is_enough():
    own = np.column_stack([columns(6) * UNITS, np.zeros(40)])
    basis = orthonormal(np.column_stack([own, own[:, 1] * 7.0]))
    assert basis.shape == (40, 5)
    np.testing.assert_allclose(basis.T @ basis, np.eye(5), atol=1e-12)
    np.testing.assert_allclose(without(columns(6), basis), 0.0, atol=1e-8)
    values = columns(8, count=2)
    once = without(values, basis)
    np.testing.assert_allclose(without(once, basis), once, atol=1e-14)
    np.testing.assert_allclose(
        once, values - columns(6) @ np.linalg.lstsq(columns(6), values, rcond=None)[0], atol=1e-9
    )


@in_units
@pytest.mark.parametrize("flat", [0, 2, 5])
def test_ridge_is_the_posterior_mean(flat, units):
    """Least squares of the rows with one further row for each prior: the value zero, seen with the prior's sigma."""
    own, values = columns(9), columns(10)[:, 0]
    sigma = np.random.default_rng(9).uniform(0.05, 2.0, 5 - flat)
    augmented = np.vstack([own, np.eye(5)[flat:] / sigma[:, None]])
    expected = np.linalg.lstsq(augmented, np.append(values, np.zeros(5 - flat)), rcond=None)[0] / units
    whole = np.column_stack([own * units, values])
    np.testing.assert_allclose(ridge(whole.T @ whole, flat, (units[flat:] / sigma) ** 2), expected, rtol=1e-8)


def test_a_firm_prior_holds_at_zero_and_a_flat_column_that_nothing_determines_stays_there():
    own, values = columns(11), columns(12)[:, 0]
    own[:, 1] = 0.0
    whole = np.column_stack([own, values])
    held = ridge(whole.T @ whole, 4, np.array([1e12]))
    assert held[1] == 0.0
    assert abs(held[-1]) < 1e-10
    free = [0, 2, 3]  # as if the others were not there
    np.testing.assert_allclose(held[free], np.linalg.lstsq(own[:, free], values, rcond=None)[0], rtol=1e-8)


@pytest.mark.parametrize("shape", [(4, 3, 2), (4, 3, 0), (0, 6, 2), (0, 3, 0)])
def test_every_component_of_a_row_is_an_equation_even_where_nothing_is_unknown(shape):
    own = np.arange(float(np.prod(shape))).reshape(shape)
    flat = equations_of(own)
    assert flat.shape == (shape[0] * shape[1], shape[2])
    assert [list(row) for row in flat] == [list(own[n, c]) for n in range(shape[0]) for c in range(shape[1])]
    assert orthonormal(flat).shape[0] == len(flat)
