"""What fits to the other rows leave: against refitting row by row, and what no column can explain."""

import numpy as np

from thermal_robot.inference.generate import HeldOut
from thermal_robot.inference.grouping import each


def left_out(columns, values, flat, prior, folds):
    return HeldOut.of(columns, values, folds).left(flat, prior)


def problem(seed, noise=1.0):
    rng = np.random.default_rng(seed)
    columns = rng.normal(size=(60, 3, 4))
    truth = np.array([1.0, -2.0, 0.5, 3.0])
    return columns, columns @ truth + noise * rng.normal(size=(60, 3))


def test_it_is_what_separate_fits_leave():
    columns, values = problem(0)
    labels = np.arange(60) % 5
    expected = 0.0
    for label in range(5):
        held = labels == label
        fitted = np.linalg.lstsq(columns[~held].reshape(-1, 4), values[~held].ravel(), rcond=None)[0]
        expected += ((values[held] - columns[held] @ fitted) ** 2).sum()
    np.testing.assert_allclose(left_out(columns, values, 4, np.zeros(0), each(labels)), expected, rtol=1e-8)


def test_a_tight_prior_holds_a_column_at_nothing():
    columns, values = problem(2)
    folds = each(np.arange(60) % 6)
    without = left_out(columns[:, :, :3], values, 3, np.zeros(0), folds)
    np.testing.assert_allclose(left_out(columns, values, 3, np.array([1e12]), folds), without, rtol=1e-6)


def test_a_further_column_counts_as_if_it_had_been_there():
    columns, values = problem(5)
    folds, prior = each(np.arange(60) % 6), np.array([0.3])
    first = HeldOut.of(columns[:, :, :3], values, folds)
    whole = left_out(columns, values, 3, prior, folds)
    np.testing.assert_allclose(first.left(3, prior, columns[:, :, 3:]), whole, rtol=1e-12)
