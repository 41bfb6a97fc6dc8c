"""Evidence of moves from products against the density of all measurements, written out."""

import numpy as np
import pytest
from scipy.special import logsumexp
from scipy.stats import multivariate_normal
from wear_cases import columns, measured, series_of

from thermal_robot.fleet import wear_settings as settings
from thermal_robot.fleet.wear_moves import Beside, Grid, Move, Series, log_prior

DAYS = np.array([0.0, 3.0, 10.0, 11.0, 30.0])
MODELS = [
    (),
    (Move(0, "jump", 2),),
    (Move(2, "trend"),),
    (Move(1, "walk"),),
    (Move(0, "trend"), Move(1, "jump", 0)),
    (Move(2, "walk"), Move(0, "jump", 3)),
]


def case(seed=0):
    design, rng = columns(len(DAYS), 3, seed)
    states = np.tile(rng.normal(size=3), (len(DAYS), 1))
    states[3:, 0] += 0.4
    values = measured(design, states, rng)
    return design, values, series_of(design, values, DAYS)


def over_time(move, scale):
    """(K, K) prior covariance of what a move adds to its parameter, as it is defined."""
    if move.kind == "jump":
        shape = (np.arange(len(DAYS)) > move.after).astype(float)
        return scale**2 * np.outer(shape, shape)
    if move.kind == "trend":
        shape = (DAYS - DAYS.mean()) / (DAYS[-1] - DAYS[0])
        return scale**2 * np.outer(shape, shape)
    return scale**2 * np.minimum.outer(DAYS, DAYS) / (DAYS[-1] - DAYS[0])


def density(design, values, moves, scale, factor):
    """Log density of all measurements of all campaigns under some moves."""
    states = np.kron(np.ones((len(DAYS), len(DAYS))), settings.WIDE**2 * np.eye(3))
    for move in moves:
        one = np.zeros((3, 3))
        one[move.parameter, move.parameter] = 1.0
        states += np.kron(over_time(move, scale), one)
    rows = design.shape[1]
    whole = np.zeros((len(DAYS) * rows, 3 * len(DAYS)))
    for k in range(len(DAYS)):
        whole[k * rows : (k + 1) * rows, 3 * k : 3 * k + 3] = design[k]
    covariance = whole @ states @ whole.T + factor**2 * np.eye(len(whole))
    return multivariate_normal(cov=covariance).logpdf(values.ravel())


@pytest.mark.parametrize("moves", MODELS[1:], ids=str)
@pytest.mark.parametrize(("scale", "factor"), [(1.0, 1.0), (0.1, 1.0), (0.3, 1.6)])
def test_evidence_is_that_of_the_density_of_all_measurements(moves, scale, factor):
    design, values, series = case()
    grid = Grid.of(series)
    point = int(np.flatnonzero((grid.variance == scale**2) & (grid.inflation == factor**2))[0])
    found = Beside.of(series, grid, moves).log_likelihood[point] - Beside.of(series, grid, ()).log_likelihood[point]
    wanted = density(design, values, moves, scale, factor) - density(design, values, (), scale, factor)
    # the constants' prior is wide, not endless, and not widened by the scatter
    assert found == pytest.approx(wanted, abs=0.01 if factor == 1.0 else 0.05)


def test_one_more_move_is_worth_what_both_are_worth():
    series = case()[2]
    grid, first = Grid.of(series), (Move(0, "trend"),)
    column = np.array([series.spans(Move(1, "jump", 2))[0]])
    beside = Beside.of(series, grid, first)
    own, pull = beside.left(series, grid, column)
    tau, phi2 = grid.variance, grid.inflation
    gain = 0.5 * (pull[:, 0] / phi2) ** 2 / (own[:, 0] / phi2 + 1.0 / tau) - 0.5 * np.log1p(tau * own[:, 0] / phi2)
    both = Beside.of(series, grid, (*first, Move(1, "jump", 2))).log_likelihood
    np.testing.assert_allclose(beside.log_likelihood + gain, both, atol=1e-8)


def test_priors_of_all_moves_of_all_parameters_are_what_is_stated():
    series = case()[2]
    for count in (1, 3):
        some = Series(series.matrices, series.vectors, series.times, np.arange(3) < count)
        odds = [np.exp(log_prior(Move(0, "jump", j), some)) for j in range(4)]
        one = sum(odds) + np.exp(log_prior(Move(0, "trend"), some)) + np.exp(log_prior(Move(0, "walk"), some))
        assert (1.0 + one) ** -count == pytest.approx(1.0 - settings.ANY_CHANGE)


def test_grid_is_a_prior():
    series = case()[2]
    grid = Grid.of(series)
    distance, degrees = series.scattered
    prior = grid.log_base + 0.5 * distance / grid.inflation + 0.5 * degrees * np.log(grid.inflation)
    assert logsumexp(prior) == pytest.approx(0.0)


def test_scatter_of_campaigns_alike_is_their_degrees_of_freedom():
    rng = np.random.default_rng(3)
    ratio = []
    for _ in range(50):
        design = 3.0 * rng.normal(size=(5, 30, 3))
        values = measured(design, np.tile(rng.normal(size=3), (5, 1)), rng)
        distance, degrees = series_of(design, values, DAYS).scattered
        assert degrees == 4 * 3
        ratio.append(distance / degrees)
    assert np.mean(ratio) == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / 12 / 50))
