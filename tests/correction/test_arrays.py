"""Samples from arrays: conditions by names that somebody knows."""

import numpy as np
import pytest

from thermal_robot.campaign import Settings
from thermal_robot.correction.model import of_arrays
from thermal_robot.errors import CampaignError


def samples(robot, q, conditions, needs=()):
    return of_arrays(robot, Settings("", robot.tool_frame), q, conditions, needs)


def test_a_number_counts_for_all_rows(rv_m2):
    found = samples(rv_m2, np.zeros((3, 5)), {"temperature": 24, "payload": [0.0, 1.0, 2.0]})
    assert found.q.shape == (3, 5)
    np.testing.assert_array_equal(found.covariates["temperature"], [24.0] * 3)
    np.testing.assert_array_equal(found.covariates["payload"], [0.0, 1.0, 2.0])
    assert samples(rv_m2, np.zeros(5), {}).samples == 1


@pytest.mark.parametrize(
    ("name", "meant"),
    [("temprature", "temperature"), ("aproach.joint_3", "approach.joint_3"), ("approach.joint_9", "approach.joint_")],
)
def test_a_name_that_nothing_has_is_refused_with_the_one_that_was_meant(rv_m2, name, meant):
    with pytest.raises(CampaignError, match=rf"column '{name}': nothing has this name; did you mean '{meant}.*tempera"):
        samples(rv_m2, np.zeros(5), {name: 1.0}, ["temperature"])


def test_any_column_of_a_campaign_and_any_that_the_model_needs_is_known(rv_m2):
    link = rv_m2.urdf_links[2]
    known = ["order", "tilt.x", f"tilt.{link}.y", f"temperature.{link}", "torque.joint_2", "humidity"]
    assert set(samples(rv_m2, np.zeros(5), dict.fromkeys(known, 1.0), ["humidity"]).covariates) == set(known)
    with pytest.raises(CampaignError, match=r"'humidity': nothing has this name.*needs no condition"):
        samples(rv_m2, np.zeros(5), {"humidity": 1.0})


def test_what_is_no_row_of_numbers_is_refused(rv_m2):
    with pytest.raises(CampaignError, match=r"no rows of numbers.*an array \(N, 5\)"):
        samples(rv_m2, np.zeros((3, 5)), {"temperature": [1.0, 2.0]})
