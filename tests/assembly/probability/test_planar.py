"""Planar deviations in discs and rectangles: both integrals against many digits, each other, products and draws."""

from fractions import Fraction

import mpmath as mp
import numpy as np
import pytest
from scipy.special import ndtr

from thermal_robot.assembly.probability.planar import Principal, by_chords, disc_by_edge, planar_probability

MATRICES = {
    "round": np.eye(2),
    "turned": np.array([[2.0, 0.9], [0.9, 0.7]]),
    "nearly singular": np.array([[1.0, 1.0 - 1e-13], [1.0 - 1e-13, 1.0]]),
    "cancelling": np.array([[0.7, 0.3], [0.3, 0.09 / 0.7 * (1.0 + 1e-10)]]),
    "µm": 1e-12 * np.array([[196.0, 30.0], [30.0, 324.0]]),
    "unequal": np.diag([1e4, 1e-4]),
}
TURNED = MATRICES["turned"]


def turned(angle):
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def drawn(seed, ratio, count=300):
    """Covariances of axes up to a ratio (0: singular), means, radii, segments: of all sizes beside each other."""
    rng = np.random.default_rng(seed)
    wide = np.exp(rng.uniform(-2.0, 2.0, count))
    narrow = wide / ratio ** rng.uniform(0.0, 1.0, count) if ratio else np.zeros(count)
    turn = np.moveaxis(turned(rng.uniform(0.0, np.pi, count)), 2, 0)
    matrices = np.einsum("nij,nj,nkj->nik", turn, np.stack([wide, narrow], axis=-1) ** 2, turn)
    means = rng.normal(size=(count, 2)) * (wide * rng.uniform(0.0, 3.0, count))[:, None]
    means[rng.random(count) < 0.3] = 0.0
    ends = rng.normal(size=(count, 2)) * (wide * np.exp(rng.uniform(-4.0, 1.5, count)))[:, None]
    return 0.5 * (matrices + np.swapaxes(matrices, 1, 2)), means, wide * np.exp(rng.uniform(-3.0, 2.0, count)), ends


def area(axes, centre):
    """P and 1 - P in 20 digits: chords along the second coordinate, their probabilities summed along the first."""
    with mp.workdps(20):
        a, b, m, n = (mp.mpf(float(v)) for v in (*axes, *centre))

        def chord(t):
            x, half = a * mp.sin(t), b * mp.cos(t)
            return mp.npdf(x - m) * (mp.ncdf(half - n) - mp.ncdf(-half - n)) * a * mp.cos(t)

        whole = mp.quad(chord, mp.linspace(-mp.pi / 2, mp.pi / 2, 7))
        return float(whole), float(1 - whole)


def by_area(matrix, mean, radius, end):
    """P with the mean uniform on a segment: Gauss's nodes over disc and segment, density of the normal part."""
    nodes, weights = np.polynomial.legendre.leggauss(60)
    r, t, s = np.meshgrid(0.5 * radius * (nodes + 1.0), np.pi * nodes, nodes, indexing="ij")
    share = np.einsum("i,j,k->ijk", 0.5 * radius * weights, np.pi * weights, 0.5 * weights) * r
    points = np.stack([r * np.cos(t), r * np.sin(t)], -1) - mean - s[..., None] * end
    exponent = np.einsum("...i,ij,...j->...", points, np.linalg.inv(matrix), points)
    return float(np.sum(share * np.exp(-0.5 * exponent)) / (2.0 * np.pi * np.sqrt(np.linalg.det(matrix))))


@pytest.mark.parametrize("name", MATRICES)
def test_principal_axes_are_right_also_where_the_determinant_cancels(name):
    matrix = MATRICES[name]
    found = Principal.of(matrix)
    with mp.workdps(60):
        values = sorted(mp.eigsy(mp.matrix(matrix.tolist()), eigvals_only=True))
    assert found.large == pytest.approx(float(values[1]), rel=1e-14, abs=0.0)
    assert found.small == pytest.approx(float(values[0]), rel=1e-12, abs=0.0)
    a, b, c = (Fraction(float(v)) for v in (matrix[0, 0], matrix[0, 1], matrix[1, 1]))
    assert found.large * found.small == pytest.approx(float(a * c - b * b), rel=1e-12, abs=0.0)
    np.testing.assert_allclose(matrix @ found.direction, found.large * found.direction, atol=1e-13 * found.large)


def test_singular_and_zero_covariances_have_axes_too():
    line = Principal.of(np.outer([0.6, 0.8], [0.6, 0.8]) * 25.0)
    assert (line.large, line.small) == pytest.approx((25.0, 0.0), rel=1e-14, abs=1e-14)
    assert abs(line.direction @ np.array([0.6, 0.8])) == pytest.approx(1.0, rel=1e-14)
    nothing = Principal.of(np.zeros((2, 2)))
    assert (nothing.large, nothing.small) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("axes", "centre", "count"),
    [
        ((0.02, 0.03), (0.0, 0.0), 32),
        ((0.7, 2.1), (0.0, 0.0), 48),
        ((3.0, 4.5), (0.4, -1.2), 64),
        ((5.0, 6.0), (1.0, 0.5), 96),
        ((1.0, 8.0), (2.5, 3.0), 256),
        ((2.0, 2.0), (2.0, 0.0), 48),
        ((1.0, 1.0), (4.0, -3.0), 64),
        ((1.0, 40.0), (0.0, 0.0), 0),
        ((2.0, 60.0), (1.0, 20.0), 0),
        ((0.5, 100.0), (0.2, 99.0), 0),
        ((3.0, 50.0), (0.0, 52.0), 0),
    ],
)
def test_inside_and_outside_are_those_of_the_area(axes, centre, count):
    expected, missed = area(axes, centre)
    given = np.diag([1.0, (axes[0] / axes[1]) ** 2])[None], np.array([[centre[0], centre[1] * axes[0] / axes[1]]])
    kind = (np.array([[axes[0]]]), "circle", np.zeros((1, 2)))
    found = [[by_chords(*given, *kind, outside)[0] for outside in (False, True)]]
    if count:
        found.append([v[0] for v in disc_by_edge(np.array([axes]), np.array([centre]), count)])
    for inside, outside in found:
        assert inside == pytest.approx(expected, rel=1e-11, abs=2e-15)
        assert outside == pytest.approx(missed, rel=1e-10, abs=1e-14 if np.hypot(*centre) > min(axes) else 0.0)


@pytest.mark.parametrize("ratio", [3.0, 100.0, 1e4, 1e8, 0.0])
@pytest.mark.parametrize("heated", [False, True])
def test_inside_and_outside_are_integrated_apart_and_add_up(ratio, heated):
    matrices, means, radii, ends = drawn(1, ratio)
    given, kind = (matrices, means), {"shape": "circle", "segment": ends if heated else None}
    inside, outside = (planar_probability(*given, 2.0 * radii[:, None], **kind, outside=o) for o in (False, True))
    np.testing.assert_allclose(inside + outside, 1.0, rtol=0.0, atol=1e-13)
    more = planar_probability(*given, 2.04 * radii[:, None], **kind)
    assert np.all(more >= inside - 1e-14)
    chords = by_chords(*given, radii[:, None], "circle", ends if heated else np.zeros_like(ends), True)
    np.testing.assert_allclose(outside, chords, rtol=1e-10)


@pytest.mark.parametrize("wide", [0.3, 3.0])
@pytest.mark.parametrize("beside", [0.0, 0.6, -0.95, 1.5])
def test_without_a_narrow_part_a_single_chord_remains(wide, beside):
    mean = np.array([[0.4 / wide, beside]])
    inside, outside = (
        planar_probability(np.diag([wide**-2, 0.0]), mean, np.array([[2.0]]), shape="circle", outside=o)[0]
        for o in (False, True)
    )
    half = wide * float(mp.sqrt(max(1 - mp.mpf(beside) ** 2, 0)))
    assert inside == pytest.approx(float(mp.ncdf(half - 0.4) - mp.ncdf(-half - 0.4)), rel=1e-13)
    assert inside + outside == pytest.approx(1.0, abs=1e-15)


@pytest.mark.parametrize("end", [(3.0, 0.0), (1.0, 2.0), (0.0, 0.3)])
@pytest.mark.parametrize("mean", [(0.0, 0.0), (0.5, -0.9)])
def test_a_segment_is_the_mean_over_its_places(end, mean):
    found = planar_probability(TURNED, np.array([mean]), np.array([[2.4]]), shape="circle", segment=np.array(end))
    assert found[0] == pytest.approx(by_area(TURNED, np.array(mean), 1.2, np.array(end)), abs=1e-13)


@pytest.mark.parametrize("outside", [False, True])
@pytest.mark.parametrize("shape", ["circle", "rectangle"])
@pytest.mark.parametrize("segment", [None, [1.5, -0.4]])
def test_probability_is_that_of_drawn_errors(shape, segment, outside):
    rng, count, mean = np.random.default_rng(6), 200_000, np.array([0.4, -0.7])
    error = rng.standard_normal((count, 2)) @ np.linalg.cholesky(TURNED).T + mean
    if segment is not None:
        error += rng.uniform(-1.0, 1.0, count)[:, None] * segment
    sizes = np.array([[3.0]]) if shape == "circle" else np.array([[3.0, 1.6]])
    within = np.hypot(*error.T) < 1.5 if shape == "circle" else np.all(np.abs(error) < 0.5 * sizes, axis=1)
    along = None if segment is None else np.array(segment)
    found = planar_probability(TURNED, mean[None], sizes, shape=shape, segment=along, outside=outside)
    counted = np.mean(~within if outside else within)
    assert abs(found[0] - counted) < 5.0 * np.sqrt(found[0] * (1.0 - found[0]) / count)


def test_rectangle_of_independent_axes_is_a_product():
    means = np.array([[0.0, 0.0], [1.0, -2.0], [5.0, 0.3]])
    sides, deviations = np.array([[2.0, 3.0], [0.1, 7.0], [4.0, 1.0]]), np.array([1.3, 0.4])
    ends = [(sign * 0.5 * sides - means) / deviations for sign in (1.0, -1.0)]
    expected = np.prod(ndtr(ends[0]) - ndtr(ends[1]), axis=1)
    found = planar_probability(np.diag(deviations**2), means, sides, shape="rectangle")
    np.testing.assert_allclose(found, expected, rtol=1e-11)


@pytest.mark.parametrize("outside", [False, True])
def test_a_rectangle_with_chords_askew_is_the_same(outside):
    """A short segment turns the chords, and hardly changes the law."""
    means, sides = np.array([[0.3, 0.2], [2.0, 1.0]]), np.array([[2.5, 0.7]] * 2)
    plain = planar_probability(TURNED, means, sides, shape="rectangle", outside=outside)
    for angle in (0.0, 0.4, 1.9):
        short = 1e-9 * turned(angle)[0]
        found = planar_probability(TURNED, means, sides, shape="rectangle", segment=short, outside=outside)
        np.testing.assert_allclose(found, plain, rtol=1e-12)


@pytest.mark.parametrize("segment", [np.zeros(2), np.array([0.8, 0.3]), np.array([1e-9, 2e-9])])
def test_a_disc_knows_no_directions_and_a_segment_no_beginning(segment):
    rng = np.random.default_rng(7)
    means, sizes = rng.normal(size=(6, 2)), rng.uniform(0.1, 9.0, (6, 1))
    reference = planar_probability(TURNED, means, sizes, shape="circle", segment=segment)
    for turn in (turned(0.4), turned(1.9), -np.eye(2)):
        given = turn @ TURNED @ turn.T, means @ turn.T, sizes
        np.testing.assert_allclose(
            planar_probability(*given, shape="circle", segment=turn @ segment), reference, rtol=1e-12
        )
    each = [planar_probability(TURNED, means[[k]], sizes[[k]], shape="circle", segment=segment)[0] for k in range(6)]
    np.testing.assert_allclose(reference, each, rtol=1e-12)
    np.testing.assert_allclose(
        planar_probability(TURNED, means, sizes, shape="circle", segment=-segment), reference, rtol=1e-12
    )
