"""From values to displacement: sums in every channel, zero for nothing, and every answer through the gate."""

from dataclasses import dataclass

import numpy as np
import pytest
from helpers import SAMPLES, commanded

from thermal_robot import EffectError
from thermal_robot.effects import (
    BaseFrame,
    Drift,
    Effect,
    Geometric,
    InstrumentScale,
    JointGain,
    JointOffset,
    Parameter,
    ThermalElongation,
    ToolFrame,
    at_joint,
)
from thermal_robot.effects.apply import displacement
from thermal_robot.observations import observe


def seen(robot):
    return observe(
        commanded(robot, {"temperature": np.linspace(20.0, 30.0, SAMPLES), "time": np.arange(SAMPLES, dtype=float)})
    )


def test_no_effect_displaces_nothing(rv_m2):
    moved, instrument = displacement(seen(rv_m2), [])
    assert instrument is None
    shapes = [np.shape(a) for a in (moved.joint, moved.segment, moved.base, moved.tool)]
    assert shapes == [(SAMPLES, 5), (SAMPLES, len(rv_m2.segments), 6), (SAMPLES, 6), (SAMPLES, 6)]
    assert not any(np.any(a) for a in (moved.joint, moved.segment, moved.base, moved.tool))


def test_effects_add_up_in_any_order_and_are_linear_in_their_values(rv_m2):
    observations, rng = seen(rv_m2), np.random.default_rng(0)
    kinds = (
        JointOffset(),
        JointGain(),
        ThermalElongation(),
        Geometric(),
        Drift(span=9.0),
        BaseFrame(),
        ToolFrame(),
        InstrumentScale(),
    )
    held = [(e, rng.normal(size=len(e.parameters(observations)))) for e in kinds]

    def flat(effects):
        moved, instrument = displacement(observations, effects)
        parts = (moved.joint, moved.segment, moved.base, moved.tool, 0.0 if instrument is None else instrument)
        return [np.asarray(part) for part in parts]

    whole, alone = flat(held), [flat([item]) for item in held]
    for k, together in enumerate(whole):
        np.testing.assert_allclose(together, sum(one[k] for one in alone), atol=1e-12)
        np.testing.assert_allclose(flat(held[::-1])[k], together, atol=1e-12)
        np.testing.assert_allclose(flat([(e, -2.0 * v) for e, v in held])[k], -2.0 * together, atol=1e-12)
        assert np.any(together)


def test_an_offset_is_a_displacement_of_its_joint_alone(rv_m2):
    moved, _ = displacement(seen(rv_m2), [(JointOffset(), np.array([0.0, 2e-3, 0.0, 0.0, 0.0]))])
    np.testing.assert_array_equal(moved.joint, np.tile([0.0, 2e-3, 0.0, 0.0, 0.0], (SAMPLES, 1)))
    assert not np.any(moved.segment)


def test_values_that_are_not_the_parameters_are_refused(rv_m2):
    with pytest.raises(EffectError, match="'joint_offset' was fitted with 4 parameters and has 5 in these rows"):
        displacement(seen(rv_m2), [(JointOffset(), np.zeros(4))])


@dataclass(frozen=True)
class Far(Effect):
    """A joint that the robot does not have."""

    name = "far"

    def parameters(self, observations):
        return (Parameter("sag", "rad", 1e-3, "joint", "joint_9", (at_joint(8, 1.0),)),)


def test_an_answer_that_breaks_the_contract_is_refused(rv_m2):
    with pytest.raises(EffectError, match=r"'far', parameter 'sag, joint_9'.*index is 8"):
        displacement(seen(rv_m2), [(Far(), np.zeros(1))])
