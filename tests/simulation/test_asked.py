"""Effects with values: by name, by place or as they are; what cannot be is refused with what was meant."""

from dataclasses import dataclass

import numpy as np
import pytest

from thermal_robot import (
    EffectError,
    simulate,
)
from thermal_robot.effects import Drift, Effect, Parameter, at_joint


@dataclass(frozen=True)
class Sag(Effect):
    """An effect of a user's own."""

    name = "sag"

    def parameters(self, observations):
        joints = enumerate(observations.robot.joint_names)
        return tuple(Parameter("sag", "rad", 1e-3, "joint", name, (at_joint(j, 1.0),)) for j, name in joints)


def test_an_effect_of_ones_own_and_a_setting_of_ones_own(planar):
    found = simulate(planar, {Sag(): {"elbow": 2e-3}}, rows=9)
    named = simulate(planar, {"joint_offset": {"elbow": 2e-3}}, rows=9)
    np.testing.assert_array_equal(found.position, named.position)
    # by name over the campaign, as it is over its own span
    by_name = simulate(planar, {"drift": {"translation x": 1e-3}}, rows=9)
    as_it_is = simulate(planar, {Drift(span=60.0): {"translation x": 1e-3}}, rows=9)
    sound = simulate(planar, rows=9)
    assert (by_name.position - sound.position)[-1, 0] == pytest.approx(1e-3, abs=1e-12)
    assert (as_it_is.position - sound.position)[-1, 0] == pytest.approx(8e-3, abs=1e-12)


@pytest.mark.parametrize(
    ("effects", "message"),
    [
        ({"backlsh": 1e-3}, "no effect is named 'backlsh'; did you mean 'backlash'"),
        ({"backlash": {"joint3": 1e-3}}, "no parameter 'joint3' here; did you mean 'joint_3'"),
        ({"backlash": {"lost motion": 1e-3}}, "'lost motion' is 5 parameters; name one of 'lost motion, joint_1'"),
        ({"backlash": -1e-3}, "'lost motion, joint_1': -0.001, expected a number, not negative, in rad"),
        ({"backlash": {"joint_1": float("nan")}}, "NaN, expected"),
        ({"joint_offset": True}, "true, expected a number in rad"),
        ({"joint_offset": "much"}, "'much', expected a number in rad"),
        ({"joint_offset": [1e-3] * 4}, "has 5 parameters, 4 values given"),
        ({"drift": 1e-4}, "one number cannot stand for parameters in m, rad"),
        ({"tracking_lag": 1e-3}, "it needs velocity.joint_1.*as conditions={'velocity.joint_1'"),
        ({"joint_ripple": 1e-3}, "no parameters here.*JointRipple\\(joints=…"),
        ({5: 1.0}, "5 is neither the name of an effect nor an effect"),
        ([5], "no effects with values"),
        ({"excess_repeatability": {"joint_9": 1.0}}, "no parameter 'joint_9'"),
    ],
)
def test_effects_that_cannot_be_are_refused(rv_m2, effects, message):
    with pytest.raises(EffectError, match=message):
        simulate(rv_m2, effects)


def test_an_effect_without_anything_to_follow_says_what_it_needs(rv_m2):
    with pytest.raises(EffectError, match="it needs temperature; give"):
        simulate(rv_m2, {"thermal_elongation": 1e-5}, conditions={"temperature": None})


def test_a_robot_that_is_warm_all_the_time_is_larger_by_the_same_share(rv_m2):
    cold = simulate(rv_m2, conditions={"temperature": 20.0})
    warm = simulate(rv_m2, {"thermal_elongation": 1e-5}, conditions={"temperature": 32.0})
    np.testing.assert_allclose(warm.position, (1.0 + 12e-5) * cold.position, rtol=0.0, atol=1e-12)
