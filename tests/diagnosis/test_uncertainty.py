"""Deviations widen where neighbours err alike; 95 % of fresh rows lie within 1.96 of those of predictions."""

from dataclasses import replace

import numpy as np
import pytest
from conftest import load_arm
from helpers import NOISE
from simulate import simulate

from thermal_robot import diagnose
from thermal_robot.diagnosis.uncertainty import inflated_for_structure
from thermal_robot.effects import JointGain, choose
from thermal_robot.inference.fit import fit
from thermal_robot.kinematics import Displacement
from thermal_robot.observations import Frames, observe

GAIN, JOINT = 1.5e-3, 1


def warped(robot, seed, size):
    """An arm whose second joint has a wrong gain, in a world in which every joint errs smoothly with all of them."""
    plain = replace(simulate(robot, seed=seed, noise=NOISE)[0], priors={})
    rng, error = np.random.default_rng([seed, 1]), np.zeros_like(plain.q)
    for j in range(plain.q.shape[1]):
        for _ in range(3):
            error[:, j] += size * np.sin(
                plain.q @ rng.normal(scale=0.7, size=plain.q.shape[1]) + rng.uniform(0.0, 6.28)
            )
    error[:, JOINT] += GAIN * plain.q[:, JOINT]
    true = observe(plain, Frames.declared(plain), displacement=Displacement(joint=error)).predicted_position
    return replace(plain, position=true + NOISE * rng.normal(size=true.shape))


def told(known):
    """Value and deviation of the second joint's gain."""
    e, b = known.explanation, known.explanation.block_of(JointGain())
    own = [p.place for p in e.linear.blocks[b].parameters].index(known.corrected.robot.joint_names[JOINT])
    values, covariance = e.values[b]
    return values[own], float(np.sqrt(covariance[own, own]))


@pytest.fixture(scope="module")
def off(rv_m2):
    """(seeds, 2) how far the gain is off in a smooth world, in deviations before and after."""
    found = []
    for seed in range(12):
        known = fit(warped(rv_m2, seed, 2e-4), [JointGain()])
        found.append([(told(k)[0] - GAIN) / told(k)[1] for k in (known, inflated_for_structure(known))])
    return np.array(found)


@pytest.mark.slow
def test_the_posterior_is_five_times_too_sure_where_neighbours_err_alike(off):
    """What is smooth enough to be taken for a gain cannot be told from one: two thirds too sure is what is left."""
    alone, wider = np.sqrt((off**2).mean(axis=0))
    assert alone > 4.0
    assert 0.7 < wider < 2.0
    assert (np.abs(off[:, 1]) <= np.abs(off[:, 0]) + 1e-12).all()


def test_independent_noise_leaves_deviations_nearly_as_they_are(rv_m2):
    times = []
    for seed in range(3):
        known = fit(warped(rv_m2, seed, 0.0), [JointGain()])
        wider = inflated_for_structure(known)
        assert told(wider)[0] == told(known)[0]
        times.append(told(wider)[1] / told(known)[1])
    assert min(times) >= 1.0 - 1e-9
    assert np.median(times) < 1.3


def test_a_discrepancy_counts_no_more_than_what_is_left(rv_m2):
    """Its likelihood may take it for a thousand times as large: in what the effects take it is not seen."""
    known = fit(warped(rv_m2, 0, 2e-4), [JointGain()])
    e = known.explanation
    assert e.discrepancy.kernel is not None
    grown = [replace(e, discrepancy=replace(e.discrepancy, tau=times * e.discrepancy.tau)) for times in (1e2, 1e4)]
    stds = [told(inflated_for_structure(replace(known, explanation=each)))[1] for each in (e, *grown)]
    assert stds[1] == pytest.approx(stds[2], rel=1e-9)
    assert told(known)[1] < stds[0] <= stds[1] * (1.0 + 1e-9)


def test_no_axis_becomes_wider_than_its_prior(rv_m2):
    known = fit(simulate(rv_m2, ["geometric"], seed=3)[0], choose(("geometric",)))
    (b,) = known.explanation.best.blocks
    prior = known.explanation.linear.blocks[b].sizes * known.explanation.best.scales[b]
    narrow, wide = (k.explanation.values[b][1] / np.outer(prior, prior) for k in (known, inflated_for_structure(known)))
    assert np.linalg.eigvalsh(wide - narrow).min() > -1e-9
    assert np.linalg.eigvalsh(wide).max() <= max(1.0, np.linalg.eigvalsh(narrow).max()) + 1e-9


def test_a_diagnosis_that_leaves_noise_alone_and_a_fit_of_nothing_keep_them(rv_m2):
    # a diagnosis that leaves noise alone keeps them
    plain = simulate(rv_m2, ["joint_gain"], seed=4, noise=NOISE, ratio=(5.0, 6.0))[0]
    found = diagnose(plain, effects=(), only=("joint_gain",))
    assert not found.unexplained.flagged
    (gain,) = (f for f in found.effects if f.name == "joint_gain")
    known = fit(plain, choose(("joint_gain",)))
    ((effect, _),) = known.effects
    deviations = np.sqrt(np.diag(known.explanation.values[known.explanation.best.blocks[0]][1]))
    assert [p.std for p in gain.parameters if p.identified] == pytest.approx(deviations.tolist(), rel=1e-6)
    assert effect.name == "joint_gain"
    # A smooth discrepancy and no effect, as where frames are known and no candidate is worth its place.
    known = fit(warped(rv_m2, 0, 2e-4), [])
    assert known.explanation.discrepancy.kernel is not None
    assert inflated_for_structure(known) is known


MIXTURES = (["joint_offset"], ["thermal_elongation"], ["joint_compliance"], ["transmission_error"], ["geometric"], [])


def within(prediction, measured):
    return np.abs(measured - prediction.position) < 1.96 * prediction.std


@pytest.mark.slow
def test_fresh_rows_of_simulated_robots():
    """Over cases and rows together, with the instrument's noise and without."""
    noisy, clean, rng = [], [], np.random.default_rng(20)
    for robot in (load_arm("rv_m2"), load_arm("ur10")):
        for seed, effects in enumerate(MIXTURES):
            for samples in (60, 150):
                campaign, _, (fresh, place) = simulate(robot, effects, samples=samples, seed=40 + seed, fresh=200)
                model = diagnose(campaign).model
                measured = place + rng.normal(scale=NOISE, size=place.shape)
                noisy.append(within(model.prediction(fresh, noise=True), measured).mean())
                clean.append(within(model.prediction(fresh), place).mean())
    assert 0.93 < np.mean(noisy) < 0.97, noisy
    assert 0.90 < np.mean(clean), clean
    assert min(noisy) > 0.80, noisy


@pytest.mark.slow
def test_noisy_rows_beside_quiet_ones_make_predictions_no_less_certain(rv_m2):
    """What is no noise is told by the quiet rows; a fresh measurement has the noise of all rows."""
    campaign, _, (fresh, _) = simulate(rv_m2, ["joint_offset"], samples=200, seed=7, fresh=50)
    rng, times = np.random.default_rng(7), np.repeat([1.0, 10.0], 100)
    further = rng.normal(size=(200, 3)) * NOISE * np.sqrt(times**2 - 1.0)[:, None]
    both = replace(campaign, position=campaign.position + further, noise_position=None, noise_of_rows=NOISE * times)
    half = diagnose(campaign.take(np.arange(100))).model
    whole = diagnose(both).model
    own, other = (model.prediction(fresh).std for model in (whole, half))
    assert np.median(own / other) == pytest.approx(1.0, abs=0.35)
    noisy = whole.prediction(fresh, noise=True).std
    assert np.sqrt(np.median(noisy**2 - own**2)) == pytest.approx(NOISE * np.sqrt(50.5), rel=0.1)
