"""The probability of a disc along its edge, against integrals over its area in many digits."""

import mpmath as mp
import numpy as np
import pytest
from scipy.special import ndtr

from thermal_robot.assembly.probability.planar import angles_needed, disc_by_edge, segment_by_edge


def area(axes, centre):
    """P and 1 - P in 20 digits: chords along the second coordinate, their probabilities summed along the first."""
    with mp.workdps(20):
        a, b, m, n = (mp.mpf(float(v)) for v in (*axes, *centre))

        def chord(t):
            x, half = a * mp.sin(t), b * mp.cos(t)
            return mp.npdf(x - m) * (mp.ncdf(half - n) - mp.ncdf(-half - n)) * a * mp.cos(t)

        whole = mp.quad(chord, mp.linspace(-mp.pi / 2, mp.pi / 2, 7))
        return float(whole), float(1 - whole)


def area_about(axes, centre, segment):
    """Mean of the same over a segment, by Gauss's nodes on many panels both ways."""
    nodes, weights = np.polynomial.legendre.leggauss(24)
    panels = np.arange(40)[:, None]
    unit, share = ((2.0 * panels + 1.0 + nodes) / 40.0 - 1.0).ravel(), np.tile(weights / 40.0, 40)
    t, s = 0.5 * np.pi * unit[:, None], unit[None]
    m, n = (c + s * g for c, g in zip(centre, segment, strict=True))
    x, half = axes[0] * np.sin(t), axes[1] * np.cos(t)
    density = np.exp(-0.5 * (x - m) ** 2) / np.sqrt(2.0 * np.pi) * half * axes[0] / axes[1] * 0.5 * np.pi
    return float(share @ (density * (ndtr(half - n) - ndtr(-half - n))) @ (0.5 * share))


CASES = [
    ((0.02, 0.03), (0.0, 0.0)),
    ((0.7, 2.1), (0.0, 0.0)),
    ((3.0, 4.5), (0.4, -1.2)),
    ((5.0, 6.0), (1.0, 0.5)),
    ((1.0, 8.0), (2.5, 3.0)),
    ((2.0, 2.0), (2.0, 0.0)),
    ((1.0, 1.0), (4.0, -3.0)),
]


def enough(axes, centre):
    """A number of angles, a multiple of four, that is said to be enough."""
    return int(4 * np.ceil(angles_needed(axes, np.abs(centre))[0] / 4))


@pytest.mark.parametrize(("axes", "centre"), CASES)
def test_inside_and_outside_are_those_of_the_area(axes, centre):
    expected, missed = area(axes, centre)
    given = np.array([axes]), np.array([centre])
    inside, outside, _ = disc_by_edge(*given, enough(*given))
    assert inside[0] == pytest.approx(expected, rel=1e-12, abs=1e-15)
    assert outside[0] == pytest.approx(missed, rel=1e-10 if np.hypot(*centre) < min(axes) else 1e-14, abs=0.0)


@pytest.mark.parametrize(("axes", "centre"), CASES)
def test_the_rate_is_what_another_radius_does(axes, centre):
    given, step = (np.array([axes]), np.array([centre])), 1e-5
    rate = disc_by_edge(*given, enough(*given))[2][0]
    more, less = (area(np.multiply(axes, np.exp(s)), centre)[0] for s in (step, -step))
    assert rate == pytest.approx((more - less) / (2.0 * step), rel=1e-7, abs=1e-11)


def test_a_quarter_of_the_edge_is_the_whole_about_the_centre():
    axes = np.array([a for a, c in CASES])
    centre = np.zeros_like(axes)
    whole, quarter = disc_by_edge(axes, centre, 96), disc_by_edge(axes, centre, 96, central=True)
    np.testing.assert_allclose(quarter, whole, rtol=1e-13)


def test_equal_axes_follow_the_law_of_rayleigh():
    radius = np.array([1e-4, 0.3, 1.0, 3.0, 6.0])
    inside, outside, rate = disc_by_edge(np.tile(radius[:, None], 2), np.zeros((5, 2)), 96, central=True)
    np.testing.assert_allclose(inside, -np.expm1(-0.5 * radius**2), rtol=1e-13)
    np.testing.assert_allclose(outside, np.exp(-0.5 * radius**2), rtol=1e-11)
    np.testing.assert_allclose(rate, radius**2 * np.exp(-0.5 * radius**2), rtol=1e-13)


@pytest.mark.parametrize(
    ("axes", "centre", "segment"),
    [
        ((1.0, 2.0), (0.0, 0.0), (3.0, 0.0)),
        ((1.5, 1.0), (0.5, -0.2), (1.0, 2.0)),
        ((4.0, 6.0), (0.0, 1.0), (2.0, -9.0)),
        ((0.3, 0.5), (1.0, 0.0), (0.0, 1.5)),
    ],
)
def test_a_segment_is_the_mean_over_its_places(axes, centre, segment):
    expected = area_about(axes, centre, segment)
    given = tuple(np.array([v]) for v in (axes, centre, segment))
    count = enough(given[0], np.zeros((1, 2)))
    inside, rate = segment_by_edge(*given, count)
    assert inside[0] == pytest.approx(expected, abs=4e-15)
    step = 1e-5
    more, less = (segment_by_edge(given[0] * np.exp(s), *given[1:], count)[0][0] for s in (step, -step))
    assert rate[0] == pytest.approx((more - less) / (2.0 * step), rel=1e-8, abs=1e-10)
