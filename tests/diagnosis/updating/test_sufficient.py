"""Sums of rows: what the guard promises of the rows in them holds for every step within its reach."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from updating_cases import in_full, measured

from thermal_robot.diagnosis.sequential import (
    Guard,
    Judge,
    Point,
    Sums,
    WeightedRows,
    bend,
    carried,
    linearised,
    products,
)
from thermal_robot.inference.columns import unknown_frames
from thermal_robot.inference.registration import moved


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


def test_no_step_within_reach_carries_a_safe_row_into_the_tail_and_hardly_one_across_the_median(rows, guard):
    scores, rng = guard.scores(rows, np.ones(len(rows))), np.random.default_rng(1)
    assert (guard.scores(rows, np.full(len(rows), 0.9)) == -1.0).all()  # rows that count less are never safe
    safe = rows[scores >= guard.reach]
    assert 50 < len(safe) < 400
    below, crossed = np.linalg.norm(safe[:, :, -1], axis=1) < guard.medians, []
    for _ in range(50):
        after = np.linalg.norm(safe[:, :, -1] - safe[:, :, :-1] @ within(guard, rng), axis=1)
        assert (after < guard.bend - guard.share * guard.reach).all()
        crossed.append((after < guard.medians) != below)
    assert np.mean(crossed) < 0.01


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

    def some(part):
        return Sums.of(rows[part], WeightedRows(SimpleNamespace(relative_noise=None), weights[part], aside[part]))

    one, two = some(slice(None)), some(slice(100)).plus(some(slice(100, None)))
    assert np.allclose(one.products, two.products)
    assert one.counts.tolist() == two.counts.tolist() == [400, 342, 342]
    left = one.plus(some(slice(100)), -1)
    assert np.allclose(left.products, some(slice(100, None)).products)


def test_the_tail_begins_nearer_where_the_fit_takes_up_more():
    assert bend(3, 0.1, np.ones(3), np.ones(3)) < bend(3, 0.0, np.ones(3), np.ones(3))
    assert bend(3, 0.0, np.ones(3), 2.0 * np.ones(3)) == pytest.approx(2.0 * bend(3, 0.0, np.ones(3), np.ones(3)))


def test_columns_are_what_a_step_does_to_the_gap(whole, grown):
    """A turn of the base turns what is left of a row, too, which is small where there is no gross error."""
    choice, point, rows = grown.choice, grown.fitted.point, whole.take(np.flatnonzero(~grown.fitted.rows.aside)[:20])
    here, names = linearised(rows, point, choice), unknown_frames(rows)
    flat = len(names)
    step = 1e-6 * np.random.default_rng(0).normal(size=here.shape[2] - 1)
    there = linearised(rows, Point(moved(point.frames, step[:flat], names), point.values + step[flat:]), choice)
    change = here[:, :, -1] - there[:, :, -1]
    assert np.allclose(change, here[:, :, :-1] @ step, atol=1e-4 * np.abs(change).max())


def test_rows_that_are_noisier_say_less(whole, grown):
    rows = whole.take(np.arange(2))
    noisy = replace(rows, noise_of_rows=np.array([2e-5, 6e-5]), noise_position=2e-5)
    alike, stack = (linearised(own, grown.fitted.point, grown.choice) for own in (noisy, rows))
    assert np.allclose(alike[0], stack[0])
    assert np.allclose(3.0 * alike[1], stack[1])
    assert np.allclose(products(alike, in_full(noisy).kept), products(stack, np.ones(2)))


def test_products_after_a_step_are_those_of_the_gap_after_it():
    rng = np.random.default_rng(1)
    rows, weights, step = rng.normal(size=(30, 6, 5)), rng.uniform(size=30), rng.normal(size=3)
    after = rows.copy()
    after[:, :, -1] -= rows[:, :, :3] @ step
    assert np.allclose(carried(products(rows, weights), step), products(after, weights))
    # positions and orientations are summed apart
    rows = np.repeat([1.0, 2.0], 3)[None, :, None] * np.ones((4, 6, 2))
    assert np.allclose(products(rows, np.ones(4))[:, 0, 0], [12.0, 48.0])


def test_values_fall_to_their_effects(found, grown):
    choice, values = grown.choice, np.concatenate([v for _, v in found.fit.effects])
    assert sum(len(own) for _, own in choice.split(values)) == len(values)
    for (effect, own), (known, original) in zip(choice.split(values), found.fit.effects, strict=True):
        assert effect.name == known.name
        assert (own == original).all()


def test_some_rows_of_several_batches(whole):
    both = WeightedRows.joined(in_full(whole.take(np.arange(10))), in_full(whole.take(np.arange(10, 30))))
    assert (both.take(np.array([3, 25])).campaign.rows == whole.rows[[3, 25]]).all()
    assert len(both.weights) == len(both.aside) == 30


def test_by_the_diagnosis_rows_get_the_weight_of_their_distance(grown):
    rows = measured(200, seed=3, gross=0.1)
    judge = Judge(grown.fitted.point, np.full(3, 2e-5), 300)
    single = WeightedRows.weighed(replace(grown.choice, judge=judge), rows)
    assert 10 < single.aside.sum() < 30
    assert (single.weights[single.aside] == 0.0).all()
    assert (single.weights[~single.aside] > 0.5).all()
