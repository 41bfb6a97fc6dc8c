"""The stated rate of false alarms holds, and is not far from what happens."""

import numpy as np
import pytest
from scipy.stats import binom
from wear_cases import columns, jumping, measured, series_of

from thermal_robot.fleet.wear_moves import Grid, Move, chances, scatter


def without_change(seed, campaigns=10, parameters=4, noise=1.0):
    design, rng = columns(campaigns, parameters, seed)
    states = np.tile(rng.normal(size=parameters), (campaigns, 1))
    return series_of(design, noise * measured(design, states, rng), np.arange(float(campaigns)))


def least(series):
    return float(chances(series, Grid.of(series), ()).min())


@pytest.mark.parametrize("noise", [1.0, 1.8])
def test_series_without_a_change_ring_at_most_as_often_as_stated(noise):
    """Whether the deviations are right, or too small: then the scatter of the campaigns says so."""
    count = 500
    found = np.array([least(without_change(seed, noise=noise)) for seed in range(count)])
    for stated in (0.2, 0.05):
        rung = int((found <= stated).sum())
        assert rung <= binom.ppf(0.999, count, stated)
    assert (found <= 0.2).mean() > 0.02  # the bound is no idle one


def test_a_clear_jump_is_no_chance_and_the_others_are_judged_beside_it():
    series = jumping(size=1.0)
    grid = Grid.of(series)
    beside = chances(series, grid, (Move(1, "jump", 4),))
    assert beside[1] < 1e-9
    assert np.delete(beside, 1).min() > 0.01


def test_what_is_not_followed_never_rings():
    series = jumping(size=1.0)
    series = type(series)(series.matrices, series.vectors, series.times, np.array([True, False, True, True]))
    assert chances(series, Grid.of(series), ())[1] == 1.0


def test_scatter_is_what_it_was_made_with_and_never_below_one():
    grown = [scatter(s, Grid.of(s), ()) for s in (without_change(seed, noise=2.0) for seed in range(40))]
    assert np.mean(grown) == pytest.approx(4.0, rel=0.1)
    assert scatter(without_change(1, noise=0.1), Grid.of(without_change(1)), ()) == 1.0
