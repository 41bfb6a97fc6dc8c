"""What was not used for the fit was not used, and noise alone is neither explained nor shrunk."""

from dataclasses import replace

import numpy as np
import pytest
from simulate import simulate

from thermal_robot import diagnose

on_arms = pytest.mark.parametrize("arm", ["rv_m2", "ur10", "panda"], indirect=True)


@on_arms
def test_held_out_rows_are_fitted_as_badly_as_fresh_ones(arm):
    """Twenty parameters from sixty rows: the fit is 15 % closer to its own rows than to any others, held out or new."""
    to_fresh, to_own = [], []
    for seed in range(3):
        campaign, _, (fresh, place) = simulate(arm, ["geometric"], seed=seed, samples=60, fresh=200)
        found = diagnose(campaign, only=["geometric"])
        miss2 = ((found.model.predict(fresh)[0] - place) ** 2).sum(axis=1).mean() + 3.0 * 25e-6**2
        to_fresh.append(found.gap.held_out.rms_after / np.sqrt(miss2))
        to_own.append(found.gap.held_out.rms_after / found.gap.rms_after)
    assert 0.9 < np.mean(to_fresh) < 1.15
    assert np.mean(to_own) > 1.07


def noise_alone(robot):
    """Campaigns of a perfect robot, however they come."""
    yield simulate(robot, seed=0)
    yield simulate(robot, seed=1, turning=3e-5)
    yield simulate(robot, seed=2, outliers=0.1)
    yield simulate(robot, seed=3, samples=30)
    yield simulate(robot, seed=4, heavy=True)
    campaign, truth, _ = simulate(robot, seed=5)
    yield replace(campaign, noise_position=None), truth, None


@pytest.mark.parametrize("arm", ["rv_m2", "panda"], indirect=True)
def test_noise_is_not_explained_and_does_not_shrink(arm):
    named, flagged, shrinkage = [], [], []
    for campaign, truth, _ in noise_alone(arm):
        found = diagnose(campaign)
        named.append(found.verdict)
        flagged.append(found.unexplained.flagged)
        shrinkage.append(found.gap.held_out.shrinkage)
        kept = campaign.samples - len(found.outliers)
        assert set(found.outliers) >= {row for row in truth["outliers"] if far(campaign, found, row)}
        assert found.gap.rms_before / found.gap.noise_floor == pytest.approx(1.0, abs=4.0 / np.sqrt(3 * kept) + 0.2)
        assert "noise" in found.summary
    assert sum(bool(n) for n in named) + sum(flagged) <= 1, named
    assert np.median(shrinkage) < 0.005
    assert max(shrinkage) < 0.05


def far(campaign, found, row):
    """Whether a row lies ten noises from where the target is."""
    index = int(np.flatnonzero(campaign.rows == row)[0])
    return np.linalg.norm(campaign.position[index] - found.model.predict(campaign)[0][index]) > 10.0 * 25e-6


def test_effects_that_are_not_at_work_would_not_shrink_held_out_rows(rv_m2):
    gains = []
    for seed in range(3):
        found = diagnose(simulate(rv_m2, seed=seed)[0])
        gains += [f.shrinkage for f in found.effects if f.status == "not_found"]
    assert len(gains) >= 24
    assert np.mean(gains) < 0.005
    assert max(gains) < 0.05
