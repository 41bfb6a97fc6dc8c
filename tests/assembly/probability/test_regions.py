"""Discs and rectangles along chords: their areas, ends and crossings are those of the shapes."""

import numpy as np
import pytest

from thermal_robot.assembly.probability.planar import Disc, Rectangle

ANGLES = [0.0, 0.3, 0.5 * np.pi, -1.1, np.pi]


def turned(angle):
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


SIDES = np.array([[1.0, 2.0], [0.3, 0.3], [5.0, 0.1]])
REGIONS = {"disc": Disc(np.array([1.0, 0.2, 30.0]))} | {
    f"rectangle at {angle:.1f}": Rectangle(SIDES, turned(angle)) for angle in ANGLES
}
every_region = pytest.mark.parametrize("region", list(REGIONS.values()), ids=list(REGIONS))


def areas(region):
    if isinstance(region, Disc):
        return np.pi * region.radius**2
    return 4.0 * np.prod(region.half_sides, axis=1)


def contains(region, points, slack=0.0):
    """Whether points (3, K, 2) lie in their region; a definition that knows nothing of chords."""
    if isinstance(region, Disc):
        return np.linalg.norm(points, axis=-1) <= region.radius[:, None] * (1.0 + slack)
    return np.all(np.abs(points @ region.axes) <= region.half_sides[:, None] * (1.0 + slack) + slack, axis=-1)


@every_region
def test_chords_add_up_to_the_area(region):
    every, nodes = np.arange(3), np.polynomial.legendre.leggauss(20)
    total, breaks = np.zeros(3), region.breaks()
    assert np.all(np.diff(breaks, axis=1) >= 0.0)
    for left, right in zip(breaks.T[:-1], breaks.T[1:], strict=True):
        half = 0.5 * (right - left)[:, None]
        t = 0.5 * (right + left)[:, None] + half * nodes[0]
        low, high = region.chord(every, t)
        total += ((high - low) * region.abscissa(every, t)[1] * half) @ nodes[1]
    # Smooth between the breaks: twenty points on each panel are exact.
    np.testing.assert_allclose(total, areas(region), rtol=1e-12)


@every_region
def test_chords_end_on_the_boundary(region):
    every, breaks = np.arange(3), region.breaks()
    share = np.linspace(0.01, 0.99, 23)
    t = breaks[:, :1] + share * (breaks[:, -1:] - breaks[:, :1])
    x, _ = region.abscissa(every, t)
    for end, outwards in zip(region.chord(every, t), (-1.0, 1.0), strict=True):
        step = outwards * 1e-6 * np.abs(areas(region))[:, None] ** 0.5
        assert np.all(contains(region, np.stack([x, end - step], axis=-1), 1e-12))
        assert not np.any(contains(region, np.stack([x, end + step], axis=-1)))


@every_region
def test_parameter_undoes_the_abscissa_and_its_rate_is_the_derivative(region):
    every, breaks = np.arange(3), region.breaks()
    t = breaks[:, :1] + np.linspace(0.02, 0.98, 17) * (breaks[:, -1:] - breaks[:, :1])
    x, rate = region.abscissa(every, t)
    np.testing.assert_allclose(region.parameter(x), t, atol=1e-12)
    step = 1e-6
    after, before = (region.abscissa(every, t + sign * step)[0] for sign in (1.0, -1.0))
    np.testing.assert_allclose(rate, (after - before) / (2.0 * step), rtol=1e-6, atol=1e-9)
    # Beyond the region the parameter stays at its ends.
    far = np.full((3, 1), 1e9)
    np.testing.assert_array_equal(region.parameter(np.hstack([-far, far])), breaks[:, [0, -1]])


@every_region
@pytest.mark.parametrize("slope", [0.0, 0.7, -3.0])
def test_lines_enter_and_leave_at_the_crossings(region, slope):
    # A dense walk along each line finds where it enters and leaves; both places must be among the crossings.
    size = areas(region)[:, None] ** 0.5
    intercept = np.array([[0.0], [0.1], [-0.05]]) * size
    crossings = region.crossings(slope, intercept)
    reach = region.abscissa(np.arange(3), region.breaks()[:, [0, -1]])[0]
    x = np.linspace(reach[:, 0], reach[:, 1], 20_001, axis=1)
    within = contains(region, np.stack([x, slope * x + intercept], axis=-1))
    for row in range(3):
        changes = np.flatnonzero(np.diff(within[row]))
        for place in x[row, changes]:
            spacing = x[row, 1] - x[row, 0]
            assert np.min(np.abs(crossings[row] - place)) <= 1.5 * spacing


def test_a_line_that_misses_a_disc_gives_its_nearest_approach_twice():
    found = Disc(np.array([1.0])).crossings(-1.0, np.array([[4.0]]))
    np.testing.assert_allclose(found, [[2.0, 2.0]], rtol=1e-14)


def test_a_rectangle_along_the_axes_has_equal_chords():
    region = Rectangle(np.array([[2.0, 0.5]]), np.eye(2))
    low, high = region.chord(np.array([0]), np.array([[-1.9, 0.0, 1.9]]))
    np.testing.assert_array_equal(low, -0.5)
    np.testing.assert_array_equal(high, 0.5)
    np.testing.assert_array_equal(region.breaks(), [[-2.0, -2.0, 2.0, 2.0]])
