"""A comparison in words."""

import pytest

from thermal_robot.report import text_campaigns as words


def change(**more):
    plain = {"title": "joint zero offsets", "effect": "own", "kind": "joint", "place": "elbow", "since": "may"}
    plain |= {"groups": [["april"], ["may"]], "values": [1e-3, 1.25e-3], "unit": "rad", "parameters": ["zero"]}
    return plain | {"chi2": 31.4, "degrees": 1, "p_value": 2e-7} | more


def comparison(changes=(), statuses=("shared",), lost=None):
    effects = [{"name": s, "title": f"what is {s}", "status": s} for s in statuses]
    lost = [s for s in statuses if s in ("contradicts", "not_needed")] if lost is None else lost
    campaigns = [{"name": "april"}, {"name": "may"}]
    return {"changes": list(changes), "effects": effects, "campaigns": campaigns, "verdict": {"lost": lost}}


def test_nothing_changed_is_said():
    said = words.comparison_headline(comparison())
    assert said == "Nothing changed between april and may. They share what is shared."


def test_a_change_and_a_lost_name_are_said():
    said = words.comparison_headline(comparison([change()], ("shared", "contradicts")))
    assert said.startswith("Joint zero offsets at elbow changed since may.")
    assert said.endswith("What is contradicts loses its name.")
    both = words.comparison_headline(comparison([], ("contradicts", "not_needed")))
    assert both == "What is contradicts and what is not_needed lose their name."


def test_what_no_diagnosis_named_has_no_name_to_lose():
    said = words.comparison_headline(comparison([change(effect="contradicts")], ("contradicts",), lost=[]))
    assert said == "What differs between april and may has no name."
    row = {"name": "own", "status": "contradicts", "reason": "april alone needs it", "degrees": 0, "p_value": 1.0}
    for named, status in ((["april"], "loses its name"), ([], "not at work")):
        told = next(words.effects({"effects": [{**row, "named": named}]}))
        assert told[1] == f"{status}: april alone needs it"


def test_a_change_is_told_with_its_values():
    said = words.change_in_words(change(), ["april", "may"])
    assert "since may: 1.00 mrad in april, 1.25 mrad in may; χ² 31.4 on 1, below 0.001 % by chance" in said
    apart = change(since="", groups=[["a", "c"], ["b"]], values=[], parameters=["x", "y"])
    assert "between a, c | b (2 parameters)" in words.change_in_words(apart, ["a", "b", "c"])


@pytest.mark.parametrize(("p", "said"), [(None, "–"), (1e-9, "below 0.001 %"), (0.0213, "2.1 %"), (1.0, "1e+02 %")])
def test_chance(p, said):
    assert words.chance(p) == said.replace("1e+02", "100")


def test_a_value_stands_with_its_deviation():
    assert words.with_deviation(-1.165e-3, 3.8e-5, "rad", 1e-3) == "−1.165 ± 0.038 mrad"
    assert words.with_deviation(None, None, "rad", 1e-3) == "–"
