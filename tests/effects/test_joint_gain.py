"""Joints that move by a little more than commanded."""

import numpy as np
import pytest
from helpers import commanded, tool_at, tool_with

from thermal_robot.effects import JointGain
from thermal_robot.observations import observe


@pytest.mark.parametrize("arm", ["rv_m2", "ur10", "panda", "awkward"], indirect=True)
def test_a_gain_multiplies_the_command(arm):
    campaign = commanded(arm)
    gain = 1e-2 * (1.0 + np.arange(arm.n))
    expected = tool_at(arm, (1.0 + gain) * campaign.q)
    np.testing.assert_allclose(tool_with(campaign, JointGain(), gain), expected, atol=1e-14)


def test_what_drives_it_is_what_it_multiplies(rv_m2):
    observations = observe(commanded(rv_m2))
    for parameter in JointGain().parameters(observations):
        assert parameter.unit == "1"
        response = parameter.responses[0].values
        name, unit, values = JointGain().driver(observations, [parameter], response)
        assert (name, unit) == (f"position of {parameter.place}", "rad")
        np.testing.assert_array_equal(values, response)
