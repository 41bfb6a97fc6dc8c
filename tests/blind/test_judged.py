"""One record judged, question by question, of one campaign and of several."""

from typing import get_args

import pytest
from blind_records import (
    J1,
    J2,
    L2,
    alarm,
    change,
    compared,
    crash,
    effect,
    failed_together,
    fleet,
    record,
    said,
    series,
    told_shared,
)

from thermal_robot.blind.cases import SEVERAL, Kind
from thermal_robot.blind.judged import (
    BAD,
    HEADLINE,
    first_named,
    found,
    is_absent,
    is_miss,
    marks,
    ratio,
    said_words,
    true_words,
)

OPEN = effect("joint_offset", 0.5, "confounded")


def law(place=J1, quantity="time"):
    return effect("discovered.1", places=[place], quantity=quantity, shape="step")


def single(case):
    """Answers to questions that are asked once."""
    return {question: given[0] for question, given in marks(case).items() if len(given) == 1}


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
        (said(effect("drift"), law()), False, True),
        # an escape: confounded, and yet named
        (said(effect("drift"), OPEN), True, False),
        (said(effect("drift"), OPEN, verdict=["drift", "joint_offset"]), False, False),
    ],
)
def test_exact_is_what_is_at_work_and_nothing_else(answer, exact, alarm):
    case = record("single", answer, ["drift"], {"joint_gain": 0.3, "geometric": 0.09})
    assert (marks(case)["exact"], marks(case)["false_alarm"]) == ((exact,), (alarm,))
    assert is_miss(case) is not exact


def test_where_nothing_is_at_work_the_unexplained_is_a_false_alarm_too():
    for answer, exact in ((said(), True), (said(flagged=True), False), (said(effect("drift")), False)):
        assert marks(record("null", answer)) == {"exact": (exact,), "false_alarm": (not exact,)}


def test_places_are_asked_of_what_was_found_rightly():
    answer = said(effect("backlash", places=[J1, J2]), effect("drift", places=[J2]), effect("geometric", places=[J2]))
    case = record("many", answer, ["backlash", "drift", "joint_gain"])
    case["truth"]["parts"]["drift"]["places"] = [J1, J2]
    assert (marks(case)["located"], marks(case)["among_places"]) == ((True, False), (True, True))
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
        return single(record(of_kind, said(*effects, **more), ["drift"] if of_kind == "removed" else [], **true))

    told = {"flagged": True, "where": [J1, J2], "follows": ["order"]}
    assert set(judged(**told).values()) == {True}
    assert judged()["flagged"] is False
    blamed = judged(effect("backlash", 0.9), **told)
    assert (blamed["not_blamed"], blamed["right"], blamed["place"]) == (False, False, True)
    assert judged(effect("backlash", 0.89), **told)["not_blamed"]
    # only the first counts, and what a discovered law says before the rest
    assert not judged(flagged=True, where=[J2, J1], follows=["j2", "time"])["place"]
    answers = judged(law(L2), flagged=True, where=[J2], follows=["j2"])
    assert (answers["place"], answers["quantity"], answers["not_blamed"]) == (True, True, True)
    answers = judged(law(J2, "j2"), **told)
    assert (answers["place"], answers["quantity"]) == (False, False)


@pytest.mark.parametrize(
    ("testable", "advice", "named", "asks"),
    [(False, "Record temperature.", True, True), (False, "Nothing.", True, False), (True, "Record it.", False, False)],
)
def test_a_hidden_condition_is_to_be_asked_for(testable, advice, named, asks):
    missing = effect("thermal_elongation", None, "not_testable", needs=["temperature.forearm"])
    answer = said(*([] if testable else [missing]), flagged=True, advice=advice)
    found_ = single(record("hidden", answer, ["thermal_elongation"], needs=["temperature"], hidden=["temperature"]))
    assert found_ == {"named": named, "asks": asks, "flagged": True, "not_blamed": True, "right": asks}


@pytest.mark.parametrize(
    ("answer", "unlisted", "sound", "alarm"),
    [
        (said(), None, True, False),  # too small to be seen
        (said(effect("drift")), None, True, False),
        (said(effect("drift"), effect("backlash")), None, False, True),
        (said(effect("drift"), flagged=True), None, False, False),
        (said(effect("drift"), flagged=True), "slip", True, False),
        # a law of another place or quantity is a false name, one beside the place is none
        (said(effect("drift"), law(L2), flagged=True), "slip", True, False),
        (said(effect("drift"), law(J2), flagged=True), "slip", False, True),
        (said(effect("drift"), law(J1, "payload"), flagged=True), "slip", False, True),
    ],
)
def test_sound_is_what_names_nothing_false(answer, unlisted, sound, alarm):
    case = record("mixed", answer, ["drift"], unlisted=unlisted, places=[J1], near=[J1, L2], quantities=["time"])
    assert marks(case) == {"sound": (sound,), "false_alarm": (alarm,)}
    assert is_miss(case) is not sound


def test_a_place_beside_the_true_one_is_near_it():
    true = {"unlisted": "cable", "places": [J1], "near": [J1, L2], "quantities": ["time"]}
    for where, exact, near in ((J1, True, True), (L2, False, True), (J2, False, False)):
        answers = single(record("unlisted", said(flagged=True, where=[where]), **true))
        assert (answers["place"], answers["near_place"]) == (exact, near)


def test_that_it_follows_nothing_is_right_only_where_it_was_called_unexplained():
    true = {"unlisted": "coolant", "places": [J1], "quantities": ["none"]}
    for answer, right in (
        (said(flagged=True, where=[J1]), True),
        (said(law(quantity="none"), flagged=True), True),
        (said(), False),
        (said(flagged=True, where=[J1], follows=["time"]), False),
    ):
        assert marks(record("unlisted", answer, **true))["quantity"] == (right,)
    # and wrong where something that was recorded is followed
    other = {**true, "quantities": ["time"]}
    assert marks(record("unlisted", said(flagged=True, where=[J1]), **other))["quantity"] == (False,)


def test_beside_a_cause_the_listed_effects_are_to_be_found_too():
    true = {"unlisted": "coolant", "places": [J1], "quantities": ["none"]}
    drift = effect("drift")
    assert set(single(record("both", said(drift, flagged=True, where=[J1]), ["drift"], **true)).values()) == {True}
    answers = single(record("both", said(flagged=True, where=[J1]), ["drift"], **true))
    assert (answers["listed"], answers["flagged"], answers["right"]) == (False, True, False)
    answers = single(record("both", said(drift, effect("geometric"), flagged=True), ["drift"], **true))
    assert (answers["listed"], answers["not_blamed"], answers["right"]) == (True, False, False)


@pytest.mark.parametrize("of_kind", get_args(Kind))
def test_no_answer_is_wrong_everywhere_and_asked_what_an_answer_is_asked(of_kind):
    true = {"places": [J1], "quantities": ["time"], "needs": ["time"]}
    lost = failed_together(of_kind) if of_kind in SEVERAL else crash(of_kind, "drift", **true)
    answers = marks(lost)
    assert answers[HEADLINE[of_kind]] == (False,)
    assert is_miss(lost)
    assert all(given == (name in BAD) for name, told in answers.items() for given in told)
    if of_kind not in SEVERAL:
        assert set(marks(record(of_kind, said(), ["drift"], **true))) == set(answers)
    assert set(HEADLINE) == set(get_args(Kind))


def test_the_background_is_neither_there_nor_absent():
    case = record("hard", said(), ["drift"], {"backlash": 0.1, "geometric": 0.099, "joint_gain": None})
    absent = {name for name in ("drift", "backlash", "geometric", "joint_gain", "unheard_of") if is_absent(case, name)}
    assert absent == {"geometric", "joint_gain", "unheard_of"}
    assert (ratio(case, "drift"), ratio(case, "joint_gain"), ratio(case, "unheard_of")) == (3.0, None, None)


def test_what_is_found_and_what_is_named_first_may_differ():
    case = record("pair", said(effect("drift"), effect("backlash", 0.2, "not_found"), verdict=["backlash", "drift"]))
    assert (found(case), first_named(case)) == ({"drift"}, "backlash")
    assert first_named(record("null", said())) is None
    assert (found(crash("pair")), first_named(crash("pair"))) == (frozenset(), None)


# ---- several campaigns

SHARED = {"effect": "backlash", "parameter": "lost motion, j1", "place": J1}
OWN = {"robot": "r02", "effect": "joint_gain", "parameter": "gain error, j2", "place": J2}


@pytest.mark.parametrize(
    ("told", "exact", "found", "wrong"),
    [
        ([("joint_offset", "j1")], True, True, False),
        ([("joint_offset", "j2")], False, False, True),
        ([("joint_offset", "j1"), ("backlash", "j1")], False, True, True),
        ([("joint_gain", "j1")], False, False, True),
        ([], False, False, False),
    ],
)
def test_of_two_campaigns_what_changed_is_to_be_told_and_nothing_else(told, exact, found, wrong):
    case = compared("changed", told, change("joint_offset", "j1", "changes", 0))
    assert single(case) == {"exact": exact, "found": found, "false_alarm": wrong, "listed": True}
    assert is_miss(case) is not exact


def test_where_nothing_changed_nothing_is_to_be_told():
    assert single(compared("same", [])) == {"exact": True, "false_alarm": False, "listed": True}
    assert not single(compared("same", [("backlash", "j1")]))["exact"]
    # an effect at work that loses its name is told beside
    assert single(compared("same", [], named=())) == {"exact": True, "false_alarm": False, "listed": False}
    assert not is_miss(series("steady", []))
    assert is_miss(series("steady", [alarm("backlash", "j1", "walk")]))


@pytest.mark.parametrize(
    ("how", "rings", "wrong"),
    [
        ("jumps", [("j1", "jump", 4)], set()),
        ("begins", [("j1", "jump", 4)], set()),  # from nothing
        ("jumps", [("j1", "jump", 5)], {"exact", "day"}),
        ("jumps", [("j1", "trend", None)], {"exact", "way", "day"}),
        ("jumps", [("j2", "jump", 4)], {"exact", "found", "way", "place", "day", "false_alarm"}),
        ("jumps", [("j1", "jump", 4), ("j2", "trend", None)], {"exact", "false_alarm"}),
        ("jumps", [], {"exact", "found", "way", "place", "day"}),
        ("grows", [("j1", "trend", None)], set()),
        ("grows", [("j1", "jump", 4)], {"exact", "way"}),
        ("grows", [("j1", "walk", None)], {"exact", "way"}),
    ],
)
def test_of_a_series_kind_day_and_joint_are_to_be_right(how, rings, wrong):
    told = [alarm("backlash", place, kind, after) for place, kind, after in rings]
    case = series("series", told, change("backlash", "j1", how, None if how == "grows" else 4))
    answers = {q: given for q, given in single(case).items() if q not in ("amount", "day_within")}
    assert {q for q, given in answers.items() if given == (q in BAD)} == wrong
    assert ("day" in marks(case)) is (how != "grows")
    assert is_miss(case) is bool(wrong)


def test_where_another_effect_of_the_joint_rings_the_place_is_right_and_the_name_is_not():
    case = series("series", [alarm("joint_gain", "j1", "jump", 4)], change("backlash", "j1", "jumps", 4))
    answers = single(case)
    assert (answers["place"], answers["found"], answers["false_alarm"]) == (True, False, True)


def test_intervals_are_asked_of_what_was_told_rightly():
    true = change("backlash", "j1", "jumps", 4, amount=1e-4)

    def of(**more):
        return single(series("series", [alarm("backlash", "j1", "jump", 4, **more)], true))

    # the true size is 1.9 and 2.1 deviations away
    assert of(size=1.19e-4, std=1e-5)["amount"]
    assert not of(size=1.21e-4, std=1e-5)["amount"]
    assert of(span=(3, 5))["day_within"]
    assert not of(span=(5, 7))["day_within"]
    wandering = marks(series("series", [alarm("backlash", "j1", "walk")], true))
    assert (wandering["amount"], wandering["day_within"]) == ((), ())


@pytest.mark.parametrize("group", [None, "hall 1"])
def test_of_a_fleet_what_is_shared_is_to_be_found_and_single_faults_are_not_to_be_called_shared(group):
    def of(*told, **more):
        answers = marks(fleet([{**SHARED, "group": group}], [OWN], told, **more))
        return tuple(all(answers[q]) for q in ("exact", "shared_found", "own_kept", "own_named", "false_alarm"))

    right, alone = told_shared(SHARED, group), told_shared(OWN)
    other = told_shared({"effect": "joint_gain", "parameter": "gain error, j3"})
    assert of(right) == (True, True, True, False, False)
    assert of() == (False, False, True, False, False)
    assert of(right, alone) == (False, True, False, False, True)
    assert of(right, other) == (False, True, True, False, True)
    assert of(right, apart=[{**OWN, "unit": "1"}])[3]
    assert not of(right, apart=[{**OWN, "robot": "r03"}])[3]
    assert of(right, found=[{**OWN, "place": "j2"}])[3]
    assert of(right, gathered=[{"effect": "joint_gain", "label": "hall", "group": "hall 1"}])[4]


def test_a_fault_of_one_hall_is_shared_by_that_hall_alone():
    true = [{**SHARED, "group": "hall 1"}]
    for told, right in ((None, False), ("hall 1", True), ("hall 2", False)):
        assert marks(fleet(true, [], [told_shared(SHARED, told)]))["shared_found"] == (right,)
    gathers = [{"effect": "backlash", "label": "hall", "group": "hall 1"}]
    answers = single(fleet(true, [], [], gathered=gathers))
    assert (answers["shared_found"], answers["false_alarm"]) == (True, False)


def test_words_say_what_was_true_and_what_was_said():
    jumps = series("series", [alarm("backlash", "j1", "jump", 4)], change("backlash", "j1", "jumps", 4))
    assert true_words(jumps["truth"]) == ("backlash jumps, j1, after campaign 5",)
    assert said_words("series", jumps["said"]) == ("backlash, j1: jump after campaign 5",)
    told = fleet([{**SHARED, "group": "hall 1"}], [OWN], [told_shared(SHARED, "hall 1")])
    assert true_words(told["truth"]) == ("lost motion, j1 shared by hall 1", "gain error, j2 of r02")
    assert said_words("fleet", told["said"]) == ("lost motion, j1 shared by hall",)
    changed = {"changes": [{"effect": "joint_offset", "place": ""}]}
    assert said_words("changed", changed) == ("joint_offset, everywhere",)
    nothing = {key: [] for key in ("changes", "parameters", "shared", "gathered")}
    assert {said_words(kind, nothing) for kind in SEVERAL} == {()}
