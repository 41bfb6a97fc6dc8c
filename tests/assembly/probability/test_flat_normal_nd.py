"""Flat-normal in the plane and in space: area, moments, products, and what one coordinate of it is."""

import numpy as np
import pytest

from thermal_robot.assembly.probability import FlatNormal, UniformSpread, flat_normal_nd, joining_probability

COVARIANCE = np.array([[1.0, 0.4], [0.4, 0.5]])
COLUMNS = np.array([[0.5, 0.2, 1.0, -0.3], [0.1, 0.6, 0.2, 0.4]])
SPREADS = {
    "segment": UniformSpread.segment([0.8, -0.5], [0.2, 0.1]),
    "box": UniformSpread.box([0.7, 1.3], np.array([[0.6, -0.8], [0.8, 0.6]])),
    "links": UniformSpread.zonotope(COLUMNS, -1.0, [0.5, 1.0, 0.0, 1.0]),
    "area": UniformSpread.zonotope(COLUMNS, -1.0, [0.5, 1.0, 0.0, 1.0], over="area"),
}


def grid(law, count=64, reach=8.0):
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
    with pytest.raises(ValueError, match="without area"):
        UniformSpread.zonotope([[1.0, 2.0], [2.0, 4.0]], -1.0, 1.0, over="area")
    with pytest.raises(ValueError, match="narrow"):
        joining_probability(
            1e-8 * np.eye(2), 1.0, thermal=UniformSpread.zonotope(np.eye(2)[:, [0, 1, 0, 1]], -1.0, 1.0)
        )
