"""The flat-normal distribution against mpmath, its limits, its quantiles and its fit."""

import mpmath as mp
import numpy as np
import pytest
from scipy import stats

from thermal_robot.assembly.probability import FlatNormal, eq18_printed_area, flat_normal
from thermal_robot.assembly.probability.kernels import density, inside_probability, log_density, log_tail, tail
from thermal_robot.errors import EstimationError

RATIOS = [1e-8, 1e-3, 0.05, 0.3, 0.58, 1.0, 1.7, 3.0, 1e3, 1e6]


def exact(x, sigma, half_width):
    """Density at ``x`` and P(X > x), by the two-term formulas in 700 digits, which survive their cancellation."""
    with mp.workdps(700):
        x, sigma, half_width = map(mp.mpf, (x, sigma, half_width))
        edges = (x + half_width) / sigma, (x - half_width) / sigma
        upper, lower = (mp.erfc(e / mp.sqrt(2)) / 2 for e in edges)
        value = (lower - upper) / (2 * half_width)
        # The integral of the upper tail from e on: phi(e) - e Q(e).
        far, near = (mp.npdf(e) - e * q for e, q in zip(edges, (upper, lower), strict=True))
        return value, sigma * (near - far) / (2 * half_width)


@pytest.mark.parametrize("ratio", RATIOS)
def test_density_and_tails_are_right_to_twelve_digits_however_far_out(ratio):
    half_width = float(np.sqrt(3.0) * ratio)
    for z in (0.0, 0.3, 0.9, 2.4, 3.9, 4.1, 8.0, 25.0, 36.0):
        for x in (z, half_width + z, abs(half_width - z)):
            value, beyond = exact(x, 1.0, half_width)
            if beyond < mp.mpf("1e-300"):
                continue
            assert abs(density(x, 1.0, half_width) / value - 1) < 1e-12
            assert abs(tail(x, 1.0, half_width) / beyond - 1) < 1e-12
            assert abs(density(-x, 1.0, half_width) / value - 1) < 1e-12
            assert abs(tail(-x, 1.0, half_width) + float(beyond) - 1.0) < 1e-15


@pytest.mark.parametrize("ratio", [1e-3, 1.0, 10.0])
def test_logarithms_go_on_where_numbers_underflow(ratio):
    half_width = float(np.sqrt(3.0) * ratio)
    x = half_width + 60.0  # the tail is about exp(-1800)
    value, beyond = exact(x, 1.0, half_width)
    assert tail(x, 1.0, half_width) == 0.0
    assert abs(log_density(x, 1.0, half_width) / mp.log(value) - 1) < 1e-14
    assert abs(log_tail(x, 1.0, half_width) / mp.log(beyond) - 1) < 1e-14


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


@pytest.mark.parametrize("half_width", [0.0, 0.4, 5.0])
def test_short_intervals_keep_their_digits(half_width):
    low, high = np.array([0.3, -2e-9, 7.0]), np.array([0.3 + 1e-9, 1e-9, 7.0 + 1e-7])
    value = inside_probability(low, high, 1.0, half_width)
    expected = density(0.5 * (low + high), 1.0, half_width) * (high - low)
    np.testing.assert_allclose(value, expected, rtol=1e-12)


def test_draws_follow_the_law():
    law = FlatNormal(1.0, 3.0, 2.0)
    sample = law.rvs(size=20_000, random_state=1)
    # Kolmogorov's distance exceeds 2.95 / sqrt(n) with probability 5e-8, that of five standard deviations.
    assert stats.kstest(sample, law.cdf).statistic < 2.95 / np.sqrt(20_000)


def test_fit_finds_the_parts_of_a_large_sample():
    truth = FlatNormal(1.0, 3.0, 2.0)
    found = FlatNormal.fitted(truth.rvs(size=5000, random_state=1))
    # Standard errors by the curvature of the likelihood are 0.03, 0.03 and 0.03.
    assert float(found.sigma) == pytest.approx(1.0, abs=0.15)
    assert float(found.half_width) == pytest.approx(3.0, abs=0.15)
    assert found.mean() == pytest.approx(2.0, abs=0.15)


def test_fit_reaches_a_likelihood_no_smaller_than_the_truth_and_the_limits():
    for seed, truth in enumerate(
        (FlatNormal(1.0, 0.0), FlatNormal(1.0, 2.0), FlatNormal(0.05, 1.0), FlatNormal(0.0, 1.0))
    ):
        sample = truth.rvs(size=300, random_state=seed)
        best = float(np.sum(flat_normal.logpdf(sample, *flat_normal.fit(sample))))
        assert best >= float(np.sum(truth.logpdf(sample))) - 1e-9
        assert best >= float(np.sum(stats.norm(sample.mean(), sample.std()).logpdf(sample))) - 1e-9
        assert best >= -300.0 * np.log(np.ptp(sample)) - 1e-6


def test_fit_of_a_peaked_sample_is_the_normal_limit():
    sample = np.random.default_rng(0).standard_t(4, size=500)
    r, loc, scale = flat_normal.fit(sample)
    assert r == 0.0
    assert (loc, scale) == pytest.approx((sample.mean(), sample.std()), rel=1e-12)
    assert flat_normal.fit(sample, method="MM")[0] == 0.0


def test_fit_holds_what_it_is_told():
    sample = FlatNormal(1.0, 3.0, 2.0).rvs(size=200, random_state=1)
    assert flat_normal.fit(sample, fr=1.0, floc=2.0)[:2] == pytest.approx((1.0, 2.0), rel=1e-12)
    assert flat_normal.fit(sample, fscale=1.9)[2] == pytest.approx(1.9, rel=1e-12)


@pytest.mark.parametrize("sample", [[1.0, 2.0, 3.0], [1.0] * 9, [1.0, 2.0, np.nan, 3.0, 4.0]])
def test_fit_refuses_what_determines_nothing(sample):
    with pytest.raises(EstimationError):
        flat_normal.fit(sample)


@pytest.mark.parametrize("parts", [(0.0, 0.0), (-1.0, 1.0), (1.0, -1.0), (np.inf, 1.0), (np.nan, 1.0)])
def test_impossible_parts_are_refused(parts):
    with pytest.raises(ValueError, match="sigma and half_width"):
        FlatNormal(*parts)
