"""Compiled loops of the probability of a disc: they say what the other engine says, whatever they are given."""

import numpy as np
import pytest
from scipy.stats import ncx2

from thermal_robot.assembly.probability import compiled, failing_probability, joining_probability
from thermal_robot.kinematics import settings
from thermal_robot.kinematics.compiled import installed

pytestmark = pytest.mark.skipif(not installed(), reason="the loops are in the extra fast: numba is not installed")
CASES = 3000


@pytest.fixture
def always(monkeypatch):
    monkeypatch.setattr(compiled, "MANY", 1)


def drawn(rng, ratio, count=CASES):
    """(count, 2, 2) covariances of deviations of 1 by up to ``ratio`` less, turned, in squares of 1e-5 m."""
    angle, narrow = rng.uniform(0.0, np.pi, count), ratio ** -rng.uniform(0.0, 1.0, count)
    axes = np.stack([np.stack([np.cos(angle), -np.sin(angle)], -1), np.stack([np.sin(angle), np.cos(angle)], -1)], -2)
    return 1e-10 * (axes * np.stack([np.ones(count), narrow**2], -1)[:, None, :]) @ axes.transpose(0, 2, 1)


def both(monkeypatch, *case):
    """Return the chances inside and outside, by the loops and without them."""
    found = []
    for many in (1, 10**9):
        monkeypatch.setattr(compiled, "MANY", many)
        found.append((joining_probability(*case), failing_probability(*case)))
    return found


@pytest.mark.parametrize("ratio", [1.0, 3.0, 100.0, 1e4])
@pytest.mark.parametrize("reach", [0.01, 1.0, 3.0, 12.0], ids="{}_deviations".format)
@pytest.mark.parametrize("shifted", [False, True], ids=["central", "shifted"])
def test_they_agree_with_the_other_engine(monkeypatch, ratio, reach, shifted):
    rng = np.random.default_rng(int(ratio + reach))
    mean = 1e-5 * rng.normal(size=(CASES, 2)) if shifted else 0.0
    radius = 1e-5 * reach * rng.uniform(0.5, 2.0, CASES)
    (inside, outside), (expected, missed) = both(monkeypatch, drawn(rng, ratio), 2.0 * radius, mean)
    np.testing.assert_allclose(inside, expected, rtol=0.0, atol=4e-15)
    np.testing.assert_allclose(outside, missed, rtol=1e-10, atol=0.0)
    assert ((inside >= 0.0) & (inside <= 1.0)).all()


def test_round_deviations_have_the_law_of_a_non_central_square(always):
    rng = np.random.default_rng(2)
    mean, radius = rng.normal(size=(CASES, 2)), rng.uniform(0.1, 4.0, CASES)
    found = joining_probability(np.eye(2), 2.0 * radius, mean)
    np.testing.assert_allclose(found, ncx2.cdf(radius**2, 2, (mean**2).sum(axis=1)), rtol=0.0, atol=1e-12)


def test_the_number_of_threads_does_not_show(always, monkeypatch):
    rng, found = np.random.default_rng(3), []
    covariance, mean = drawn(rng, 4.0), 1e-5 * rng.normal(size=(CASES, 2))
    for threads, piece in ((1, 16_384), (3, 170)):
        monkeypatch.setattr(settings, "THREADS", threads)
        monkeypatch.setattr(settings, "PIECE", piece)
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
