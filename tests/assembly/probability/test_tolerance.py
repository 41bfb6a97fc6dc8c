"""Tolerance polygon and zonotope against brute-force enumeration of the corners."""

from itertools import product

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from thermal_robot.assembly.probability import plane_axes, polygon_in_plane, zonotope

ELONGATIONS = np.array([14.0, 5.0, 9.0, 7.0, 8.0])  # micrometres, for 3 K
POSES = {"a": (0.5235, 0.6981, -0.3490, -1.0471), "b": (0.5235, 0.8726, -1.3962, -1.0471)}


def sensitivities(q1, q2, q3, q4):
    """Equations 9-11 as columns: what one unit of every link's elongation does to x, y, z."""
    angles = np.cumsum([q2, q3, q4])
    forward = np.concatenate([[0.0, 1.0], np.cos(angles)])
    upward = np.concatenate([[1.0, 0.0], np.sin(angles)])
    return np.stack([np.sin(q1) * forward, np.cos(q1) * forward, upward])


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
        np.testing.assert_allclose(columns @ body.farthest_corner, body.farthest, rtol=1e-13, atol=1e-13)
        np.testing.assert_allclose(body.corners @ columns.T, body.vertices, rtol=1e-13, atol=1e-13)
        assert np.all((body.corners == low) | (body.corners == high))
        directions = rng.normal(size=(20, dimension))
        np.testing.assert_allclose(body.support(directions), np.max(directions @ corners.T, axis=1), rtol=1e-13)
        assert np.all(body.contains(corners))
        assert not np.any(body.contains(body.vertices + 1e-9 * (body.vertices - body.centre)))


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


def test_turned_box_is_a_box():
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    body = zonotope(turn * [1.0, 2.0, 3.0], 0.0, 1.0)
    assert (len(body.vertices), len(body.faces)) == (8, 6)
    assert body.volume == pytest.approx(6.0, rel=1e-13)
    assert body.farthest_distance == pytest.approx(np.sqrt(14.0), rel=1e-14)


def test_parallel_generators_leave_a_segment_and_none_a_point():
    for columns in ([[1.0, -2.0, 0.5], [2.0, -4.0, 1.0]], [[1.0, -2.0, 0.5], [2.0, -4.0, 1.0], [0.0, 0.0, 0.0]]):
        body = zonotope(columns, 0.0, 1.0)
        assert (len(body.vertices), body.content, body.faces) == (2, 0.0, ())
        assert body.farthest_distance == pytest.approx(2.0 * np.sqrt(5.0), rel=1e-14)
        middle = body.centre
        assert body.contains(middle)
        assert not body.contains(middle + np.eye(len(middle))[0] * 0.01)
    for dimension in (2, 3):
        body = zonotope(np.zeros((dimension, 4)), -1.0, 1.0)
        np.testing.assert_array_equal(body.vertices, np.zeros((1, dimension)))
        assert body.contains(np.zeros(dimension))
        assert not body.contains(np.full(dimension, 0.1))
    assert zonotope(np.empty((2, 0)), 0.0, 1.0).farthest_distance == 0.0


def test_flat_body_in_space_is_its_polygon():
    columns = np.array([[1.0, 0.0, 1.0], [0.0, 1.0, 1.0], [0.0, 0.0, 0.0]])
    body = zonotope(columns, 0.0, 1.0)
    assert (len(body.vertices), body.volume) == (6, 0.0)
    assert body.contains([1.0, 1.0, 0.0])
    assert not body.contains([1.0, 1.0, 0.01])
    assert body.farthest_distance == pytest.approx(np.sqrt(8.0), rel=1e-14)


@pytest.mark.parametrize(
    ("pose", "bound", "expected"), [("a", 0.0, 27.35), ("a", -1.0, 29.34), ("b", 0.0, 22.89), ("b", -1.0, 32.71)]
)
def test_figure_5_farthest_point_and_vertices(pose, bound, expected):
    body = polygon_in_plane(sensitivities(*POSES[pose]), bound * ELONGATIONS, ELONGATIONS, "yz")
    assert len(body.vertices) == 10
    assert body.farthest_distance == pytest.approx(expected, abs=0.005)


def test_polygon_in_a_plane_is_the_shadow_of_the_body():
    columns = sensitivities(*POSES["a"])
    body = zonotope(columns, 0.0, ELONGATIONS)
    for plane in ("xy", "zx", np.array([1.0, 2.0, -0.5]), np.array([0.0, 0.0, 2.0]), np.eye(3)[[2, 0]]):
        shadow = polygon_in_plane(columns, 0.0, ELONGATIONS, plane)
        flat = body.vertices @ plane_axes(plane).T
        assert np.all(shadow.contains(flat))
        directions = np.random.default_rng(3).normal(size=(30, 2))
        np.testing.assert_allclose(shadow.support(directions), np.max(directions @ flat.T, axis=1), atol=1e-12)


def test_axes_of_a_normal_are_right_handed_and_the_first_is_level():
    for normal in ([0.3, -0.4, 1.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]):
        first, second = plane_axes(normal)
        np.testing.assert_allclose(np.cross(first, second), np.array(normal) / np.linalg.norm(normal), atol=1e-15)
        assert first[2] == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize(
    ("columns", "low", "high"),
    [
        (np.ones(3), 0.0, 1.0),
        (np.ones((4, 3)), 0.0, 1.0),
        (np.ones((2, 3)), 1.0, 0.0),
        (np.ones((2, 3)), np.zeros(2), 1.0),
        (np.full((2, 3), np.nan), 0.0, 1.0),
        (np.ones((2, 3)), 0.0, np.inf),
    ],
)
def test_impossible_bounds_are_refused(columns, low, high):
    with pytest.raises(ValueError, match=r"generators|bound|lower|upper"):
        zonotope(columns, low, high)


@pytest.mark.parametrize("plane", ["xx", "xw", "xyz", [0.0, 0.0, 0.0], np.ones((2, 3)), np.eye(2)])
def test_impossible_planes_are_refused(plane):
    with pytest.raises(ValueError, match="plane"):
        polygon_in_plane(np.eye(3), 0.0, 1.0, plane)
