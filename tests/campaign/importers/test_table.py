"""Two tables that become one: by names or in order, each in its own layout; all formats are in test_formats."""

import numpy as np
import pytest

from thermal_robot.campaign.importers.plan import planned
from thermal_robot.campaign.importers.table import commands, joined
from thermal_robot.campaign.table import Table
from thermal_robot.errors import CampaignError

MEASURED = Table("m.csv", {"n": ["b", "a", "b"], "x": ["1,5", "2", "3"]}, np.array([2, 3, 4]), 1, decimal_comma=True)
COMMANDED = Table("c.csv", {"q": ["0.25", "0.5"], "point": ["a", "b"], "mark": ["u", "v"]}, np.array([2, 3]), 1)


def test_by_name_with_repeats_and_each_with_its_decimals():
    table, notes = joined(MEASURED, COMMANDED, "n")
    assert notes == ()
    np.testing.assert_array_equal(table.numbers("x"), [1.5, 2, 3])
    np.testing.assert_array_equal(table.numbers("q"), [0.5, 0.25, 0.5])
    assert table.text("mark") == ["v", "u", "v"]
    assert list(table.columns) == ["n", "x", "q", "mark"]
    assert table.file == "m.csv with c.csv"


def test_in_order():
    table, notes = joined(MEASURED.take(np.array([True, True, False])), COMMANDED)
    np.testing.assert_array_equal(table.numbers("q"), [0.25, 0.5])
    assert notes == ("rows of m.csv and c.csv joined in their order",)
    with pytest.raises(CampaignError, match="found 3 and 2 rows"):
        joined(MEASURED, COMMANDED)


def test_a_column_in_both_tables_is_refused():
    twice = Table("c.csv", {**COMMANDED.columns, "x": ["1", "2"]}, COMMANDED.rows, 1)
    with pytest.raises(CampaignError, match=r"c\.csv, row 1, column 'x': has a column that m\.csv has, too"):
        joined(MEASURED, twice, "n")


PAIRS = [[0.5, 20.0], [0.75, 21.0]]
POINTS = {
    "header = false": (False, {}),
    "a header": (True, {}),
    "skip": (False, {"skip": 1}),
    "comment": (True, {"comment": "#"}),
}
"""How the first table is laid out: whether it has a header, and what [table] says of it."""


def lined(names, separator, comma, above=""):
    lines = [separator.join(f"{v:g}" for v in row) for row in PAIRS]
    lines = [line.replace(".", ",") for line in lines] if comma else lines
    return above + "\n".join([separator.join(names), *lines] if names else lines) + "\n"


@pytest.mark.parametrize(("separator", "comma"), [(",", 0), (";", 0), (";", 1), ("\t", 1), (" ", 0), ("  ", 1)])
@pytest.mark.parametrize("headed", [False, True])
@pytest.mark.parametrize("how", POINTS)
def test_the_second_table_is_read_as_the_first_or_as_it_stands(tmp_path, how, headed, separator, comma):
    header, layout = POINTS[how]
    above = {"skip": "Log of cell 7\n", "comment": "# by hand\n"}.get(how, "")
    (tmp_path / "j.txt").write_text(lined(["q", "T"] if headed else [], separator, comma, above))
    plan = planned({"table": {"header": header, **layout}})
    table = commands(tmp_path / "j.txt", plan)
    assert [table.numbers(name).tolist() for name in table.columns] == np.transpose(PAIRS).tolist()
    assert list(table.columns) == (["q", "T"] if headed else ["1", "2"])
    (tmp_path / "j.txt").write_text(lined(["q", "T"] if headed else [], separator, comma))
    plain = commands(tmp_path / "j.txt", planned({"table": {"header": header}, "commands": {"header": headed}}))
    assert list(plain.columns) == list(table.columns)


def test_numbers_of_columns_go_on_in_the_second_table():
    bare = Table("c", {"1": ["0.25", "0.5"], "2": ["a", "b"]}, np.array([1, 2]))
    table, _ = joined(MEASURED, bare, "n")
    assert list(table.columns) == ["n", "x", "3"]
    np.testing.assert_array_equal(table.numbers("3"), [0.5, 0.25, 0.5])
