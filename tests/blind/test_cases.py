"""Cases, and the records whose fields their module lists."""

import json
import pickle
import re
from dataclasses import FrozenInstanceError, asdict
from typing import get_args

import pytest
from blind_fakes import RV_M2, case
from blind_records import trial, trial_of_several

from thermal_robot.blind import cases
from thermal_robot.blind.cases import ASKS, SEVERAL, Case, Kind, Several
from thermal_robot.blind.judged import HEADLINE


def test_a_case_travels_to_another_process_and_into_a_file():
    asked = case("c1", "drift", seed=2**61, hidden=("time",))
    assert pickle.loads(pickle.dumps(asked)) == asked
    assert hash(asked) == hash(pickle.loads(pickle.dumps(asked)))
    plain = json.loads(json.dumps(asdict(asked)))
    assert (plain["seed"], plain["effects"], plain["robot"]["tool_frame"]) == (2**61, ["drift"], "tool0")
    with pytest.raises(FrozenInstanceError):
        asked.effects = ()


def test_a_case_asks_for_nothing_special_unless_told():
    asked = Case("c1", 0, "null", RV_M2)
    assert (asked.effects, asked.without, asked.hidden, asked.unlisted, asked.own) == ((), (), (), None, "")
    assert (asked.background, asked.heavy) == (0.0, False)
    # an effect is larger than the noise, and a campaign a possible one
    assert 1.0 < asked.ratio[0] < asked.ratio[1]
    assert 10 < asked.samples[0] < asked.samples[1]


def test_several_campaigns_are_asked_by_their_kind_and_travel_too():
    asked = Case("s1", 1, "series", RV_M2, ("drift",), several=Several((12, 12), "grows", "drift", (8.0, 16.0)))
    assert pickle.loads(pickle.dumps(asked)) == asked
    assert json.loads(json.dumps(asdict(asked)))["several"]["how"] == "grows"
    assert set(SEVERAL) == set(ASKS) < set(get_args(Kind))


def test_every_kind_can_be_judged():
    assert set(HEADLINE) == set(get_args(Kind))


def test_records_have_the_fields_that_are_listed():
    listed = set(re.findall(r'"(\w+)":', cases.__doc__))
    real = {"right", "asked", "answer"}  # which a real case adds when it judges
    for record in (*trial(), *trial_of_several()):
        assert set(record) - real <= listed
        assert set(record["truth"]) <= listed
        assert record["kind"] in get_args(Kind)
