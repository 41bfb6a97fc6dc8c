"""Tables of every kind become the same numbers; what is no table, or no number, is refused with its row."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from campaign.files import PLAIN, PLAIN_TOML, ROWS, add, put, read, refusal, renamed, says, with_column
from scipy.io import savemat

from thermal_robot.campaign import Campaign, read_campaign
from thermal_robot.campaign import table as tables
from thermal_robot.campaign.table import Layout, Table, read_table, table_from_frame
from thermal_robot.errors import CampaignError

SAME = {
    "byte-order mark": b"\xef\xbb\xbf" + ROWS.encode(),
    "Windows line ends": ROWS.replace("\n", "\r\n"),
    "old Mac line ends": ROWS.replace("\n", "\r"),
    "tabs": ROWS.replace(",", "\t"),
    "semicolons": ROWS.replace(",", ";"),
    "blanks": ROWS.replace(",", "  "),
    "as numpy writes it": "# by hand\n#2026\n# " + ROWS.replace(",", " "),
    "a marked header": "\n#" + ROWS,
    "blanks around everything": ROWS.replace(",", " , "),
    "separator at the end of each line": ROWS.replace("\n", ",\n"),
    "empty lines at the end": ROWS + "\n,,,,,,\n\n",
    "quotes": ROWS.replace("x", '"x"'),
    "typographic minus": ROWS.replace("-", "−"),
    "UTF-16": ROWS.encode("utf-16"),
}


@pytest.fixture(scope="module")
def plain(tmp_path_factory) -> Campaign:
    return read_campaign(put(tmp_path_factory.mktemp("plain") / "c"))


@pytest.mark.parametrize("how", SAME)
def test_every_dialect_is_the_same_table(tmp_path: Path, plain: Campaign, how: str) -> None:
    other = read_campaign(put(tmp_path / "c", SAME[how]))
    np.testing.assert_array_equal(plain.q, other.q)
    np.testing.assert_array_equal(plain.position, other.position)
    assert other.warnings == ()


def saved(folder: Path, ending: str) -> Path:
    """The campaign's table under another ending, of which campaign.toml is told."""
    toml = put(folder) / "campaign.toml"
    toml.write_text(toml.read_text().replace("measurements.csv", f"measurements.{ending}"))
    return folder / f"measurements.{ending}"


def test_the_one_matrix_of_a_matlab_file_is_a_table_without_names(tmp_path):
    rows = np.arange(12.0).reshape(4, 3)
    savemat(tmp_path / "t.mat", {"Positions": rows, "note": "of Monday"})
    table = read_table(tmp_path / "t.mat")
    assert (list(table.columns), table.rows.tolist(), table.unnamed) == (["1", "2", "3"], [1, 2, 3, 4], True)
    np.testing.assert_array_equal(table.numbers("2"), rows[:, 1])
    savemat(tmp_path / "two.mat", {"Positions": rows, "Angles": rows[:, :2]})
    with pytest.raises(CampaignError, match=r"one matrix of numbers; found Positions \(4 x 3\), Angles \(4 x 2\)"):
        read_table(tmp_path / "two.mat")
    (tmp_path / "no.mat").write_text("x,y\n1,2\n")
    with pytest.raises(CampaignError, match="cannot be read as a MATLAB file"):
        read_table(tmp_path / "no.mat")


@pytest.mark.parametrize(
    ("name", "what"), [("s.json", "text of another kind"), ("log.BAG", "a recording"), ("p.ls", "a robot's program")]
)
def test_a_file_that_holds_no_table_is_called_what_it_is(tmp_path, name, what):
    (tmp_path / name).write_text("{\n")
    with pytest.raises(CampaignError, match=f"is {what} by its ending, and no table"):
        read_table(tmp_path / name)


@pytest.mark.parametrize("ending", ["xlsx", "ods", "parquet", "pq"])
def test_workbooks_and_parquet(tmp_path: Path, plain: Campaign, ending: str) -> None:
    pytest.importorskip({"xlsx": "openpyxl", "ods": "odf"}.get(ending, "pyarrow"))
    file = saved(tmp_path / "c", ending)
    frame = pd.read_csv(file.with_suffix(".csv"))
    if ending in ("xlsx", "ods"):
        with pd.ExcelWriter(file) as book:
            frame.to_excel(book, sheet_name="Monday", index=False)
            frame.head(1).to_excel(book, sheet_name="Tuesday", index=False)
    else:
        frame.set_index("turn").to_parquet(file)
    campaign = read_campaign(file.parent)
    np.testing.assert_array_equal(plain.q, campaign.q)
    np.testing.assert_array_equal(plain.position, campaign.position)
    assert campaign.rows.tolist() == [2, 3, 4]
    more = "has 2 sheets: the first, 'Monday', was read"
    assert [more in warning for warning in campaign.warnings] == [True] * (ending in ("xlsx", "ods"))


def test_a_workbook_is_laid_out_as_stated(tmp_path: Path) -> None:
    pytest.importorskip("openpyxl")
    cells = [["Log of cell 7", None, None], [None, None, None], ["a", "when", "b"], [1.5, "# no", "2,5"]]
    when = [pd.Timestamp("2020-07-14 16:39:04"), pd.Timestamp("2020-07-14 16:40:00")]
    cells += [["// left out", None, None], [2, when[0], "3,5"], [0.1, when[1], None]]
    pd.DataFrame(cells).to_excel(tmp_path / "t.xlsx", header=False, index=False)
    table = read_table(tmp_path / "t.xlsx", Layout(skip=1, comment="//"))
    assert (table.header, table.rows.tolist()) == (3, [4, 6, 7])
    np.testing.assert_array_equal(table.numbers("b", gaps=True), [2.5, 3.5, np.nan])
    assert table.text("when") == ["# no", *map(str, when)]
    numbered = read_table(tmp_path / "t.xlsx", Layout(skip=3, header=False, comment="//"))
    assert (list(numbered.columns), numbered.rows.tolist()) == (["1", "2", "3"], [4, 6, 7])


@pytest.mark.parametrize(
    ("name", "missing", "told"),
    [
        ("t.xlsx", "openpyxl", 'workbooks need openpyxl … pip install "thermal-robot[excel]"'),
        ("t.xlsx", "", "cannot be read as a workbook"),
        ("t.parquet", "pyarrow.parquet", 'Parquet files need pyarrow … pip install "thermal-robot[parquet]"'),
        ("t.parquet", "", "cannot be read as a Parquet file"),
        ("t.csv", "", "is a workbook … a name that ends in .xlsx or .ods"),
        ("monday.csv", "", "there is no such file"),
        (".", "", "is a directory"),
    ],
)
def test_what_cannot_be_read_and_why(tmp_path, monkeypatch, name, missing, told):
    for file in ("t.xlsx", "t.parquet", "t.csv"):
        (tmp_path / file).write_bytes(b"PK\x03\x04")
    if missing == "openpyxl":
        pd.DataFrame([[1.0]]).to_excel(tmp_path / "t.xlsx")
    if missing:
        monkeypatch.setitem(sys.modules, missing, None)
    error = refusal(tmp_path, toml=PLAIN_TOML.replace("measurements.csv", name))
    assert error.file == str(tmp_path / name)
    assert says(error, told)


DECIMAL_COMMAS = ROWS.replace(",", ";").replace("1000", "1000,25")


@pytest.mark.parametrize("separator", [";", "\t", " ", "   "])
def test_decimal_commas(tmp_path: Path, separator: str) -> None:
    campaign = read_campaign(put(tmp_path / "c", DECIMAL_COMMAS.replace(";", separator)))
    assert campaign.position[0, 0] == pytest.approx(1.00025)
    table = DECIMAL_COMMAS.replace(";", separator)
    error = refusal(tmp_path, table=table.split("\n", 1)[1])
    assert says(error, "the first line of … was taken for a header")


def test_labels_keep_their_commas_accents_and_lines(tmp_path: Path) -> None:
    table = ROWS.replace(",", ";").replace("z", "z;session", 1)
    table = table.replace("500\n", "500.5;1,5\n").replace("510\n", "510;b\n").replace("520\n", "520;\n")
    campaign = read_campaign(put(tmp_path / "a", table))
    assert campaign.labels["session"].tolist() == ["1,5", "b", ""]
    assert campaign.position[0, 2] == pytest.approx(0.5005)
    campaign = read_campaign(put(tmp_path / "b", add(ROWS, session="früh spät spät").encode("cp1252")))
    assert campaign.labels["session"].tolist() == ["früh", "spät", "spät"]
    assert "Windows-1252" in campaign.warnings[0]
    two = ROWS.replace("z\n", "z,session\n").replace("500\n", '500,"two\nlines"\n')
    two = two.replace("510\n", "510,b\n").replace("520\n", "520,c\n")
    assert read_campaign(put(tmp_path / "c", two)).rows.tolist() == [2, 4, 5]
    assert read_campaign(put(tmp_path / "d", ROWS.replace("\n-10", "\n\n-10"))).rows.tolist() == [2, 4, 5]


def test_marked_lines_before_the_rows_are_no_rows(tmp_path: Path) -> None:
    (tmp_path / "t.txt").write_text("# x y\n1 2\n3 4\n")
    table = read_table(tmp_path / "t.txt", Layout(header=False))
    assert (table.rows.tolist(), table.numbers("2").tolist()) == ([2, 3], [2.0, 4.0])
    (tmp_path / "t.csv").write_text("#,x\n1,2\n3,4\n")
    assert list(read_table(tmp_path / "t.csv").columns) == ["#", "x"]
    (tmp_path / "t.csv").write_text("# only\n")
    with pytest.raises(CampaignError, match="has a header but no rows"):
        read_table(tmp_path / "t.csv")


POINT = "turn;lift;slide;roll;x;y;z\n0,1;0,2;30;0,4;1.000;0;500\n"
COMMA = "a number with a decimal comma, as elsewhere in this file"
FIELDS = "wrong number of fields … 9 as in the header"
# table, row, column, found, what is said
REFUSED = [
    ("", None, None, None, "is empty"),
    ("\n \n", None, None, None, "is empty"),
    (PLAIN.split("\n")[0], None, None, None, "has a header but no rows … one row per measurement"),
    (renamed(note="x"), 1, "x", "it 2 times", "duplicate column … every column once"),
    (renamed(note=""), 1, None, "column 9 without one", "a column has no name"),
    (PLAIN.replace(",2,8", ",2"), 3, None, "8", FIELDS),
    (PLAIN.replace(",2,8", ",2,8,9"), 3, None, "10", FIELDS),
    (PLAIN.replace(",2,8", ',"2,8'), 3, None, None, "cannot be read as CSV … unexpected end"),
    (b"PAR1...", None, None, None, "Parquet file by its contents … ends in .parquet"),
    (PLAIN.replace("900", "9" * 200_000), 3, None, None, "cannot be read as CSV … field larger than field limit"),
    (PLAIN.replace("900", "12.3a"), 3, "x", "'12.3a'", "text where a number should be … expected a number"),
    (PLAIN.replace("0.3", "0_3"), 3, "lift", "'0_3'", "text where a number should be"),
    (PLAIN.replace("900", ""), 3, "x", "an empty cell", "a value is missing"),
    (PLAIN.replace("520", "nan"), 4, "z", "'nan'", "a value is missing"),
    (PLAIN.replace("900", "inf"), 3, "x", "'inf'", "not a finite number"),
    (PLAIN.replace("900", "-1e300"), 3, "x", "'-1e300'", "larger than anything that is measured"),
    (PLAIN.replace(",2,8", ",inf,8"), 3, "time", "'inf'", "not a finite number"),
    (with_column("sim.x,sim.y,sim.z", "1,2,3", "1,,3", "1,2,3"), 3, "sim.y", "an empty cell", "missing"),
    (ROWS.split("\n", 1)[1], None, ..., None, "the first line of … was taken for a header"),
    (POINT, 2, "x", "'1.000'", COMMA),
    (POINT.replace("1.000", "1.000,5"), 2, "x", "'1.000,5'", COMMA),
    # hostile ones
    (PLAIN + '"', None, ..., None, "cannot be read as CSV"),
    (PLAIN + "1" * 10_000_000, None, ..., None, "cannot be read as CSV"),
    ("," * 1_000_000, None, None, None, "is empty"),
    (PLAIN + "\n" * 200_000, None, ..., None, "100000 lines in succession are blank"),
    (
        "\n".join(f"{line}{',1' * 5000}" for line in PLAIN.split()),
        1,
        None,
        "5009",
        "at most 1000, a row for each measurement",
    ),
    (b"\0" * 100_000, None, None, None, "has a header but no rows"),
]


@pytest.mark.parametrize(("table", "row", "column", "found", "said"), REFUSED, ids=lambda value: str(value)[-20:])
def test_a_spoilt_table_is_refused_with_its_row(tmp_path, table, row, column, found, said):
    error = refusal(tmp_path, table=table)
    assert error.file == str(tmp_path / "measurements.csv")
    assert column is ... or (error.row, error.column) == (row, column)
    assert found in (None, error.found)
    assert says(error, said)


def test_a_table_that_is_too_large_is_refused_before_it_is_read(tmp_path, monkeypatch):
    monkeypatch.setattr(tables, "MOST_CELLS", 18)
    assert "has more cells than can be read" in str(refusal(tmp_path))
    monkeypatch.setattr(tables, "LARGEST_TABLE", len(PLAIN) - 1)
    assert "is larger than any table" in str(refusal(tmp_path))


def test_a_frame_keeps_its_own_rows_or_counts_them_as_a_file() -> None:
    frame = pd.DataFrame({" a ": [1, 2], "b": ["x", None]}, index=[7, 3])
    table = table_from_frame(frame)
    assert (list(table.columns), table.rows.tolist(), table.header) == (["a", "b"], [7, 3], None)
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
    with pytest.raises(CampaignError, match=f"^<table>.*{words}"):
        table_from_frame(frame)


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
    "truths": ([True, False, True], [1.0, 0.0, 1.0]),
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


def test_numbers_and_text_of_one_column() -> None:
    table = Table("t.csv", {"a": ["1", "", "2e3", "−4"], "b": ["1", "", "low", "high"]}, np.arange(2, 6))
    np.testing.assert_array_equal(table.numbers("a", gaps=True), [1.0, np.nan, 2000.0, -4.0])
    assert table.text("a") == ["1", "", "2e3", "−4"]
    assert (table.first_text("a"), table.first_text("b")) == (None, 2)
    with pytest.raises(CampaignError, match="row 3, column 'a': a value is missing; found an empty cell"):
        table.numbers("a")
    typed = Table("<table>", {"a": np.array([1.5, np.nan, 3.0])}, np.arange(3))
    np.testing.assert_array_equal(typed.numbers("a", gaps=True), [1.5, np.nan, 3.0])
    assert (typed.text("a"), typed.first_text("a"), typed.is_empty("a")) == (["1.5", "", "3"], None, False)


@pytest.mark.parametrize("word", ["", "nan", "NaN", "NA", "n/a", "null", "None", "<NA>"])
def test_these_words_are_empty_cells(word: str) -> None:
    table = Table("t.csv", {"a": [word, word], "b": [word, "1"]}, np.arange(2, 4))
    assert (table.is_empty("a"), table.is_empty("b")) == (True, False)
    assert np.isnan(table.numbers("b", gaps=True)).tolist() == [True, False]
    assert (table.text("b"), table.first_text("b")) == (["", "1"], None)


def test_a_number_survives_its_text() -> None:
    numbers = np.random.default_rng(2).normal(size=200) * 10.0 ** np.linspace(-20, 19, 200)
    cells = [repr(float(number)) for number in numbers]
    for comma in (False, True):
        told = [cell.replace(".", ",") for cell in cells] if comma else cells
        table = Table("t.csv", {"a": told}, np.arange(200), decimal_comma=comma)
        np.testing.assert_array_equal(table.numbers("a"), numbers)


def test_the_largest_figure_is_taken_and_the_smallest_are_none() -> None:
    cells, numbers = ["1e20", "1e-300", "-5e-324", "-1e-29"], [1e20, 0.0, 0.0, -1e-29]
    assert Table("t", {"a": cells}, np.arange(4)).numbers("a").tolist() == numbers
    with pytest.raises(CampaignError, match="larger than anything"):
        Table("t", {"a": ["-1e21"]}, np.arange(1)).numbers("a", gaps=True)


def test_pandas_is_not_loaded_for_csv(tmp_path: Path) -> None:
    import subprocess

    code = "import sys; from thermal_robot.campaign import read_campaign; read_campaign(sys.argv[1])"
    command = [sys.executable, "-c", f"{code}; print('pandas' in sys.modules)", str(put(tmp_path / "c"))]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
    assert read(tmp_path).warnings == ()
