"""The gate: every answer that breaks the contract is refused, with the effect, the parameter and what was found."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from helpers import SAMPLES, commanded

from thermal_robot import EffectError, diagnose
from thermal_robot.effects import Effect, Parameter, Response, at_base, at_instrument, at_joint, at_segment, at_tool
from thermal_robot.effects.gate import checked, driver
from thermal_robot.inference.columns import block
from thermal_robot.observations import observe

GOOD = Parameter("sag", "rad", 1e-3, "joint", "joint_2", (at_joint(1, 1.0),))


@dataclass(frozen=True)
class Answers(Effect):
    """An effect of somebody's own that answers whatever it is given."""

    answer: Any = ()
    drives: Any = None
    name = "sagging"

    def parameters(self, observations):
        return self.answer

    def driver(self, observations, parameters, error):
        return self.drives


@pytest.fixture(scope="module")
def observations(rv_m2):
    return observe(replace(commanded(rv_m2), position=np.zeros((SAMPLES, 3))))


def with_response(channel, index, values):
    return (replace(GOOD, responses=(Response(channel, index, values),)),)


ROWS = np.ones(SAMPLES)
WRONG = {
    "nothing": (None, "answers NoneType"),
    "a parameter alone": (GOOD, "answers Parameter"),
    "a generator": ((p for p in (GOOD,)), "answers generator"),
    "a name": (("sag",), "parameter 1: found str, expected a Parameter"),
    "names twice": ((GOOD, replace(GOOD, size=2e-3)), "'sag, joint_2': the name is used twice"),
    "size 0": ((replace(GOOD, size=0.0),), "size is 0.0"),
    "size below 0": ((replace(GOOD, size=-1e-3),), "size is -0.001"),
    "size nan": ((replace(GOOD, size=float("nan")),), "size is nan"),
    "size inf": ((replace(GOOD, size=np.inf),), "size is inf"),
    "size of rows": ((replace(GOOD, size=ROWS),), "size is array"),
    "size in words": ((replace(GOOD, size="1 mm"),), "size is '1 mm'"),
    "kind unknown": ((replace(GOOD, kind="axis"),), "kind is 'axis', expected one of joint, link"),
    "unit not text": ((replace(GOOD, unit=None),), "unit is None, expected text"),
    "label not text": ((replace(GOOD, label=3),), "label is 3, expected text"),
    "place not text": ((replace(GOOD, place=1),), "place is 1, expected text"),
    "one response": ((replace(GOOD, responses=at_joint(1, 1.0)),), "responses are Response"),
    "numbers": ((replace(GOOD, responses=(1.0,)),), "a response is float"),
    "channel unknown": (with_response("wrist", 0, np.ones(6)), "channel is 'wrist', expected one of joint, segment"),
    "joint too far": ((replace(GOOD, responses=(at_joint(5, 1.0),)),), "joint index is 5, expected 0 to 4"),
    "joint from the end": ((replace(GOOD, responses=(at_joint(-1, 1.0),)),), "joint index is -1"),
    "joint by name": (with_response("joint", "joint_2", ROWS), "joint index is 'joint_2'"),
    "segment too far": ((replace(GOOD, responses=(at_segment(99, np.ones(6)),)),), "segment index is 99"),
    "a second base": (with_response("base", 1, np.ones(6)), "base index is 1, expected 0 to 0"),
    "a row too few": ((replace(GOOD, responses=(at_joint(1, ROWS[1:]),)),), r"joint are float64 \(9,\)"),
    "one column": ((replace(GOOD, responses=(at_joint(1, ROWS[:, None]),)),), r"joint are float64 \(10, 1\)"),
    "half a twist": ((replace(GOOD, responses=(at_segment(0, np.ones(3)),)),), r"expected float \(6,\) or \(10, 6\)"),
    "twists for other rows": ((replace(GOOD, responses=(at_tool(np.ones((9, 6))),)),), r"tool are float64 \(9, 6\)"),
    "a twist measured": (
        (replace(GOOD, responses=(at_instrument(np.ones((SAMPLES, 6))),)),),
        r"expected float \(10, 3",
    ),
    "a list": (with_response("joint", 1, [1.0] * SAMPLES), "values of channel joint are"),
    "whole numbers": (with_response("joint", 1, np.ones(SAMPLES, dtype=int)), "are int64"),
    "nan": ((replace(GOOD, responses=(at_joint(1, np.where(ROWS.cumsum() < 3, np.nan, 1.0)),)),), "not finite in 2"),
    "inf": ((replace(GOOD, responses=(at_base([0.0, 0.0, np.inf, 0.0, 0.0, 0.0]),)),), "not finite in 1"),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_answer_is_refused_by_name(observations, case):
    answer, words = WRONG[case]
    with pytest.raises(EffectError, match=f"effect 'sagging'.*{words}"):
        checked(Answers(answer), observations)


@pytest.mark.parametrize(
    "responses",
    [
        (),
        (at_joint(0, 1.0), at_joint(4, ROWS)),
        (at_segment(0, np.ones(6)), at_segment(1, np.ones((SAMPLES, 6)))),
        (at_base(np.ones(6)), at_tool(np.ones((SAMPLES, 6))), at_instrument(np.ones((SAMPLES, 3)))),
    ],
)
def test_a_right_answer_passes_as_it_is(observations, responses):
    given = (replace(GOOD, responses=responses), replace(GOOD, place="joint_3", size=np.float64(2.0)))
    assert checked(Answers(given), observations) == given
    assert checked(Answers(list(given)), observations) == given


def test_what_is_no_effect_is_refused(observations):
    with pytest.raises(EffectError, match="not an effect"):
        checked("joint_offset", observations)


def test_columns_come_through_the_gate(observations):
    with pytest.raises(EffectError, match=r"'sagging'.*not finite"):
        block(observations, Answers(WRONG["nan"][0]))


def test_a_diagnosis_stops_at_a_wrong_answer_with_its_name(rv_m2):
    from simulate import simulate

    with pytest.raises(EffectError, match=r"'sagging', parameter 'sag, joint_2': size is 0\.0"):
        diagnose(simulate(rv_m2, samples=40)[0], effects=[Answers(WRONG["size 0"][0])], only=["sagging"])


def test_a_driver_is_a_name_a_unit_and_rows(observations):
    error = np.zeros(SAMPLES)
    assert driver(Answers(), observations, (GOOD,), error) is None
    assert driver(Answers(drives=("load", "N", ROWS)), observations, (GOOD,), error)[:2] == ("load", "N")
    for wrong in (
        "load",
        ("load", "N"),
        ("load", 3, ROWS),
        (1, "N", ROWS),
        ("load", "N", ROWS[1:]),
        ("l", "N", ROWS * np.nan),
    ):
        with pytest.raises(EffectError, match="'sagging': driver answers"):
            driver(Answers(drives=wrong), observations, (GOOD,), error)
