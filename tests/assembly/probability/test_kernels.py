"""Normal plus uniform on a line: density, tails and intervals against mpmath, and the laws that bind them."""

import mpmath as mp
import numpy as np
import pytest

from thermal_robot.assembly.probability.kernels import (
    density,
    inside_probability,
    log_density,
    log_tail,
    mills_ratio,
    outside_probability,
    second_mills_ratio,
    tail,
)

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


@pytest.mark.parametrize("half_width", [0.0, 0.4, 5.0])
def test_short_intervals_keep_their_digits(half_width):
    low, high = np.array([0.3, -2e-9, 7.0]), np.array([0.3 + 1e-9, 1e-9, 7.0 + 1e-7])
    value = inside_probability(low, high, 1.0, half_width)
    expected = density(0.5 * (low + high), 1.0, half_width) * (high - low)
    np.testing.assert_allclose(value, expected, rtol=1e-12)


@pytest.mark.parametrize("t", [0.0, 1e-9, 0.7, 3.99, 4.01, 8.99, 9.01, 40.0, 1e4])
def test_mills_ratios_keep_their_digits(t):
    with mp.workdps(60):
        upper, density_at = mp.erfc(mp.mpf(t) / mp.sqrt(2)) / 2, mp.npdf(mp.mpf(t))
        first = upper / density_at
        second = 1 - mp.mpf(t) * first  # loses 2 log10(t) digits of its 60
    assert abs(mills_ratio(np.array([t]))[0] / first - 1) < 1e-14
    assert abs(second_mills_ratio(np.array([t]))[0] / second - 1) < 1e-12


CASES = [(1.0, 0.0), (1.0, 0.3), (1.0, 5.0), (1e-6, 1.0), (0.0, 2.0)]


@pytest.mark.parametrize(("sigma", "half_width"), CASES)
def test_logarithms_and_tails_are_those_of_the_numbers(sigma, half_width):
    x = np.linspace(-6.3, 6.4, 51)
    numbers, beyond = density(x, sigma, half_width), tail(x, sigma, half_width)
    for logs, values in ((log_density(x, sigma, half_width), numbers), (log_tail(x, sigma, half_width), beyond)):
        some = values > 0.0
        assert some.sum() >= 7
        np.testing.assert_allclose(logs[some], np.log(values[some]), rtol=1e-11, atol=1e-15)
        assert np.all(logs[~some] < -700.0)
    # Symmetry: what lies beyond x on one side lies beyond −x on the other.
    np.testing.assert_allclose(tail(x, sigma, half_width) + tail(-x, sigma, half_width), 1.0, rtol=0.0, atol=1e-15)
    np.testing.assert_array_equal(density(x, sigma, half_width), density(-x, sigma, half_width))


@pytest.mark.parametrize(("sigma", "half_width"), CASES)
def test_unit_of_length_does_not_matter(sigma, half_width):
    x = np.linspace(-4.0, 4.0, 33) * (sigma + half_width)
    scaled = (1e-5 * x, 1e-5 * sigma, 1e-5 * half_width)
    # Where a wide uniform part meets its edge the argument's own rounding shows: 1e-16 of a step 1e-6 wide.
    np.testing.assert_allclose(tail(*scaled), tail(x, sigma, half_width), rtol=1e-8, atol=1e-300)
    np.testing.assert_allclose(1e-5 * density(*scaled), density(x, sigma, half_width), rtol=1e-8, atol=1e-300)


@pytest.mark.parametrize(("sigma", "half_width"), [(1.0, 0.0), (1.0, 0.3), (1.0, 5.0), (0.2, 1.0), (0.0, 2.0)])
def test_inside_and_outside_add_up_and_intervals_join(sigma, half_width):
    rng = np.random.default_rng(1)
    low, middle, high = np.sort(rng.normal(0.0, 3.0, (3, 300)), axis=0)
    inside = inside_probability(low, high, sigma, half_width)
    outside = outside_probability(low, high, sigma, half_width)
    np.testing.assert_allclose(inside + outside, 1.0, rtol=0.0, atol=4e-16)
    parts = [inside_probability(*ends, sigma, half_width) for ends in ((low, middle), (middle, high))]
    np.testing.assert_allclose(sum(parts), inside, rtol=1e-12, atol=1e-300)
    mirrored = inside_probability(-high, -low, sigma, half_width)
    np.testing.assert_allclose(mirrored, inside, rtol=1e-13)


def test_tails_are_those_of_drawn_errors():
    rng, drawn = np.random.default_rng(2), 200_000
    sample = rng.normal(0.0, 0.7, drawn) + rng.uniform(-1.5, 1.5, drawn)
    for x in (-2.0, -0.4, 0.9, 1.5, 2.5):
        beyond = float(tail(x, 0.7, 1.5))
        assert abs(np.mean(sample > x) - beyond) < 5.0 * np.sqrt(beyond * (1.0 - beyond) / drawn)


def test_a_far_interval_does_not_vanish_beside_one():
    with mp.workdps(40):
        expected = mp.erfc(20 / mp.sqrt(2)) / 2 - mp.erfc(21 / mp.sqrt(2)) / 2
    found = inside_probability(np.array([20.0, -21.0]), np.array([21.0, -20.0]), 1.0, 0.0)
    np.testing.assert_allclose(found, float(expected), rtol=1e-13)


def test_no_width_at_all_is_a_point():
    low, high = np.array([-1.0, 0.0, 0.1, -1.0]), np.array([1.0, 0.5, 1.0, 0.0])
    np.testing.assert_array_equal(inside_probability(low, high, 0.0, 0.0), [1.0, 1.0, 0.0, 1.0])
    np.testing.assert_array_equal(log_density(np.array([0.0, 1e-300]), 0.0, 0.0), [np.inf, -np.inf])
    np.testing.assert_array_equal(log_tail(np.array([-1.0, 0.0, 1.0]), 0.0, 0.0), [0.0, -np.inf, -np.inf])


def test_arguments_broadcast_and_a_number_stays_a_number():
    table = density(np.array([[0.0], [1.0]]), np.array([1.0, 2.0, 3.0]), 0.5)
    assert table.shape == (2, 3)
    assert density(1.0, 2.0, 0.5).shape == ()
    # a vectorised exponential may round otherwise than a single one
    assert table[1, 1] == pytest.approx(density(1.0, 2.0, 0.5), rel=1e-14)
