"""The uniform part of an error: moments, tilings and draws of segments, boxes and zonotopes."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull, Delaunay

from thermal_robot.assembly.probability import UniformSpread, joining_probability, zonotope
from thermal_robot.assembly.probability.spread import generator_bounds

COLUMNS = np.array([[1.0, 0.3, 0.7, 0.2, -0.4], [0.2, 1.4, 0.6, -0.5, 0.3]])


@pytest.mark.parametrize("over", ["links", "area"])
def test_spread_has_the_moments_of_its_draws(over):
    columns = np.array([[1.0, 0.3, 0.7, 0.2], [0.2, 1.4, 0.6, -0.5]])
    spread = UniformSpread.zonotope(columns, [-1.0, 0.0, -0.5, 0.0], [1.0, 0.7, 0.5, 2.0], over=over)
    draws = spread.rvs(100_000, random_state=3)
    error = np.sqrt(np.diag(spread.covariance) / 100_000)
    assert np.all(np.abs(draws.mean(axis=0) - spread.mean) < 5.0 * error)
    # Bounded variables: the standard error of a variance is below its own size times sqrt(2 / n).
    np.testing.assert_allclose(np.cov(draws.T), spread.covariance, atol=5.0 * np.sqrt(2e-5) * spread.covariance.max())
    inside = joining_probability(0.25 * np.eye(2), 3.0, -spread.mean, thermal=spread)
    noisy = draws - spread.mean + 0.5 * np.random.default_rng(8).normal(size=draws.shape)
    counted = np.mean(np.hypot(*noisy.T) < 1.5)
    assert abs(counted - inside) < 5.0 * np.sqrt(inside * (1.0 - inside) / 100_000)


def test_a_segment_runs_from_start_to_end():
    spread = UniformSpread.segment([3.0, 1.0], [1.0, -3.0])
    np.testing.assert_allclose(spread.mean, [2.0, -1.0])
    draws = spread.rvs(2000, 0)
    along = (draws - [1.0, -3.0]) @ np.array([2.0, 4.0]) / 20.0
    assert np.all((along >= 0.0) & (along <= 1.0))
    np.testing.assert_allclose(draws, np.array([1.0, -3.0]) + along[:, None] * [2.0, 4.0], atol=1e-14)
    np.testing.assert_array_equal(UniformSpread.segment([1.0, 2.0]).mean, 0.0)


def test_variance_of_an_edge_is_a_third_of_its_half_length_squared():
    # Eq 19: ±16 µm has (32 µm)²/12; and three axes do not mix.
    np.testing.assert_allclose(UniformSpread.box([16.0, 0.0, 3.0]).covariance, np.diag([32.0**2, 0.0, 36.0]) / 12.0)
    turn = np.array([[0.6, -0.8], [0.8, 0.6]])
    turned = UniformSpread.box([2.0, 1.0], turn)
    np.testing.assert_allclose(turned.covariance, turn @ np.diag([4.0, 1.0]) @ turn.T / 3.0, rtol=1e-13)
    assert turned.dimension == 2


@pytest.mark.parametrize("dimension", [2, 3])
def test_tiles_fill_the_zonotope_once(dimension):
    rng = np.random.default_rng(dimension)
    columns, low, high = rng.normal(size=(dimension, 5)), -rng.uniform(size=5), rng.uniform(size=5)
    spread, body = UniformSpread.zonotope(columns, low, high, over="area"), zonotope(columns, low, high)
    contents = [2.0**dimension * abs(np.linalg.det(piece.generators)) for piece in spread.pieces]
    assert sum(contents) == pytest.approx(body.content, rel=1e-12)
    np.testing.assert_allclose([p.weight for p in spread.pieces], np.array(contents) / body.content, rtol=1e-11)
    # No point lies in two tiles, and every point in one.
    vertices = body.vertices
    inside = rng.dirichlet(np.ones(len(vertices)), 500) @ vertices
    held = np.zeros(500)
    for piece in spread.pieces:
        held += np.all(np.abs(np.linalg.solve(piece.generators, (inside - piece.centre).T)) < 1.0, axis=0)
    np.testing.assert_array_equal(held, 1.0)


def test_uniform_over_the_area_is_uniform():
    spread = UniformSpread.zonotope(COLUMNS, -1.0, 1.0, over="area")
    draws, body = spread.rvs(40_000, 1), zonotope(COLUMNS, -1.0, 1.0)
    assert np.all(body.contains(draws))
    # Triangles between the vertices: each holds its share of the area of the draws.
    triangles = Delaunay(body.vertices)
    areas = np.array([ConvexHull(body.vertices[t]).volume for t in triangles.simplices]) / body.area
    counted = np.bincount(triangles.find_simplex(draws), minlength=len(areas)) / len(draws)
    assert np.all(np.abs(counted - areas) < 5.0 * np.sqrt(areas * (1.0 - areas) / len(draws)))
    # Independent links prefer the middle: they are narrower.
    links = UniformSpread.zonotope(COLUMNS, -1.0, 1.0)
    assert np.all(np.linalg.eigvalsh(spread.covariance - links.covariance) > 0.0)


def test_two_generators_are_the_same_over_links_and_over_the_area():
    one, two = (UniformSpread.zonotope(COLUMNS[:, :2], -1.0, [0.5, 1.0], over=over) for over in ("links", "area"))
    np.testing.assert_allclose(one.mean, two.mean, rtol=1e-13)
    np.testing.assert_allclose(one.covariance, two.covariance, rtol=1e-13)


def test_bounds_without_width_leave_a_point():
    spread = UniformSpread.zonotope(COLUMNS, 0.3, 0.3)
    np.testing.assert_allclose(spread.mean, 0.3 * COLUMNS.sum(axis=1), rtol=1e-14)
    np.testing.assert_array_equal(spread.covariance, 0.0)
    np.testing.assert_allclose(spread.rvs(3, 0), np.tile(spread.mean, (3, 1)))


def test_a_seed_repeats_a_draw():
    spread = UniformSpread.zonotope(COLUMNS, -1.0, 1.0, over="area")
    np.testing.assert_array_equal(spread.rvs(20, 5), spread.rvs(20, np.random.default_rng(5)))
    assert not np.array_equal(spread.rvs(20, 5), spread.rvs(20, 6))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: UniformSpread.box([-1.0, 1.0]), "not be negative"),
        (lambda: UniformSpread.box([1.0, 1.0], np.ones((2, 2))), "orthonormal"),
        (lambda: UniformSpread.box([1.0, np.inf]), "finite vector"),
        (lambda: UniformSpread.segment([[1.0, 2.0]]), "finite vector"),
        (lambda: UniformSpread.zonotope(COLUMNS, -1.0, 1.0, over="volume"), "'links' or 'area'"),
        (lambda: UniformSpread.zonotope([[1.0, 2.0], [2.0, 4.0]], -1.0, 1.0, over="area"), "without area"),
        (lambda: generator_bounds(COLUMNS, [0.0, 0.0, 0.0, 2.0, 0.0], 1.0), "for generator 3"),
        (lambda: generator_bounds(COLUMNS, np.zeros(4), 1.0), r"shape \(5,\)"),
        (lambda: generator_bounds(COLUMNS[0], 0.0, 1.0), "must be columns"),
        (lambda: generator_bounds(COLUMNS, np.nan, 1.0), "finite"),
    ],
)
def test_impossible_parts_are_refused(make, words):
    with pytest.raises(ValueError, match=words):
        make()
