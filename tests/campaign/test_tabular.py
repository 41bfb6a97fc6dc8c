"""Dialects of CSV, Parquet and data frames: the same numbers and rows; files that are no table."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from campaign.files import ROWS as WHOLE
from campaign.files import add, put
from campaign.spoilt import ROWS, TOML, refusal, renamed, table_is_refused

from thermal_robot.campaign import read_campaign
from thermal_robot.campaign import table as tables
from thermal_robot.campaign.table import table_from_frame
from thermal_robot.errors import CampaignError

SEMICOLONS = WHOLE.replace(",", ";").replace("1000", "1000,25")


@pytest.mark.parametrize(
    "data",
    [
        pytest.param(b"\xef\xbb\xbf" + WHOLE.encode(), id="byte-order mark"),
        pytest.param(WHOLE.replace("\n", "\r\n").encode(), id="Windows line ends"),
        pytest.param(WHOLE.replace("\n", "\r").encode(), id="old Mac line ends"),
        pytest.param(WHOLE.replace(",", "\t").encode(), id="tabs"),
        pytest.param(WHOLE.replace(",", ";").encode(), id="semicolons"),
        pytest.param(WHOLE.replace(",", "  ").encode(), id="blanks"),
        pytest.param(("# by hand\n#2026\n# " + WHOLE.replace(",", " ")).encode(), id="as numpy writes it"),
        pytest.param(("\n#" + WHOLE).encode(), id="a marked header"),
        pytest.param(WHOLE.replace(",", " , ").encode(), id="blanks around everything"),
        pytest.param(WHOLE.replace("\n", ",\n").encode(), id="separator at the end of each line"),
        pytest.param((WHOLE + "\n,,,,,,\n\n").encode(), id="empty lines at the end"),
        pytest.param(WHOLE.replace("x", '"x"').encode(), id="quotes"),
        pytest.param(WHOLE.replace("-", "−").encode(), id="typographic minus"),
        pytest.param(WHOLE.encode("utf-16"), id="UTF-16"),
    ],
)
def test_same_numbers(tmp_path: Path, data: bytes) -> None:
    plain, other = read_campaign(put(tmp_path / "a")), read_campaign(put(tmp_path / "b", data))
    np.testing.assert_array_equal(plain.q, other.q)
    np.testing.assert_array_equal(plain.position, other.position)
    assert other.warnings == ()


@pytest.mark.parametrize("separator", [";", "\t", " ", "   "])
def test_decimal_commas(tmp_path: Path, separator: str) -> None:
    campaign = read_campaign(put(tmp_path / "c", SEMICOLONS.replace(";", separator)))
    assert campaign.position[0, 0] == pytest.approx(1.00025)


def test_labels_keep_their_commas(tmp_path: Path) -> None:
    table = WHOLE.replace(",", ";").replace("z", "z;session", 1)
    table = table.replace("500\n", "500.5;1,5\n").replace("510\n", "510;b\n").replace("520\n", "520;\n")
    campaign = read_campaign(put(tmp_path / "c", table))
    assert campaign.labels["session"].tolist() == ["1,5", "b", ""]
    assert campaign.position[0, 2] == pytest.approx(0.5005)


def test_marked_lines_before_the_rows_are_no_rows(tmp_path: Path) -> None:
    (tmp_path / "t.txt").write_text("# x y\n1 2\n3 4\n")
    table = tables.read_table(tmp_path / "t.txt", tables.Layout(header=False))
    assert (table.rows.tolist(), table.numbers("2").tolist()) == ([2, 3], [2.0, 4.0])
    (tmp_path / "t.csv").write_text("#,x\n1,2\n3,4\n")
    assert list(tables.read_table(tmp_path / "t.csv").columns) == ["#", "x"]
    (tmp_path / "t.csv").write_text("# only\n")
    with pytest.raises(CampaignError, match="has a header but no rows"):
        tables.read_table(tmp_path / "t.csv")


@pytest.mark.parametrize("ending", ["xlsx", "ods"])
def test_workbooks(tmp_path: Path, ending: str) -> None:
    pytest.importorskip({"xlsx": "openpyxl", "ods": "odf"}[ending])
    folder = put(tmp_path / "c")
    plain = read_campaign(folder)
    frame = pd.read_csv(folder / "measurements.csv")
    with pd.ExcelWriter(folder / f"measurements.{ending}") as book:
        frame.to_excel(book, sheet_name="Monday", index=False)
        frame.head(1).to_excel(book, sheet_name="Tuesday", index=False)
    file = folder / "campaign.toml"
    file.write_text(file.read_text().replace("measurements.csv", f"measurements.{ending}"))
    campaign = read_campaign(folder)
    np.testing.assert_array_equal(plain.q, campaign.q)
    np.testing.assert_array_equal(plain.position, campaign.position)
    assert campaign.rows.tolist() == [2, 3, 4]
    assert "has 2 sheets: the first, 'Monday', was read" in campaign.warnings[0]


def test_a_workbook_is_laid_out_as_stated(tmp_path: Path) -> None:
    pytest.importorskip("openpyxl")
    cells = [["Log of cell 7", None, None], [None, None, None], ["a", "when", "b"], [1.5, "# no", "2,5"]]
    when = [pd.Timestamp("2020-07-14 16:39:04"), pd.Timestamp("2020-07-14 16:40:00")]
    cells += [["// left out", None, None], [2, when[0], "3,5"], [0.1, when[1], None]]
    pd.DataFrame(cells).to_excel(tmp_path / "t.xlsx", header=False, index=False)
    table = tables.read_table(tmp_path / "t.xlsx", tables.Layout(skip=1, comment="//"))
    assert (table.header, table.rows.tolist()) == (3, [4, 6, 7])
    np.testing.assert_array_equal(table.numbers("b", gaps=True), [2.5, 3.5, np.nan])
    assert table.text("when") == ["# no", *map(str, when)]
    numbered = tables.read_table(tmp_path / "t.xlsx", tables.Layout(skip=3, header=False, comment="//"))
    assert (list(numbered.columns), numbered.rows.tolist()) == (["1", "2", "3"], [4, 6, 7])


def test_a_workbook_without_what_reads_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("openpyxl")
    pd.DataFrame([[1.0]]).to_excel(tmp_path / "t.xlsx")
    monkeypatch.setitem(sys.modules, "openpyxl", None)
    error = refusal(tmp_path, toml=TOML.replace("measurements.csv", "t.xlsx"))
    assert "workbooks need openpyxl" in str(error)
    assert 'pip install "thermal-robot[excel]"' in str(error)


def test_broken_workbook(tmp_path: Path) -> None:
    pytest.importorskip("openpyxl")
    (tmp_path / "t.xlsx").write_bytes(b"PK\x03\x04")
    error = refusal(tmp_path, toml=TOML.replace("measurements.csv", "t.xlsx"))
    assert "cannot be read as a workbook" in str(error)


@pytest.mark.parametrize("separator", [",", ";", "\t", " "])
def test_a_row_that_was_taken_for_a_header_is_told(tmp_path: Path, separator: str) -> None:
    table = WHOLE.split("\n", 1)[1].replace(",", separator)
    error = refusal(tmp_path, table=table)
    assert "the first line of" in str(error)
    assert "was taken for a header" in str(error)


def test_rows_are_counted_as_an_editor_does(tmp_path: Path) -> None:
    assert read_campaign(put(tmp_path / "c", WHOLE.replace("\n-10", "\n\n-10"))).rows.tolist() == [2, 4, 5]


def test_a_label_over_two_lines_does_not_shift_the_count(tmp_path: Path) -> None:
    table = WHOLE.replace("z\n", "z,session\n").replace("500\n", '500,"two\nlines"\n')
    table = table.replace("510\n", "510,b\n").replace("520\n", "520,c\n")
    assert read_campaign(put(tmp_path / "c", table)).rows.tolist() == [2, 4, 5]


def test_windows_code_page_is_accepted_with_a_warning(tmp_path: Path) -> None:
    campaign = read_campaign(put(tmp_path / "c", add(WHOLE, session="früh spät spät").encode("cp1252")))
    assert campaign.labels["session"].tolist() == ["früh", "spät", "spät"]
    assert "Windows-1252" in campaign.warnings[0]


@pytest.mark.parametrize("ending", ["parquet", "pq"])
def test_parquet(tmp_path: Path, ending: str) -> None:
    pytest.importorskip("pyarrow")
    folder = put(tmp_path / "c")
    plain = read_campaign(folder)
    frame = pd.read_csv(folder / "measurements.csv").set_index("turn")
    frame.to_parquet(folder / f"measurements.{ending}")
    file = folder / "campaign.toml"
    file.write_text(file.read_text().replace("measurements.csv", f"measurements.{ending}"))
    campaign = read_campaign(folder)
    np.testing.assert_array_equal(plain.q, campaign.q)
    assert campaign.rows.tolist() == [2, 3, 4]


# table, row, column, found, words of the sentence
REFUSED = [
    ("", None, None, None, ["is empty"]),
    ("\n \n", None, None, None, ["is empty"]),
    (ROWS.split("\n")[0], None, None, None, ["has a header but no rows", "one row per measurement"]),
    (renamed(note="x"), 1, "x", "it 2 times", ["duplicate column", "every column once"]),
    (renamed(note=""), 1, None, "column 9 without one", ["a column has no name"]),
    (ROWS.replace(",2,8", ",2"), 3, None, "8", ["wrong number of fields", "9 as in the header"]),
    (ROWS.replace(",2,8", ",2,8,9"), 3, None, "10", ["wrong number of fields", "9 as in the header"]),
    (ROWS.replace(",2,8", ',"2,8'), 3, None, None, ["cannot be read as CSV", "unexpected end"]),
    (b"PK\x03\x04...", None, None, None, ["is a workbook", "a name that ends in .xlsx or .ods"]),
    (b"PAR1...", None, None, None, ["Parquet file by its contents", "ends in .parquet"]),
    (
        ROWS.replace("900", "9" * 200_000),
        3,
        None,
        None,
        ["cannot be read as CSV", "field larger than field limit"],
    ),
]


@pytest.mark.parametrize("refused", REFUSED)
def test_refused(tmp_path: Path, refused: tuple[Any, ...]) -> None:
    table_is_refused(tmp_path, *refused)


def test_no_table(tmp_path: Path) -> None:
    error = refusal(tmp_path, toml=TOML.replace("measurements.csv", "monday.csv"))
    assert error.file == str(tmp_path / "monday.csv")
    assert "there is no such file" in str(error)
    error = refusal(tmp_path, toml=TOML.replace("measurements.csv", "."))
    assert "is a directory" in str(error)


def test_parquet_without_pyarrow(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "t.parquet").write_bytes(b"PAR1")
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    error = refusal(tmp_path, toml=TOML.replace("measurements.csv", "t.parquet"))
    assert error.file == str(tmp_path / "t.parquet")
    assert 'pip install "thermal-robot[parquet]"' in str(error)


def test_broken_parquet(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    (tmp_path / "t.parquet").write_bytes(b"PAR1")
    error = refusal(tmp_path, toml=TOML.replace("measurements.csv", "t.parquet"))
    assert "cannot be read as a Parquet file" in str(error)


def test_a_frame_keeps_its_own_rows_or_counts_them_as_a_file() -> None:
    frame = pd.DataFrame({" a ": [1, 2], "b": ["x", None]}, index=[7, 3])
    table = table_from_frame(frame)
    assert list(table.columns) == ["a", "b"]
    assert (table.rows.tolist(), table.header) == ([7, 3], None)
    assert table.text("b") == ["x", ""]
    as_file = table_from_frame(frame, "t.parquet", first_row=2)
    assert (as_file.rows.tolist(), as_file.header) == ([2, 3], 1)
    frame.index = [4, 4]  # two rows of one number cannot be told apart
    assert table_from_frame(frame).rows.tolist() == [0, 1]


@pytest.mark.parametrize(
    ("frame", "words"),
    [
        (pd.DataFrame({"a": []}), "has a header but no rows"),
        (pd.DataFrame([[1, 2]], columns=["a", "a "]), "duplicate column"),
        (pd.DataFrame([[1, 2]], columns=["a", " "]), "a column has no name"),
    ],
)
def test_a_frame_that_is_no_table(frame: pd.DataFrame, words: str) -> None:
    with pytest.raises(CampaignError, match=words) as caught:
        table_from_frame(frame)
    assert caught.value.file == "<table>"


def test_nullable_numbers_of_pandas_are_numbers() -> None:
    frame = pd.DataFrame({"a": pd.array([1, None], dtype="Int64"), "b": [True, False]})
    table = table_from_frame(frame)
    np.testing.assert_array_equal(table.numbers("a", gaps=True), [1.0, np.nan])
    assert table.numbers("b").tolist() == [1.0, 0.0]


class Mute:
    """A cell that cannot say itself."""

    def __str__(self) -> str:
        raise RuntimeError("no words")


ODD = {
    "dates": (pd.date_range("2020", periods=3), None),
    "times": (pd.to_timedelta([1, 2, 3], unit="s"), None),
    "intervals": (pd.interval_range(0, 3), None),
    "complex": (np.array([1.0, 2.0, 3j]), None),
    "bytes": ([b"1", b"2", b"3"], None),
    "lists": ([[1.0], [2.0], [3.0]], None),
    "mute": ([Mute(), 1.0, 2.0], None),
    "of 5000 digits": (pd.Series([10**5000, 1, 2], dtype=object), None),
    "infinite": ([1.0, np.inf, 2.0], None),
    "enormous": ([1.0, -1e300, 2.0], None),
    "missing": (pd.array([1, None, 3], dtype="Int64"), None),
    "text": (pd.array(["1", "2", "3"], dtype="string"), [1.0, 2.0, 3.0]),
    "mixed": ([1.0, "2", 3], [1.0, 2.0, 3.0]),
    "categories": (pd.Categorical([1.5, 1.5, 2.5]), [1.5, 1.5, 2.5]),
    "nullable": (pd.array([1, 2, 3], dtype="Int64"), [1.0, 2.0, 3.0]),
    "sparse": (pd.arrays.SparseArray([0.0, 0.0, 3.0]), [0.0, 0.0, 3.0]),
    "unsigned": (np.arange(3, dtype=np.uint8), [0.0, 1.0, 2.0]),
    "half": (np.arange(3, dtype=np.float16), [0.0, 1.0, 2.0]),
}
"""Columns by what is odd about them: values, and the numbers that they are; none where they are refused."""


@pytest.mark.parametrize("name", ODD)
def test_a_column_of_any_type_is_read_as_it_is_or_refused_in_a_sentence(name: str) -> None:
    values, numbers = ODD[name]
    table = table_from_frame(pd.DataFrame({"a": values}))
    if numbers is not None:
        assert table.numbers("a").tolist() == numbers
        return
    with pytest.raises(CampaignError, match=r"^<table>, row \d, column 'a': .*expected a number$"):
        table.numbers("a")


@pytest.mark.parametrize(
    ("index", "rows"),
    [
        (pd.Index(pd.array([None, 5, 6], dtype="Int64")), [0, 1, 2]),
        (pd.Index(np.array([2**63, 1, 2], dtype=np.uint64)), [0, 1, 2]),
        (pd.MultiIndex.from_product([["a"], [1, 2, 3]]), [0, 1, 2]),
        (pd.date_range("2020", periods=3), [0, 1, 2]),
        (pd.RangeIndex(4, 10, 2), [4, 6, 8]),
    ],
)
def test_rows_are_counted_where_the_index_is_no_row_number(index: pd.Index, rows: list[int]) -> None:
    assert table_from_frame(pd.DataFrame({"a": [1.0, 2.0, 3.0]}).set_axis(index)).rows.tolist() == rows


def test_names_of_columns_of_any_type_are_text() -> None:
    frame = pd.DataFrame([[1.0, 2.0, 3.0]], columns=pd.Index([1, ("a", 2), Mute()], dtype=object, tupleize_cols=False))
    assert list(table_from_frame(frame).columns) == ["1", "('a', 2)", "<Mute>"]


HOSTILE = {
    "a quote that never ends": (ROWS + '"', "cannot be read as CSV"),
    "a line of 10 MB": (ROWS + "1" * 10_000_000, "cannot be read as CSV"),
    "nothing but separators": ("," * 1_000_000, "is empty"),
    "blank lines without end": (ROWS + "\n" * 200_000, "100000 lines in succession are blank"),
    "columns without end": (
        "\n".join(line + ",1" * 5000 for line in ROWS.split()).replace(",1", ",c", 5000),
        "too many columns; found 5009",
    ),
    "NUL": (b"\0" * 100_000, "has a header but no rows"),
}


@pytest.mark.parametrize("kind", HOSTILE)
def test_a_hostile_table_is_refused(tmp_path: Path, kind: str) -> None:
    table, told = HOSTILE[kind]
    error = refusal(tmp_path, table=table)
    assert told in str(error)
    assert len(str(error)) <= 1000


def test_a_table_that_is_too_large_is_refused_before_it_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tables, "MOST_CELLS", 18)
    assert "has more cells than can be read" in str(refusal(tmp_path))
    monkeypatch.setattr(tables, "LARGEST_TABLE", len(ROWS) - 1)
    assert "is larger than any table" in str(refusal(tmp_path))
