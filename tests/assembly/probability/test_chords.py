"""Discs beside a normal part that is narrow one way, down to none: against integrals in many digits."""

import mpmath as mp
import numpy as np
import pytest
from assembly.probability.test_boundary import area

from thermal_robot.assembly.probability.planar import chords_resolve, disc_by_chords


def chances(axes, centre):
    """As the function is called: the second coordinate of the mean over the radius."""
    return disc_by_chords(np.array([axes]), np.array([[centre[0], centre[1] / axes[1]]]))


@pytest.mark.parametrize(
    ("axes", "centre"),
    [((1.0, 40.0), (0.0, 0.0)), ((2.0, 60.0), (1.0, 20.0)), ((0.5, 100.0), (0.2, 99.0)), ((3.0, 50.0), (0.0, 52.0))],
)
def test_chords_are_the_area(axes, centre):
    expected, missed = area(axes, centre)
    inside, outside, rate = (part[0] for part in chances(axes, centre))
    assert inside == pytest.approx(expected, rel=1e-11, abs=2e-15)
    assert outside == pytest.approx(missed, rel=1e-11)
    step = 1e-6
    more, less = (area(np.multiply(axes, np.exp(s)), centre)[0] for s in (step, -step))
    assert rate == pytest.approx((more - less) / (2.0 * step), rel=1e-7, abs=1e-9)


@pytest.mark.parametrize("wide", [0.3, 1.0, 3.0])
@pytest.mark.parametrize("beside", [0.0, 0.6, -0.95])
def test_without_a_narrow_part_a_single_chord_remains(wide, beside):
    inside, outside, _ = disc_by_chords(np.array([[wide, np.inf]]), np.array([[0.4, beside]]))
    half = wide * float(mp.sqrt(1 - mp.mpf(beside) ** 2))
    expected = float(mp.ncdf(half - 0.4) - mp.ncdf(-half - 0.4))
    assert inside[0] == pytest.approx(expected, rel=1e-13)
    assert inside[0] + outside[0] == pytest.approx(1.0, abs=1e-15)


def test_a_mean_that_no_chord_meets_is_outside():
    inside, outside, rate = disc_by_chords(np.array([[1.0, np.inf]]), np.array([[0.0, 1.5]]))
    assert (inside[0], outside[0], rate[0]) == (0.0, 1.0, 0.0)


def test_what_64_nodes_do_not_follow_is_said():
    at = np.array([[0.0, 0.0], [0.0, 1.0]])
    assert chords_resolve(np.array([[1e3, 1e6], [1e3, 1e4]]), at).tolist() == [True, False]
