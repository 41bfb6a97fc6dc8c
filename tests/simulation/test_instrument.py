"""Noise has the size that is stated, and nothing else changes with it."""

import numpy as np
import pytest

from thermal_robot import (
    CampaignError,
    simulate,
)
from thermal_robot.kinematics import quaternion_to_rotation


def poses_of(campaign):
    pose = np.tile(np.eye(4), (campaign.samples, 1, 1))
    pose[:, :3, :3] = quaternion_to_rotation(campaign.orientation)
    pose[:, :3, 3] = campaign.position
    return pose


def test_the_noise_has_the_size_that_is_stated(planar):
    given = dict(rows=4000, measures="pose", seed=8)
    exact = simulate(planar, **given)
    found = simulate(planar, noise=3e-5, noise_orientation=2e-4, **given)
    np.testing.assert_array_equal(found.q, exact.q)
    assert (found.noise_position, found.noise_orientation) == (3e-5, 2e-4)
    # 4000 rows tell each axis' sigma to 1.1 %
    np.testing.assert_allclose((found.position - exact.position).std(axis=0), 3e-5, rtol=0.05)
    turn = poses_of(found)[:, :3, :3] @ poses_of(exact)[:, :3, :3].transpose(0, 2, 1)
    about = 0.5 * np.column_stack(
        [turn[:, 2, 1] - turn[:, 1, 2], turn[:, 0, 2] - turn[:, 2, 0], turn[:, 1, 0] - turn[:, 0, 1]]
    )
    np.testing.assert_allclose(about.std(axis=0), 2e-4, rtol=0.05)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"noise": -1e-6}, "a noise cannot be negative"),
        ({"noise_orientation": 1e-4}, "only positions are measured"),
        ({"measures": "poses"}, 'expected "position" or "pose"'),
    ],
)
def test_an_instrument_that_cannot_be_is_refused(rv_m2, given, message):
    with pytest.raises(CampaignError, match=message):
        simulate(rv_m2, **given)
