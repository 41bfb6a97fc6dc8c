"""The score of a blind trial, from records made by hand whose answers are known."""

import json

import pytest
from blind_records import crash, record, said, trial, trial_of_several

from thermal_robot.blind.report.page import html
from thermal_robot.blind.report.text import markdown, text
from thermal_robot.blind.score import score


def of(rates, name):
    return rates[name].successes, rates[name].trials


def kind(found, name):
    return next(k for k in found.kinds if k.kind == name)


def test_the_score_holds_each_kind():
    found = score(trial())
    assert (found.cases, found.failed) == (12, 1)
    assert [k.kind for k in found.kinds] == "single pair null hard removed hidden unlisted real".split()
    single = kind(found, "single")
    assert (single.cases, single.failed) == (4, 1)
    assert {q: of(single.rates, q) for q in ("exact", "first_named", "false_alarm", "located")} == {
        "exact": (1, 4), "first_named": (1, 4), "false_alarm": (2, 4), "located": (2, 2),
    }  # fmt: skip
    assert of(found.by_effect["backlash"], "found") == (0, 3)
    assert of(found.by_effect["drift"], "first_named") == (3, 4)
    assert of(found.by_robot["ur10"], "exact") == (0, 1)
    assert of(found.unlisted["cable"], "place") == (1, 1)
    assert [(r.asked, r.answer, r.right) for r in found.real] == [("arm: untouched", "<geometric>", True)]
    assert found.seconds.longest == 0.5
    # the law of the unlisted cause has its place and its quantity
    assert (found.laws.successes, found.laws.trials) == (1, 1)
    assert (found.worse.successes, found.worse.trials) == (0, 11)
    assert single.fresh.count == 3
    assert single.fresh.median == pytest.approx(3**-0.5)


def test_misses_can_be_looked_up():
    misses = {m.id: m for m in score(trial()).misses}
    assert list(misses) == ["a2", "a3", "a4", "n2", "t1", "p1"]
    assert misses["a4"].error == "the diagnosis failed: late"
    assert (misses["a2"].truth, misses["a2"].said, misses["a2"].probability) == (("drift",), ("backlash", "drift"), 0.9)
    assert misses["a2"].wrong == ("exact", "first_named", "false_alarm")
    assert misses["a3"].unexplained == "none"


def test_several_campaigns_are_scored_beside_and_change_no_figure_of_single_ones():
    alone, whole = score(trial()).to_dict(), score([*trial(), *trial_of_several()]).to_dict()
    assert [k["kind"] for k in whole["kinds"]][-5:] == ["same", "changed", "steady", "series", "fleet"]
    assert whole["kinds"][: len(alone["kinds"])] == alone["kinds"]
    counted = {"kinds", "cases", "failed", "misses", "changes"}
    assert {name for name in alone if alone[name] != whole[name]} == counted
    assert (whole["cases"], whole["failed"]) == (alone["cases"] + 7, alone["failed"] + 1)
    misses = {m["id"]: m for m in whole["misses"]}
    assert {name for name in misses if name.startswith("k")} == {"k3", "k5", "k7"}
    assert (misses["k5"]["truth"], misses["k5"]["wrong"]) == (
        ["backlash grows, j1"],
        [
            "exact",
            "way",
        ],
    )
    assert misses["k5"]["said"] == ["backlash, j1: jump after campaign 5"]
    assert misses["k7"]["error"] == "the diagnosis failed: late"
    by_change = {name: rates["exact"]["successes"] for name, rates in whole["changes"].items()}
    assert by_change == {"backlash grows": 0, "backlash jumps": 1, "joint_offset changes": 1}


@pytest.mark.parametrize(
    "records", [[], trial(), trial_of_several(), [crash("single", "drift")], [record("null", said())]]
)
def test_whatever_was_asked_can_be_written(records):
    plain = score(records).to_dict()
    assert json.loads(json.dumps(plain, allow_nan=False)) == plain
    assert plain["schema"] == "thermal-robot/blind/1"
    assert html(plain, "today").count("<html") == 1
    assert max(map(len, text(plain).splitlines())) <= 100
    assert markdown(plain).startswith("| case |")


def test_the_order_of_the_records_changes_no_figure():
    one, other = score(trial()).to_dict(), score(trial()[::-1]).to_dict()
    for name in ("cases", "failed", "kinds", "by_effect", "by_robot", "removed", "unlisted", "confusion"):
        assert one[name] == other[name], name
    for name in ("by_effect", "by_robot", "removed", "unlisted"):
        assert list(one[name]) == sorted(one[name])
    assert one["detection"]["table"] == other["detection"]["table"]
    assert {m["id"] for m in one["misses"]} == {m["id"] for m in other["misses"]}
