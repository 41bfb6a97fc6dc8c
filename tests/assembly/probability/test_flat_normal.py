"""The flat-normal distribution: limits, quantiles, moments, draws and fit, Eqs 18 and 20; in the plane and in space."""

from itertools import product

import numpy as np
import pytest
from scipy import stats

from thermal_robot.assembly.probability import (
    FlatNormal,
    UniformSpread,
    flat_normal,
    flat_normal_nd,
    joining_probability,
)
from thermal_robot.errors import EstimationError


def test_no_uniform_part_is_normal_and_no_normal_part_is_uniform():
    x = np.array([-40.0, -5.0, -0.5, 0.0, 0.2, 3.0, 12.0])
    normal, flat = stats.norm(1.0, 2.0), stats.uniform(-2.0, 6.0)
    for name in ("pdf", "cdf", "sf", "logpdf", "logsf", "logcdf"):
        np.testing.assert_allclose(getattr(FlatNormal(2.0, 0.0, 1.0), name)(x), getattr(normal, name)(x), rtol=1e-13)
        np.testing.assert_allclose(getattr(FlatNormal(0.0, 3.0, 1.0), name)(x), getattr(flat, name)(x), rtol=1e-13)
    # The limits are approached at the rate of r**4 and 1/r, without a jump before.
    np.testing.assert_allclose(FlatNormal(2.0, 1e-5, 1.0).pdf(x), normal.pdf(x), rtol=1e-8)
    np.testing.assert_allclose(FlatNormal(1e-9, 3.0, 1.0).cdf(x), flat.cdf(x), rtol=1e-12)
    assert FlatNormal(1e-9, 3.0).pdf(3.0) == pytest.approx(0.5 / 6.0, rel=1e-12)  # the edge has half the plateau
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
    assert 12.0 * weights @ inner / (2.0 * np.sqrt(6.0) * np.pi * r) == pytest.approx(1.0 / np.sqrt(np.pi), rel=1e-12)


def test_draws_follow_the_law():
    law = FlatNormal(1.0, 3.0, 2.0)
    sample = law.rvs(size=20_000, random_state=1)
    # Kolmogorov's distance exceeds 2.95 / sqrt(n) with probability 5e-8, that of five standard deviations.
    assert stats.kstest(sample, law.cdf).statistic < 2.95 / np.sqrt(20_000)


@pytest.mark.parametrize("parts", [(0.0, 0.0), (-1.0, 1.0), (1.0, -1.0), (np.inf, 1.0), (np.nan, 1.0)])
def test_impossible_parts_are_refused(parts):
    with pytest.raises(ValueError, match="sigma and half_width"):
        FlatNormal(*parts)


def likelihood(sample, law):
    return float(np.sum(flat_normal.logpdf(sample, *law)))


@pytest.mark.parametrize("truth", [(1.0, 0.0), (1.0, 2.0), (0.05, 1.0), (0.0, 1.0)])
def test_fit_reaches_a_likelihood_no_smaller_than_truth_limits_and_neighbours(truth):
    law = FlatNormal(*truth)
    sample = law.rvs(size=300, random_state=5)
    found = flat_normal.fit(sample)
    best = likelihood(sample, found)
    assert best >= float(np.sum(law.logpdf(sample))) - 1e-9
    assert best >= float(np.sum(stats.norm(sample.mean(), sample.std()).logpdf(sample))) - 1e-9
    assert best >= -300.0 * np.log(np.ptp(sample)) - 1e-6
    for k, step in product(range(3), (-1e-2, -1e-3, 1e-3, 1e-2)):
        if 0.0 < found[0] < np.inf:
            assert likelihood(sample, [v + step * (j == k) for j, v in enumerate(found)]) < best


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
    for ratio in (0.0, 1.0, np.inf):
        assert flat_normal.fit(sample, f0=ratio, floc=0.5, fscale=2.0) == pytest.approx((ratio, 0.5, 2.0), rel=1e-12)
    with pytest.raises(TypeError, match="unknown arguments"):
        flat_normal.fit(sample, fshape=1.0)
    with pytest.raises(ValueError, match="'MLE' or 'MM'"):
        flat_normal.fit(sample, method="guess")


@pytest.mark.parametrize("sample", [[1.0, 2.0, 3.0], [1.0] * 9, [1.0, 2.0, np.nan, 3.0, 4.0]])
def test_fit_refuses_what_determines_nothing(sample):
    with pytest.raises(EstimationError):
        flat_normal.fit(sample)


@pytest.mark.parametrize("r", [0.0, 0.7, 2.0, np.inf])
def test_moments_of_a_law_give_its_ratio_back(r):
    # Quantiles at even shares stand for the law itself: a sample without chance.
    sample = flat_normal(r, 5.0, 3.0).ppf((np.arange(40_000) + 0.5) / 40_000)
    found, mean, scale = flat_normal.fit(sample, method="MM")
    assert (mean, scale) == pytest.approx((5.0, 3.0), rel=1e-3)
    # The share of the uniform variance; its slope against the kurtosis is infinite at r = 0.
    share, expected = (1.0 if np.isinf(x) else x**2 / (1.0 + x**2) for x in (found, r))
    assert share == pytest.approx(expected, abs=0.05 if r == 0.0 else 5e-3)


@pytest.mark.parametrize("method", ["MM", "MLE"])
def test_fit_moves_with_the_sample(method):
    sample = FlatNormal(1.0, 3.0).rvs(size=150, random_state=3)
    r, mean, scale = flat_normal.fit(sample, method=method)
    moved = flat_normal.fit(40.0 - 1e-5 * sample, method=method)
    assert moved[0] == pytest.approx(r, rel=1e-4)
    assert moved[1] == pytest.approx(40.0 - 1e-5 * mean, abs=1e-10)
    assert moved[2] == pytest.approx(1e-5 * scale, rel=1e-5)


COVARIANCE = np.array([[1.0, 0.4], [0.4, 0.5]])
COLUMNS = np.array([[0.5, 0.2, 1.0, -0.3], [0.1, 0.6, 0.2, 0.4]])
SPREADS = {
    "segment": UniformSpread.segment([0.8, -0.5], [0.2, 0.1]),
    "box": UniformSpread.box([0.7, 1.3], np.array([[0.6, -0.8], [0.8, 0.6]])),
    "links": UniformSpread.zonotope(COLUMNS, -1.0, [0.5, 1.0, 0.0, 1.0]),
    "area": UniformSpread.zonotope(COLUMNS, -1.0, [0.5, 1.0, 0.0, 1.0], over="area"),
}


def grid(law, count=48, reach=8.0):
    """Points and weights of a product rule about the mean."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    scale = reach * np.sqrt(np.diag(law.covariance))
    points = np.stack(np.meshgrid(nodes, nodes, indexing="ij"), -1).reshape(-1, 2) * scale + law.mean
    return points, np.outer(weights, weights).ravel() * np.prod(scale)


@pytest.mark.parametrize("name", SPREADS)
def test_density_has_area_one_and_the_exact_moments(name):
    law = flat_normal_nd(COVARIANCE, SPREADS[name], [0.3, -0.2])
    points, weights = grid(law)
    mass = weights * law.pdf(points)
    assert mass.sum() == pytest.approx(1.0, abs=1e-12)
    np.testing.assert_allclose(mass @ points, law.mean, atol=1e-12)
    offsets = points - law.mean
    np.testing.assert_allclose((offsets.T * mass) @ offsets, law.covariance, atol=1e-12)


@pytest.mark.parametrize("name", SPREADS)
def test_disc_probability_is_the_integral_of_the_density(name):
    law = flat_normal_nd(COVARIANCE, SPREADS[name])
    radius, angle = np.meshgrid(*(np.polynomial.legendre.leggauss(n)[0] for n in (24, 40)), indexing="ij")
    weights = np.outer(*(np.polynomial.legendre.leggauss(n)[1] for n in (24, 40)))
    radius, angle = 0.8 * (radius + 1.0), np.pi * angle
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle)], -1)
    integral = np.sum(weights * 0.8 * np.pi * radius * law.pdf(points))
    assert joining_probability(COVARIANCE, 3.2, thermal=SPREADS[name]) == pytest.approx(integral, abs=1e-12)


@pytest.mark.parametrize("dimension", [2, 3])
def test_independent_axes_are_a_product_far_into_the_tails(dimension):
    deviations, half = np.array([1.0, 0.3, 2.0])[:dimension], np.array([0.5, 1.0, 4.0])[:dimension]
    law = flat_normal_nd(np.diag(deviations**2), UniformSpread.box(half))
    x = np.array([[0.0, 0.0, 0.0], [20.0, -9.0, 30.0], [-70.0, 1.0, 0.2]])[:, :dimension]
    expected = sum(FlatNormal(s, a).logpdf(x[:, k]) for k, (s, a) in enumerate(zip(deviations, half, strict=True)))
    np.testing.assert_allclose(law.logpdf(x), expected, rtol=1e-13)


def test_segment_in_space_is_flat_normal_along_it_and_normal_across():
    end = np.array([1.0, 2.0, -2.0])
    law = flat_normal_nd(0.25 * np.eye(3), UniformSpread.segment(end))
    along, across = end / 3.0, np.array([2.0, 1.0, 2.0]) / 3.0
    t = np.array([0.0, 2.9, 8.0, 17.0])
    expected = FlatNormal(0.5, 3.0).logpdf(t) - 0.5 * (0.4 / 0.5) ** 2 - np.log(2.0 * np.pi * 0.25)
    np.testing.assert_allclose(law.logpdf(t[:, None] * along + 0.4 * across), expected, rtol=1e-13)


def test_zonotope_in_space_has_the_moments_of_its_draws_and_a_density_of_area_one():
    columns = np.array([[0.5, 0.2, 1.0, -0.3], [0.1, 0.6, 0.2, 0.4], [0.3, 0.0, 0.1, 0.9]])
    nodes, weights = np.polynomial.hermite_e.hermegauss(14)
    # What lies opposite has the same density, so that half of the space counts twice.
    half = nodes > 0.0
    units = np.stack(np.meshgrid(nodes[half], nodes, nodes, indexing="ij"), -1).reshape(-1, 3)
    shares = 2.0 * np.einsum("i,j,k->ijk", weights[half], weights, weights).ravel() * np.exp(0.5 * np.sum(units**2, 1))
    for over in ("links", "area"):
        law = flat_normal_nd(np.diag([0.5, 0.8, 0.6]), UniformSpread.zonotope(columns, -1.0, 1.0, over=over))
        root = np.linalg.cholesky(law.covariance)
        points = units @ root.T
        density = law.pdf(points)
        np.testing.assert_allclose(law.pdf(-points[::100]), density[::100], rtol=1e-10)
        mass = shares * density * np.linalg.det(root)
        assert mass.sum() == pytest.approx(1.0, abs=1e-6)
        np.testing.assert_allclose((points.T * mass) @ points, law.covariance, atol=1e-5)
        draws = law.rvs(50_000, random_state=2)
        limit = 5.0 * np.sqrt(2.0 / 50_000) * law.covariance.max()
        np.testing.assert_allclose(np.cov(draws.T), law.covariance, atol=limit)


def test_one_coordinate_of_a_box_probability_is_the_flat_normal():
    law = flat_normal_nd(COVARIANCE, UniformSpread.segment([0.8, 0.0]), [0.3, 0.1])
    line = FlatNormal(1.0, 0.8, 0.3)
    for bound in (-3.0, 0.0, 0.7):
        value = law.box_probability([-np.inf, -np.inf], [bound, np.inf])
        assert value == pytest.approx(float(line.cdf(bound)), rel=1e-12)


def test_what_has_no_density_is_refused():
    segment = UniformSpread.segment([1.0, 0.0])
    for matrix in (np.ones((2, 2)), np.zeros((2, 2)), np.eye(3), np.array([[1.0, 0.3], [0.2, 1.0]])):
        with pytest.raises(ValueError, match="covariance"):
            flat_normal_nd(matrix, segment)
    law = flat_normal_nd(np.eye(2), segment)
    for ask, words in (
        (lambda: law.pdf(np.zeros(3)), r"shape \(\.\.\., 2\)"),
        (lambda: law.box_probability([0.0, 0.0], [-1.0, 1.0]), "above its upper"),
        (lambda: flat_normal_nd(np.eye(3), UniformSpread.box([1.0] * 3)).box_probability(0.0, 1.0), "for the plane"),
    ):
        with pytest.raises(ValueError, match=words):
            ask()
