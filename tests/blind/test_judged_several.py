"""Answers about several campaigns, judged: what is right, what is a false alarm, what is called shared."""

import pytest
from blind_records import alarm, change, compared, failed_together, fleet, series, told_shared

from thermal_robot.blind.judged import BAD, HEADLINE, is_miss, marks, said_words, true_words

SHARED = {"effect": "backlash", "parameter": "lost motion, j1", "place": {"kind": "joint", "name": "j1"}}
OWN = {"robot": "r02", "effect": "joint_gain", "parameter": "gain error, j2", "place": {"kind": "joint", "name": "j2"}}


def yes(record, question):
    return all(marks(record)[question])


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
    record = compared("changed", told, change("joint_offset", "j1", "changes", 0))
    assert (yes(record, "exact"), yes(record, "found"), yes(record, "false_alarm")) == (exact, found, wrong)
    assert is_miss(record) is not exact


def test_where_nothing_changed_nothing_is_to_be_told():
    assert marks(compared("same", [])) == {"exact": (True,), "false_alarm": (False,), "listed": (True,)}
    assert marks(compared("same", [("backlash", "j1")]))["exact"] == (False,)
    # an effect at work that loses its name is told beside
    lost = compared("same", [], named=())
    assert marks(lost) == {"exact": (True,), "false_alarm": (False,), "listed": (False,)}
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
    record = series("series", told, change("backlash", "j1", how, None if how == "grows" else 4))
    answers = marks(record)
    found = {
        q for q, given in answers.items() if any(a == (q in BAD) for a in given) and q not in ("amount", "day_within")
    }
    assert found == wrong
    assert ("day" in answers) is (how != "grows")


def test_another_effect_of_the_right_joint_has_the_place_and_is_a_false_alarm():
    answers = marks(series("series", [alarm("joint_gain", "j1", "jump", 4)], change("backlash", "j1", "jumps", 4)))
    assert (answers["place"], answers["found"], answers["false_alarm"]) == ((True,), (False,), (True,))


def test_intervals_are_asked_of_what_was_told_rightly():
    true = change("backlash", "j1", "jumps", 4, amount=1e-4)

    def of(**more):
        answers = marks(series("series", [alarm("backlash", "j1", "jump", 4, **more)], true))
        return answers["amount"], answers["day_within"]

    # the true size is 1.9 and 2.1 deviations away
    assert of(size=1.19e-4, std=1e-5)[0] == (True,)
    assert of(size=1.21e-4, std=1e-5)[0] == (False,)
    assert of(span=(3, 5))[1] == (True,)
    assert of(span=(5, 7))[1] == (False,)
    wandering = marks(series("series", [alarm("backlash", "j1", "walk")], true))
    assert (wandering["amount"], wandering["day_within"]) == ((), ())


@pytest.mark.parametrize("group", [None, "hall 1"])
def test_of_a_fleet_what_is_shared_is_to_be_found_and_single_faults_are_not_to_be_called_shared(group):
    def of(*told, **more):
        answers = marks(fleet([{**SHARED, "group": group}], [OWN], told, **more))
        return tuple(all(answers[q]) for q in ("exact", "shared_found", "own_kept", "own_named", "false_alarm"))

    right, alone = told_shared(SHARED, group), told_shared(OWN)
    assert of(right) == (True, True, True, False, False)
    assert of() == (False, False, True, False, False)
    assert of(right, alone) == (False, True, False, False, True)
    other = told_shared({"effect": "joint_gain", "parameter": "gain error, j3"})
    assert of(right, other) == (False, True, True, False, True)
    stands_out = [{**OWN, "unit": "1"}]
    assert of(right, apart=stands_out)[3]
    assert not of(right, apart=[{**OWN, "robot": "r03"}])[3]
    assert of(right, found=[{**OWN, "place": "j2"}])[3]
    assert of(right, gathered=[{"effect": "joint_gain", "label": "hall", "group": "hall 1"}])[4]


def test_a_fault_of_one_hall_is_shared_by_that_hall_alone():
    true = [{**SHARED, "group": "hall 1"}]
    for told, right in ((None, False), ("hall 1", True), ("hall 2", False)):
        assert marks(fleet(true, [], [told_shared(SHARED, told)]))["shared_found"] == (right,)
    gathers = [{"effect": "backlash", "label": "hall", "group": "hall 1"}]
    answers = marks(fleet(true, [], [], gathered=gathers))
    assert (answers["shared_found"], answers["false_alarm"]) == ((True,), (False,))


@pytest.mark.parametrize("kind", ["same", "changed", "steady", "series", "fleet"])
def test_no_answer_is_wrong_everywhere(kind):
    record = failed_together(kind)
    answers = marks(record)
    assert all(a is (q in BAD) for q, given in answers.items() for a in given)
    assert is_miss(record)
    assert answers[HEADLINE[kind]] == (False,)
    assert said_words(kind, {key: [] for key in ("changes", "parameters", "shared", "gathered")}) == ()


def test_words_say_what_was_true_and_what_was_said():
    jumps = series("series", [alarm("backlash", "j1", "jump", 4)], change("backlash", "j1", "jumps", 4))
    assert true_words(jumps["truth"]) == ("backlash jumps, j1, after campaign 5",)
    assert said_words("series", jumps["said"]) == ("backlash, j1: jump after campaign 5",)
    record = fleet([{**SHARED, "group": "hall 1"}], [OWN], [told_shared(SHARED, "hall 1")])
    assert true_words(record["truth"]) == ("lost motion, j1 shared by hall 1", "gain error, j2 of r02")
    assert said_words("fleet", record["said"]) == ("lost motion, j1 shared by hall",)
    assert said_words("changed", {"changes": [{"effect": "joint_offset", "place": ""}]}) == (
        "joint_offset, everywhere",
    )
