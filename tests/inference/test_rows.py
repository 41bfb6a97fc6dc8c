"""Which rows belong together: repeats of a pose, neighbours in joint space, spells of time, folds."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.distance import cdist
from simulate import commands

from thermal_robot.campaign import Campaign
from thermal_robot.inference.rows import (
    folds,
    near_repeats,
    neighbourhoods,
    spells,
)
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
