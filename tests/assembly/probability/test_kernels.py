"""Normal plus uniform on a line: density, tails and intervals against mpmath, and the laws that bind them."""

import mpmath as mp
import numpy as np
import pytest
from helpers import some

from thermal_robot.assembly.probability.kernels import (
    density,
    inside_probability,
    integrate_panels,
    log_density,
    log_tail,
    outside_probability,
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


@pytest.mark.parametrize("ratio", some(RATIOS, 3))
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


def test_depth_limits_where_a_jump_is_found():
    # The edge is placed to 2^-depth of the panel, and no better: 1/3 has no finite binary fraction.
    ends = np.array([[0.0, 1.0]])
    found = [integrate_panels(lambda _, t: (t > 1.0 / 3.0).astype(float), ends, depth=d)[0] for d in (3, 10, 20)]
    errors = np.abs(np.array(found) - 2.0 / 3.0)
    np.testing.assert_array_less(errors, [2.0**-3, 2.0**-10, 2.0**-20])
    assert errors[0] > errors[1] > errors[2] > 0.0
