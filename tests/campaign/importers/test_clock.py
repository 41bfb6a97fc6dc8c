"""The offset of two clocks: found within what is stated, with an honest deviation, and refused where there is none."""

import numpy as np
import pytest
from campaign.importers.recordings import TARGET, recorded

from thermal_robot.campaign.importers.rosbag import lag
from thermal_robot.errors import CampaignError

NOWHERE = np.zeros(3)


@pytest.mark.parametrize("offset", [0.347, -12.3, 1.5e9])
def test_a_known_offset_is_recovered_to_a_tenth_of_a_millisecond(rv_m2, offset):
    joints, target, _ = recorded(rv_m2, np.random.default_rng(1), offset=offset)
    found = lag(joints, target, rv_m2, NOWHERE)
    assert found.value == pytest.approx(offset, abs=1e-4)
    assert 0 < found.std < 1e-4
    assert found.left < 2 * np.sqrt(3) * 5e-5


def test_the_deviation_is_honest_where_the_robot_is_bent(rv_m2):
    """Errors of the robot that the fit does not know, of a millimetre, spoil the offset by no more than is told."""
    errors, told = [], []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        offset = rng.uniform(-20, 20)
        joints, target, _ = recorded(rv_m2, rng, offset=offset, bent=3e-3)
        found = lag(joints, target, rv_m2, NOWHERE)
        errors.append(found.value - offset)
        told.append(found.std)
    scores = np.array(errors) / told
    assert np.abs(errors).max() < 1e-3
    assert np.abs(scores).max() < 4.0
    assert 0.2 < np.sqrt((scores**2).mean()) < 2.0


def test_where_the_target_is_need_not_be_known(rv_m2):
    joints, target, _ = recorded(rv_m2, np.random.default_rng(3), offset=2.0)
    near, far = (lag(joints, target, rv_m2, place) for place in (TARGET, TARGET + 0.2))
    assert near.value == pytest.approx(far.value, abs=1e-5)


def test_two_motions_that_have_nothing_to_do_with_each_other_are_refused(rv_m2):
    joints = recorded(rv_m2, np.random.default_rng(1), offset=0.0)[0]
    target = recorded(rv_m2, np.random.default_rng(2), offset=0.0)[1]
    with pytest.raises(CampaignError, match=r"however the clocks differ; found \d+ mm rms of \d+ mm"):
        lag(joints, target, rv_m2, NOWHERE)


def test_a_robot_that_hardly_moves_tells_no_time(rv_m2):
    joints, target, _ = recorded(rv_m2, np.random.default_rng(1), offset=0.0, rate=2.0, poses=8)
    with pytest.raises(CampaignError, match="too few samples are in motion"):
        lag(joints, target, rv_m2, NOWHERE)
