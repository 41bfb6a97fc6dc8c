"""Eccentric gears and encoders: periods on the joint's side and on the motor's."""

import re

import numpy as np
import pytest
from helpers import commanded, tool_at, tool_with

from thermal_robot.effects import TransmissionError
from thermal_robot.effects.gate import checked
from thermal_robot.observations import observe


@pytest.mark.parametrize("arm", ["rv_m2", "ur10", "panda"], indirect=True)
def test_a_transmission_error_is_periodic_in_the_joint_and_in_the_motor(arm):
    campaign = commanded(arm, gears={arm.joint_names[1]: 101.0})
    parameters = TransmissionError().parameters(observe(campaign))
    values = 1e-3 * (1.0 + np.arange(len(parameters)))
    q = campaign.q.copy()
    for parameter, value in zip(parameters, values, strict=True):
        shape, order = re.match(r"(sine|cosine), order (\d+)", parameter.label).groups()
        j = arm.joint_names.index(parameter.place)
        q[:, j] += value * (np.sin if shape == "sine" else np.cos)(int(order) * campaign.q[:, j])
    assert len(parameters) == 4 * arm.n + 4
    np.testing.assert_allclose(tool_with(campaign, TransmissionError(), values), tool_at(arm, q), atol=1e-14)


def test_one_wheel_alone_has_the_parameters_of_its_joint(rv_m2):
    observations = observe(commanded(rv_m2, gears={"joint_3": 50.0}))
    whole, one = (checked(e, observations) for e in (TransmissionError(), TransmissionError(places=("joint_3",))))
    assert [p.name for p in one] == [p.name for p in whole if p.place == "joint_3"]
    assert len(one) == 8


def test_a_slide_has_a_period_only_behind_a_gear(awkward):
    slide = next(n for n, kind in zip(awkward.joint_names, awkward.joint_types, strict=True) if kind == "prismatic")
    without, with_gear = (
        [p for p in TransmissionError().parameters(observe(commanded(awkward, gears=g))) if p.place == slide]
        for g in ({}, {slide: 400.0})
    )
    assert without == []
    assert {(p.label, p.unit) for p in with_gear} == {
        (f"{shape}, order {order}", "m") for shape in ("sine", "cosine") for order in (400, 800)
    }


def test_it_is_drawn_against_the_joints_own_position(rv_m2):
    observations = observe(commanded(rv_m2))
    for parameter in TransmissionError().parameters(observations):
        name, unit, values = TransmissionError().driver(observations, [parameter], np.zeros(10))
        assert (name, unit) == (f"position of {parameter.place}", "rad")
        order = float(parameter.label.split()[-1])
        shape = np.sin if parameter.label.startswith("sine") else np.cos
        np.testing.assert_allclose(parameter.responses[0].values, shape(order * values), atol=1e-15)


def test_wheels_of_either_side_and_single_orders_are_settings(rv_m2):
    """Without a stated ratio there is one side; each setting has just the orders of its wheels."""

    def orders(effect, here):
        found = {p.label.split()[-1] for p in checked(effect, here) if p.place == "joint_3"}
        return frozenset(int(order) for order in found)

    plain = observe(commanded(rv_m2))
    assert {orders(e, plain) for e in TransmissionError().variants(plain)} == {
        frozenset(own) for own in ((1, 2), (1,), (2,))
    }
    geared = observe(commanded(rv_m2, gears={"joint_3": 50.0}))
    found = [orders(e, geared) for e in TransmissionError().variants(geared)]
    both = ((1, 2, 50, 100), (1, 2), (50, 100), (1,), (2,), (50,), (100,))
    assert found == [frozenset(own) for own in both]
