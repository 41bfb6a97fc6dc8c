"""Panels that halve themselves: integrals with known answers, however narrow, kinked or far apart in size."""

import numpy as np
import pytest
from scipy.special import erf

from thermal_robot.assembly.probability.kernels import integrate_panels


def alone(function, breakpoints, **options):
    """One integral of a function of points only."""
    return integrate_panels(lambda owner, t: function(t), np.array([breakpoints], dtype=float), **options)[0]


def test_polynomials_need_no_halving():
    levels = []

    def cube(owner, t):
        levels.append(len(owner))
        return t**3

    np.testing.assert_allclose(integrate_panels(cube, np.array([[0.0, 1.0, 4.0]])), [64.0], rtol=1e-14)
    assert levels == [2, 4], "two panels, and once their halves"


@pytest.mark.parametrize("width", [1.0, 1e-2, 1e-5, 1e-9])
def test_a_peak_is_found_by_panels_that_close_in_on_it(width):
    # The peak stands at 0.3; panels grow by four from there, as those of the callers do.
    ladder = 4.0 ** -np.arange(20.0)
    found = alone(
        lambda t: np.exp(-0.5 * ((t - 0.3) / width) ** 2), 0.3 + np.concatenate([-ladder, [0.0], ladder[::-1]])
    )
    expected = width * np.sqrt(2.0 * np.pi) * erf(1.0 / width / np.sqrt(2.0))
    assert found == pytest.approx(expected, rel=1e-13 + 1e-16 / width, abs=0.0)


def test_kinks_jumps_and_roots_inside_a_panel():
    assert alone(lambda t: np.abs(t - 1.0 / 3.0), [0.0, 1.0]) == pytest.approx(5.0 / 18.0, rel=1e-13)
    assert alone(lambda t: (t > 1.0 / 3.0).astype(float), [0.0, 1.0]) == pytest.approx(2.0 / 3.0, rel=1e-12)
    assert alone(np.sqrt, [0.0, 4.0]) == pytest.approx(16.0 / 3.0, rel=1e-11)


def test_depth_limits_where_a_jump_is_found():
    # The edge is placed to 2^-depth of the panel, and no better: 1/3 has no finite binary fraction.
    errors = [abs(alone(lambda t: (t > 1.0 / 3.0).astype(float), [0.0, 1.0], depth=d) - 2.0 / 3.0) for d in (3, 10, 20)]
    assert all(error < 2.0**-depth for error, depth in zip(errors, (3, 10, 20), strict=True))
    assert errors[0] > errors[1] > errors[2] > 0.0


def test_many_integrals_at_once_are_each_relatively_right():
    sizes = 10.0 ** np.arange(-300.0, 300.0, 25.0)
    ends = np.linspace(1.0, 3.0, len(sizes))
    breakpoints = np.stack([np.zeros_like(ends), 0.1 * ends, ends], axis=1)
    found = integrate_panels(lambda owner, t: sizes[owner][:, None] * np.exp(t), breakpoints)
    np.testing.assert_allclose(found, sizes * np.expm1(ends), rtol=1e-13)


def test_each_integral_has_its_own_function():
    powers = np.array([0, 1, 5, 20])
    found = integrate_panels(lambda owner, t: t ** powers[owner][:, None], np.tile([0.0, 0.5, 1.0], (4, 1)))
    np.testing.assert_allclose(found, 1.0 / (powers + 1.0), rtol=1e-13)


def test_panels_that_are_halved_stay_with_their_integral():
    # ∫₀¹ k |t − c| dt, each kink in a place of its own and each integral of its own size.
    kinks, sizes = np.array([0.11, 0.34, 0.57, 0.83]), np.array([1.0, 1e3, 1e-3, 10.0])
    found = integrate_panels(
        lambda owner, t: sizes[owner][:, None] * np.abs(t - kinks[owner][:, None]), np.tile([0.0, 1.0], (4, 1))
    )
    np.testing.assert_allclose(found, sizes * (kinks**2 + (1.0 - kinks) ** 2) / 2.0, rtol=1e-12)


def test_empty_panels_cost_nothing_and_an_empty_integral_is_zero():
    points = []

    def one(owner, t):
        points.append(t.size)
        return np.ones_like(t)

    few = integrate_panels(one, np.array([[0.0, 2.0]]))
    cost = sum(points)
    points.clear()
    many = integrate_panels(one, np.array([[0.0, 0.0, 0.0, 2.0, 2.0]]))
    assert (few[0], sum(points)) == (many[0], cost)
    np.testing.assert_array_equal(integrate_panels(one, np.array([[1.0, 1.0], [0.0, 2.0]])), [0.0, few[0]])


def test_more_panels_than_are_held_at_once_are_all_counted():
    breakpoints = np.linspace(0.0, 1.0, 20_001)[None, :]
    assert integrate_panels(lambda owner, t: 3.0 * t**2, breakpoints)[0] == pytest.approx(1.0, rel=1e-12)


def test_zero_everywhere_is_zero():
    assert alone(np.zeros_like, [0.0, 1.0, 2.0]) == 0.0
