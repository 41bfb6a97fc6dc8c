"""Evidence, search, values and chances of moves, from products of columns that are at hand."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import logsumexp
from scipy.stats import binom, multivariate_normal
from wear_cases import columns, jumping, measured, series_of

from thermal_robot.fleet import settings
from thermal_robot.fleet.wear_moves import (
    Beside,
    Grid,
    Move,
    State,
    chances,
    explanations,
    fieller,
    log_prior,
    moves_of,
    scatter,
)

DAYS = np.array([0.0, 3.0, 10.0, 11.0, 30.0])
MODELS = [
    (Move(0, "jump", 2),),
    (Move(2, "trend"),),
    (Move(1, "walk"),),
    (Move(0, "trend"), Move(1, "jump", 0)),
    (Move(2, "walk"), Move(0, "jump", 3)),
]


@pytest.fixture(scope="module")
def case():
    design, rng = columns(len(DAYS), 3, 0)
    states = np.tile(rng.normal(size=3), (len(DAYS), 1))
    states[3:, 0] += 0.4
    values = measured(design, states, rng)
    return design, values, series_of(design, values, DAYS)


def of_states(states, times, seed):
    design, rng = columns(len(states), states.shape[1], seed)
    return series_of(design, measured(design, states, rng), times)


def best(series):
    return next(iter(explanations(series)))


def over_time(move, scale):
    """(K, K) prior covariance of what a move adds to its parameter, as it is defined."""
    if move.kind == "walk":
        return scale**2 * np.minimum.outer(DAYS, DAYS) / (DAYS[-1] - DAYS[0])
    step, line = (np.arange(len(DAYS)) > move.after).astype(float), (DAYS - DAYS.mean()) / (DAYS[-1] - DAYS[0])
    shape = step if move.kind == "jump" else line
    return scale**2 * np.outer(shape, shape)


def density(design, values, moves, scale, factor):
    """Log density of all measurements of all campaigns under some moves."""
    states = np.kron(np.ones((len(DAYS), len(DAYS))), settings.WIDE**2 * np.eye(3))
    for move in moves:
        states += np.kron(over_time(move, scale), np.diag(np.arange(3) == move.parameter).astype(float))
    rows = design.shape[1]
    whole = np.zeros((len(DAYS) * rows, 3 * len(DAYS)))
    for k in range(len(DAYS)):
        whole[k * rows : (k + 1) * rows, 3 * k : 3 * k + 3] = design[k]
    covariance = whole @ states @ whole.T + factor**2 * np.eye(len(whole))
    return multivariate_normal(cov=covariance).logpdf(values.ravel())


@pytest.mark.parametrize("moves", MODELS, ids=str)
@pytest.mark.parametrize(("scale", "factor"), [(1.0, 1.0), (0.1, 1.0), (0.3, 1.6)])
def test_evidence_is_that_of_the_density_of_all_measurements(case, moves, scale, factor):
    design, values, series = case
    grid = series.grid
    point = int(np.flatnonzero((grid.variance == scale**2) & (grid.inflation == factor**2))[0])
    found, nothing = (Beside.of(series, some, grid).log_likelihood[point] for some in (moves, ()))
    wanted = density(design, values, moves, scale, factor) - density(design, values, (), scale, factor)
    # the constants' prior is wide, not endless, and not widened by the scatter
    assert found - nothing == pytest.approx(wanted, abs=0.01 if factor == 1.0 else 0.05)


def test_priors_are_what_is_stated(case):
    series = case[2]
    for count in (1, 3):
        some = replace(series, followed=np.arange(3) < count)
        odds = [np.exp(log_prior(Move(0, "jump", j), some)) for j in range(4)]
        one = sum(odds) + np.exp(log_prior(Move(0, "trend"), some)) + np.exp(log_prior(Move(0, "walk"), some))
        assert (1.0 + one) ** -count == pytest.approx(1.0 - settings.ANY_CHANGE)
    distance, degrees = series.scattered
    grid = series.grid
    prior = grid.log_base + 0.5 * distance / grid.inflation + 0.5 * degrees * np.log(grid.inflation)
    assert logsumexp(prior) == pytest.approx(0.0)
    assert math.fsum(settings.KINDS.values()) == pytest.approx(1.0)
    assert min(settings.KINDS.values()) > 0.0
    assert settings.SCATTER[0] == 1.0  # deviations are never made smaller
    assert list(settings.SCATTER) == sorted(settings.SCATTER)
    assert settings.SCALES[-1] < settings.WIDE


def test_scatter_of_campaigns_alike_is_their_degrees_of_freedom():
    rng, ratio = np.random.default_rng(3), []
    for _ in range(50):
        design = 3.0 * rng.normal(size=(5, 30, 3))
        values = measured(design, np.tile(rng.normal(size=3), (5, 1)), rng)
        distance, degrees = series_of(design, values, DAYS).scattered
        assert degrees == 4 * 3
        ratio.append(distance / degrees)
    # four deviations of a mean of 50 chi-squares with twelve degrees of freedom
    assert np.mean(ratio) == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / 12 / 50))


@pytest.mark.parametrize("after", [0, 3, 6])
def test_a_jump_is_found_on_its_day(after):
    found = explanations(jumping(after=after))
    assert next(iter(found)) == (Move(1, "jump", after),)
    assert sum(moves_of(found, 1).values()) > 0.99


def test_a_trend_and_a_jump_of_two_parameters_are_found_together_and_what_wanders_is_neither():
    times, states = np.array([0.0, 1, 2, 4, 5, 7, 8, 10]), np.zeros((8, 5))
    states[:, 3] = times / 10.0
    states[5:, 0] -= 0.6
    assert best(of_states(states, times, 1)) == (Move(0, "jump", 4), Move(3, "trend"))
    states = np.zeros((16, 3))
    states[:, 2] = np.cumsum(np.random.default_rng(2).normal(size=16))
    ways = moves_of(explanations(of_states(states, np.arange(16.0), 3)), 2)
    assert max(ways, key=ways.get) == Move(2, "walk")


def test_nothing_is_found_where_nothing_moves_or_may():
    found = explanations(jumping(size=0.0))
    assert next(iter(found)) == ()
    assert sum(found.values()) == pytest.approx(1.0)
    assert explanations(replace(jumping(), followed=np.zeros(4, dtype=bool))) == {(): 1.0}


def test_the_order_of_time_matters_and_its_origin_and_unit_do_not():
    series = jumping(size=0.3)
    one, other = explanations(series), explanations(replace(series, times=7.0 * series.times + 1e4))
    assert list(one) == list(other)
    np.testing.assert_allclose([*one.values()], [*other.values()], rtol=1e-6)
    series = jumping(after=1)
    back = replace(series, matrices=series.matrices[::-1], vectors=series.vectors[::-1])
    assert best(back) == (Move(1, "jump", 5),)  # days are as far apart from behind
    series, turned = jumping(size=0.8), np.array([0, 5, 1, 6, 2, 7, 3, 4])
    mixed = replace(series, matrices=series.matrices[turned], vectors=series.vectors[turned])
    assert best(mixed) != best(series)


def test_a_parameter_that_is_not_followed_is_constant_however_it_is_scaled():
    series, scale = jumping(), np.array([1.0, 1.0, 10.0, 1.0])
    still = replace(series, followed=np.array([True, True, False, True]))
    other = replace(still, matrices=series.matrices * np.outer(scale, scale), vectors=series.vectors * scale)
    (one, chance), (two, same) = (next(iter(explanations(s).items())) for s in (still, other))
    assert one == two
    assert chance == pytest.approx(same, abs=1e-3)


def test_values_of_each_campaign_are_those_of_least_squares_with_all_else_constant():
    design, rng = columns(5, 3, 4)
    states = np.tile(rng.normal(size=3), (5, 1))
    states[:, 1] += rng.normal(size=5)
    values = measured(design, states, rng)
    series = series_of(design, values, np.arange(5.0))
    state = State.of(series, (), free=1, grid=Grid(np.ones(1), np.ones(1), np.zeros(1)))
    found, covariance = state.told(state.path(1))
    rows = design.shape[1]
    whole = np.zeros((5 * rows, 2 + 5))
    whole[:, :2] = design[:, :, [0, 2]].reshape(-1, 2)
    for k in range(5):
        whole[k * rows : (k + 1) * rows, 2 + k] = design[k, :, 1]
    np.testing.assert_allclose(found, np.linalg.lstsq(whole, values.ravel(), rcond=None)[0][2:], atol=1e-4)
    deviation = np.sqrt(np.diag(np.linalg.inv(whole.T @ whole)))[2:]
    np.testing.assert_allclose(np.sqrt(np.diag(covariance)), deviation, rtol=1e-3)


COVARIANCE = np.array([[4e-4, 3e-6], [3e-6, 1e-7]])


@pytest.mark.parametrize("rate", [2e-3, -2e-3])
def test_on_the_ends_of_the_interval_the_line_is_two_deviations_from_the_limit(rate):
    value = np.array([0.1, rate])
    expected, low, high = fieller(value, COVARIANCE, 1.0)
    assert low < expected < high
    assert value[0] + rate * expected == pytest.approx(np.sign(rate))
    for end in (low, high):
        along = np.array([1.0, end])
        away = np.sign(rate) - along @ value
        assert abs(away) == pytest.approx(1.959964 * np.sqrt(along @ COVARIANCE @ along), rel=1e-6)


def test_a_rate_that_may_be_none_may_never_get_there():
    expected, low, high = fieller(np.array([0.1, 1e-3]), np.array([[4e-4, 0.0], [0.0, 1e-6]]), 1.0)
    assert high is None
    assert 0.0 < low < expected
    assert fieller(np.array([0.1, 0.0]), np.eye(2), 1.0) is None


def test_the_interval_holds_the_day_as_often_as_it_says():
    true = np.array([0.1, 2e-3])
    day = (1.0 - true[0]) / true[1]
    drawn = np.random.default_rng(0).multivariate_normal(true, COVARIANCE, 4000)
    ends = (fieller(each, COVARIANCE, 1.0) for each in drawn)
    inside = [low <= day <= (np.inf if high is None else high) for _, low, high in ends]
    assert np.mean(inside) == pytest.approx(0.95, abs=0.012)


def without_change(seed, campaigns=10, parameters=4, noise=1.0):
    design, rng = columns(campaigns, parameters, seed)
    states = np.tile(rng.normal(size=parameters), (campaigns, 1))
    return series_of(design, noise * measured(design, states, rng), np.arange(float(campaigns)))


@pytest.mark.parametrize("noise", [1.0, 1.8])
def test_series_without_a_change_ring_at_most_as_often_as_stated(noise):
    """Whether the deviations are right, or too small: then the scatter of the campaigns says so."""
    found = np.array([chances(without_change(seed, noise=noise), ()).min() for seed in range(500)])
    for stated in (0.2, 0.05):
        assert int((found <= stated).sum()) <= binom.ppf(0.999, len(found), stated)
    assert (found <= 0.2).mean() > 0.02  # the bound is no idle one


def test_a_clear_jump_is_no_chance_the_others_are_judged_beside_it_and_what_is_not_followed_never_rings():
    series = jumping(size=1.0)
    beside = chances(series, (Move(1, "jump", 4),))
    assert beside[1] < 1e-9
    assert np.delete(beside, 1).min() > 0.01
    assert chances(replace(series, followed=np.array([True, False, True, True])), ())[1] == 1.0


def test_scatter_is_what_it_was_made_with_and_never_below_one():
    grown = [scatter(without_change(seed, noise=2.0), ()) for seed in range(40)]
    assert np.mean(grown) == pytest.approx(4.0, rel=0.1)
    assert scatter(without_change(1, noise=0.1), ()) == 1.0
