"""Joint zeros that are off: the sign, the unit and what they are drawn against."""

import numpy as np
import pytest
from helpers import commanded, tool_at, tool_with

from thermal_robot.effects import JointOffset
from thermal_robot.observations import observe


@pytest.mark.parametrize("arm", ["rv_m2", "ur10", "panda", "awkward"], indirect=True)
def test_an_offset_adds_to_the_command(arm):
    campaign = commanded(arm)
    offset = 1e-2 * (1.0 + np.arange(arm.n))
    expected = tool_at(arm, campaign.q + offset)
    np.testing.assert_allclose(tool_with(campaign, JointOffset(), offset), expected, atol=1e-14)


def test_a_joint_that_turns_is_off_by_an_angle_and_one_that_slides_by_a_length(awkward):
    parameters = JointOffset().parameters(observe(commanded(awkward)))
    found = {p.place: (p.unit, p.size) for p in parameters}
    for joint, kind in zip(awkward.joint_names, awkward.joint_types, strict=True):
        assert found[joint] == (("m", 5e-4) if kind == "prismatic" else ("rad", 1e-3))


def test_it_is_drawn_against_the_joints_own_position(awkward):
    observations = observe(commanded(awkward))
    for parameter in JointOffset().parameters(observations):
        name, unit, values = JointOffset().driver(observations, [parameter], np.zeros(10))
        assert (name, unit) == (f"position of {parameter.place}", parameter.unit)
        np.testing.assert_array_equal(values, observations.q[:, awkward.joint_names.index(parameter.place)])
