"""Samples in the sequence of their clock: gaps and repeated instants go, what lies between is on straight lines."""

import numpy as np
import pytest

from thermal_robot.campaign.importers.streams import Stream, stream
from thermal_robot.errors import CampaignError


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
