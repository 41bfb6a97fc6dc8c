"""Cells as numbers and as text: what counts as empty, what is refused and where it stands."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from campaign.files import ROWS as WHOLE
from campaign.files import add, put
from campaign.spoilt import ROWS, refusal, table_is_refused, with_column

from thermal_robot.campaign import read_campaign
from thermal_robot.campaign.table import Table
from thermal_robot.errors import CampaignError

# table, row, column, found, words of the sentence
REFUSED = [
    (ROWS.replace("900", "12.3a"), 3, "x", "'12.3a'", ["text where a number should be", "expected a number"]),
    (ROWS.replace("0.3", "0_3"), 3, "lift", "'0_3'", ["text where a number should be"]),
    (ROWS.replace("900", ""), 3, "x", "an empty cell", ["a value is missing"]),
    (ROWS.replace("520", "nan"), 4, "z", "'nan'", ["a value is missing"]),
    (ROWS.replace("900", "inf"), 3, "x", "'inf'", ["not a finite number"]),
    (ROWS.replace("0.3", ""), 3, "lift", "an empty cell", ["a value is missing"]),
    (ROWS.replace("900", "-1e300"), 3, "x", "'-1e300'", ["larger than anything that is measured"]),
    (ROWS.replace("0.3", "-inf"), 3, "lift", "'-inf'", ["not a finite number"]),
    (ROWS.replace(",2,8", ",inf,8"), 3, "time", "'inf'", ["not a finite number"]),
    (ROWS.replace(",2,8", ",two,8"), 3, "time", "'two'", ["text where a number should be"]),
    (with_column("sim.x,sim.y,sim.z", "1,2,3", "1,,3", "1,2,3"), 3, "sim.y", "an empty cell", ["missing"]),
    (
        with_column("qw,qx,qy,qz", "1,0,0,0", "1,,0,0", "1,0,0,0"),
        3,
        "qx",
        "an empty cell",
        ["a value is missing"],
    ),
]


@pytest.mark.parametrize("refused", REFUSED)
def test_refused(tmp_path: Path, refused: tuple[Any, ...]) -> None:
    table_is_refused(tmp_path, *refused)


def test_the_whole_sentence(tmp_path: Path) -> None:
    table = ROWS.replace(",", ";").replace(".", ",").replace("900", "12,3a")
    error = refusal(tmp_path, table=table)
    assert str(error) == (
        f"{tmp_path / 'measurements.csv'}, row 3, column 'x': text where a number should be; "
        "found '12,3a', expected a number"
    )


def test_decimal_point_among_decimal_commas(tmp_path: Path) -> None:
    table = "turn;lift;slide;roll;x;y;z\n0,1;0,2;30;0,4;1.000;0;500\n"
    error = refusal(tmp_path, table=table)
    assert (error.row, error.column, error.found) == (2, "x", "'1.000'")
    assert error.expected == "a number with a decimal comma, as elsewhere in this file"
    assert refusal(tmp_path, table=table.replace("1.000", "1.000,5")).found == "'1.000,5'"


def test_empty_labels(tmp_path: Path) -> None:
    campaign = read_campaign(put(tmp_path / "c", add(WHOLE, session="a _ b")))
    assert campaign.labels["session"].tolist() == ["a", "", "b"]


def test_numbers_and_text_of_one_column() -> None:
    table = Table("t.csv", {"a": ["1", "", " 2e3".strip(), "−4"]}, np.arange(2, 6))
    np.testing.assert_array_equal(table.numbers("a", gaps=True), [1.0, np.nan, 2000.0, -4.0])
    assert table.text("a") == ["1", "", "2e3", "−4"]
    with pytest.raises(CampaignError, match="a value is missing") as caught:
        table.numbers("a")
    assert (caught.value.row, caught.value.found) == (3, "an empty cell")


@pytest.mark.parametrize("word", ["", "nan", "NaN", "NA", "n/a", "null", "None", "<NA>"])
def test_these_words_are_empty_cells(word: str) -> None:
    table = Table("t.csv", {"a": [word, word], "b": [word, "1"]}, np.arange(2, 4))
    assert table.is_empty("a")
    assert not table.is_empty("b")
    assert np.isnan(table.numbers("b", gaps=True)).tolist() == [True, False]
    assert table.text("b") == ["", "1"]
    assert table.first_text("b") is None


def test_the_first_text_of_a_column_is_found() -> None:
    table = Table("t.csv", {"a": ["1", "", "low", "high"]}, np.arange(2, 6))
    assert table.first_text("a") == 2


def test_columns_that_have_a_type_are_taken_as_they_are() -> None:
    values = np.array([1.5, np.nan, 3.0])
    table = Table("<table>", {"a": values}, np.arange(3))
    np.testing.assert_array_equal(table.numbers("a", gaps=True), values)
    assert table.text("a") == ["1.5", "", "3"]
    assert table.first_text("a") is None
    assert not table.is_empty("a")


def test_a_number_survives_its_text() -> None:
    numbers = np.random.default_rng(2).normal(size=200) * 10.0 ** np.linspace(-20, 19, 200)
    table = Table("t.csv", {"a": [repr(float(number)) for number in numbers]}, np.arange(200))
    np.testing.assert_array_equal(table.numbers("a"), numbers)
    comma = Table(
        "t.csv", {"a": [repr(float(n)).replace(".", ",") for n in numbers]}, np.arange(200), decimal_comma=True
    )
    np.testing.assert_array_equal(comma.numbers("a"), numbers)


@pytest.mark.parametrize("cell", ["1e300", "-1e21", "1e999", "-inf", "9" * 400])
@pytest.mark.parametrize("gaps", [True, False])
def test_a_figure_larger_than_any_is_refused(cell: str, gaps: bool) -> None:
    for cells in (["1", cell], np.array([1.0, float(cell)])):
        with pytest.raises(CampaignError, match=r"larger than anything|not a finite number") as refused:
            Table("t.csv", {"a": cells}, np.array([2, 3])).numbers("a", gaps=gaps)
        assert (refused.value.row, refused.value.column) == (3, "a")


def test_a_figure_next_to_nothing_is_nothing() -> None:
    assert Table("t.csv", {"a": ["1e-300", "-1e-29"]}, np.array([2, 3])).numbers("a").tolist() == [0.0, -1e-29]
