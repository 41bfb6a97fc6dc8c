"""Chi-squares of equal parameters against least squares over the rows themselves."""

import numpy as np
import pytest
from scipy.linalg import lstsq

from thermal_robot.effects import Parameter
from thermal_robot.fleet.compare import _equal, _parameters
from thermal_robot.fleet.compare_sums import Sums


def rows(seed, campaigns=3, count=40, width=5, blind=()):
    """Columns and values of some campaigns; a blind one does not see the first two columns apart."""
    rng, found = np.random.default_rng(seed), []
    for c in range(campaigns):
        columns = rng.normal(size=(count, width)) * 10.0
        if c in blind:
            columns[:, 1] = columns[:, 0]
        found.append((columns, columns @ rng.normal(size=width) * 0.1 + rng.normal(size=count)))
    return found


def squares(columns, values):
    return float(((values - columns @ lstsq(columns, values)[0]) ** 2).sum())


def shared(data, own):
    """Sum of squares with some columns shared by all campaigns and the others of each alone, and how many fit."""
    width, wide = data[0][0].shape[1], []
    others = [k for k in range(width) if k not in own]
    for c, (columns, _) in enumerate(data):
        block = np.zeros((len(columns), len(own) + len(others) * len(data)))
        block[:, : len(own)] = columns[:, own]
        start = len(own) + c * len(others)
        block[:, start : start + len(others)] = columns[:, others]
        wide.append(block)
    whole = np.vstack(wide)
    return squares(whole, np.concatenate([values for _, values in data])), np.linalg.matrix_rank(whole)


@pytest.mark.parametrize(("seed", "blind"), [(0, ()), (1, ()), (2, (1,)), (3, (0, 2))])
def test_equal_is_what_is_lost_by_sharing(seed, blind):
    data = rows(seed, blind=blind)
    said = [Sums(x.T @ x, x.T @ y) for x, y in data]
    own = [0, 2]
    apart = sum(squares(x, y) for x, y in data)
    together, rank = shared(data, own)
    chi2, degrees, p_value = _equal(said, own)
    assert chi2 == pytest.approx(together - apart, rel=1e-6)
    assert degrees == sum(np.linalg.matrix_rank(x) for x, _ in data) - rank
    assert 0.0 <= p_value <= 1.0


def test_values_are_least_squares_and_what_is_not_seen_is_no_number():
    data = rows(5, campaigns=2, blind=(1,))
    said = [Sums(x.T @ x, x.T @ y) for x, y in data]
    told = [Parameter(f"p{k}", "rad", 1e-3, "joint", "", ()) for k in range(5)]
    found = _parameters(told, np.full(5, 1e-3), said, range(5), ["a", "b"])
    first = lstsq(*data[0])[0] * 1e-3
    spread = np.sqrt(np.diag(np.linalg.inv(data[0][0].T @ data[0][0]))) * 1e-3
    np.testing.assert_allclose([p.values[0] for p in found], first, rtol=1e-8)
    np.testing.assert_allclose([p.stds[0] for p in found], spread, rtol=1e-8)
    assert [p.values[1] is None for p in found] == [True, True, False, False, False]
    assert found[0].difference is None
    p = found[3]
    assert p.between == ("a", "b")
    assert p.difference == pytest.approx(p.values[1] - p.values[0])
    assert p.chi2 == pytest.approx((p.difference / p.std) ** 2)
    assert p.std == pytest.approx(np.hypot(*p.stds))


def test_equal_follows_the_law_of_chi_square():
    rng = np.random.default_rng(0)
    data = rows(7, campaigns=3)
    truth, drawn = rng.normal(size=5), []
    for _ in range(300):
        said = [Sums(x.T @ x, x.T @ (x @ truth + rng.normal(size=len(x)))) for x, _ in data]
        drawn.append(_equal(said, [1, 3])[2])
    # p values are even between 0 and 1: Kolmogorov's distance of 300 of them is below 0.094 in 99 % of cases
    assert np.abs(np.sort(drawn) - (np.arange(300) + 0.5) / 300).max() < 0.094
