"""How far a joint has gone since it turned round: by hand, against a walk row by row, and with rows taken away."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from helpers import commanded

from thermal_robot.campaign.turning import SLIPS, arrivals, moves, since_turns, strained


def told(path, sessions=None, **columns):
    """Distances from the last turn, and sides of approach: both empty where rows have no order."""
    q = np.array(path, dtype=float)[:, None]
    columns = {name: np.array(values, dtype=float) for name, values in columns.items()}
    columns = columns or {"order": np.arange(float(len(q)))}
    return [of(q, ("elbow",), columns, sessions) for of in (since_turns, arrivals)]


def along(path, sessions=None, **columns):
    return told(path, sessions, **columns)[0]["elbow"].tolist()


def came(path, sessions=None, **columns):
    return told(path, sessions, **columns)[1]["approach.elbow"].tolist()


@pytest.mark.parametrize(
    ("path", "columns", "distance"),
    [
        ([0.0, 1.0, 3.0, 2.0, 0.5, 0.75], {}, [0.0, 1.0, 3.0, -1.0, -2.5, 0.25]),
        # a joint that rests has not turned, and keeps the side from which it came
        ([0.0, 2.0, 2.0, 3.0, 3.0, 1.0, 1.0], {}, [0.0, 2.0, 2.0, 3.0, 3.0, -2.0, -2.0]),
        ([1.0, 1.0, 1.0], {}, [0.0, 0.0, 0.0]),
        ([1.0, 1.0, 0.5], {}, [0.0, 0.0, -0.5]),
        # backwards in the file, and forwards in time, which tells, where there is an order, too
        ([3.0, 0.0, 2.0, 1.0], {"time": [20.0, 0.0, 30.0, 10.0]}, [3.0, 0.0, -1.0, 1.0]),
        ([3.0, 0.0], {"time": [20.0, 0.0], "order": [0.0, 1.0]}, [3.0, 0.0]),
    ],
)
def test_distance_counts_from_the_last_turn_and_its_sign_is_the_side_of_approach(path, columns, distance):
    assert along(path, **columns) == distance
    assert came(path, **columns) == np.sign(distance).tolist()


def test_a_joint_that_is_held_remembers_nothing_and_came_from_nowhere():
    read = 0.4 + 1e-6 * np.random.default_rng(1).normal(size=40)
    assert not moves(read)
    assert along(read) == came(read) == [0.0] * 40
    assert moves(np.column_stack([read, 2e3 * read, read + np.arange(40) * 1e-5])).tolist() == [False, True, True]
    assert moves(np.zeros((0, 3))).tolist() == [False] * 3


def test_nothing_is_remembered_between_sessions():
    path, sessions = [0.0, 10.0, 1.0, 9.0, 2.0, 7.0], np.array(list("ababab"))
    assert along(path, sessions) == [0.0, 0.0, 1.0, -1.0, 2.0, -3.0]
    assert came([0.0, 1.0, 5.0, 4.0], np.array(list("aabb"))) == [0.0, 1.0, 0.0, -1.0]
    assert told([0.0, 1.0], time=[5.0, 5.0]) == [{}, {}]


@pytest.mark.parametrize("seed", range(4))
def test_it_is_what_a_walk_from_row_to_row_finds(seed):
    path = np.random.default_rng(seed).normal(size=60).round(1)
    last, way, expected = path[0], 0.0, [0.0]
    for before, now in pairwise(path):
        step = np.sign(now - before)
        if step * way < 0.0:
            last = before
        way = step or way
        expected.append(now - last)
    np.testing.assert_allclose(along(path), expected, atol=1e-12)


def test_nobody_knows_whence_a_row_came_whose_predecessor_was_struck():
    path = [0.0, 2.0, 1.0, 1.0, 3.0, 0.0]
    assert came(path, order=[1, 2, 3, 5, 6, 9]) == [0.0, 1.0, -1.0, 0.0, 1.0, 0.0]
    assert came(path, order=[10, 20, 30, 50, 60, 90]) == [0.0, 1.0, -1.0, 0.0, 1.0, 0.0]
    # with a clock beside it, and in the order of that clock
    assert came(path, time=[5, 4, 3, 2, 1, 0], order=[6, 5, 3, 2, 1, 0]) == [-1.0, 0.0, -1.0, -1.0, 1.0, 0.0]
    # no counter of rows, but a clock of its own
    for clock in ([0, 41, 100, 180, 300, 420], [0.0, 1.5, 2.0, 9.0, 9.5, 30.0]):
        assert came(path, order=clock) == [0.0, 1.0, -1.0, -1.0, 1.0, -1.0]


def strains(path):
    found = told(path)[0]
    return np.column_stack([found[strained("elbow", slip)] for slip in SLIPS])


@pytest.mark.parametrize("seed", range(3))
def test_an_element_is_strained_by_what_play_of_its_width_does_not_follow(seed):
    """The stop operator is the input less the play operator's output."""
    path = np.random.default_rng(seed).uniform(-2.0, 2.0, 80)
    plays = np.full((len(path), len(SLIPS)), path[0])
    for row in range(1, len(path)):
        plays[row] = np.maximum(path[row] - SLIPS, np.minimum(path[row] + SLIPS, plays[row - 1]))
    np.testing.assert_allclose(strains(path), path[:, None] - plays, atol=1e-12)


def test_rows_in_no_order_have_no_past(rv_m2):
    assert commanded(rv_m2).since_turn == {}


def test_rows_that_are_taken_keep_their_past(rv_m2):
    whole = commanded(rv_m2, {"time": np.arange(10.0)[::-1]})
    rows = np.array([7, 2, 5])
    part = whole.take(rows)
    assert set(part.since_turn) > set(rv_m2.joint_names)
    for joint in whole.since_turn:
        np.testing.assert_array_equal(part.since_turn[joint], whole.since_turn[joint][rows])
        np.testing.assert_array_equal(part.take([1]).since_turn[joint], whole.since_turn[joint][[2]])
    # other commands have another past
    moved = replace(whole, q=whole.q[::-1])
    assert not np.array_equal(moved.since_turn["joint_2"], whole.since_turn["joint_2"])
