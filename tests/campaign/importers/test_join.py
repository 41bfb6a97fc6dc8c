"""Two tables become one: by names, whatever column of the commands has them, or in their order."""

import numpy as np
import pytest

from thermal_robot.campaign.importers.join import joined
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
