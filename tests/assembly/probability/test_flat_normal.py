"""The flat-normal distribution: its limits, quantiles, moments and draws, and Eqs 18 and 20."""

import numpy as np
import pytest
from scipy import stats

from thermal_robot.assembly.probability import FlatNormal, eq18_printed_area, flat_normal


def test_no_uniform_part_is_normal_and_no_normal_part_is_uniform():
    x = np.array([-40.0, -5.0, -0.5, 0.0, 0.2, 3.0, 12.0])
    normal, flat = stats.norm(1.0, 2.0), stats.uniform(-2.0, 6.0)
    for name in ("pdf", "cdf", "sf", "logpdf", "logsf", "logcdf"):
        np.testing.assert_allclose(getattr(FlatNormal(2.0, 0.0, 1.0), name)(x), getattr(normal, name)(x), rtol=1e-13)
        np.testing.assert_allclose(getattr(FlatNormal(0.0, 3.0, 1.0), name)(x), getattr(flat, name)(x), rtol=1e-13)
    # The limits are approached at the rate of r**4 and 1/r, without a jump before.
    np.testing.assert_allclose(FlatNormal(2.0, 1e-5, 1.0).pdf(x), normal.pdf(x), rtol=1e-8)
    np.testing.assert_allclose(FlatNormal(1e-9, 3.0, 1.0).cdf(x), flat.cdf(x), rtol=1e-12)


def test_edge_of_a_nearly_uniform_law_has_half_the_plateau():
    assert FlatNormal(1e-9, 3.0).pdf(3.0) == pytest.approx(0.5 / 6.0, rel=1e-12)
    assert FlatNormal(0.0, 3.0).support() == pytest.approx((-3.0, 3.0))


@pytest.mark.parametrize(("sigma", "half_width"), [(1.0, 0.0), (1.0, 1e-6), (1.0, 0.7), (1.0, 3.0), (0.01, 1.0)])
def test_quantiles_undo_the_distribution_function(sigma, half_width):
    law = FlatNormal(sigma, half_width)
    shares = np.array([1e-300, 1e-100, 1e-12, 1e-3, 0.2, 0.4999, 0.5, 0.7, 0.99])
    with np.errstate(all="raise", under="ignore"):
        np.testing.assert_allclose(law.sf(law.isf(shares)), shares, rtol=3e-11)
        np.testing.assert_allclose(law.cdf(law.ppf(shares)), shares, rtol=3e-11)
    assert law.ppf(0.5) == 0.0
    np.testing.assert_array_equal(law.ppf([0.0, 1.0]), [-np.inf, np.inf])


def test_uniform_quantiles_are_those_of_the_uniform():
    np.testing.assert_allclose(FlatNormal(0.0, 3.0, 1.0).ppf([0.0, 0.25, 1.0]), [-2.0, -0.5, 4.0], rtol=1e-14)


@pytest.mark.parametrize("r", [0.0, 0.5, 2.0, np.inf])
def test_moments_are_those_of_the_density(r):
    mean, variance, skewness, kurtosis = flat_normal.stats(r, moments="mvsk")
    assert (mean, variance, skewness) == (0.0, 1.0, 0.0)
    x, weights = np.polynomial.legendre.leggauss(400)
    half = np.sqrt(3.0) if np.isinf(r) else 12.0
    values = half * weights * flat_normal.pdf(half * x, r)
    for order in (1, 2, 3, 4, 6, 8):
        assert flat_normal.moment(order, r) == pytest.approx(values @ (half * x) ** order, rel=1e-11, abs=1e-12)
    assert kurtosis == pytest.approx(values @ (half * x) ** 4 - 3.0, abs=1e-11)
    entropy = -float(values @ flat_normal.logpdf(half * x, r))
    assert flat_normal.entropy(r) == pytest.approx(entropy, rel=1e-11)


def test_given_parts_have_the_variance_of_equation_20():
    law = FlatNormal(0.018, 0.016, 0.002)
    assert law.mean() == pytest.approx(0.002, rel=1e-14)
    assert law.var() == pytest.approx(0.018**2 + 0.016**2 / 3.0, rel=1e-14)
    assert law.var() == pytest.approx(4.09e-4, abs=0.005e-4)
    assert float(law.r) == pytest.approx(0.513, abs=0.0005)


def test_equation_18_as_printed_has_not_the_area_one():
    r, (x, weights) = 0.7, np.polynomial.legendre.leggauss(200)
    edge = np.sqrt(3.0) * r
    inner = np.sqrt(2.0 * np.pi) * (stats.norm.cdf(12.0 * x + edge) - stats.norm.cdf(12.0 * x - edge))
    assert 12.0 * weights @ inner / (2.0 * np.sqrt(6.0) * np.pi * r) == pytest.approx(eq18_printed_area(), rel=1e-12)
    assert 12.0 * weights @ inner / (2.0 * np.sqrt(6.0 * np.pi) * r) == pytest.approx(1.0, rel=1e-12)
    assert eq18_printed_area() == pytest.approx(0.5642, abs=5e-5)


def test_draws_follow_the_law():
    law = FlatNormal(1.0, 3.0, 2.0)
    sample = law.rvs(size=20_000, random_state=1)
    # Kolmogorov's distance exceeds 2.95 / sqrt(n) with probability 5e-8, that of five standard deviations.
    assert stats.kstest(sample, law.cdf).statistic < 2.95 / np.sqrt(20_000)


@pytest.mark.parametrize("parts", [(0.0, 0.0), (-1.0, 1.0), (1.0, -1.0), (np.inf, 1.0), (np.nan, 1.0)])
def test_impossible_parts_are_refused(parts):
    with pytest.raises(ValueError, match="sigma and half_width"):
        FlatNormal(*parts)
