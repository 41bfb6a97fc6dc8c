"""Compiled loops of the probability of a disc: they say what the other engine says, whatever they are given."""

import numpy as np
import pytest
from assembly.drawn import both, drawn, needs_loops

from thermal_robot import compiling
from thermal_robot.assembly.probability import joining_probability

pytestmark = needs_loops
CASES = 3000


def test_the_number_of_threads_does_not_show(always, monkeypatch):
    rng, found = np.random.default_rng(3), []
    covariance, mean = drawn(rng, 4.0, CASES), 1e-5 * rng.normal(size=(CASES, 2))
    for threads, piece in ((1, 16_384), (3, 170)):
        monkeypatch.setattr(compiling, "THREADS", threads)
        monkeypatch.setattr(compiling, "PIECE", piece)
        found.append(joining_probability(covariance, 5e-5, mean))
    np.testing.assert_array_equal(*found)


def test_shapes_broadcast(always):
    covariance = drawn(np.random.default_rng(4), 2.0, 20)[:, None]
    clearance = np.linspace(0.0, 1e-4, 30)
    found = joining_probability(covariance, clearance, [1e-5, 0.0])
    assert found.shape == (20, 30)
    assert (np.diff(found, axis=1) >= 0.0).all()
    np.testing.assert_array_equal(found[:, 0], 0.0)


def test_what_they_cannot_tell_is_told_by_others(monkeypatch):
    """No clearance and an endless one, a deviation of nothing, one without any width, and a very narrow one."""
    covariance = np.array([np.eye(2), np.eye(2), np.zeros((2, 2)), [[1.0, 1.0], [1.0, 1.0]], np.diag([1.0, 1e-20])])
    clearance, mean = np.array([0.0, np.inf, 2.0, 2.0, 2.0]), np.array([[0.0, 0.0]] * 4 + [[0.3, 0.0]])
    (inside, outside), (expected, missed) = both(monkeypatch, covariance, clearance, mean)
    np.testing.assert_allclose(inside, expected, rtol=0.0, atol=1e-15)
    np.testing.assert_allclose(outside, missed, rtol=1e-12, atol=0.0)
    np.testing.assert_array_equal(inside[:3], [0.0, 1.0, 1.0])


@pytest.mark.parametrize(
    ("covariance", "clearance", "mean", "words"),
    [
        ([[1.0, 0.0], [0.5, 1.0]], 1.0, 0.0, "symmetric"),
        ([[1.0, 2.0], [2.0, 1.0]], 1.0, 0.0, "semidefinite"),
        ([[np.nan, 0.0], [0.0, 1.0]], 1.0, 0.0, "finite"),
        (np.eye(2), -1.0, 0.0, "negative or missing"),
        (np.eye(2), np.nan, 0.0, "negative or missing"),
        (np.eye(2), 1.0, [np.inf, 0.0], "mean must be finite"),
        (np.eye(3), 1.0, 0.0, "shape"),
    ],
)
def test_one_that_is_wrong_among_many_is_refused_as_ever(always, covariance, clearance, mean, words):
    wrong = np.broadcast_to(np.asarray(covariance, float), (50, *np.shape(covariance))).copy()
    with pytest.raises(ValueError, match=words):
        joining_probability(wrong, clearance, mean)
