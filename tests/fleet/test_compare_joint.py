"""The joint fit on sums of products whose truth is known."""

import numpy as np
import pytest
from compared import JOINTS, listed, said

from thermal_robot.fleet.compare_joint import joint, some_of
from thermal_robot.inference.algebra import solve


def fitted(truths, rng):
    return joint(listed(len(truths)), [(0, k) for k in range(4)], said(truths, rng))


def test_what_did_not_change_is_shared_and_more_precise_than_in_any_campaign():
    rng, truth = np.random.default_rng(1), np.array([1.0, -0.5, 0.3, 0.8])
    sums = said([truth] * 3, rng)
    found = joint(listed(3), [(0, k) for k in range(4)], sums)
    assert found.changes == ()
    together = solve(sum(s.matrix for s in sums), sum(s.vector for s in sums))
    np.testing.assert_allclose(found.values, np.tile(together, (3, 1)), atol=2e-3)
    alone = np.sqrt(np.linalg.inv(sums[0].matrix).diagonal())
    assert (np.sqrt(found.covariance.diagonal()[:4]) < alone).all()
    assert found.probability[0] > 0.999


def test_one_place_that_changed_is_found_with_when():
    rng, truth = np.random.default_rng(2), np.array([1.0, -0.5, 0.3, 0.8])
    later = truth + np.array([0.0, 0.0, 0.25, 0.0])
    found = fitted([truth, truth, later, later], rng)
    (change,) = found.changes
    assert change.part.place == ("joint", "three")
    assert change.part.where in ((0, 1), (2, 3))
    assert found.values[3, 2] - found.values[0, 2] == pytest.approx(0.25, abs=0.1)
    np.testing.assert_array_equal(found.values[0, [0, 1, 3]], found.values[3, [0, 1, 3]])


def test_two_places_may_change_at_two_times():
    rng, truth = np.random.default_rng(3), np.array([1.0, -0.5, 0.3, 0.8])
    days = [truth, truth + np.array([0.4, 0.0, 0.0, 0.0]), truth + np.array([0.4, 0.0, 0.0, -0.4])]
    found = fitted(days, rng)
    assert {change.part.place[1] for change in found.changes} == {"one", "four"}
    np.testing.assert_allclose(found.values, days, atol=0.12)


def test_chance_makes_no_change_more_often_than_stated():
    rng, told = np.random.default_rng(0), 0
    for _ in range(150):
        truth = rng.normal(size=4)
        told += bool(fitted([truth, truth], rng).changes)
    # 2 % of 150 are 3; more than 8 have a chance of 0.4 %
    assert told <= 8


def test_a_change_of_five_deviations_is_found_and_nothing_else():
    rng, right = np.random.default_rng(0), 0
    for _ in range(60):
        truth, place = rng.normal(size=4), rng.integers(4)
        step = 5.0 * np.sqrt(2.0 / (60 * 16.0))
        changed = fitted([truth, truth + step * np.eye(4)[place]], rng).changes
        right += [c.part.place[1] for c in changed] == [JOINTS[place]]
    assert right >= 51


def test_which_sets_of_campaigns_may_differ():
    assert some_of(2) == ((0,), (1,))
    assert len(some_of(4)) == 2**4 - 2
    many = some_of(9)
    assert {(k,) for k in range(9)} < set(many)
    assert (0, 1, 2) in many
    assert (5, 6, 7, 8) in many
    assert len(many) == len(set(many)) < 2**9 - 2
