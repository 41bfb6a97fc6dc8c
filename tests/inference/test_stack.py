"""Columns over many rows: each different one once, and the same sums whatever the chunks."""

import numpy as np
import pytest

from thermal_robot.inference import settings
from thermal_robot.inference.kernels import Stack, chunks


@pytest.fixture
def columns():
    """Of 70 rows with three components: two blocks, of which the second repeats a column of the first, and the gap."""
    rng = np.random.default_rng(3)
    first, gap = rng.normal(size=(70, 3, 4)), rng.normal(size=(70, 3, 1))
    return [first, np.concatenate([rng.normal(size=(70, 3, 2)), first[:, :, [1]]], axis=2), gap]


@pytest.fixture
def used(columns):
    rows = np.flatnonzero(np.arange(70) % 9)
    return rows, np.random.default_rng(4).uniform(0.5, 2.0, (len(rows), 3))


def flat(columns, rows, root):
    return (np.concatenate(columns, axis=2)[rows] * root[:, :, None]).reshape(len(rows) * 3, -1)


def test_a_column_that_occurs_twice_is_held_once(columns, used):
    stack = Stack.of(columns).weighed(*used)
    assert list(stack.number) == [0, 1, 2, 3, 4, 5, 1, 6]
    whole = stack.rows(slice(None))[:, :, stack.number]
    np.testing.assert_array_equal(whole.reshape(stack.equations, -1), flat(columns, *used))


def test_columns_that_differ_in_one_row_out_of_use_are_two(columns):
    twin = columns[0].copy()
    twin[5, 0, 0] += 1e-9
    rows = np.arange(6, 70)
    assert len(Stack.of([columns[0], twin]).weighed(rows, np.ones((len(rows), 3))).different) == 5


@pytest.mark.parametrize("chunk", [1, 7, 1024])
def test_products_are_those_of_all_rows_at_once(columns, used, chunk, monkeypatch):
    monkeypatch.setattr(settings, "CHUNK", chunk)
    whole = flat(columns, *used)
    np.testing.assert_allclose(Stack.of(columns).weighed(*used).products(), whole.T @ whole, rtol=1e-12, atol=1e-12)


def test_an_array_and_some_of_its_columns_are_taken_as_they_are():
    array = np.random.default_rng(5).normal(size=(12, 5))
    some = Stack.around(array, 3).differing(np.array([4, 0]))
    np.testing.assert_array_equal(some.rows(np.array([3, 1])), array.reshape(4, 3, 5)[[3, 1]][:, :, [4, 0]])


def test_chunks_hold_every_row_once(monkeypatch):
    monkeypatch.setattr(settings, "CHUNK", 4)
    assert [np.arange(9)[part].tolist() for part in chunks(9)] == [[0, 1, 2, 3], [4, 5, 6, 7], [8]]
    assert not list(chunks(0))
