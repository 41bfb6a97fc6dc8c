"""Joining probability against mpmath at hard points, closed forms, limits and invariances."""

from functools import partial

import mpmath as mp
import numpy as np
import pytest
from helpers import some

from thermal_robot.assembly.probability import UniformSpread, failing_probability, joining_probability
from thermal_robot.assembly.probability.joining import link_nodes, planar_link_nodes


def turned(angle):
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def covariance(ratio, rho):
    deviations = np.array([1.0, 1.0 / np.sqrt(ratio)])
    return np.outer(deviations, deviations) * np.array([[1.0, rho], [rho, 1.0]])


def upper(x):
    return mp.erfc(x / mp.sqrt(2)) / 2


def exact_disc(matrix, clearance, mean):
    """Inside and outside, integrated over the coordinate along the *shorter* axis (the code takes the longer one)."""
    with mp.workdps(34):
        a, b, c = (mp.mpf(float(v)) for v in (matrix[0, 0], matrix[0, 1], matrix[1, 1]))
        radius, m = mp.mpf(float(clearance)) / 2, [mp.mpf(float(v)) for v in mean]
        angle = mp.atan2(2 * b, a - c) / 2
        large = (a + c + mp.hypot(a - c, 2 * b)) / 2
        wide, narrow = mp.sqrt(large), mp.sqrt((a * c - b * b) / large)
        along = mp.cos(angle) * m[0] + mp.sin(angle) * m[1]
        across = -mp.sin(angle) * m[0] + mp.cos(angle) * m[1]

        def inside(t):
            x, h = radius * mp.sin(t), radius * mp.cos(t)
            low, high = abs(along) - h, abs(along) + h
            return mp.npdf((x - across) / narrow) / narrow * (upper(low / wide) - upper(high / wide)) * h

        def outside(t):
            x, h = radius * mp.sin(t), radius * mp.cos(t)
            tails = upper((h - along) / wide) + upper((h + along) / wide)
            return mp.npdf((x - across) / narrow) / narrow * tails * h

        marks = {across + k * narrow for k in range(-40, 41, 4)}
        points = {mp.asin(x / radius) for x in marks if abs(x) < radius} | {mp.pi / 2 * k / 6 for k in range(-6, 7)}
        points |= {side * (mp.pi / 2 - mp.mpf(4) ** -k) for k in range(1, 6) for side in (-1, 1)}
        ends = upper((radius - across) / narrow) + upper((radius + across) / narrow)
        kwargs = {"method": "gauss-legendre", "maxdegree": 5}
        inner, outer = (mp.quad(f, sorted(points), **kwargs) for f in (inside, outside))
        assert abs(inner + outer + ends - 1) < 1e-18, "the reference must be right first"
        return inner, outer + ends


@pytest.mark.parametrize(
    ("ratio", "rho", "clearance", "mean"),
    some(
        [
            (1.0, 0.0, 4.0, (1.5, 0.3)),
            (1.0, 0.9, 16.0, (0.0, 0.0)),
            (3.0, 0.3, 30.0, (10.0, 0.0)),
            (100.0, 0.0, 4.0, (1.9, -0.2)),
            (100.0, 0.9, 20.0, (2.0, 1.0)),
            (1e4, 0.0, 4.0, (0.0, 0.0)),
            (1e4, 0.0, 6.0, (0.0, 2.9)),
            (1e4, 0.3, 16.0, (0.0, 0.0)),
            (1e4, 0.9, 3.0, (5.0, 1.0)),
            (1e4, -0.9, 0.01, (0.1, 0.0)),
            (9.0, 0.0, 2.0, (4.0, -1.0)),
            (64.0, 0.0, 2.0, (2.5, 0.4)),
            (1600.0, 0.0, 2.0, (0.0, 1.04)),
            (1e4, 0.0, 1.0, (0.2, 0.495)),
            # the small variance has to keep its digits: the determinant cancels
            (1.0, 1.0 - 1e-10, 4.0, (0.3, 0.3)),
            (1.0, -1.0 + 1e-12, 4.0, (0.3, -0.3)),
            (1e8, 0.0, 2.0, (0.3, 0.2)),
        ],
        3,
    ),
)
def test_disc_agrees_with_mpmath(ratio, rho, clearance, mean):
    matrix = covariance(ratio, rho)
    inside, outside = exact_disc(matrix, clearance, mean)
    assert abs(joining_probability(matrix, clearance, mean) - inside) < 1e-14
    assert abs(failing_probability(matrix, clearance, mean) / outside - 1) < 1e-12


def test_centred_equal_axes_have_the_closed_form_at_every_clearance():
    clearances = np.geomspace(1e-6, 70.0, 16)
    exponent = clearances**2 / 8.0
    np.testing.assert_allclose(joining_probability(np.eye(2), clearances), -np.expm1(-exponent), rtol=1e-13)
    np.testing.assert_allclose(failing_probability(np.eye(2), clearances), np.exp(-exponent), rtol=1e-12)


@pytest.mark.parametrize("rho", [0.0, 0.6, -0.99])
def test_rectangle_agrees_with_mpmath(rho):
    matrix, sides, mean = covariance(1e2, rho), np.array([3.0, 0.5]), np.array([0.4, -0.1])
    with mp.workdps(30):
        slope = mp.mpf(matrix[0, 1]) / mp.mpf(matrix[0, 0])
        rest = mp.sqrt(mp.mpf(matrix[1, 1]) - slope * mp.mpf(matrix[0, 1]))

        def strip(x, outside):
            middle = mp.mpf(mean[1]) + slope * (x - mp.mpf(mean[0]))
            low, high = (mp.mpf(-0.25) - middle) / rest, (mp.mpf(0.25) - middle) / rest
            share = upper(-low) + upper(high) if outside else 0
            return mp.npdf(x, mp.mpf(mean[0]), 1) * (share if outside else mp.ncdf(high) - mp.ncdf(low))

        points = np.linspace(-1.5, 1.5, 31).tolist()
        inside = mp.quad(lambda x: strip(x, False), points, method="gauss-legendre")
        beyond = upper(mp.mpf(1.5) - mp.mpf(mean[0])) + upper(mp.mpf(1.5) + mp.mpf(mean[0]))
        outside = mp.quad(lambda x: strip(x, True), points, method="gauss-legendre") + beyond
        assert abs(inside + outside - 1) < 1e-18, "the reference must be right first"
    assert abs(joining_probability(matrix, sides, mean, shape="rectangle") - inside) < 1e-14
    assert abs(failing_probability(matrix, sides, mean, shape="rectangle") / outside - 1) < 1e-12


def test_far_corner_of_a_rectangle_is_a_product():
    with mp.workdps(30):
        one, two = (upper(mp.mpf(k)) - upper(mp.mpf(k) + 2) for k in (9, 15))
    # Independent axes, the square of side 2 begins 9 and 15 standard deviations from the mean.
    value = joining_probability(np.eye(2), 2.0, (10.0, 16.0), shape="rectangle")
    assert abs(value / (one * two) - 1) < 1e-12


@pytest.mark.parametrize("shape", ["circle", "rectangle"])
def test_inside_and_outside_add_up_to_one_with_and_without_heat(shape):
    rng = np.random.default_rng(4)
    spreads = [None, UniformSpread.segment([1.0, 0.4]), UniformSpread.box([0.3, 2.0]), np.array([0.2, 0.5])]
    for spread in spreads:
        for _ in range(4):
            root = rng.normal(size=(2, 2)) * 10.0 ** rng.uniform(-2.0, 0.5, size=2)
            size = rng.uniform(0.5, 6.0, 2 if shape == "rectangle" else ())
            arguments = (root @ root.T, size, rng.normal(size=2))
            total = joining_probability(*arguments, shape=shape, thermal=spread) + failing_probability(
                *arguments, shape=shape, thermal=spread
            )
            assert abs(total - 1.0) < 1e-12


@pytest.mark.parametrize("unit", [1.0, 1e-6])
def test_neither_turning_everything_nor_the_unit_of_length_matters(unit):
    matrix, mean, end = covariance(50.0, 0.4), np.array([0.7, -1.1]), np.array([0.8, 0.3])
    spreads = (
        lambda turn, unit: None,
        lambda turn, unit: UniformSpread.segment(unit * turn @ end),
        lambda turn, unit: UniformSpread.box(unit * end, turn),
    )
    for spread_of in spreads:
        reference = failing_probability(matrix, 5.0, mean, thermal=spread_of(np.eye(2), 1.0))
        for turn in map(turned, (0.3, 1.0, np.pi / 2.0, 2.5)):
            other, shifted = unit**2 * turn @ matrix @ turn.T, unit * turn @ mean
            value = failing_probability(other, 5.0 * unit, shifted, thermal=spread_of(turn, unit))
            assert value == pytest.approx(reference, rel=1e-12)


def test_singular_covariance_is_a_line_and_zero_a_point():
    direction = np.array([0.6, 0.8])
    line = np.outer(direction, direction) * 4.0
    assert joining_probability(line, 6.0) == pytest.approx(float(mp.erf(1.5 / mp.sqrt(2))), rel=1e-14)
    assert failing_probability(line, 60.0) == pytest.approx(float(mp.erfc(15.0 / mp.sqrt(2))), rel=1e-12)
    # Beside the centre by 1, the chord is 2 sqrt(8) long; beside it by more than the radius there is none.
    beside = np.array([-0.8, 0.6])
    assert joining_probability(line, 6.0, beside) == pytest.approx(
        float(mp.erf(mp.sqrt(8) / 2 / mp.sqrt(2))), rel=1e-12
    )
    assert joining_probability(line, 6.0, 3.1 * beside) == 0.0
    nothing = np.zeros((2, 2))
    assert (joining_probability(nothing, 2.0, (0.6, 0.7)), failing_probability(nothing, 2.0, (0.6, 0.9))) == (1.0, 1.0)


def test_no_clearance_never_joins_and_any_clearance_always():
    for spread in (None, UniformSpread.box([1.0, 2.0])):
        np.testing.assert_array_equal(joining_probability(np.eye(2), [0.0, np.inf], thermal=spread), [0.0, 1.0])
        np.testing.assert_array_equal(failing_probability(np.eye(2), [0.0, np.inf], thermal=spread), [1.0, 0.0])
    # A rectangle without ends is a strip.
    strip = failing_probability(np.eye(2), [np.inf, 12.0], shape="rectangle")
    assert strip == pytest.approx(float(mp.erfc(6.0 / mp.sqrt(2))), rel=1e-12)


def averaged(function, matrix, size, mean, generators, count=40):
    """The thermal part by brute force: so many nodes along every generator."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    grids = np.stack(np.meshgrid(*[nodes] * generators.shape[1], indexing="ij"), -1).reshape(-1, generators.shape[1])
    shares = np.prod(np.stack(np.meshgrid(*[weights / 2.0] * generators.shape[1], indexing="ij"), -1), -1).ravel()
    return shares @ function(matrix, size, mean + grids @ generators.T)


@pytest.mark.parametrize(("shape", "size"), [("circle", 7.0), ("rectangle", (7.0, 3.0))])
@pytest.mark.parametrize("rho", [0.0, 0.7])
@pytest.mark.parametrize("mean", [(0.0, 0.0), (2.0, -1.0)])
def test_segment_is_the_average_over_shifted_means(rho, mean, shape, size):
    matrix, end = covariance(2.0, rho), np.array([0.9, -1.3])
    for spread in (UniformSpread.segment(end), UniformSpread.segment(-end)):
        for function in (joining_probability, failing_probability):
            expected = averaged(partial(function, shape=shape), matrix, size, np.array(mean), end[:, None])
            found = function(matrix, size, mean, shape=shape, thermal=spread)
            assert found == pytest.approx(expected, rel=1e-12)
    each = joining_probability(matrix[None], size, mean, segments=[end], shape=shape)
    assert each == pytest.approx(float(joining_probability(matrix, size, mean, shape=shape, thermal=spread)), abs=1e-14)


@pytest.mark.parametrize(("shape", "size"), [("circle", 9.0), ("rectangle", (9.0, 6.0))])
def test_box_and_links_are_the_average_over_shifted_means(shape, size):
    matrix, function = covariance(2.0, 0.3), partial(failing_probability, shape=shape)
    box = averaged(function, matrix, size, np.zeros(2), np.diag([0.7, 0.4]))
    assert function(matrix, size, thermal=UniformSpread.box([0.7, 0.4])) == pytest.approx(box, rel=1e-11)
    # Three links, the third in the direction of the first.
    columns = np.array([[0.5, 0.2, 1.0], [0.1, 0.6, 0.2]])
    half = UniformSpread.zonotope(columns, -0.5, 0.5)
    expected = averaged(function, matrix, size, np.zeros(2), 0.5 * columns, 14)
    assert function(matrix, size, thermal=half) == pytest.approx(expected, rel=1e-11)


def test_a_shift_adds_to_the_mean_and_each_error_may_have_its_own():
    shifted = joining_probability(np.eye(2), 4.0, [1.0, 2.0], thermal=[[3.0, -1.0], [0.2, -1.0]])
    expected = [joining_probability(np.eye(2), 4.0, mean) for mean in ([4.0, 1.0], [1.2, 1.0])]
    np.testing.assert_allclose(shifted, expected, rtol=1e-14)


@pytest.mark.parametrize("nodes", [link_nodes, planar_link_nodes])
@pytest.mark.parametrize("count", [1, 2, 3])
def test_nodes_of_links_keep_the_moments_and_refuse_a_vanishing_normal_part_at_once(nodes, count):
    columns = np.array([[0.5, 0.2, 1.0], [0.1, 0.6, 0.2]])[:, :count]
    shifts, weights = nodes(0.3 * np.eye(2), columns)
    assert weights.sum() == pytest.approx(1.0, rel=1e-12)
    np.testing.assert_allclose(weights @ shifts, 0.0, atol=1e-13)
    # A generator with u uniform on [−1, 1] has a third of its square as variance; independent ones add.
    np.testing.assert_allclose((shifts.T * weights) @ shifts, columns @ columns.T / 3.0, rtol=1e-11, atol=1e-13)
    # Without a limit that is known beforehand there would be 1e12 nodes: no memory holds them.
    for variance in (1e-8, 1e-10, 0.0):
        with pytest.raises(ValueError, match="so narrow a normal part need too many nodes"):
            nodes(variance * np.eye(2), columns)


def test_number_of_planar_nodes_does_not_grow_with_the_number_of_generators():
    """The same sum of lengths, cut into more and more pieces; parallel ones need a line of nodes only."""
    columns = np.array([[0.15, 0.06], [0.03, 0.18]])
    counts = [len(planar_link_nodes(np.eye(2), np.tile(columns / k, k))[1]) for k in (1, 2, 4)]
    assert counts[1] == counts[2] < 3 * counts[0]
    assert len(link_nodes(np.eye(2), np.tile(columns / 2, 2))[1]) > 10 * counts[1]
    shifts, _ = planar_link_nodes(np.eye(2), np.array([[0.5, 1.0, -0.2], [0.25, 0.5, -0.1]]))
    np.testing.assert_allclose(shifts @ np.array([1.0, -2.0]), 0.0, atol=1e-14)


def test_heat_without_a_normal_part_or_hardly_any_is_geometry():
    nothing = np.zeros((2, 2))
    assert joining_probability(nothing, 1.0, thermal=UniformSpread.segment([2.0, 0.0])) == pytest.approx(
        0.25, rel=1e-13
    )
    # A disc of radius 1 within a box of 3 x 4: its share of the area.
    box = UniformSpread.box([1.5, 2.0])
    assert joining_probability(nothing, 2.0, thermal=box) == pytest.approx(np.pi / 12.0, rel=1e-11)
    assert failing_probability(nothing, 2.0, thermal=box) == pytest.approx(1.0 - np.pi / 12.0, rel=1e-11)
    lost = joining_probability(1e-6 * np.eye(2), 0.2, thermal=UniformSpread.box([30.0, 20.0]))  # a disc in a wide box
    assert lost == pytest.approx(np.pi * 0.01 / 2_400.0, rel=1e-9)


def test_uniform_over_the_area_is_a_mixture_of_its_tiles():
    # Two generators make a parallelogram: there both readings of a zonotope are one.
    columns = np.array([[1.0, 0.3], [0.2, 1.4]])
    both = [UniformSpread.zonotope(columns, -1.0, [0.5, 1.0], over=over) for over in ("links", "area")]
    one, two = (failing_probability(np.eye(2), 6.0, thermal=spread) for spread in both)
    assert one == pytest.approx(float(two), rel=1e-13)
    # With five, a disc that holds only part of the polygon counts area over area.
    wide = np.array([[1.0, 0.3, 0.7, 0.2, -0.4], [0.2, 1.4, 0.6, -0.5, 0.3]])
    spread = UniformSpread.zonotope(wide, -1.0, 1.0, over="area")
    area = 4.0 * sum(abs(np.linalg.det(wide[:, [i, j]])) for i in range(5) for j in range(i))
    value = joining_probability(np.zeros((2, 2)), 1.0, thermal=spread)
    assert value == pytest.approx(np.pi / 4.0 / area, rel=1e-9)


def test_randomised_as_normal_adds_the_covariance():
    matrix, spread = np.diag([14.0, 18.0]) ** 2, UniformSpread.box([7.0, 16.0])
    expected = failing_probability(matrix + np.diag([49.0, 256.0]) / 3.0, 145.0)
    assert failing_probability(matrix, 145.0, thermal=spread, randomised="normal") == pytest.approx(expected, rel=1e-13)


def test_many_cases_at_once_are_the_single_ones():
    matrices = np.stack([np.eye(2), covariance(30.0, 0.5)])
    clearances, means = np.array([[1.0, 4.0]]).T, np.array([[0.3, 0.1], [1.0, 2.0]])
    table = joining_probability(matrices, clearances, means)
    assert table.shape == (2, 2)
    for i in range(2):
        for j in range(2):
            single = joining_probability(matrices[j], clearances[i, 0], means[j])
            assert table[i, j] == pytest.approx(float(single), rel=1e-14)


SEGMENT = UniformSpread.segment([1.0, 0.0])


@pytest.mark.parametrize("first", [0, 60], ids=["alone", "among many"])
@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"covariance": np.diag([1.0, -1.0])}, "semidefinite"),
        ({"covariance": [[1.0, 2.0], [2.0, 1.0]]}, "semidefinite"),
        ({"covariance": [[1.0, 0.2], [0.1, 1.0]]}, "symmetric"),
        ({"covariance": [[np.nan, 0.0], [0.0, 1.0]]}, "finite"),
        ({"covariance": np.eye(3)}, "shape"),
        ({"clearance": -1.0}, "negative or missing"),
        ({"clearance": np.nan}, "negative or missing"),
        ({"clearance": (1.0, 2.0, 3.0), "shape": "rectangle"}, "."),
        ({"mean": [0.0, 0.0, 0.0]}, "mean must be finite with shape"),
        ({"mean": [1.0]}, "mean must be finite with shape"),
        ({"mean": [np.inf, 0.0]}, "mean must be finite"),
        ({"shape": "ellipse"}, "."),
        ({"thermal": (1.0, 2.0, 3.0)}, "a thermal shift must be finite"),
        ({"thermal": [np.nan, 0.0]}, "a thermal shift must be finite"),
        ({"thermal": UniformSpread.box([1.0, 1.0, 1.0])}, "must be planar"),
        ({"thermal": SEGMENT, "randomised": "gauss"}, "randomised must be"),
        ({"segments": [1.0, 2.0, 3.0]}, "segments must be finite"),
        ({"segments": [1.0, 0.0], "thermal": SEGMENT}, "not both"),
    ],
)
def test_impossible_questions_are_refused(given, words, first):
    covariance = np.asarray(given.get("covariance", np.eye(2)), dtype=float)
    many = np.broadcast_to(covariance, (first, *covariance.shape)) if first else covariance
    with pytest.raises(ValueError, match=words):
        joining_probability(**{"clearance": 1.0, **given, "covariance": many})


def test_shapes_that_do_not_fit_are_refused():
    with pytest.raises(ValueError, match="cannot be broadcast"):
        joining_probability(np.broadcast_to(np.eye(2), (3, 2, 2)), np.ones(4))
