"""The result: frozen, valid by its schema, told in words."""

import json
from dataclasses import FrozenInstanceError

import jsonschema
import pytest
from compared import diagnosed, moved

import thermal_robot as tr
from thermal_robot.report import comparison_schema


@pytest.fixture(scope="module")
def found():
    return tr.compare(diagnosed(1), diagnosed(3, moved(4e-4)), names=["before", "after"])


def test_it_is_frozen_and_short_in_a_list(found):
    with pytest.raises(FrozenInstanceError):
        found.changes = ()
    assert repr(found) == "Comparison(before, after: joint_offset changed)"


def test_its_json_is_valid_and_says_the_same(found, tmp_path):
    found.to_json(tmp_path / "c.json")
    plain = json.loads((tmp_path / "c.json").read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator.check_schema(comparison_schema())
    jsonschema.Draft202012Validator(comparison_schema()).validate(plain)
    assert plain == json.loads(json.dumps(found.to_dict()))
    assert plain["changes"][0]["place"] == "joint_3"
    assert plain["summary"] == found.summary
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.Draft202012Validator(comparison_schema()).validate({**plain, "more": 1})


def test_parameters_are_a_table(found):
    table = found.parameters
    row = table.loc["joint_offset", "zero offset, joint_3"]
    assert row["after"] - row["before"] == pytest.approx(row["difference"])
    assert row["unit"] == "rad"


def test_an_effect_is_asked_for_by_name(found):
    assert found.effect("joint_offset").title == "joint zero offsets"
    with pytest.raises(KeyError, match="was not compared"):
        found.effect("joint_ofset")


def test_it_shows_itself(found):
    assert str(found).splitlines()[0] == found.summary
    assert found._repr_html_().startswith('<div class="thermal-robot">')
