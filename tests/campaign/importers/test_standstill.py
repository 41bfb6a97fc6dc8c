"""A row for each rest of the robot, in its middle; short rests and those that nobody measured are counted."""

import numpy as np
import pytest
from campaign.importers.recordings import recorded

from thermal_robot.campaign.importers.rosbag import STANDSTILL, Stream, paired, stream
from thermal_robot.errors import CampaignError


def test_a_pair_for_each_rest(rv_m2):
    joints, target, path = recorded(rv_m2, np.random.default_rng(0), offset=7.0, start=0.0)
    pairs = paired(joints, target, 7.0)
    assert len(pairs.times) == len(path.poses)
    np.testing.assert_allclose(pairs.joints, path.poses, atol=1.1e-5)
    assert ((path.begins < pairs.times) & (pairs.times < path.ends)).all()


def test_an_offset_that_is_not_known_pairs_moving_samples(rv_m2):
    """What the estimate is good for: a second off, targets are centimetres away."""
    joints, target, _ = recorded(rv_m2, np.random.default_rng(0), offset=7.0, start=0.0)
    pairs = [paired(joints, target, lag) for lag in (7.0, 6.5, 6.0)]
    common = set.intersection(*(set(p.times.tolist()) for p in pairs))
    places = [p.target[[t in common for t in p.times]] for p in pairs]
    assert np.abs(places[0] - places[1]).max() < 1e-3  # still at rest
    assert np.abs(places[0] - places[2]).max() > 0.01


def test_rests_that_are_too_short_or_unmeasured_are_counted(rv_m2):
    joints, target, path = recorded(rv_m2, np.random.default_rng(0), offset=0.0, start=0.0, poses=10)
    assert paired(joints, target, 0.0, standstill=5.0).short == 10
    gap = (target.time < path.begins[4]) | (target.time > path.ends[4])
    holed = type(target)("t", target.time[gap], target.values[gap], target.names)
    pairs = paired(joints, holed, 0.0)
    assert (len(pairs.times), pairs.lonely) == (9, 1)
    far = paired(joints, holed, 0.0, tolerance=2.0)
    assert (len(far.times), far.lonely) == (10, 0)


@pytest.mark.parametrize("velocity", [1e-3, 5e-3])
def test_a_robot_that_creeps_does_not_stand(rv_m2, velocity):
    time = np.arange(0.0, 10.0, 0.01)
    creeping = 2e-3 * time[:, None] * np.ones(rv_m2.n)
    joints = recorded(rv_m2, np.random.default_rng(0), offset=0.0, poses=2)[0]
    joints = type(joints)("j", time, creeping, joints.names)
    target = type(joints)("t", time, np.zeros((len(time), 3)), ("x", "y", "z"))
    pairs = paired(joints, target, 0.0, velocity=velocity)
    assert len(pairs.times) == int(velocity > 2e-3)
    assert STANDSTILL < 10.0


def test_samples_are_put_in_order_and_gaps_left_out():
    time = np.array([3.0, 1.0, np.nan, 2.0, 1.0])
    values = np.array([[30.0], [10.0], [0.0], [np.nan], [11.0]])
    found = stream("f", time, values, ["x"])
    np.testing.assert_array_equal(found.time, [1.0, 3.0])
    np.testing.assert_array_equal(found.values, [[10.0], [30.0]])


def test_between_samples_and_nearest():
    line = Stream("f", np.array([0.0, 1.0, 3.0]), np.array([[0.0, 5], [2.0, 5], [6.0, 5]]), ("a", "b"))
    np.testing.assert_allclose(line.between(np.array([-1.0, 0.5, 2.0, 9.0])), [[0, 5], [1, 5], [4, 5], [6, 5]])
    np.testing.assert_array_equal(line.nearest(np.array([-4.0, 0.4, 0.6, 1.9, 2.1, 7.0])), [0, 0, 1, 1, 2, 2])
    np.testing.assert_allclose(line.scaled(np.array([10.0, 1.0])).values[2], [60.0, 5.0])


def test_one_sample_is_no_recording():
    with pytest.raises(CampaignError, match="f: has fewer than two samples; found 1 of x"):
        stream("f", np.array([1.0, 1.0]), np.zeros((2, 1)), ["x"])
