"""Sums of rows: what the guard promises of the rows in them holds for every step within its reach."""

from dataclasses import replace

import numpy as np
import pytest

from thermal_robot.diagnosis.growing.sums import Guard, Sums, bend


@pytest.fixture
def rows():
    """400 rows of five columns and a gap, noise of one."""
    return np.random.default_rng(0).normal(size=(400, 3, 6))


@pytest.fixture
def guard(rows):
    flat = rows[:, :, :-1].reshape(-1, 5)
    parts = np.sqrt((rows[:, :, -1] ** 2).sum(axis=1))
    return Guard(flat.T @ flat, 1.0, 0.05, 400**-0.5, np.ones(3), np.array([np.median(parts)]), 3.4, False)


def within(guard, rng):
    """A step at the edge of the reach."""
    step = np.linalg.cholesky(np.linalg.inv(guard.metric)) @ rng.normal(size=len(guard.metric))
    return step * guard.reach / np.sqrt(step @ guard.metric @ step)


def test_no_step_within_reach_carries_a_safe_row_into_the_tail(rows, guard):
    scores, rng = guard.scores(rows, np.ones(len(rows))), np.random.default_rng(1)
    safe = rows[scores >= guard.reach]
    assert 50 < len(safe) < 400
    for _ in range(50):
        after = np.linalg.norm(safe[:, :, -1] - safe[:, :, :-1] @ within(guard, rng), axis=1)
        assert (after < guard.bend - guard.share * guard.reach).all()


def test_hardly_a_safe_row_crosses_the_median(rows, guard):
    scores, rng = guard.scores(rows, np.ones(len(rows))), np.random.default_rng(2)
    safe = rows[scores >= guard.reach]
    below = np.linalg.norm(safe[:, :, -1], axis=1) < guard.medians
    crossed = [
        ((np.linalg.norm(safe[:, :, -1] - safe[:, :, :-1] @ within(guard, rng), axis=1) < guard.medians) != below)
        for _ in range(50)
    ]
    assert np.mean(crossed) < 0.01


def test_rows_that_count_less_are_never_safe(rows, guard):
    assert (guard.scores(rows, np.full(len(rows), 0.9)) == -1.0).all()


def test_it_does_not_hold_beyond_its_reach(guard):
    step, rms = within(guard, np.random.default_rng(3)), np.ones(1)
    assert guard.holds(0.99 * step, guard.sigma, guard.medians, guard.bend, rms)
    assert not guard.holds(1.01 * step, guard.sigma, guard.medians, guard.bend, rms)
    assert not guard.holds(0.5 * step, guard.sigma, guard.medians, guard.bend - 0.1, rms)
    assert not guard.holds(0.5 * step, guard.sigma, guard.medians + 0.5, guard.bend, rms)


def test_where_the_median_bears_on_nothing_it_may_move(guard):
    quiet, step = replace(guard, quiet=True), np.zeros(5)
    assert quiet.holds(step, guard.sigma, guard.medians + 0.5, guard.bend, np.ones(1))
    assert not quiet.holds(step, guard.sigma, guard.medians, guard.bend, np.full(1, 1.5))


def test_sums_add_up(rows):
    weights, aside = np.random.default_rng(4).uniform(size=400), np.arange(400) % 7 == 0
    weights[aside] = 0.0
    one = Sums.empty(6, 1).plus(rows, rows, weights, aside)
    two = Sums.empty(6, 1).plus(rows[:100], rows[:100], weights[:100], aside[:100])
    two = two.plus(rows[100:], rows[100:], weights[100:], aside[100:])
    assert np.allclose(one.weighed, two.weighed)
    assert np.allclose(one.plain, two.plain)
    assert (one.rows, one.used, one.kept) == (two.rows, two.used, two.kept) == (400, 342, 342)


def test_the_tail_begins_nearer_where_the_fit_takes_up_more():
    assert bend(3, 0.1, np.ones(3), np.ones(3)) < bend(3, 0.0, np.ones(3), np.ones(3))
    assert bend(3, 0.0, np.ones(3), 2.0 * np.ones(3)) == pytest.approx(2.0 * bend(3, 0.0, np.ones(3), np.ones(3)))
