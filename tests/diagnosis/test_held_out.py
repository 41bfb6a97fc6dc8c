"""What was not used for the fit was not used: folds, neighbours, and campaigns that hold nothing but noise."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.distance import cdist
from simulate import commands, simulate

from thermal_robot import diagnose
from thermal_robot.campaign import Campaign
from thermal_robot.inference.rows import folds, near_repeats, neighbourhoods, spells
from thermal_robot.inference.settings import NEAR

on_arms = pytest.mark.parametrize("arm", ["rv_m2", "ur10", "panda"], indirect=True)


def repeated(robot, poses=30, repeats=4, jitter=0.0, seed=0):
    """Every pose several times, in random order, each time a little elsewhere."""
    rng = np.random.default_rng(seed)
    number = rng.permutation(np.repeat(np.arange(poses), repeats))
    q = commands(robot, poses, rng)[number]
    nudge = rng.normal(size=q.shape)
    q = q + jitter * nudge / np.linalg.norm(nudge, axis=1, keepdims=True)
    return Campaign("repeated", robot, q), number


@on_arms
@pytest.mark.parametrize("jitter", [0.0, 0.45 * NEAR])
def test_repeats_of_a_pose_are_never_on_both_sides(arm, jitter):
    for seed in range(3):
        campaign, number = repeated(arm, jitter=jitter, seed=seed)
        for rows in (campaign, replace(campaign, covariates={"time": np.arange(120.0)[::-1]})):
            fold, block = folds(rows)
            for pose in range(30):
                assert len(set(fold[number == pose])) == 1
                assert len(set(block[number == pose])) == 1
            near = cdist(rows.q, rows.q) < NEAR
            assert (fold[:, None] == fold[None, :])[near].all()


def test_rows_that_share_a_label_belong_together_however_far_apart(rv_m2):
    q = commands(rv_m2, 60, np.random.default_rng(1))
    label = np.array([f"p{k % 20}" for k in range(60)])
    label[::7] = ""
    campaign = Campaign("labelled", rv_m2, q, labels={"pose": label})
    cluster = near_repeats(campaign)
    for name in set(label) - {""}:
        assert len(set(cluster[label == name])) == 1
    assert len(set(cluster)) == len(set(label) - {""}) + np.sum(label == "")


def test_a_path_is_not_one_single_repeat(rv_m2):
    """Samples along a path lie within a hair of each other from end to end: they still make five folds."""
    along = np.linspace(0.0, 1.0, 500)[:, None]
    ends = commands(rv_m2, 2, np.random.default_rng(2))
    path = Campaign("path", rv_m2, ends[0] + along * (ends[1] - ends[0]))
    assert np.linalg.norm(np.diff(path.q, axis=0), axis=1).max() < NEAR
    fold, block = folds(path)
    assert np.bincount(fold, minlength=5).min() >= 50
    assert len(set(block)) >= 10


@pytest.mark.parametrize("samples", [20, 47, 120, 1000])
def test_blocks_are_consecutive_in_time_and_of_one_fold(rv_m2, samples):
    rng = np.random.default_rng(3)
    q = rng.uniform(-1.5, 1.5, (samples, 5))
    time = rng.permutation(samples).astype(float)
    fold, block = folds(Campaign("long", rv_m2, q, covariates={"time": time}))
    order = block[np.argsort(time)]
    assert set(fold) == set(range(5))
    assert (np.diff(order) >= 0).all()
    assert len(set(block)) == 20
    assert all(len(set(fold[block == b])) == 1 for b in set(block))
    assert np.ptp(np.bincount(fold)) <= 5


def test_spells_and_neighbourhoods_share_the_rows_out_evenly(rv_m2):
    rng = np.random.default_rng(4)
    time = rng.permutation(200).astype(float)
    campaign = Campaign("rows", rv_m2, rng.uniform(-1, 1, (200, 5)), covariates={"time": time})
    label = spells(campaign, 10)
    assert (np.bincount(label) == 20).all()
    assert (np.diff(label[np.argsort(time)]) >= 0).all()
    boxes = neighbourhoods(campaign, 16)
    assert np.ptp(np.bincount(boxes)) <= 1
    inside = np.mean([campaign.q[boxes == b].var(axis=0).sum() for b in range(16)])
    assert inside < 0.7 * campaign.q.var(axis=0).sum()


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
