"""Mean and spread of a fleet are known as well as is said, and robots that stand out are named by their probability."""

import numpy as np
import pytest
from fleet.robots import deviations, scattered
from scipy.integrate import quad

from thermal_robot.fleet.population import combined, population

FLEETS = 300


@pytest.mark.parametrize("spread", [0.7, 1.5, 4.0])
def test_mean_and_spread_lie_within_their_deviations(spread):
    off = []
    for seed in range(FLEETS):
        rng = np.random.default_rng([1, seed])
        own = deviations(rng, 40)
        found = population(scattered(rng, 40, 3.0, spread, own), own)
        off.append(((found.means[0] - 3.0) / found.deviations[0], (found.spread - spread) / found.spread_std))
    assert np.std(off, axis=0) == pytest.approx(1.0, abs=0.15)
    assert np.mean(off, axis=0) == pytest.approx(0.0, abs=0.35)


def test_units_do_not_matter():
    rng = np.random.default_rng(2)
    own = deviations(rng, 30)
    values = scattered(rng, 30, 1.0, 2.0, own)
    small, large = population(1e-6 * values, 1e-6 * own), population(1e3 * values, 1e3 * own)
    assert large.means == pytest.approx(1e9 * small.means, rel=1e-9)
    assert large.spread == pytest.approx(1e9 * small.spread, rel=1e-9)
    assert large.apart == pytest.approx(small.apart, rel=1e-6, abs=1e-12)


def test_without_robots_that_stand_out_it_is_the_normal_hierarchy():
    """Against quadrature over the spread, with the mean integrated out exactly."""
    rng = np.random.default_rng(3)
    own = deviations(rng, 50)
    values = scattered(rng, 50, 0.0, 1.5, own)

    def at(tau):
        weight = 1.0 / (own**2 + tau**2)
        mean = (weight * values).sum() / weight.sum()
        log = 0.5 * (np.log(weight) - weight * (values - mean) ** 2).sum() - 0.5 * np.log(weight.sum())
        return np.exp(log - at.best), mean

    at.best = 0.0
    at.best = max(np.log(at(tau)[0]) for tau in np.linspace(0.5, 3.0, 26))
    whole = quad(lambda t: at(t)[0], 0.0, 6.0)[0]
    spread = quad(lambda t: t * at(t)[0], 0.0, 6.0)[0] / whole
    mean = quad(lambda t: at(t)[1] * at(t)[0], 0.0, 6.0)[0] / whole
    found = population(values, own)
    assert found.spread == pytest.approx(spread, abs=0.3 * found.spread_std)
    assert found.means[0] == pytest.approx(mean, abs=0.3 * found.deviations[0])


def test_few_are_named_where_none_stands_out_and_all_where_they_do():
    false, missed = 0, 0
    for seed in range(100):
        rng = np.random.default_rng([4, seed])
        own = np.ones(100)
        values = scattered(rng, 100, 0.0, 0.5, own)
        false += int((population(values, own).apart > 0.9).sum())
        values[:3] += rng.choice([-1.0, 1.0], 3) * 9.0
        missed += int((population(values, own).apart[:3] <= 0.9).sum())
    assert false <= 5  # of 10 000 robots
    assert missed <= 3  # of 300


def test_three_that_stand_out_do_not_move_the_others():
    rng = np.random.default_rng(5)
    own = np.ones(60)
    values = scattered(rng, 60, 2.0, 0.5, own)
    clean = population(values[3:], own[3:])
    values[:3] = 300.0
    found = population(values, own)
    assert found.means[0] == pytest.approx(clean.means[0], abs=0.3 * clean.deviations[0])
    assert found.spread == pytest.approx(clean.spread, abs=0.5 * clean.spread_std)


def test_groups_that_are_alike_are_said_to_be_apart_as_often_as_stated():
    p_values = []
    for seed in range(FLEETS):
        rng = np.random.default_rng([6, seed])
        own = deviations(rng, 60)
        p_values.append(population(scattered(rng, 60, 1.0, 1.0, own), own, rng.permutation(60) % 4).alike)
    assert np.mean(np.array(p_values) < 0.05) <= 0.1
    assert np.mean(np.array(p_values) < 0.5) == pytest.approx(0.5, abs=0.12)


def test_a_group_that_differs_is_told_with_its_mean():
    rng = np.random.default_rng(7)
    own, groups = np.ones(60), np.arange(60) % 3
    values = scattered(rng, 60, 0.0, 0.5, own) + 4.0 * (groups == 2)
    found = population(values, own, groups)
    assert found.alike < 1e-9
    assert found.means == pytest.approx([0.0, 0.0, 4.0], abs=3.0 * found.deviations.max())
    assert found.counts.tolist() == [20, 20, 20]
    assert (found.apart < 0.5).all()


def test_a_mean_that_is_not_zero_is_told():
    own = np.ones(50)
    rng = np.random.default_rng(8)
    assert population(scattered(rng, 50, 1.0, 0.3, own), own).nothing < 1e-4
    assert population(scattered(rng, 50, 0.0, 0.3, own), own).nothing > 1e-3


def test_several_values_of_a_robot_are_one():
    who, values, std = combined(np.array([1.0, 3.0, 7.0]), np.array([1.0, 1.0, 2.0]), np.array([4, 4, 1]))
    assert who.tolist() == [1, 4]
    assert values == pytest.approx([7.0, 2.0])
    # two that differ by two deviations of one: χ² is 2 at one degree of freedom
    assert std == pytest.approx([2.0, np.sqrt(2.0) * np.sqrt(0.5)])


def test_a_group_in_which_all_differ_has_a_mean_and_no_end():
    found = population(np.array([-1e3, 1e3, 0.0, 0.1, 0.2, -0.1]), np.ones(6), np.array([0, 0, 1, 1, 1, 1]))
    assert np.isfinite([*found.means, *found.deviations, found.spread, *found.apart]).all()
