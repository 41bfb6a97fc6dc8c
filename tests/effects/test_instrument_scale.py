"""An instrument that measures every distance a little too long."""

import numpy as np
import pytest
from helpers import commanded, tool_with

from thermal_robot.effects import InstrumentScale
from thermal_robot.kinematics import exp6
from thermal_robot.observations import Frames, observe

FRAMES = Frames(exp6([1.0, -2.0, 0.5, 0.4, 1.0, -0.3]), exp6([0.1, 0, 0.05, 0, 0, 0]))


@pytest.mark.parametrize("arm", ["rv_m2", "ur10", "panda"], indirect=True)
def test_a_scale_error_stretches_what_is_measured_about_the_instruments_origin(arm):
    campaign = commanded(arm)
    true = tool_with(campaign, InstrumentScale(), [0.0], FRAMES)
    np.testing.assert_allclose(tool_with(campaign, InstrumentScale(), [2e-4], FRAMES), 1.0002 * true, atol=1e-14)


def test_it_is_drawn_against_the_distance_from_the_instrument(rv_m2):
    observations = observe(commanded(rv_m2), FRAMES)
    parameters = InstrumentScale().parameters(observations)
    name, unit, values = InstrumentScale().driver(observations, parameters, np.zeros(10))
    assert (name, unit) == ("distance from the instrument", "m")
    # a scale error of one moves each point by its distance
    moved = tool_with(observations.campaign, InstrumentScale(), [1.0], FRAMES) - observations.predicted_position
    np.testing.assert_allclose(values, np.linalg.norm(moved, axis=1), rtol=1e-12)
