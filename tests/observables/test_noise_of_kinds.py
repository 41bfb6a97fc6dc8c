"""Kinds of rows side by side: the noise of each is what the fit, or its own repeats, tell, where none is stated."""

from dataclasses import replace

import numpy as np
import pytest
from observables.test_along import TRUE, measured, read_as

import thermal_robot as tr
from thermal_robot.campaign.read import more_rows
from thermal_robot.diagnosis.next_measurement import next_samples
from thermal_robot.effects import library
from thermal_robot.effects.gate import checked
from thermal_robot.inference.columns import unknown_frames
from thermal_robot.inference.fit import fit_named
from thermal_robot.inference.variance_components import reweighted, weighted_fit
from thermal_robot.planning.plan import foreseen

FINE, COARSE = 2e-5, 6e-4


@pytest.fixture(scope="module")
def ur10():
    return tr.load_robot("example-robot-data:ur10", "tool0")


def mixed(robot, seed, rows=160, kinds=("plane", "distance")):
    """Half the rows touch planes, the others draw a wire that is thirty times as noisy; nothing is stated."""
    campaign = read_as(measured(robot, noise=FINE, rows=rows, seed=seed), kinds)
    kind, reading = campaign.labels["kind"], campaign.readings["distance"]
    jitter = (kind == "distance") * np.random.default_rng(seed).normal(scale=COARSE, size=campaign.samples)
    return replace(campaign, readings={**campaign.readings, "distance": reading + jitter}, noise_position=None)


def stated(campaign):
    return replace(campaign, noise_of_rows=np.where(campaign.labels["kind"] == "distance", COARSE, FINE))


def offsets(campaign):
    """Fit joint zeros; return the fit, and by how much the four that are seen are off, rms, rad."""
    fit = fit_named(campaign, [library()["joint_offset"]])
    ((effect, values),) = fit.effects
    found = {p.place: v for p, v in zip(checked(effect, fit.nominal), values, strict=True)}
    seen = [found[name] for name in campaign.robot.joint_names[1:5]]
    return fit, float(np.sqrt(np.mean((np.array(seen) - TRUE[1:5]) ** 2)))


def test_the_noisier_kind_counts_for_less_as_if_it_had_been_stated(ur10):
    found = [(offsets(own), offsets(stated(own))) for own in (mixed(ur10, seed) for seed in range(3))]
    for (fit, off), (_, known) in found:
        ratios = fit.campaign.noise_of_kinds
        assert ratios["distance"] / ratios["plane"] == pytest.approx(COARSE / FINE, rel=0.4)
        assert off == pytest.approx(known, rel=0.2, abs=2e-6)
        # what the fit is given leaves what it gave: the ratios are a fixed point
        assert reweighted(fit.campaign, fit.explanation) is fit.campaign
    assert max(off for (_, off), _ in found) < 4e-5


def test_leverages_sum_to_what_the_fit_takes_up(ur10):
    """The trace of a projection is its rank: parameters that the data determine, and frames."""
    fit, _ = offsets(stated(mixed(ur10, 0)))
    e, flat = fit.explanation, len(unknown_frames(fit.campaign))
    left, each = weighted_fit(e, e.whitening.sigma() * e.best.noise)
    assert each.sum() == pytest.approx(flat + e.best.effective, rel=1e-6)
    assert (each >= 0.0).all()
    assert (each[e.outliers] == 0.0).all()
    np.testing.assert_allclose(left, e.remainder, atol=1e-9)


def test_a_kind_that_is_hardly_checked_by_others_keeps_the_noise_of_all(ur10):
    """Thirty-two draws of a wire from four places leave a redundancy of sixteen: too few to tell their noise."""
    campaign = mixed(ur10, 1)
    kind, anchor = campaign.labels["kind"], campaign.labels["anchor"]
    far = [np.flatnonzero((kind == "distance") & (anchor == own))[:8] for own in np.unique(anchor)]
    few = campaign.take(np.sort(np.concatenate([np.flatnonzero(kind == "plane"), *far])))
    assert "distance" not in offsets(few)[0].campaign.noise_of_kinds
    assert offsets(stated(campaign))[0].campaign.noise_of_kinds == {}


def test_new_rows_are_weighed_as_the_old_ones_of_their_kind(ur10):
    campaign = replace(mixed(ur10, 2), noise_of_kinds={"plane": 0.1, "distance": 1.4})
    new = more_rows(campaign, mixed(ur10, 3), ())
    np.testing.assert_array_equal(new.relative_noise, campaign.relative_noise)


@pytest.mark.parametrize("kinds", [("plane",), ("plane", "distance")])
def test_repeats_tell_the_noise_of_each_kind_by_what_it_sees(ur10, kinds):
    """A plane sees one component of three: its repeats read 58 % of the noise, and so noise was called structure."""
    sigma = {"plane": FINE, "distance": 1e-4}
    once = read_as(measured(ur10, rows=60, seed=3), kinds)
    campaign = replace(once.take(np.repeat(np.arange(60), 4)), noise_position=None)
    kind, rng = campaign.labels["kind"], np.random.default_rng(4)
    of = {"height": "plane", "distance": "distance"}
    readings = {
        name: values + (kind == of[name]) * rng.normal(scale=sigma[of[name]], size=campaign.samples)
        for name, values in campaign.readings.items()
    }
    found = tr.diagnose(replace(campaign, readings=readings))
    assert found.gap.noise_source == "repeats"
    assert not found.unexplained.flagged
    told = {own.kind: own.noise_floor for own in found.gap.kinds} or {"plane": found.gap.noise_floor}
    assert set(told) == set(kinds)
    for own, floor in told.items():
        assert floor == pytest.approx(sigma[own], rel=0.25)


def test_next_samples_are_of_the_kind_that_tells_more(ur10):
    """A wire that is thirty times as noisy as a plane is worth a thousandth of it; both counted alike."""
    known = tr.diagnose(stated(mixed(ur10, 0)), only=["joint_offset"])
    samples = next_samples(known.fit, count=10).samples
    assert all("plane" in sample.labels for sample in samples)
    assert samples[-1].gain > 0.5


def test_what_is_foreseen_is_by_the_noise_of_each_row(ur10):
    both = stated(mixed(ur10, 0))
    touched = both.take(both.labels["kind"] == "plane")
    (whole,), (planes,) = (foreseen(own, "joint_offset") for own in (both, touched))
    assert sum(p.told for p in planes.parameters) == 4
    for one, other in zip(whole.parameters, planes.parameters, strict=True):
        assert 0.9 * other.sigma < one.sigma <= other.sigma * (1.0 + 1e-9)
