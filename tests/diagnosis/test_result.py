"""One frozen value: told by whoever is asked to, written as JSON without loss."""

import json
from dataclasses import FrozenInstanceError, replace

import jsonschema
import pytest
from helpers import numbers

from thermal_robot import teller
from thermal_robot.diagnosis.result import told
from thermal_robot.errors import CampaignError, EffectError
from thermal_robot.report import schema
from thermal_robot.teller import told_by


class Parrot:
    """A teller that says whom it was asked about."""

    def headline(self, diagnosis):
        return f"headline of {diagnosis.campaign}"

    def advice(self, diagnosis):
        return f"advice for {diagnosis.campaign}"

    def text(self, diagnosis):
        return f"text of {diagnosis.campaign}"

    def fragment(self, diagnosis):
        return f"<p>{diagnosis.campaign}</p>"

    def explain_figure(self, explained):
        return f"figure of {explained.effect}"


@pytest.fixture
def nobody(monkeypatch):
    monkeypatch.setattr(teller, "_tellers", [])


def test_without_a_teller_it_says_what_to_do(hall, nobody):
    for ask in (told, str, lambda d: d._repr_html_(), lambda d: d.explain("backlash")):
        with pytest.raises(RuntimeError, match="import thermal_robot, or call told_by"):
            ask(hall)
    assert "backlash" in repr(hall)
    assert hall.to_dict()["verdict"]["summary"] == hall.summary


def test_whoever_was_named_last_is_asked(hall, nobody):
    class Other(Parrot):
        def headline(self, diagnosis):
            return "other"

    told_by(Parrot())
    said = told(replace(hall, summary="", advice=""))
    assert (said.summary, said.advice) == (f"headline of {hall.campaign}", f"advice for {hall.campaign}")
    assert str(hall) == f"text of {hall.campaign}"
    assert hall._repr_html_() == f"<p>{hall.campaign}</p>"
    assert hall.explain("backlash") == "figure of backlash"
    told_by(Other())
    assert told(hall).summary == "other"
    assert said.effects == hall.effects


def test_json_holds_all_and_nothing_that_json_cannot(hall, tmp_path):
    hall.to_json(tmp_path / "diagnosis.json")
    text = (tmp_path / "diagnosis.json").read_text(encoding="utf-8")
    again = json.loads(text, parse_constant=lambda word: pytest.fail(f"{word} is no JSON"))
    assert again == hall.to_dict()
    jsonschema.validate(again, schema())
    assert again["schema"] == "thermal-robot/diagnosis/2"
    assert tuple(again["verdict"]["effects"]) == hall.verdict
    assert [e["name"] for e in again["effects"]] == [f.name for f in hall.effects]
    assert again["gap"]["held_out"]["shrinkage"] == hall.gap.held_out.shrinkage
    assert len(numbers(again)) > 100


@pytest.mark.parametrize("no_number", [float("nan"), float("inf")])
def test_what_is_no_number_becomes_null(hall, no_number):
    left = replace(hall.unexplained, p_value=no_number, rms=no_number)
    plain = replace(hall, unexplained=left).to_dict()
    assert (plain["unexplained"]["p_value"], plain["unexplained"]["rms"]) == (None, None)
    json.dumps(plain, allow_nan=False)


def test_without_a_fit_nothing_is_proposed(hall):
    bare = replace(hall, fit=None)
    assert bare.to_dict()["next"]["samples"] == []
    for ask in (bare.next_samples, lambda: bare.explain("backlash")):
        with pytest.raises(ValueError, match="without its fit"):
            ask()
    assert len(hall.next_samples(3).samples) == 3
    for count in (0, -1, 2.5):
        with pytest.raises(CampaignError, match=rf"cannot propose so many; found {count}, expected a whole number"):
            hall.next_samples(count)


def test_effects_are_asked_for_by_name(hall):
    assert hall.finding("backlash").name == "backlash"
    with pytest.raises(KeyError):
        hall.finding("gremlins")
    with pytest.raises(EffectError, match=r"^no effect named 'backlsh' was considered; did you mean 'backlash'\?$"):
        hall.finding("backlsh")
    with pytest.raises(EffectError, match=r"no effect named 'xx' was considered; there are .*joint_gain"):
        hall.finding("xx")
    assert hall.title("backlash") == hall.finding("backlash").title != ""
    assert hall.title("somebodys_own") == "somebodys own"
    assert hall.is_frame("base_frame")
    assert not hall.is_frame("backlash")


def test_it_is_frozen(hall):
    with pytest.raises(FrozenInstanceError):
        hall.verdict = ()
