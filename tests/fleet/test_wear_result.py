"""The JSON of a robot over time holds what the values hold."""

import json

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
