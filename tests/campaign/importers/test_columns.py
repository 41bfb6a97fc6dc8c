"""Where a column comes from: by name or number, summed, scaled, shifted, counted, constant, as an instant."""

import numpy as np
import pytest

from thermal_robot.campaign.importers.plan import column_kind, columns_kind
from thermal_robot.campaign.table import Table
from thermal_robot.errors import CampaignError
from thermal_robot.schema import MisfitError

TABLE = Table(
    "f.csv",
    {"a": ["1", "", "3"], "b": np.array([10.0, 20.0, 30.0]), "c": ["p", "q", ""], "t": ["7 s", "9 s", ""]},
    np.array([2, 3, 4]),
    1,
)


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ("a", [1, np.nan, 3]),
        (2, [10, 20, 30]),
        ({"column": "a", "scale": -2.0, "offset": 1.0}, [-1, np.nan, -5]),
        ({"sum": ["a", 2]}, [11, np.nan, 33]),
        ({"value": 4}, [4, 4, 4]),
        ({"count": True}, [0, 1, 2]),
        ({"column": "b", "since_first": True}, [0, 10, 20]),
        ({"column": "t", "time": "%S s"}, [0, 2, np.nan]),
    ],
)
def test_numbers(given, expected):
    np.testing.assert_array_equal(column_kind(given, "").numbers(TABLE), expected)


def test_texts():
    assert column_kind("c", "").text(TABLE) == ["p", "q", ""]
    assert column_kind({"sum": ["a", "c"]}, "").text(TABLE) == ["1 p", " q", "3 "]
    assert column_kind({"value": "run 1"}, "").text(TABLE) == ["run 1"] * 3


def test_what_is_not_there():
    for source in ("d", 5):
        with pytest.raises(CampaignError, match=f"f.csv, row 1, column '{source}': there is no such column"):
            column_kind(source, "").numbers(TABLE)
    with pytest.raises(CampaignError, match="row 2, column 'c': text where a number should be; found 'p'"):
        column_kind("c", "").numbers(TABLE)


@pytest.mark.parametrize("given", [0, "", 1.5, {}, {"column": "a", "count": True}, {"colum": "a"}, {"sum": "a"}, None])
def test_what_is_no_source(given):
    with pytest.raises(MisfitError, match=r"columns\.x"):
        columns_kind({"x": given}, "columns")


def test_all_joints_at_once():
    taken = columns_kind({"joints": ["a", {"column": 2, "scale": 0.5}], "x": 1}, "columns")
    np.testing.assert_array_equal(taken["joints"][1].numbers(TABLE), [5, 10, 15])
    with pytest.raises(MisfitError, match="columns: 3, expected columns by name"):
        columns_kind(3, "columns")
