"""Tolerance polygon and zonotope against enumeration of the corners; the uniform part: moments, tilings, draws."""

from itertools import product

import numpy as np
import pytest
from scipy.spatial import ConvexHull, Delaunay

from thermal_robot.assembly.probability import (
    UniformSpread,
    joining_probability,
    plane_axes,
    polygon_in_plane,
    zonotope,
)


def random_case(rng, dimension, count, kind):
    columns = rng.normal(size=(dimension, count))
    low = rng.normal(size=count)
    high = low + rng.uniform(0.2, 2.0, count)
    if kind == "parallel":
        columns[:, 1], columns[:, 3] = -2.0 * columns[:, 0], 0.5 * columns[:, 0]
    elif kind == "zero":
        columns[:, 2] = 0.0
        low[3] = high[3]
    elif kind == "coplanar":
        columns[:, 3] = columns[:, 0] + columns[:, 1]
        columns[:, 4] = columns[:, 0] - 2.0 * columns[:, 1]
    return columns, low, high


def corners_of(columns, low, high):
    return np.array(list(product(*zip(low, high, strict=True)))) @ columns.T


CASES = [(d, k, kind) for d in (2, 3) for k in (5, 8) for kind in ("general", "parallel", "zero", "coplanar")]


@pytest.mark.parametrize(("dimension", "count", "kind"), CASES)
def test_zonotope_is_the_hull_of_all_corners(dimension, count, kind):
    rng = np.random.default_rng(count + dimension)
    for _ in range(5):
        columns, low, high = random_case(rng, dimension, count, kind)
        body, corners = zonotope(columns, low, high), corners_of(columns, low, high)
        hull = ConvexHull(corners)
        assert body.content == pytest.approx(hull.volume, rel=1e-11)
        assert ConvexHull(body.vertices).volume == pytest.approx(hull.volume, rel=1e-11)
        assert len(ConvexHull(body.vertices).vertices) == len(body.vertices), "every vertex must be needed"
        assert body.farthest_distance == pytest.approx(np.max(np.linalg.norm(corners, axis=1)), rel=1e-14)
        np.testing.assert_allclose(body.corners @ columns.T, body.vertices, rtol=1e-13, atol=1e-13)
        assert np.all((body.corners == low) | (body.corners == high))


@pytest.mark.parametrize("kind", ["general", "parallel", "zero", "coplanar"])
def test_polygon_runs_counter_clockwise_from_its_lowest_vertex(kind):
    columns, low, high = random_case(np.random.default_rng(1), 2, 6, kind)
    vertices = zonotope(columns, low, high).vertices
    edges = np.roll(vertices, -1, axis=0) - vertices
    turns = edges[:, 0] * np.roll(edges, -1, axis=0)[:, 1] - edges[:, 1] * np.roll(edges, -1, axis=0)[:, 0]
    assert np.all(turns > 0.0)
    assert np.argmin(vertices[:, 1]) == 0
    x, y = vertices.T
    shoelace = 0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))
    assert zonotope(columns, low, high).area == pytest.approx(shoelace, rel=1e-12)


@pytest.mark.parametrize("kind", ["general", "parallel", "zero", "coplanar"])
def test_faces_close_the_body_and_look_outwards(kind):
    columns, low, high = random_case(np.random.default_rng(2), 3, 6, kind)
    body = zonotope(columns, low, high)
    edges = {}
    volume = 0.0
    for face in body.faces:
        points = body.vertices[list(face)]
        volume += sum(np.linalg.det(points[[0, i, i + 1]]) for i in range(1, len(face) - 1)) / 6.0
        for one, two in zip(face, face[1:] + face[:1], strict=True):
            edges[one, two] = edges.get((one, two), 0) + 1
    assert all(count == 1 and edges[two, one] == 1 for (one, two), count in edges.items())
    assert len(body.vertices) - len(edges) // 2 + len(body.faces) == 2, "Euler"
    assert body.volume == pytest.approx(volume, rel=1e-12)


def test_parallel_generators_leave_a_segment_and_none_a_point():
    for columns in ([[1.0, -2.0, 0.5], [2.0, -4.0, 1.0]], [[1.0, -2.0, 0.5], [2.0, -4.0, 1.0], [0.0, 0.0, 0.0]]):
        body = zonotope(columns, 0.0, 1.0)
        assert (len(body.vertices), body.content, body.faces) == (2, 0.0, ())
        assert body.farthest_distance == pytest.approx(2.0 * np.sqrt(5.0), rel=1e-14)
    for dimension in (2, 3):
        body = zonotope(np.zeros((dimension, 4)), -1.0, 1.0)
        np.testing.assert_array_equal(body.vertices, np.zeros((1, dimension)))
    assert zonotope(np.empty((2, 0)), 0.0, 1.0).farthest_distance == 0.0


def test_a_turned_box_is_a_box_and_a_flat_body_its_polygon():
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    body = zonotope(turn * [1.0, 2.0, 3.0], 0.0, 1.0)
    assert (len(body.vertices), len(body.faces)) == (8, 6)
    assert body.volume == pytest.approx(6.0, rel=1e-13)
    assert body.farthest_distance == pytest.approx(np.sqrt(14.0), rel=1e-14)
    columns = np.array([[1.0, 0.0, 1.0], [0.0, 1.0, 1.0], [0.0, 0.0, 0.0]])
    body = zonotope(columns, 0.0, 1.0)
    assert (len(body.vertices), body.volume) == (6, 0.0)
    assert body.farthest_distance == pytest.approx(np.sqrt(8.0), rel=1e-14)


def test_polygon_in_a_plane_is_the_shadow_of_the_body():
    columns, low, high = random_case(np.random.default_rng(4), 3, 5, "general")
    body = zonotope(columns, low, high)
    for plane in ("xy", "zx", np.array([1.0, 2.0, -0.5]), np.array([0.0, 0.0, 2.0]), np.eye(3)[[2, 0]]):
        shadow = polygon_in_plane(columns, low, high, plane)
        flat = body.vertices @ plane_axes(plane).T
        outline = flat[ConvexHull(flat).vertices]
        apart = np.linalg.norm(shadow.vertices[:, None] - outline, axis=2)
        np.testing.assert_allclose(apart.min(axis=0), 0.0, atol=1e-12)
        np.testing.assert_allclose(apart.min(axis=1), 0.0, atol=1e-12)


def test_axes_of_a_normal_are_right_handed_and_the_first_is_level():
    for normal in ([0.3, -0.4, 1.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]):
        first, second = plane_axes(normal)
        np.testing.assert_allclose(np.cross(first, second), np.array(normal) / np.linalg.norm(normal), atol=1e-15)
        assert first[2] == pytest.approx(0.0, abs=1e-15)


COLUMNS = np.array([[1.0, 0.3, 0.7, 0.2, -0.4], [0.2, 1.4, 0.6, -0.5, 0.3]])


@pytest.mark.parametrize("over", ["links", "area"])
def test_spread_has_the_moments_of_its_draws(over):
    columns = np.array([[1.0, 0.3, 0.7, 0.2], [0.2, 1.4, 0.6, -0.5]])
    spread = UniformSpread.zonotope(columns, [-1.0, 0.0, -0.5, 0.0], [1.0, 0.7, 0.5, 2.0], over=over)
    draws = spread.rvs(100_000, random_state=3)
    np.testing.assert_array_equal(draws[:5], spread.rvs(100_000, np.random.default_rng(3))[:5])
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
    # Triangles between the vertices: each holds its share of the area of the draws.
    triangles = Delaunay(body.vertices)
    areas = np.array([ConvexHull(body.vertices[t]).volume for t in triangles.simplices]) / body.area
    counted = np.bincount(triangles.find_simplex(draws), minlength=len(areas)) / len(draws)
    assert np.all(np.abs(counted - areas) < 5.0 * np.sqrt(areas * (1.0 - areas) / len(draws)))
    # Independent links prefer the middle: they are narrower.
    links = UniformSpread.zonotope(COLUMNS, -1.0, 1.0)
    assert np.all(np.linalg.eigvalsh(spread.covariance - links.covariance) > 0.0)


SQUARE = np.ones((2, 3))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: UniformSpread.box([-1.0, 1.0]), "not be negative"),
        (lambda: UniformSpread.box([1.0, 1.0], np.ones((2, 2))), "orthonormal"),
        (lambda: UniformSpread.box([1.0, np.inf]), "finite vector"),
        (lambda: UniformSpread.segment([[1.0, 2.0]]), "finite vector"),
        (lambda: UniformSpread.zonotope(COLUMNS, -1.0, 1.0, over="volume"), "'links' or 'area'"),
        (lambda: UniformSpread.zonotope([[1.0, 2.0], [2.0, 4.0]], -1.0, 1.0, over="area"), "without area"),
        (lambda: zonotope(COLUMNS, [0.0, 0.0, 0.0, 2.0, 0.0], 1.0), "for generator 3"),
        (lambda: zonotope(COLUMNS, np.zeros(4), 1.0), r"shape \(5,\)"),
        (lambda: zonotope(np.ones(3), 0.0, 1.0), "must be columns"),
        (lambda: zonotope(np.ones((4, 3)), 0.0, 1.0), "two or three rows"),
        (lambda: zonotope(SQUARE, np.nan, 1.0), "finite"),
        (lambda: zonotope(SQUARE, 0.0, np.inf), "finite"),
        (lambda: zonotope(SQUARE, 0.0, 1.0).volume, "a polygon has an area"),
        (lambda: zonotope(np.eye(3), 0.0, 1.0).area, "in space has a volume"),
        (lambda: polygon_in_plane(SQUARE, 0.0, 1.0, "xy"), "three rows"),
        *(
            (lambda plane=plane: polygon_in_plane(np.eye(3), 0.0, 1.0, plane), "plane")
            for plane in ("xx", "xw", "xyz", [0.0, 0.0, 0.0], np.ones((2, 3)), np.eye(2))
        ),
    ],
)
def test_what_is_impossible_is_refused(make, words):
    with pytest.raises(ValueError, match=words):
        make()
