"""Values over time against least squares; the day of a limit against the line's own deviation there."""

import numpy as np
import pytest
from wear_cases import columns, jumping, measured, series_of

from thermal_robot.fleet.wear_moves import Grid, Move, State, fieller


def test_values_of_each_campaign_are_those_of_least_squares_with_all_else_constant():
    design, rng = columns(5, 3, 4)
    states = np.tile(rng.normal(size=3), (5, 1))
    states[:, 1] += rng.normal(size=5)
    values = measured(design, states, rng)
    series = series_of(design, values, np.arange(5.0))
    grid = Grid(np.array([1.0]), np.array([1.0]), np.zeros(1))
    found, std = State.of(series, grid, (), free=1).over_time(1)
    rows = design.shape[1]
    whole = np.zeros((5 * rows, 2 + 5))
    whole[:, :2] = design[:, :, [0, 2]].reshape(-1, 2)
    for k in range(5):
        whole[k * rows : (k + 1) * rows, 2 + k] = design[k, :, 1]
    wanted = np.linalg.lstsq(whole, values.ravel(), rcond=None)[0][2:]
    deviation = np.sqrt(np.diag(np.linalg.inv(whole.T @ whole)))[2:]
    np.testing.assert_allclose(found, wanted, atol=1e-4)
    np.testing.assert_allclose(std, deviation, rtol=1e-3)


def test_a_jump_is_as_large_as_it_was_made():
    series = jumping(size=1.0)
    state = State.of(series, Grid.of(series), (Move(1, "jump", 4),))
    amount, std = state.amount(series.spans(Move(1, "jump", 4))[0])
    assert abs(amount - 1.0) < 4.0 * std
    values, _ = state.over_time(1)
    assert np.ptp(values[:5]) == 0.0
    assert values[5] - values[4] == pytest.approx(amount)


@pytest.mark.parametrize("rate", [2e-3, -2e-3])
def test_on_the_ends_of_the_interval_the_line_is_two_deviations_from_the_limit(rate):
    value = np.array([0.1, rate])
    covariance = np.array([[4e-4, 3e-6], [3e-6, 1e-7]])
    expected, low, high = fieller(value, covariance, 1.0)
    assert low < expected < high
    assert value[0] + rate * expected == pytest.approx(np.sign(rate))
    for end in (low, high):
        along = np.array([1.0, end])
        away = np.sign(rate) - along @ value
        assert abs(away) == pytest.approx(1.959964 * np.sqrt(along @ covariance @ along), rel=1e-6)


def test_a_rate_that_may_be_none_may_never_get_there():
    expected, low, high = fieller(np.array([0.1, 1e-3]), np.array([[4e-4, 0.0], [0.0, 1e-6]]), 1.0)
    assert high is None
    assert 0.0 < low < expected
    assert fieller(np.array([0.1, 0.0]), np.eye(2), 1.0) is None


def test_the_interval_holds_the_day_as_often_as_it_says():
    rng = np.random.default_rng(0)
    covariance = np.array([[4e-4, 3e-6], [3e-6, 1e-7]])
    true = np.array([0.1, 2e-3])
    day = (1.0 - true[0]) / true[1]
    drawn = rng.multivariate_normal(true, covariance, 4000)
    ends = (fieller(each, covariance, 1.0) for each in drawn)
    inside = [low <= day <= (np.inf if high is None else high) for _, low, high in ends]
    assert np.mean(inside) == pytest.approx(0.95, abs=0.012)
