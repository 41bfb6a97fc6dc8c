"""Which moves come out: those that were put in; time's order matters, its origin does not."""

from dataclasses import replace

import numpy as np
import pytest
from wear_cases import columns, jumping, measured, series_of

from thermal_robot.fleet.wear_moves import Move, explanations


def of_states(states, times, seed):
    design, rng = columns(len(states), states.shape[1], seed)
    return series_of(design, measured(design, states, rng), times)


@pytest.mark.parametrize("after", [0, 3, 6])
def test_a_jump_is_found_on_its_day(after):
    found = explanations(jumping(after=after))
    assert found.best == (Move(1, "jump", after),)
    assert sum(found.of_parameter(1).values()) > 0.99


def test_a_trend_and_a_jump_of_two_parameters_are_found_together():
    times = np.array([0.0, 1, 2, 4, 5, 7, 8, 10])
    states = np.zeros((8, 5))
    states[:, 3] = times / 10.0
    states[5:, 0] -= 0.6
    found = explanations(of_states(states, times, 1))
    assert found.best == (Move(0, "jump", 4), Move(3, "trend"))


def test_what_wanders_is_neither():
    rng = np.random.default_rng(2)
    states = np.zeros((16, 3))
    states[:, 2] = np.cumsum(rng.normal(size=16))
    ways = explanations(of_states(states, np.arange(16.0), 3)).of_parameter(2)
    assert max(ways, key=ways.get) == Move(2, "walk")


def test_nothing_is_found_where_nothing_moves():
    found = explanations(jumping(size=0.0))
    assert found.best == ()
    assert found.probabilities.sum() == pytest.approx(1.0)


def test_the_origin_and_the_unit_of_time_do_not_matter():
    series = jumping(size=0.3)
    one, other = explanations(series), explanations(replace(series, times=7.0 * series.times + 1e4))
    assert one.moves == other.moves
    np.testing.assert_allclose(one.probabilities, other.probabilities, rtol=1e-6)


def test_time_reversed_the_jump_is_on_the_other_side():
    series = jumping(after=1)
    back = replace(
        series,
        matrices=series.matrices[::-1],
        vectors=series.vectors[::-1],
        times=(series.times[-1] - series.times)[::-1],
    )
    assert explanations(back).best == (Move(1, "jump", 5),)


def test_the_order_of_campaigns_matters():
    series, turned = jumping(size=0.8), np.array([0, 5, 1, 6, 2, 7, 3, 4])
    mixed = replace(series, matrices=series.matrices[turned], vectors=series.vectors[turned])
    assert explanations(mixed).best != explanations(series).best


def test_units_of_a_parameter_do_not_matter_where_its_expected_size_goes_along():
    """A parameter that is not followed is constant, however it is scaled."""
    series = jumping()
    scale = np.array([1.0, 1.0, 10.0, 1.0])
    other = replace(
        series, matrices=series.matrices * np.outer(scale, scale), vectors=series.vectors * scale,
        followed=np.array([True, True, False, True]),
    )  # fmt: skip
    still = replace(series, followed=other.followed)
    one, two = explanations(still), explanations(other)
    assert one.best == two.best
    assert one.probabilities[0] == pytest.approx(two.probabilities[0], abs=1e-3)
