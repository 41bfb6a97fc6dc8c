"""What a robot file alone can do for the gap, on the page and in the JSON of a diagnosis."""

import jsonschema
import pytest
from report.test_page import Reader, headings

from thermal_robot.correction.holding import FORMATS, expectation
from thermal_robot.report import html, schema
from thermal_robot.report.tables import files

ASKED = "What may I deploy?"


def test_the_json_has_what_is_expected_of_each_file(zeros):
    plain = zeros.to_dict()
    jsonschema.validate(plain, schema())
    assert len(plain["files"]) == len(zeros.model.files) > 3
    assert {name for told in plain["files"] for name in told["files"]} == set(FORMATS)
    for told in plain["files"]:
        shrinkage = 1.0 - (told["rms_after"] / told["rms_before"]) ** 2
        assert told["shrinkage"] == pytest.approx(shrinkage, abs=0.02)
        assert told["rms_after"] > zeros.gap.held_out.rms_after, "lost motion stays"
    left = {told["holds"]: told["rms_after"] for told in plain["files"] if told["min_sigma"] is None}
    assert left["ticks"] > left["zeros"], "an encoder's step is coarser than the zeros are known"


@pytest.mark.slow
def test_the_page_says_what_correct_says_of_the_file(zeros):
    page = html(zeros)
    assert ASKED in headings(page)
    told = files(zeros)
    assert told["heads"][1] == "beyond 2 σ (as written)"
    said = expectation(zeros.model.files, "offsets", 2.0)[0]
    cell = next(row for row in told["rows"] if "offsets" in row[0])[1]
    assert f"shrinkage {cell.split(' %')[0]} %" in said
    assert cell in Reader(page).words


@pytest.mark.slow
def test_what_no_file_holds_is_said_and_has_no_table(demo, written):
    assert "files" not in demo.to_dict()
    assert "holds what is constant; nothing here is" in Reader(html(demo)).words
    assert ASKED not in headings(written(html, "nothing"))
