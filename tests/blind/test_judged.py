"""One record judged, question by question."""

from typing import get_args

import pytest
from blind_records import J1, J2, L2, crash, effect, record, said

from thermal_robot.blind.cases import SEVERAL, Kind
from thermal_robot.blind.judged import BAD, HEADLINE, first_named, found, is_absent, is_miss, marks, ratio


@pytest.mark.parametrize(
    ("answer", "exact", "alarm"),
    [
        (said(effect("drift")), True, False),
        (said(effect("drift"), effect("backlash", 0.3, "not_found")), True, False),
        (said(effect("drift"), effect("backlash")), False, True),
        (said(effect("backlash")), False, True),
        (said(), False, False),
        (said(effect("drift"), flagged=True), False, False),
        # at work in the background, not asked for
        (said(effect("drift"), effect("joint_gain")), True, False),
        (said(effect("joint_gain")), False, False),
        # less than a tenth of the noise is nothing
        (said(effect("drift"), effect("geometric")), False, True),
        (said(effect("drift"), effect("discovered.1")), False, True),
        # an escape: confounded, and yet named
        (said(effect("drift"), effect("joint_offset", 0.5, "confounded")), True, False),
        (
            said(effect("drift"), effect("joint_offset", 0.5, "confounded"), verdict=["drift", "joint_offset"]),
            False,
            False,
        ),
    ],
)
def test_exact_is_what_is_at_work_and_nothing_else(answer, exact, alarm):
    found = marks(record("single", answer, ["drift"], {"joint_gain": 0.3, "geometric": 0.09}))
    assert found["exact"] == (exact,)
    assert found["false_alarm"] == (alarm,)
    assert is_miss(record("single", answer, ["drift"], {"joint_gain": 0.3, "geometric": 0.09})) is not exact


def test_where_nothing_is_at_work_the_unexplained_is_a_false_alarm_too():
    assert marks(record("null", said())) == {"exact": (True,), "false_alarm": (False,)}
    assert marks(record("null", said(flagged=True))) == {"exact": (False,), "false_alarm": (True,)}
    assert marks(record("null", said(effect("drift")))) == {"exact": (False,), "false_alarm": (True,)}


def test_places_are_asked_of_what_was_found_rightly():
    answer = said(effect("backlash", places=[J1, J2]), effect("drift", places=[J2]), effect("geometric", places=[J2]))
    case = record("many", answer, ["backlash", "drift", "joint_gain"])
    case["truth"]["parts"]["drift"]["places"] = [J1, J2]
    found = marks(case)
    assert found["located"] == (True, False)
    assert found["among_places"] == (True, True)
    case["truth"]["parts"]["drift"]["places"] = []  # it sits everywhere
    assert marks(case)["located"] == (True,)
    # a link is not the joint of that name
    case["truth"]["parts"]["backlash"]["places"] = [{"kind": "link", "name": "j1"}]
    assert marks(case)["among_places"] == (False,)


@pytest.mark.parametrize("of_kind", ["removed", "unlisted"])
def test_what_is_withheld_is_to_be_flagged_and_nobody_blamed(of_kind):
    true = {"places": [J1, L2], "quantities": ["time", "order"]}
    if of_kind == "unlisted":
        true["unlisted"] = "cable"

    def judged(*effects, **more):
        answers = marks(record(of_kind, said(*effects, **more), ["drift"] if of_kind == "removed" else [], **true))
        return {name: given for name, (given,) in answers.items()}

    told = {"flagged": True, "where": [J1, J2], "follows": ["order"]}
    assert set(judged(**told).values()) == {True}
    assert judged()["flagged"] is False
    blamed = judged(effect("backlash", 0.9), **told)
    assert (blamed["not_blamed"], blamed["right"], blamed["place"]) == (False, False, True)
    assert judged(effect("backlash", 0.89), **told)["not_blamed"]
    # only the first counts, and what a discovered law says before the rest
    assert not judged(flagged=True, where=[J2, J1], follows=["j2", "time"])["place"]
    law = effect("discovered.1", places=[L2], quantity="time", shape="step")
    found = judged(law, flagged=True, where=[J2], follows=["j2"])
    assert (found["place"], found["quantity"], found["not_blamed"]) == (True, True, True)
    law = effect("discovered.1", places=[J2], quantity="j2", shape="step")
    found = judged(law, **told)
    assert (found["place"], found["quantity"]) == (False, False)


def test_a_hidden_condition_is_to_be_asked_for():
    missing = effect("thermal_elongation", None, "not_testable", needs=["temperature.forearm"])
    true = {"effects": ["thermal_elongation"], "needs": ["temperature"], "hidden": ["temperature"]}
    advice = "Record temperature: thermal elongation could not be tested."
    found = marks(record("hidden", said(missing, flagged=True, advice=advice), **true))
    assert set(found.values()) == {(True,)}
    found = marks(record("hidden", said(missing, flagged=True), **true))
    assert (found["named"], found["asks"], found["right"]) == ((True,), (False,), (False,))
    found = marks(record("hidden", said(flagged=True, advice=advice), **true))
    assert (found["named"], found["asks"]) == ((False,), (False,))


def test_a_failure_is_wrong_everywhere():
    known = {"exact": (False,), "first_named": (False,), "false_alarm": (True,), "located": (), "among_places": ()}
    assert marks(crash("single", "drift")) == known
    assert marks(crash("null")) == {"exact": (False,), "false_alarm": (True,)}
    for case in (crash("removed", "drift", places=[J1]), crash("hidden", "drift"), crash("unlisted", unlisted="cable")):
        assert set(marks(case).values()) == {(False,)}
    assert is_miss(record("real", None, ["geometric"], right=True, asked="untouched", answer="-"))


@pytest.mark.parametrize(
    ("answer", "unlisted", "sound", "alarm"),
    [
        (said(), None, True, False),  # too small to be seen
        (said(effect("drift")), None, True, False),
        (said(effect("drift"), effect("backlash")), None, False, True),
        (said(effect("drift"), flagged=True), None, False, False),
        (said(effect("drift"), flagged=True), "slip", True, False),
        # a law of another place or quantity is a false name, one beside the place is none
        (
            said(effect("drift"), effect("discovered.1", places=[L2], quantity="time"), flagged=True),
            "slip",
            True,
            False,
        ),
        (
            said(effect("drift"), effect("discovered.1", places=[J2], quantity="time"), flagged=True),
            "slip",
            False,
            True,
        ),
        (said(effect("drift"), effect("discovered.1", quantity="payload"), flagged=True), "slip", False, True),
    ],
)
def test_sound_is_what_names_nothing_false(answer, unlisted, sound, alarm):
    case = record("mixed", answer, ["drift"], unlisted=unlisted, places=[J1], near=[J1, L2], quantities=["time"])
    assert marks(case) == {"sound": (sound,), "false_alarm": (alarm,)}
    assert is_miss(case) is not sound


def test_a_place_beside_the_true_one_is_near_it():
    true = {"unlisted": "cable", "places": [J1], "near": [J1, L2], "quantities": ["time"]}
    for where, exact, near in ((J1, True, True), (L2, False, True), (J2, False, False)):
        found = marks(record("unlisted", said(flagged=True, where=[where]), **true))
        assert (found["place"], found["near_place"]) == ((exact,), (near,))


def test_that_it_follows_nothing_is_right_only_where_it_was_called_unexplained():
    true = {"unlisted": "coolant", "places": [J1], "quantities": ["none"]}
    law = effect("discovered.1", quantity="none", shape="constant")
    for answer, right in (
        (said(flagged=True, where=[J1]), True),
        (said(law, flagged=True), True),
        (said(), False),
        (said(flagged=True, where=[J1], follows=["time"]), False),
    ):
        assert marks(record("unlisted", answer, **true))["quantity"] == (right,)
    # and wrong where something that was recorded is followed
    other = {**true, "quantities": ["time"]}
    assert marks(record("unlisted", said(flagged=True, where=[J1]), **other))["quantity"] == (False,)


def test_beside_a_cause_the_listed_effects_are_to_be_found_too():
    true = {"unlisted": "coolant", "places": [J1], "quantities": ["none"]}
    found = marks(record("both", said(effect("drift"), flagged=True, where=[J1]), ["drift"], **true))
    assert set(found.values()) == {(True,)}
    found = marks(record("both", said(flagged=True, where=[J1]), ["drift"], **true))
    assert (found["listed"], found["flagged"], found["right"]) == ((False,), (True,), (False,))
    found = marks(record("both", said(effect("drift"), effect("geometric"), flagged=True), ["drift"], **true))
    assert (found["listed"], found["not_blamed"], found["right"]) == ((True,), (False,), (False,))


@pytest.mark.parametrize("of_kind", [kind for kind in get_args(Kind) if kind not in SEVERAL])
def test_every_kind_is_asked_the_question_that_makes_it_a_miss(of_kind):
    true = {"places": [J1], "quantities": ["time"], "needs": ["time"]}
    silent = marks(record(of_kind, said(), ["drift"], **true))
    lost = marks(crash(of_kind, "drift", **true))
    assert silent[HEADLINE[of_kind]]
    # a crash is asked what an answer is asked, and wrong about it
    assert set(lost) == set(silent)
    assert is_miss(crash(of_kind, "drift", **true))
    assert all(given == (name in BAD) for name, answers in lost.items() for given in answers)


def test_the_background_is_neither_there_nor_absent():
    case = record("hard", said(), ["drift"], {"backlash": 0.1, "geometric": 0.099, "joint_gain": None})
    assert [is_absent(case, name) for name in ("drift", "backlash", "geometric", "joint_gain", "unheard_of")] == [
        False, False, True, True, True,
    ]  # fmt: skip
    assert (ratio(case, "drift"), ratio(case, "joint_gain"), ratio(case, "unheard_of")) == (3.0, None, None)


def test_what_is_found_and_what_is_named_first_may_differ():
    case = record("pair", said(effect("drift"), effect("backlash", 0.2, "not_found"), verdict=["backlash", "drift"]))
    assert found(case) == {"drift"}
    assert first_named(case) == "backlash"
    assert first_named(record("null", said())) is None
    assert (found(crash("pair")), first_named(crash("pair"))) == (frozenset(), None)
