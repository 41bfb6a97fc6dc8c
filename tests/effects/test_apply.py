"""Sums of fitted effects, places of parameters, and the columns on which a fitted effect depends."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest
from helpers import SAMPLES, commanded

from thermal_robot import EffectError, observe, simulate
from thermal_robot.effects import (
    Backlash,
    BaseFrame,
    Drift,
    Effect,
    Geometric,
    InstrumentScale,
    JointCompliance,
    JointGain,
    JointOffset,
    Parameter,
    ThermalElongation,
    ToolFrame,
    at_base,
    at_joint,
    at_segment,
)
from thermal_robot.effects.apply import by_place, depends_on, displacement


def test_a_parameter_of_all_links_is_shared_out_and_one_with_a_place_is_not(rv_m2):
    own = Parameter("bent", "rad", 1e-3, "link", "hand", (at_segment(1, np.ones(6)),))
    assert by_place(rv_m2, own) == (own,)
    responses = tuple(at_segment(s, np.eye(6)[0] * (s + 1)) for s in range(len(rv_m2.segments)))
    parts = by_place(rv_m2, Parameter("strain", "1/K", 1e-5, "link", "", responses))
    assert [p.place for p in parts] == list(dict.fromkeys(s.parent_link for s in rv_m2.segments))
    assert [r for p in parts for r in p.responses] == sorted(responses, key=lambda r: r.index)
    for part in parts:
        assert {rv_m2.segments[r.index].parent_link for r in part.responses} == {part.place}
    both = by_place(rv_m2, Parameter("sag", "rad", 1e-3, "joint", "", (at_joint(1, 1.0), at_base(np.ones(6)))))
    assert [(p.kind, p.place) for p in both] == [("joint", "joint_2"), ("joint", "base")]


@pytest.fixture(scope="module")
def driven(rv_m2):
    """Commands with a temperature and a clock."""
    return observe(commanded(rv_m2, {"temperature": np.linspace(20.0, 30.0, SAMPLES), "time": np.arange(10.0)}))


def flat(observations, effects):
    moved, instrument = displacement(observations, effects)
    return [moved.joint, moved.segment, moved.base, moved.tool, np.zeros(1) if instrument is None else instrument]


def test_effects_add_up_in_any_order_and_are_linear_in_their_values(driven, rv_m2):
    rng, segments = np.random.default_rng(0), len(rv_m2.segments)
    kinds = (JointOffset(), JointGain(), ThermalElongation(), Geometric(), Drift(span=9.0), BaseFrame(), ToolFrame())
    held = [(e, rng.normal(size=len(e.parameters(driven)))) for e in (*kinds, InstrumentScale())]
    whole, alone = flat(driven, held), [flat(driven, [item]) for item in held]
    assert [part.shape for part in whole] == [(10, 5), (10, segments, 6), (10, 6), (10, 6), (10, 3)]
    for k, together in enumerate(whole):
        np.testing.assert_allclose(together, sum(one[k] for one in alone), atol=1e-12)
        np.testing.assert_allclose(flat(driven, held[::-1])[k], together, atol=1e-12)
        np.testing.assert_allclose(flat(driven, [(e, -2.0 * v) for e, v in held])[k], -2.0 * together, atol=1e-12)
        assert np.any(together)
    assert not any(np.any(part) for part in flat(driven, []))
    assert displacement(driven, [])[1] is None
    one = flat(driven, [(JointOffset(), np.array([0.0, 2e-3, 0.0, 0.0, 0.0]))])
    np.testing.assert_array_equal(one[0], np.tile([0.0, 2e-3, 0.0, 0.0, 0.0], (SAMPLES, 1)))
    assert not np.any(one[1])


@dataclass(frozen=True)
class Far(Effect):
    """A joint that the robot does not have."""

    name = "far"

    def parameters(self, observations):
        return (Parameter("sag", "rad", 1e-3, "joint", "joint_9", (at_joint(8, 1.0),)),)


def test_values_that_are_not_the_parameters_and_answers_that_break_the_contract_are_refused(driven, rv_m2):
    with pytest.raises(EffectError, match=r"'joint_offset' was fitted with 4 parameters and has 5 in these rows$"):
        displacement(driven, [(JointOffset(), np.zeros(4))])
    with pytest.raises(EffectError, match=r"'backlash' was fitted with 5 .* has 0 in these rows, which lack approach"):
        displacement(driven, [(Backlash(), np.zeros(5))])
    with pytest.raises(EffectError, match=r"'far', parameter 'sag, joint_9'.*index is 8"):
        displacement(driven, [(Far(), np.zeros(1))])


@pytest.fixture(scope="module")
def seen(rv_m2):
    return observe(simulate(rv_m2, {"backlash": 1e-4}, rows=30, seed=2))


def having(seen, **columns):
    return observe(replace(seen.campaign, covariates={**seen.covariates, **columns}))


@dataclass(frozen=True)
class Either(Effect):
    """Follows the speed, or the payload where no speed is recorded; of equal rows nobody can tell which."""

    name: ClassVar[str] = "either"
    title: ClassVar[str] = "either"
    needs: ClassVar[tuple[str, ...]] = ("speed", "payload")

    def parameters(self, observations):
        values = [c for n in self.needs if (c := observations.covariates.get(n)) is not None]
        return (Parameter("share", "rad", 1e-3, "joint", "joint_1", (at_joint(0, np.sum(values, axis=0) > 0.0),)),)


def test_a_model_asks_for_what_its_effects_depend_on_in_their_places_and_for_no_more(seen, rv_m2):
    for joint in ("joint_2", "joint_5"):
        assert depends_on(Backlash(places=(joint,)), seen) == (f"approach.{joint}",)
    assert depends_on(Backlash(), seen) == tuple(f"approach.{joint}" for joint in rv_m2.joint_names)
    # a column that equals another here counts, and so does one that does not vary
    link = rv_m2.segments[-1].parent_link
    both = having(seen, **{f"temperature.{link}": seen.covariates["temperature"]})
    assert depends_on(ThermalElongation(places=(link,)), both) == (f"temperature.{link}",)
    constant = having(seen, **{"payload": np.full(30, 1.5), "approach.joint_3": np.ones(30)})
    assert depends_on(JointCompliance(places=("joint_2",)), constant) == ("payload",)
    assert depends_on(Backlash(places=("joint_3",)), constant) == ("approach.joint_3",)
    # of columns of which one is needed both are kept
    assert depends_on(Either(), having(seen, speed=np.ones(30), payload=np.ones(30))) == ("speed", "payload")
