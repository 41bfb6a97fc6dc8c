"""Normal plus uniform along a segment in the plane: axes in exact arithmetic, probabilities by products and draws."""

from fractions import Fraction

import mpmath as mp
import numpy as np
import pytest
from scipy.special import ndtr

from thermal_robot.assembly.probability.planar import Frame, Principal, planar_probability

MATRICES = {
    "round": np.eye(2),
    "turned": np.array([[2.0, 0.9], [0.9, 0.7]]),
    "nearly singular": np.array([[1.0, 1.0 - 1e-13], [1.0 - 1e-13, 1.0]]),
    "cancelling": np.array([[0.7, 0.3], [0.3, 0.09 / 0.7 * (1.0 + 1e-10)]]),
    "µm": 1e-12 * np.array([[196.0, 30.0], [30.0, 324.0]]),
    "unequal": np.diag([1e4, 1e-4]),
}


def turned(angle):
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


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
    direction = found.direction
    assert np.hypot(*direction) == pytest.approx(1.0, rel=1e-15)
    np.testing.assert_allclose(matrix @ direction, found.large * direction, atol=1e-13 * found.large)


def test_singular_and_zero_covariances_have_axes_too():
    line = Principal.of(np.outer([0.6, 0.8], [0.6, 0.8]) * 25.0)
    assert line.large == pytest.approx(25.0, rel=1e-14)
    assert line.small == pytest.approx(0.0, abs=1e-14)
    assert abs(line.direction @ np.array([0.6, 0.8])) == pytest.approx(1.0, rel=1e-14)
    nothing = Principal.of(np.zeros((2, 2)))
    assert (nothing.large, nothing.small) == (0.0, 0.0)


@pytest.mark.parametrize("name", MATRICES)
@pytest.mark.parametrize("angle", [0.0, 0.4, 1.9])
def test_frame_has_the_covariance_in_its_own_axes(name, angle):
    second = turned(angle)[:, 1]
    frame = Frame.along(Principal.of(MATRICES[name]), second, 0.5)
    np.testing.assert_allclose(frame.rotation @ frame.rotation.T, np.eye(2), atol=1e-15)
    np.testing.assert_array_equal(frame.rotation[1], second)
    # x with its deviation; y = slope x plus an independent remainder.
    root = np.array([[frame.spread, 0.0], [frame.slope * frame.spread, frame.remainder]])
    inside = frame.rotation @ MATRICES[name] @ frame.rotation.T
    np.testing.assert_allclose(root @ root.T, inside, atol=1e-12 * np.abs(MATRICES[name]).max())
    # However narrow, the remainder keeps its digits: the product of both variances is the determinant.
    a, b, c = (Fraction(float(v)) for v in MATRICES[name][np.triu_indices(2)])
    assert (frame.spread * frame.remainder) ** 2 == pytest.approx(float(a * c - b * b), rel=1e-11, abs=0.0)


@pytest.mark.parametrize("outside", [False, True])
@pytest.mark.parametrize("shape", ["circle", "rectangle"])
@pytest.mark.parametrize("segment", [None, [1.5, -0.4]])
def test_probability_is_that_of_drawn_errors(shape, segment, outside):
    rng, drawn, mean = np.random.default_rng(6), 200_000, np.array([0.4, -0.7])
    error = rng.standard_normal((drawn, 2)) @ np.linalg.cholesky(MATRICES["turned"]).T + mean
    if segment is not None:
        error += rng.uniform(-1.0, 1.0, drawn)[:, None] * segment
    sizes = np.array([[3.0]]) if shape == "circle" else np.array([[3.0, 1.6]])
    within = np.hypot(*error.T) < 1.5 if shape == "circle" else np.all(np.abs(error) < 0.5 * sizes, axis=1)
    counted = np.mean(~within if outside else within)
    along = None if segment is None else np.array(segment)
    found = planar_probability(MATRICES["turned"], mean[None], sizes, shape=shape, segment=along, outside=outside)
    assert abs(found[0] - counted) < 5.0 * np.sqrt(found[0] * (1.0 - found[0]) / drawn)


def test_rectangle_of_independent_axes_is_a_product():
    means = np.array([[0.0, 0.0], [1.0, -2.0], [5.0, 0.3]])
    sides, deviations = np.array([[2.0, 3.0], [0.1, 7.0], [4.0, 1.0]]), np.array([1.3, 0.4])
    ends = [(sign * 0.5 * sides - means) / deviations for sign in (1.0, -1.0)]
    expected = np.prod(ndtr(ends[0]) - ndtr(ends[1]), axis=1)
    found = planar_probability(np.diag(deviations**2), means, sides, shape="rectangle")
    np.testing.assert_allclose(found, expected, rtol=1e-11)


@pytest.mark.parametrize("segment", [None, [0.8, 0.3]])
def test_a_disc_does_not_know_its_directions(segment):
    mean, along = np.array([[0.7, -1.1]]), None if segment is None else np.array(segment)
    reference = planar_probability(MATRICES["turned"], mean, np.array([[2.0]]), shape="circle", segment=along)
    for angle in (0.4, 1.9, np.pi):
        turn = turned(angle)
        moved = None if along is None else turn @ along
        found = planar_probability(
            turn @ MATRICES["turned"] @ turn.T, mean @ turn.T, np.array([[2.0]]), shape="circle", segment=moved
        )
        np.testing.assert_allclose(found, reference, rtol=1e-12)


@pytest.mark.parametrize("shape", ["circle", "rectangle"])
def test_a_short_segment_is_none_and_a_reversed_one_the_same(shape):
    means, sizes = np.array([[0.3, 0.2], [2.0, 1.0]]), np.full((2, 1 if shape == "circle" else 2), 2.5)
    options = {"shape": shape, "outside": True}
    plain = planar_probability(MATRICES["turned"], means, sizes, **options)
    short = planar_probability(MATRICES["turned"], means, sizes, segment=np.array([1e-9, 2e-9]), **options)
    np.testing.assert_allclose(short, plain, rtol=1e-12)
    end = np.array([0.9, -0.3])
    one, other = (planar_probability(MATRICES["turned"], means, sizes, segment=s, **options) for s in (end, -end))
    np.testing.assert_allclose(one, other, rtol=1e-12)


def test_many_errors_at_once_are_the_single_ones():
    rng = np.random.default_rng(7)
    means, sizes = rng.normal(size=(6, 2)), rng.uniform(0.1, 9.0, (6, 1))
    together = planar_probability(MATRICES["turned"], means, sizes, shape="circle")
    single = [
        planar_probability(MATRICES["turned"], means[[k]], sizes[[k]], shape="circle")[0] for k in range(len(means))
    ]
    np.testing.assert_allclose(together, single, rtol=1e-12)
