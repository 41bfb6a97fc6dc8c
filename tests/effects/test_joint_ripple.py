"""Ripple of the gears as an effect: waves of a joint's own position, none at first."""

from dataclasses import replace

import numpy as np
import pytest
from simulate import simulate

from thermal_robot.effects import gate
from thermal_robot.effects.arguments import with_arguments
from thermal_robot.effects.joint_ripple import JointRipple
from thermal_robot.observations import observe
from thermal_robot.schema import MisfitError


@pytest.fixture(scope="module")
def observations(rv_m2):
    return observe(simulate(rv_m2, samples=40, seed=3)[0])


def test_it_begins_without_waves_and_gains_one_at_a_time(observations):
    none = JointRipple()
    assert gate.checked(none, observations) == ()
    assert none.share < 1e-100  # nothing that could be at work
    two = none.having("joint_2", 26.5, 1000.0).having("joint_3", 17.2, 500.0)
    assert [p.place for p in gate.checked(two, observations)] == ["joint_2", "joint_2", "joint_3", "joint_3"]
    # either wave was one of so many, and both are chosen for themselves
    assert two.share == pytest.approx(1.0 / 500_000.0)
    assert gate.alone(two, observations) == ()


def test_twenty_waves_are_some_of_very_many_and_are_restored_so():
    ripple = JointRipple()
    for order in range(20, 45):
        ripple = ripple.having("joint_2", float(order), 150.0)
    assert ripple.tried > 1e50
    assert with_arguments(JointRipple, {**vars(ripple), "joints": list(ripple.joints)}, "") == ripple
    with pytest.raises(MisfitError, match="from 1 on"):
        with_arguments(JointRipple, {"tried": np.inf}, "")


def test_a_wave_comes_back_so_many_times_in_a_turn(observations):
    ripple = JointRipple().having("joint_2", 12.0, 1.0)
    sine, cosine = (p.responses[0].values for p in gate.checked(ripple, observations))
    np.testing.assert_allclose(sine**2 + cosine**2, 1.0)
    j = observations.robot.joint_names.index("joint_2")
    phase = np.unwrap(np.arctan2(sine, cosine)[np.argsort(observations.q[:, j])])
    moved = np.sort(observations.q[:, j])
    # between neighbours a twelfth of a turn is one whole wave
    turns = np.round((12.0 * np.diff(moved) - np.diff(phase)) / (2.0 * np.pi), 9)
    np.testing.assert_allclose(turns, np.round(turns), atol=1e-6)


def test_it_is_drawn_against_the_joint_s_position(observations):
    ripple = JointRipple().having("joint_2", 12.0, 1.0)
    own = gate.checked(ripple, observations)
    name, unit, values = gate.driver(ripple, observations, own, np.zeros(40))
    assert (name, unit) == ("position of joint_2", "rad")
    np.testing.assert_array_equal(values, observations.q[:, observations.robot.joint_names.index("joint_2")])


def test_an_order_of_the_motor_is_called_so(observations):
    stated = replace(observations, campaign=replace(observations.campaign, gears={"joint_2": 50.0, "joint_3": 80.0}))
    ripple = JointRipple().having("joint_2", 100.08, 1.0).having("joint_2", 24.9, 1.0).having("joint_3", 100.0, 1.0)
    labels = [p.label for p in gate.checked(ripple, stated)][::2]
    assert labels == [
        "sine, order 100.08 (2 a turn of the motor)",
        "sine, order 24.9 (1/2 a turn of the motor)",
        "sine, order 100",
    ]
