"""Rows at a point: columns against finite differences of the exact model, and products that a step carries along."""

from dataclasses import replace

import numpy as np

from thermal_robot.diagnosis.growing.choice import Point
from thermal_robot.diagnosis.growing.sums import Seen, carried, frame_names, products
from thermal_robot.inference.frames import moved


def test_columns_are_what_a_step_does_to_the_gap(whole, grown):
    """A turn of the base turns what is left of a row, too, which is small where there is no gross error."""
    choice, point, rows = grown.choice, grown.fitted.point, whole.take(np.flatnonzero(~grown.single.aside)[:20])
    here = Seen.at(rows, point, choice)
    flat = len(here.names)
    step = 1e-6 * np.random.default_rng(0).normal(size=here.stack.shape[2] - 1)
    there = Seen.at(rows, Point(moved(point.frames, step[:flat], here.names), point.values + step[flat:]), choice)
    change = here.gap - there.gap
    assert np.allclose(change, here.stack[:, :, :-1] @ step, atol=1e-4 * np.abs(change).max())


def test_rows_that_are_noisier_say_less(whole, grown):
    rows = replace(whole.take(np.arange(2)), noise_of_rows=np.array([2e-5, 6e-5]), noise_position=2e-5)
    seen = Seen.at(rows, grown.fitted.point, grown.choice)
    assert np.allclose(seen.alike[0], seen.stack[0])
    assert np.allclose(3.0 * seen.alike[1], seen.stack[1])


def test_no_rows_have_all_columns(whole, grown):
    nothing = Seen.at(whole.take([]), grown.fitted.point, grown.choice, rivals=True)
    some = Seen.at(whole.take([0]), grown.fitted.point, grown.choice, rivals=True)
    assert nothing.stack.shape == (0, *some.stack.shape[1:])
    assert nothing.names == some.names == frame_names(whole)


def test_products_after_a_step_are_those_of_the_gap_after_it():
    rng = np.random.default_rng(1)
    rows, weights, step = rng.normal(size=(30, 6, 5)), rng.uniform(size=30), rng.normal(size=3)
    after = rows.copy()
    after[:, :, -1] -= rows[:, :, :3] @ step
    assert np.allclose(carried(products(rows, weights), step), products(after, weights))


def test_positions_and_orientations_are_summed_apart():
    rows = np.ones((4, 6, 2))
    rows[:, 3:] = 2.0
    assert np.allclose(products(rows, np.ones(4))[:, 0, 0], [12.0, 48.0])
