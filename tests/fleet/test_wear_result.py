"""A robot over time as JSON, which holds what the values hold, and in words."""

import json
from dataclasses import replace

from wear_cases import by_hand

from thermal_robot.fleet.wear_result import SCHEMA


def test_json_holds_everything(tmp_path):
    wear = by_hand()
    wear.to_json(tmp_path / "wear.json")
    found = json.loads((tmp_path / "wear.json").read_text(encoding="utf-8"))
    assert found == wear.to_dict()
    assert found["schema"] == SCHEMA == "thermal-robot/wear/1"
    assert [p["parameter"] for p in found["parameters"]] == [w.parameter for w in wear.parameters]
    assert found["parameters"][0]["jump"]["after"] == 1
    assert found["parameters"][1]["values"][2] is None
    assert found["parameters"][1]["crossing"]["dates"] == ["2026-07-20", "2026-06-30", "2026-08-19"]


def test_it_names_what_rings():
    wear = by_hand()
    assert [w.place for w in wear.alarms] == ["elbow", "wrist"]
    assert repr(wear) == "Wear('arm', 4 campaigns: zero offset, elbow (jump), lost motion, wrist (trend))"


def test_the_sentence_says_what_moved_when_and_how_fast():
    said = by_hand().summary
    assert "zero offset, elbow jumped by +0.0002 ± 2e-05 rad between run_1 (2026-02-01) and run_2 (2026-03-01)" in said
    assert "lost motion, wrist moves by +1e-06 ± 1e-07 rad a day" in said


def test_the_text_says_chance_limit_and_what_cannot_be_compared():
    said = str(by_hand())
    assert "at most 1 % of series" in said
    assert "chance of such an alarm without a change: at most 1e-06" in said
    assert "cannot be told from a change of zero offset, wrist" in said
    assert "limit 0.0005 rad: about 2026-07-20 (95 %: 2026-06-30 to 2026-08-19)" in said
    assert "not compared zero offset, pan: unknown frames hide its changes" in said
    assert "note         a <note> to know" in said


def test_without_dates_there_is_no_rate():
    said = str(by_hand(dated=False))
    assert "no dates, so no rates" in said
    assert "moves steadily, by +9e-05" in said
    assert "not foreseen, for lack of a rate" in said


def test_no_alarm_is_told_with_its_rate():
    wear = by_hand()
    quiet = replace(wear, parameters=tuple(replace(w, alarm=False) for w in wear.parameters))
    assert "nothing moves that would not by chance in 1 % of such series" in quiet.summary
    assert "perhaps" in str(quiet)
