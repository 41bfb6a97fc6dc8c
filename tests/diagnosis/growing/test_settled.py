"""The fit at rest: independent of where it begins, of the order of rows, and at the minimum that it claims."""

from dataclasses import replace

import numpy as np
import pytest
from growing_cases import far, in_full, measured

import thermal_robot as tr
from thermal_robot.diagnosis.growing.choice import Point
from thermal_robot.diagnosis.growing.settled import Begin, settled
from thermal_robot.diagnosis.growing.stream import begun
from thermal_robot.diagnosis.growing.sums import Seen
from thermal_robot.inference.frames import moved


def test_it_ends_at_the_same_place_wherever_it_begins(whole, grown):
    known = grown.fitted
    begin = replace(Begin.about(known), best=None, leverage=0.0, sigma=known.sigma)
    astray = replace(begin, point=Point(begin.point.frames, 1.3 * known.point.values))
    one, other = (settled(grown.choice, grown.sums, in_full(whole), b) for b in (begin, astray))
    assert one.steady
    assert other.steady
    assert far(one, other) < 1e-7


def test_the_order_of_rows_does_not_matter(whole, grown):
    mixed = whole.take(np.random.default_rng(2).permutation(whole.samples))
    one, other = (settled(grown.choice, grown.sums, in_full(c), Begin.about(grown.fitted)) for c in (whole, mixed))
    assert far(one, other) < 1e-7
    assert one.noise == pytest.approx(other.noise, rel=1e-10)
    assert set(whole.rows[one.single.aside]) == set(mixed.rows[other.single.aside])


def cost(grown, fitted, point):
    """What the fit makes least, by the exact model: weighed squares in units of the noise, and the priors'."""
    seen = Seen.at(fitted.single.campaign, point, grown.choice).alike[:, :, -1]
    sizes = np.concatenate([b.sizes * fitted.best.scales[k] for k, b in enumerate(grown.choice.blocks)])
    return (fitted.single.weights @ (seen / fitted.noise) ** 2).sum() + ((point.values / sizes) ** 2).sum()


def test_no_step_makes_the_cost_less(grown):
    fitted, names = grown.fitted, Seen.at(grown.single.campaign.take([0]), grown.fitted.point, grown.choice).names
    least, rng = cost(grown, fitted, fitted.point), np.random.default_rng(3)
    deviation = np.sqrt(np.diag(np.linalg.inv(fitted.products[:-1, :-1]))) * fitted.best.noise
    for _ in range(20):
        step = 0.1 * deviation * rng.normal(size=len(deviation))
        there = Point(moved(fitted.point.frames, step[: len(names)], names), fitted.point.values + step[len(names) :])
        assert cost(grown, fitted, there) > least


def test_gross_errors_are_set_aside_and_do_not_count(found, grown):
    assert grown.single.aside.sum() >= 20
    assert grown.fitted.count == found.samples - grown.single.aside.sum()
    assert np.sqrt(grown.fitted.squares[0] / grown.fitted.count) < 1.2 * np.sqrt(3.0) * 2e-5


@pytest.mark.parametrize("stated", [True, False])
def test_the_noise_is_found_whether_it_is_stated_or_not(stated):
    campaign = measured(200, seed=8)
    campaign = campaign if stated else replace(campaign, noise_position=None)
    fitted = begun(tr.diagnose(campaign, only=["joint_offset", "backlash"]).fit).fitted
    assert fitted.noise[0] == pytest.approx(2e-5, rel=0.1)
