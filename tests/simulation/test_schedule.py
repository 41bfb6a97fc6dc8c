"""When rows are measured: repeats, orders and conditions."""

import numpy as np
import pytest

from thermal_robot.simulation import schedule as settings
from thermal_robot.simulation.schedule import balanced, conditions, in_turn, visits


@pytest.mark.parametrize(("rows", "repeats"), [(12, 1), (12, 2), (12, 3), (12, 6), (30, 5)])
def test_every_row_is_one_visit_and_none_follows_itself(rows, repeats):
    places = visits(rows, repeats)
    assert sorted(places.ravel().tolist()) == list(range(rows))
    q, which = in_turn(np.arange(rows // repeats, dtype=float)[:, None], places)
    assert np.array_equal(q[:, 0], which)
    assert np.all(np.diff(which) != 0)
    assert np.bincount(which).tolist() == [repeats] * (rows // repeats)


def test_a_sorted_order_is_mixed_until_both_sides_occur():
    poses = np.sort(np.random.default_rng(0).uniform(size=(40, 6)), axis=0)
    places = visits(40, 1)
    order = balanced(poses, places, np.random.default_rng(1))
    assert sorted(order.tolist()) == list(range(40))
    rising = (np.diff(poses[order], axis=0) > 0.0).mean(axis=0)
    assert np.all(np.abs(rising - 0.5) <= settings.BALANCED + 1e-12)


def test_conditions_have_a_value_for_each_row():
    found = conditions(50, 6.0, (1.0, 3.0))
    assert {name: len(values) for name, values in found.items()} == {"time": 50, "temperature": 50, "payload": 50}
    assert found["payload"][0] == 0.0
    assert np.bincount(np.searchsorted([0.0, 1.0, 3.0], found["payload"])).min() >= 15
    assert np.all(np.diff(found["time"]) > 0.0)
    assert 0.9 * 6.0 < np.ptp(found["temperature"]) <= 6.0
    assert "payload" not in conditions(50, 6.0)
