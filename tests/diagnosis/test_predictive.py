"""Of fresh rows, 95 % lie within 1.96 of the deviations that a model tells, on simulated and on real robots."""

import os
from dataclasses import replace

import numpy as np
import pytest
from conftest import load_arm
from simulate import simulate

from thermal_robot import diagnose

DATA = os.environ.get("THERMAL_ROBOT_DATA")

NOISE = 25e-6
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
