"""Discs by every engine: the edge, chords and compiled loops find the same chances."""

from itertools import product

import numpy as np
import pytest
from helpers import some
from scipy.stats import ncx2

from thermal_robot import compiling
from thermal_robot.assembly.probability import (
    compiled,
    failing_probability,
    joining_probability,
    required_clearance,
)
from thermal_robot.assembly.probability.planar import Principal, by_chords, disc_chances

needs_loops = pytest.mark.skipif(
    not compiling.loads("thermal_robot.assembly.probability.loops"),
    reason="the loops are in the extra fast: numba is not installed",
)
COUNT = 1000


def cases(seed, ratio, segments, count=300):
    """Covariances of ratios up to one given, means, radii, segments: of all sizes beside each other."""
    rng = np.random.default_rng(seed)
    wide = np.exp(rng.uniform(-2.0, 2.0, count))
    narrow = wide / ratio ** rng.uniform(0.0, 1.0, count) if ratio else np.zeros(count)
    angle = rng.uniform(0.0, np.pi, count)
    turn = np.stack([np.cos(angle), -np.sin(angle), np.sin(angle), np.cos(angle)], axis=-1).reshape(-1, 2, 2)
    matrices = np.einsum("nij,nj,nkj->nik", turn, np.stack([wide, narrow], axis=-1) ** 2, turn)
    means = rng.normal(size=(count, 2)) * (wide * rng.uniform(0.0, 3.0, count))[:, None]
    means[rng.random(count) < 0.3] = 0.0
    ends = rng.normal(size=(count, 2)) * (wide * np.exp(rng.uniform(-4.0, 1.5, count)))[:, None]
    radii = wide * np.exp(rng.uniform(-3.0, 2.0, count))
    return 0.5 * (matrices + np.swapaxes(matrices, 1, 2)), means, radii, ends if segments else None


@pytest.mark.parametrize(("ratio", "segments"), some(product([3.0, 100.0, 1e4, 1e8, 0.0], [False, True]), 3))
def test_what_is_told_is_what_halved_panels_find(ratio, segments):
    matrices, means, radii, ends = cases(1, ratio, segments)
    principal, ends = Principal.of(matrices), np.zeros_like(means) if ends is None else ends
    found, beyond = disc_chances(principal, means, radii, ends)
    case = (principal, means, 2.0 * radii[:, None], ends, "circle")
    inside, outside = (by_chords(*case, out) for out in (False, True))
    told, digits = np.isfinite(found), np.isfinite(beyond)
    np.testing.assert_allclose(inside + outside, 1.0, rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(found[told], inside[told], rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(beyond[digits], outside[digits], rtol=1e-10)
    assert np.all(digits[told & (outside > 1.01e-5)])
    assert told.all() or segments, "without a segment every disc is resolved"


@pytest.mark.parametrize("failing", [0.7, 6.6e-5, np.exp(-200.0)])
@pytest.mark.parametrize("segments", [False, True])
@pytest.mark.parametrize("ratio", [3.0, 1e4])
def test_many_clearances_fail_as_often_as_is_asked_and_are_as_one_by_one(ratio, failing, segments):
    matrices, means, _, ends = cases(6, ratio, segments, count=12)
    heated = {} if ends is None else {"segments": ends}
    found = required_clearance(matrices, failing=failing, mean=means, **heated)
    fails = failing_probability(matrices, found, means, **heated)
    np.testing.assert_allclose(np.log(fails), np.log(failing), rtol=1e-9)
    single = {name: part[3] for name, part in heated.items()}
    one = required_clearance(matrices[3], failing=failing, mean=means[3], **single)
    assert isinstance(one, float)
    assert found[3] == pytest.approx(one, rel=1e-12)


@pytest.fixture
def always(monkeypatch):
    """Compiled loops, however few cases there are."""
    monkeypatch.setattr(compiled, "MANY", 1)


def both(monkeypatch, *case):
    """Return the chances inside and outside, by the loops and without them."""
    found = []
    for many in (1, 10**9):
        monkeypatch.setattr(compiled, "MANY", many)
        found.append((joining_probability(*case), failing_probability(*case)))
    return found


@pytest.mark.slow
@needs_loops
@pytest.mark.parametrize("ratio", [1.0, 3.0, 100.0, 1e4, 1e8])
@pytest.mark.parametrize("reach", [0.01, 1.0, 3.0, 12.0], ids="{}_deviations".format)
@pytest.mark.parametrize("shifted", [False, True], ids=["central", "shifted"])
def test_loops_agree_with_the_other_engine(monkeypatch, ratio, reach, shifted):
    count = COUNT if ratio < 1e8 else 100  # beyond their reach they ask the other engine, which takes its time
    matrices, means, _, _ = cases(int(ratio + reach), ratio, False, count)
    deviation = np.sqrt(Principal.of(matrices).large)
    radius = reach * deviation * np.random.default_rng(1).uniform(0.5, 2.0, count)
    means = means if shifted else 0.0
    # in metres: the loops may not know the unit
    (inside, outside), (expected, missed) = both(monkeypatch, 1e-10 * matrices, 2e-5 * radius, 1e-5 * means)
    np.testing.assert_allclose(inside, expected, rtol=0.0, atol=4e-15)
    np.testing.assert_allclose(outside, missed, rtol=1e-10, atol=0.0)
    assert ((inside >= 0.0) & (inside <= 1.0)).all()


@needs_loops
def test_round_deviations_have_the_law_of_a_non_central_square(always):
    rng = np.random.default_rng(2)
    mean, radius = rng.normal(size=(COUNT, 2)), rng.uniform(0.1, 4.0, COUNT)
    found = joining_probability(np.eye(2), 2.0 * radius, mean)
    np.testing.assert_allclose(found, ncx2.cdf(radius**2, 2, (mean**2).sum(axis=1)), rtol=0.0, atol=1e-12)


@needs_loops
def test_the_number_of_threads_does_not_show(always, monkeypatch):
    matrices, means, _, _ = cases(3, 4.0, False, COUNT)
    found = []
    for threads, piece in ((1, 16_384), (3, 170)):
        monkeypatch.setattr(compiling, "THREADS", threads)
        monkeypatch.setattr(compiling, "PIECE", piece)
        found.append(joining_probability(matrices, 5.0, means))
    np.testing.assert_array_equal(*found)


@needs_loops
def test_loops_broadcast_and_more_clearance_joins_more_often(always):
    matrices = cases(4, 2.0, False, 20)[0]
    matrices /= Principal.of(matrices).large[:, None, None]
    found = joining_probability(matrices[:, None], np.linspace(0.0, 10.0, 30), [1.0, 0.0])
    assert found.shape == (20, 30)
    assert (np.diff(found, axis=1) >= 0.0).all()
    np.testing.assert_array_equal(found[:, 0], 0.0)


@needs_loops
def test_what_loops_cannot_tell_is_told_by_others(monkeypatch):
    """No clearance and an endless one, a deviation of nothing, one without any width, and a very narrow one."""
    covariance = np.array([np.eye(2), np.eye(2), np.zeros((2, 2)), [[1.0, 1.0], [1.0, 1.0]], np.diag([1.0, 1e-20])])
    clearance, mean = np.array([0.0, np.inf, 2.0, 2.0, 2.0]), np.array([[0.0, 0.0]] * 4 + [[0.3, 0.0]])
    (inside, outside), (expected, missed) = both(monkeypatch, covariance, clearance, mean)
    np.testing.assert_allclose(inside, expected, rtol=0.0, atol=1e-15)
    np.testing.assert_allclose(outside, missed, rtol=1e-12, atol=0.0)
    np.testing.assert_array_equal(inside[:3], [0.0, 1.0, 1.0])
