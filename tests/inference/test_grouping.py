"""Which rows belong together: repeats of a pose, neighbours in joint space, blocks."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.distance import cdist
from simulate import commands

from thermal_robot.campaign import Campaign
from thermal_robot.inference.grouping import (
    blocks,
    consecutive_outliers,
    in_order,
    near_repeats,
    neighbourhoods,
    repeated_poses,
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
            block = blocks(rows)
            for pose in range(30):
                assert len(set(block[number == pose])) == 1
            near = cdist(rows.q, rows.q) < NEAR
            assert (block[:, None] == block[None, :])[near].all()


def test_points_of_two_paths_are_not_the_same_pose_whatever_they_are_called(rv_m2):
    label = {"path": np.array(["a", "a", "b", "b", "a", ""]), "pose": np.array(["1", "2", "1", "", "1", "1"])}
    campaign = Campaign("paths", rv_m2, commands(rv_m2, 6, np.random.default_rng(1)), labels=label)
    assert campaign.pose_labels.tolist() == ["a / 1", "a / 2", "b / 1", "", "a / 1", "1"]
    number = repeated_poses(campaign)
    assert number[0] == number[4]
    assert len({*number.tolist()}) == 5
    assert repeated_poses(campaign.take([3, 5]))[0] != repeated_poses(campaign.take([3, 5]))[1]


def test_a_path_is_not_one_single_repeat(rv_m2):
    """Samples along a path lie within a hair of each other from end to end: they still make blocks."""
    along = np.linspace(0.0, 1.0, 500)[:, None]
    ends = commands(rv_m2, 2, np.random.default_rng(2))
    path = Campaign("path", rv_m2, ends[0] + along * (ends[1] - ends[0]))
    assert np.linalg.norm(np.diff(path.q, axis=0), axis=1).max() < NEAR
    block = blocks(path)
    assert np.bincount(block).max() <= 50
    assert len(set(block)) >= 10


@pytest.mark.parametrize("samples", [20, 47, 120, 1000])
def test_blocks_are_consecutive_in_time_and_of_one_size(rv_m2, samples):
    rng = np.random.default_rng(3)
    q = rng.uniform(-1.5, 1.5, (samples, 5))
    time = rng.permutation(samples).astype(float)
    block = blocks(Campaign("long", rv_m2, q, covariates={"time": time}))
    order = block[np.argsort(time)]
    assert (np.diff(order) >= 0).all()
    assert set(block) == set(range(20))
    assert np.ptp(np.bincount(block)) <= 1
    assert set(blocks(Campaign("long", rv_m2, q))) == set(range(20))


def clocked(robot, **columns):
    """Twelve rows whose clock runs otherwise than the file."""
    q = commands(robot, 12, np.random.default_rng(5))
    return Campaign("clocked", robot, q, covariates={k: np.asarray(v, dtype=float) for k, v in columns.items()})


def test_rows_follow_each_other_by_the_clock_and_stand_in_a_row_where_three_do(rv_m2):
    # rows follow each other by the clock and without one as in the file
    backwards = np.arange(12.0)[::-1]
    np.testing.assert_array_equal(in_order(clocked(rv_m2)), np.arange(12))
    np.testing.assert_array_equal(in_order(clocked(rv_m2, time=backwards)), np.arange(12)[::-1])
    np.testing.assert_array_equal(in_order(clocked(rv_m2, order=backwards)), np.arange(12)[::-1])
    # the time is the better clock; rows of one time stay as they are
    both = clocked(rv_m2, time=np.arange(12.0) // 3, order=backwards)
    np.testing.assert_array_equal(in_order(both), np.arange(12))
    # of rows set aside those that follow each other thrice stand in a row
    time = np.array([0, 6, 1, 7, 2, 8, 3, 9, 4, 10, 5, 11])
    aside = np.isin(np.arange(12), [0, 1, 2, 4, 9, 10, 11])
    # by the clock: rows 0, 2, 4 at 0, 1, 2; rows 10, 1 at 5 and 6; rows 9, 11 at 10 and 11
    own = consecutive_outliers(clocked(rv_m2, time=time), aside)
    np.testing.assert_array_equal(np.flatnonzero(own), [0, 2, 4])
    # as they stand in the file: 0, 1, 2; then 4 alone; 9, 10, 11
    np.testing.assert_array_equal(np.flatnonzero(consecutive_outliers(clocked(rv_m2), aside)), [0, 1, 2, 9, 10, 11])
    for few in ([], [3], [3, 4], [3, 5, 7], [0, 1, 3, 4]):
        assert not consecutive_outliers(clocked(rv_m2), np.isin(np.arange(12), few)).any()
    # the first rows do not follow the last
    assert not consecutive_outliers(clocked(rv_m2), np.isin(np.arange(12), [0, 1, 11])).any()


@on_arms
def test_repeated_poses_are_those_of_one_command_or_label(arm):
    campaign, number = repeated(arm)
    np.testing.assert_array_equal(same(repeated_poses(campaign)), same(number))
    # what a controller's rounding leaves is one command; a tenth of a milliradian is another
    nearly = replace(campaign, q=np.round(campaign.q, 5) + 1e-8)
    np.testing.assert_array_equal(same(repeated_poses(nearly)), same(number))
    apart = replace(campaign, q=campaign.q + 1e-4 * np.arange(120)[:, None])
    assert len(set(repeated_poses(apart))) == 120
    # the label counts where there is one, an empty one stands alone
    label = np.array([f"p{k % 20}" for k in range(120)])
    label[:4] = ""
    far = replace(campaign, q=commands(arm, 120, np.random.default_rng(1)), labels={"pose": label})
    for rows in (repeated_poses(far), near_repeats(far)):
        for name in set(label) - {""}:
            assert len(set(rows[label == name])) == 1
        assert len(set(rows)) == 20 + 4


def same(labels):
    """(N, N) which rows share a label."""
    return labels[:, None] == labels[None, :]


def test_few_rows_make_few_blocks_and_boxes(rv_m2):
    q = commands(rv_m2, 3, np.random.default_rng(6))
    assert sorted(blocks(Campaign("three", rv_m2, q))) == [0, 1, 2]
    assert sorted(neighbourhoods(Campaign("three", rv_m2, q), 8)) == [0, 1, 2]
    alone = Campaign("one", rv_m2, q[[0, 0, 0]])
    assert set(blocks(alone)) == {0}


def test_neighbourhoods_are_boxes_of_joint_space(rv_m2):
    """Two of them are kept apart by one joint at least; the joint that varies most is split first."""
    q = np.random.default_rng(7).uniform(-1.0, 1.0, (256, 5)) * [0.1, 1.0, 0.3, 0.1, 0.1]
    campaign = Campaign("boxes", rv_m2, q)
    half = neighbourhoods(campaign, 2)
    assert max(q[half == half[q[:, 1].argmin()], 1]) < min(q[half == half[q[:, 1].argmax()], 1])
    boxes = neighbourhoods(campaign, 16)
    assert np.ptp(np.bincount(boxes)) <= 1
    low = np.array([q[boxes == b].min(axis=0) for b in range(16)])
    high = np.array([q[boxes == b].max(axis=0) for b in range(16)])
    apart = (low[:, None] > high[None, :]) | (high[:, None] < low[None, :])
    assert (apart.any(axis=2) | np.eye(16, dtype=bool)).all()
