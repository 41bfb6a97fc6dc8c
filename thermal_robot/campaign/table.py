"""Tables of text or numbers with row numbers, read from CSV, Parquet, MATLAB, spreadsheets and data frames.

The module does not depend on robots or on the meaning of columns.
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, TextIO, TypeAlias

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign.checked import beyond, first_true, refuse, without_rounding
from thermal_robot.campaign.names import LABELS
from thermal_robot.errors import CampaignError
from thermal_robot.files import is_file, is_folder

if TYPE_CHECKING:
    import pandas as pd

Cells: TypeAlias = "Sequence[str] | Array"
"""A column: text as it stands in the file, or numbers where the source has a type of its own."""

_FEW = 5  # rows that a sentence names
_EMPTY = frozenset({"", "nan", "na", "n/a", "null", "none", "<na>"})


def without_names(header: Iterable[str], file: str) -> str:
    """Warning text if a header consists of two or more numbers only, so that it is a data row; else empty."""
    try:
        figures = [float(name.replace(",", ".").replace("−", "-")) for name in header]
    except ValueError:
        return ""
    remedy = "write names above it, or `header = false` under [table] of a mapping"
    told = f"; the first line of {file} is numbers alone and was taken for a header: {remedy}"
    return told if len(figures) > 1 else ""


@dataclass(frozen=True)
class Table:
    """Columns of equal length with row numbers."""

    file: str  # name of the file as the user gave it, for messages
    columns: Mapping[str, Cells]  # cells by name, names stripped of blanks
    rows: NDArray[np.int64]  # (N,) row numbers: as a text editor counts them, or the integer index of a data frame
    header: int | None = None  # row number of the header, ``None`` for a data frame
    decimal_comma: bool = False  # numbers are written 1,5
    warnings: tuple[str, ...] = ()  # what was odd about the file
    unread: tuple[str, ...] = ()  # further columns of the file, which an import left out, for messages

    @property
    def headless(self) -> str:
        """Warning text if the table's header is a data row (:func:`without_names`); else empty."""
        return "" if self.header is None else without_names(self.columns, self.file)

    @property
    def unnamed(self) -> bool:
        """Whether the file has no header, so that its columns are called 1, 2, 3 …."""
        return self.header is None and all(name == str(k) for k, name in enumerate(self.columns, start=1))

    def error(self, problem: str, column: str, index: int | None = None, **told: str) -> CampaignError:
        """Build a CampaignError that names the file, a column, and the row of an index from 0, else the header's."""
        row = self.header if index is None else int(self.rows[index])
        return CampaignError(self.file, problem, row=row, column=column, **told)

    def refuse(
        self,
        wrong: NDArray[np.bool_],
        problem: str,
        column: str,
        expected: str,
        found: Callable[[int], str] | None = None,
    ) -> None:
        """Raise a CampaignError for the first true row of the mask ``wrong`` (N,), with its cell or ``found`` of it."""
        refuse(self.file, column, wrong, problem, expected, found or partial(self._shown, column), self.rows)

    def _shown(self, column: str, index: int) -> str:
        """Format a cell for a message: text in quotes, a number without, "an empty cell" where there is nothing."""
        cell = self.columns[column][index]
        if isinstance(cell, str):
            return repr(cell) if cell else "an empty cell"
        return "an empty cell" if np.isnan(cell) else f"{cell:.15g}"

    def numbers(self, column: str, *, gaps: bool = False) -> Array:
        """Column as (N,) numbers in the file's unit; with ``gaps`` empty cells are NaN.

        Raises
        ------
        CampaignError
            Text, a number that is infinite or too large, or an empty cell without ``gaps``.
        """
        values, text = self._parsed(column)
        if text.any():
            mixed = self.decimal_comma and "." in str(self.columns[column][int(np.argmax(text))])
            expected = "a number" + (" with a decimal comma, as elsewhere in this file" if mixed else "")
            self.refuse(text, "text where a number should be", column, expected)
        empty = np.isnan(values)
        wrong = beyond(values) & ~(gaps & empty)
        if wrong.any():
            unfilled, first = len(values) > 1 and bool(empty.all()), values[np.argmax(wrong)]
            problem = "not a finite number" if np.isinf(first) else "larger than anything that is measured"
            lacking = "the column is still to be filled in" if unfilled else "a value is missing"
            self.refuse(wrong, lacking if np.isnan(first) else problem, column, "a number")
        return without_rounding(values)

    def text(self, column: str) -> list[str]:
        """Column as N strings; numbers in shortest form, empty cells as ``""``."""
        cells = self.columns[column]
        if isinstance(cells, np.ndarray):
            return ["" if np.isnan(value) else f"{value:.15g}" for value in cells]
        return ["" if cell.lower() in _EMPTY else cell for cell in cells]

    def take(self, chosen: NDArray[np.bool_] | NDArray[np.int64]) -> Table:
        """Return the table of some rows, chosen by a mask (N,) or by indices from 0; row numbers are kept."""
        index = np.arange(len(self.rows))[chosen]
        columns: dict[str, Cells] = {
            name: cells[index] if isinstance(cells, np.ndarray) else [cells[int(i)] for i in index]
            for name, cells in self.columns.items()
        }
        return replace(self, columns=columns, rows=self.rows[index])

    def numeric(self) -> dict[str, Array]:
        """Return the columns that hold nothing but numbers, (N,) each, NaN for empty cells."""
        return {name: self.numbers(name, gaps=True) for name in self.columns if self.first_text(name) is None}

    def frame(self, *, numbers: bool = False) -> pd.DataFrame:
        """Convert the table to a data frame; with ``numbers``, columns of numbers only are parsed, else cells stay.

        Columns of numbers are parsed in any case where the file has decimal commas.
        """
        import pandas as pd

        return pd.DataFrame({**self.columns, **(self.numeric() if numbers or self.decimal_comma else {})})

    def first_text(self, column: str) -> int | None:
        """Index from 0 of the first cell that is neither a number nor empty; ``None`` for a numeric column."""
        return first_true(self._parsed(column)[1])

    def is_empty(self, column: str) -> bool:
        """Whether all cells of the column are empty."""
        values, text = self._parsed(column)
        return bool((np.isnan(values) & ~text).all())

    def _parsed(self, column: str) -> tuple[Array, NDArray[np.bool_]]:
        """Parse a column: number (N,) in each cell, NaN where there is none, and mask (N,) of the cells with text."""
        cells = self.columns[column]
        if isinstance(cells, np.ndarray):
            return np.array(cells, dtype=np.float64), np.zeros(len(cells), dtype=bool)
        if not self.decimal_comma and "_" not in "".join(cells):
            try:
                # nearly every column of nearly every file
                return np.array([float(cell) for cell in cells]), np.zeros(len(cells), dtype=bool)
            except ValueError:
                pass
        found = [_number(cell, self.decimal_comma) for cell in cells]
        return np.array(found, dtype=np.float64), np.array([number is None for number in found], dtype=bool)


def _number(cell: str, comma: bool) -> float | None:
    """Parse a cell, with decimal ``comma`` or point: a number, NaN for an empty cell, ``None`` for text."""
    # 1.234,5 has a thousands separator, which cannot be told from a decimal point; Python alone writes 1_000
    if "_" in cell or (comma and "." in cell):
        return None
    try:
        # a spreadsheet's or a document's minus sign is still a minus sign
        return float((cell.replace(",", ".") if comma else cell).replace("−", "-"))
    except ValueError:
        return float("nan") if cell.lower() in _EMPTY else None


def listed_rows(numbers: NDArray[np.int64]) -> str:
    """Text with the count of rows and the first five of their numbers: ``3 rows (4, 7, 9)``."""
    more = "" if len(numbers) <= _FEW else " …"
    return f"{len(numbers)} row{'s' if len(numbers) > 1 else ''} ({', '.join(map(str, numbers[:_FEW]))}{more})"


_DECIMAL_COMMA = re.compile(r"[+\-−]?\d*,\d+([eE][+-]?\d+)?")
_MARKED = re.compile(r" *# *(?=[^\s,;#])")  # a column of numbers that is called # is no mark
_MOST_BLANK_LINES = 100_000  # in succession: nobody scrolls past so many
LARGEST_TABLE = 256 << 20  # Bytes: a million rows of ten columns with all digits, which are read in 1.5 GB
MOST_CELLS = 20_000_000  # The same, for a file whose cells are short or packed
MOST_COLUMNS = 1000  # Logs of two arms with every quantity that a controller knows have a few hundred
PARQUET = (".parquet", ".pq")  # Endings of the names of Parquet files
WORKBOOKS = {".xlsx": "openpyxl", ".xlsm": "openpyxl", ".ods": "odfpy"}
"""Endings of the names of workbooks, and what pandas reads them with."""
MATLAB = ".mat"
"""Ending of MATLAB's files, of which one matrix is a table without names."""
NO_TABLES = {
    **dict.fromkeys((".json", ".yaml", ".yml", ".xml", ".urdf"), "text of another kind"),
    **dict.fromkeys((".bag", ".db3", ".mcap"), "a recording"),
    **dict.fromkeys((".npy", ".npz", ".pkl", ".h5", ".hdf5"), "a file of arrays"),
    **dict.fromkeys((".src", ".ls", ".mod", ".modx", ".tp"), "a robot's program"),
}
"""Endings of files that people have beside a table and that hold none, and what they are."""
_PACKED = (
    (b"PK\x03\x04", "is a workbook or an archive", "a name that ends in .xlsx or .ods, or the table as CSV or Parquet"),
    (b"PAR1", "is a Parquet file by its contents", "a name that ends in .parquet"),
)
"""First bytes of files that are no text, what they are, and what helps."""
TABLES = {".csv": "", **dict.fromkeys(PARQUET, "pyarrow"), ".xlsx": "openpyxl", ".ods": "odf"}
"""Endings of tables that are written, and the module that writes each."""
TYPED = tuple(ending for ending, module in TABLES.items() if module)
"""Those whose cells have a type."""
_ONE_ROW = "one row per measurement"
SPACE = " "  # A separator of which any number is one, as of blanks and tabs in a list that is lined up for the eye


@dataclass(frozen=True)
class Layout:
    """Layout of a foreign text file: separators, header and comments."""

    # one character, :data:`SPACE`, or empty: the first line that holds anything tells, and blanks separate where it has
    # no other separator and the next line falls into as many parts
    separator: str = ""
    skip: int = 0  # lines before the header, or before the first row, that hold something else
    header: bool = True  # whether there is a line of names; columns are called 1, 2, 3 … where there is none
    comment: str = ""  # lines that begin so are left out; empty where there are none


PLAIN = Layout()  # A header and rows, nothing else


def read_table(path: Path, layout: Layout = PLAIN) -> Table:
    """Read a CSV or, by its ending, a Parquet file, the first sheet of a workbook (.xlsx, .ods) or a matrix (.mat).

    Columns of a CSV file may be separated by commas, semicolons, tabs or blanks, with decimal commas where the
    separator is not a comma; a byte-order mark, Windows line ends and blank lines do no harm.

    Parameters
    ----------
    path
        The file.
    layout
        Of a text file, where it is not a header and rows alone.

    Raises
    ------
    CampaignError
        No such file, an empty one, a header without rows, a row with too few or too many fields, a duplicate
        column.
    """
    file, ending = str(path), path.suffix.lower()
    if not is_file(path):
        problem = "is a directory" if is_folder(path) else "there is no such file"
        raise CampaignError(file, problem, expected="the table of measurements")
    if path.stat().st_size > LARGEST_TABLE:
        raise CampaignError(file, "is larger than any table that can be read", expected=f"{LARGEST_TABLE >> 20} MiB")
    if what := NO_TABLES.get(ending):
        expected = "CSV, Parquet, .xlsx, .ods or .mat; `thermal-robot import --help` lists what else is read"
        raise CampaignError(file, f"is {what} by its ending, and no table", found=path.suffix, expected=expected)
    if ending in WORKBOOKS:
        return _read_workbook(path, layout)
    if ending in (MATLAB, *PARQUET):
        return _read_matlab(path) if ending == MATLAB else _read_parquet(path)
    try:
        with path.open("rb") as stream:
            head = stream.read(4)
        for start, what, expected in _PACKED:
            if head.startswith(start):
                raise CampaignError(file, what, expected=expected)
        try:
            return _read_text(path, layout, "utf-16" if head.startswith((b"\xff\xfe", b"\xfe\xff")) else "utf-8-sig")
        except UnicodeDecodeError:
            # spreadsheets still write the Windows code page; only letters outside ASCII differ
            odd = f"{file} is not UTF-8 and was read as Windows-1252: check names and labels with accents"
            return replace(_read_text(path, layout, "cp1252"), warnings=(odd,))
    except OSError as error:
        raise CampaignError(file, f"cannot be read: {error.strerror}") from error


def without_library(file: str, ending: str) -> CampaignError:
    """Build the CampaignError for a file whose ending needs a library that is not installed."""
    extra, problem = "parquet", "Parquet files need pyarrow, which is not installed"
    if ending in WORKBOOKS:
        extra, problem = "excel", f"workbooks need {WORKBOOKS[ending]}, which is not installed"
    return CampaignError(file, problem, expected=f'pip install "thermal-robot[{extra}]", or the table as CSV')


def _read_text(path: Path, layout: Layout, encoding: str) -> Table:
    with path.open(encoding=encoding, errors="strict" if encoding == "utf-8-sig" else "replace", newline="") as stream:
        separator = layout.separator or _separator(_lines(stream, layout))
        stream.seek(0)
        lines = csv.reader(_lines(stream, layout, even=separator == SPACE), delimiter=separator, strict=True)
        return _table(str(path), lines, layout.header, comma=separator != ",")


def _table(file: str, lines: Iterable[list[str]], named: bool, comma: bool = True) -> Table:
    """Build a table from lines of text fields, whose first is the header if ``named``; detect decimal commas."""
    header, cells, numbers = _records(file, lines, named)
    if len(numbers) < 2:
        raise CampaignError(file, "has a header but no rows", expected=_ONE_ROW)
    # A separator at the end of every line makes a column of nothing.
    kept = [i for i, name in enumerate(header) if name or any(cells[i])]
    _check_header(file, [header[i] for i in kept], number=numbers[0])
    columns = {header[i]: cells[i] for i in kept}
    texts = (cell for name, column in columns.items() if name not in LABELS for cell in column)
    comma = comma and any("," in cell and _DECIMAL_COMMA.fullmatch(cell) for cell in texts)
    return Table(file, columns, np.array(numbers[1:], dtype=np.int64), numbers[0] if named else None, comma)


def table_from_frame(frame: pd.DataFrame, file: str = "<table>", *, first_row: int | None = None) -> Table:
    """Convert a pandas data frame to a table; one without rows, or with a duplicate column, is refused.

    Rows are numbered from ``first_row``; without it by the frame's index if this is of unique integers, so that
    ``frame.loc[row]`` finds the row that a message names, else by position from 0.
    """
    import pandas as pd

    header = [_as_text(name) for name in frame.columns]
    _check_header(file, header, number=None if first_row is None else 1)
    if len(frame) == 0:
        raise CampaignError(file, "has a header but no rows", expected=_ONE_ROW)
    index = frame.index
    own = pd.api.types.is_signed_integer_dtype(index.dtype) and index.is_unique and not index.hasnans
    rows = index.to_numpy(dtype=np.int64) if own and first_row is None else np.arange(len(frame)) + (first_row or 0)
    columns: dict[str, Cells] = {}
    for i, name in enumerate(header):
        series = frame.iloc[:, i]
        if pd.api.types.is_numeric_dtype(series.dtype) and not pd.api.types.is_complex_dtype(series.dtype):
            columns[name] = series.to_numpy(dtype=np.float64, na_value=np.nan)
        else:
            columns[name] = ["" if gap else _as_text(cell) for cell, gap in zip(series, series.isna(), strict=True)]
    return Table(file, columns, rows.astype(np.int64), None if first_row is None else 1)


def _as_text(cell: object) -> str:
    """Convert a cell's value to text without blanks at the ends, or to the name of its type where that fails."""
    try:
        return str(cell).strip()
    except Exception:  # a cell may hold anybody's object, and Python writes no whole number of 5000 digits
        return f"<{type(cell).__name__}>"


@contextmanager
def _reading(path: Path, kind: str) -> Iterator[None]:
    """Context manager that turns any error of a reading library into a CampaignError that names the file."""
    try:
        yield
    except CampaignError:
        raise
    except ImportError as error:
        raise without_library(str(path), path.suffix.lower()) from error
    except Exception as error:  # each library raises its own
        raise CampaignError(str(path), f"cannot be read as a {kind} ({' '.join(str(error).split())})") from error


def _read_parquet(path: Path) -> Table:
    import pandas as pd

    file = str(path)
    with _reading(path, "Parquet file"):
        from pyarrow.parquet import read_metadata

        held = read_metadata(path)
        _require_size(file, held.num_rows, held.num_columns)
        frame = pd.read_parquet(path)
    # An index with a name is a column that pandas set aside.
    if twice := [name for name in frame.index.names if name in frame.columns]:
        raise CampaignError(file, "duplicate column", column=str(twice[0]), found="it as the index, too")
    return table_from_frame(frame.reset_index(drop=frame.index.names == [None]), file, first_row=2)


def _read_workbook(path: Path, layout: Layout) -> Table:
    """Read the first sheet of a workbook as a table, with the spreadsheet's row numbers."""
    import pandas as pd

    with _reading(path, "workbook"):
        sheets = pd.read_excel(path, sheet_name=None, header=None, dtype=object)
    first, frame = next(iter(sheets.items()))
    _require_size(str(path), *frame.shape)
    rows = frame.astype(object).where(frame.notna(), "").to_numpy()
    lines = ([_as_text(cell) for cell in row] for row in rows)
    kept = (
        [] if k < layout.skip or (layout.comment and line[0].startswith(layout.comment)) else line
        for k, line in enumerate(lines)
    )
    more = f"{path} has {len(sheets)} sheets: the first, {first!r}, was read"
    return replace(_table(str(path), kept, layout.header), warnings=(more,) if len(sheets) > 1 else ())


def _read_matlab(path: Path) -> Table:
    """Read the one matrix in a MATLAB file as a table with columns 1, 2, 3 … and rows from 1; else refuse the file."""
    import pandas as pd
    from scipy.io import loadmat

    file = str(path)
    with _reading(path, "MATLAB file of version 7 or older"):
        held = {name: np.asarray(value) for name, value in loadmat(path).items()}
    matrices = {k: v for k, v in held.items() if v.ndim == 2 and v.size > 1 and v.dtype.kind in "fiu"}
    if len(matrices) != 1:
        shapes = ", ".join(f"{name} ({' x '.join(map(str, value.shape))})" for name, value in matrices.items())
        raise CampaignError(file, "does not hold one matrix of numbers", found=shapes or "none", expected="one")
    (values,) = matrices.values()
    _require_size(file, *values.shape)
    frame = pd.DataFrame(values, columns=range(1, values.shape[1] + 1))
    return replace(table_from_frame(frame, file, first_row=1), header=None)


def _lines(stream: TextIO, layout: Layout, *, even: bool = False) -> Iterator[str]:
    """Yield the lines of a text file; skipped ones and comments are blanked, so that line numbers stay.

    With ``even`` each run of white space becomes one blank. Of leading lines that begin with # the last is the header,
    as numpy writes it, unless the layout states a comment.
    """
    marked: list[str] = []
    leading = not layout.comment
    for number, line in enumerate(stream):
        if number < layout.skip or (layout.comment and line.lstrip().startswith(layout.comment)):
            line = "\n"
        elif even:
            line = f"{SPACE.join(line.split())}\n"
        if leading and (found := _MARKED.match(line)):
            yield from ["\n"] * len(marked)
            marked = [line[found.end() :] if layout.header else "\n"]
            continue
        yield from marked
        marked = []
        leading = leading and not line.strip()
        yield line
    yield from marked


def _separator(lines: Iterator[str]) -> str:
    """Detect the separator: semicolon or tab if in the first line, white space if two lines fit it, else comma."""
    held = (line for line in lines if line.strip())
    header, line = next(held, ""), next(held, "")
    parts, rest = header.split(), line.split()
    blanks = len(parts) > 1 and len(rest) in (0, len(parts))
    blanks = blanks and all(_DECIMAL_COMMA.fullmatch(part) or "," not in part for part in parts)
    return next((each for each in (";", "\t") if each in header), SPACE if blanks else ",")


def _records(file: str, lines: Iterable[list[str]], named: bool) -> tuple[list[str], list[list[str]], list[int]]:
    """Split lines of fields into header, cells by column, and line numbers of header and rows.

    Blank lines are left out. Where columns are not ``named``, the header is 1, 2, 3 … with line number 0.
    """
    header: list[str] = []
    cells: list[list[str]] = []
    numbers: list[int] = []
    before = 0
    try:
        for fields in lines:
            # a field may hold the end of a line, which csv counts; a workbook has a row for each
            start, before = before + 1, getattr(lines, "line_num", before + 1)
            if not any(field.strip() for field in fields):
                if start - (numbers[-1] if numbers else 0) > _MOST_BLANK_LINES:
                    raise CampaignError(file, f"more than {_MOST_BLANK_LINES} lines in succession are blank", row=start)
                continue
            if not header:
                header = [name.strip() for name in fields] if named else [str(k + 1) for k in range(len(fields))]
                cells, numbers = [[] for _ in header], [start if named else 0]
                if named:
                    continue
            if len(fields) != len(header):
                expected = f"{len(header)} as in the {'header' if named else 'first row'}"
                problem = "wrong number of fields"
                raise CampaignError(file, problem, row=start, found=str(len(fields)), expected=expected)
            numbers.append(start)
            for column, field in zip(cells, fields, strict=True):
                column.append(field.strip())
            _require_size(file, len(numbers), len(header))
    except csv.Error as error:
        raise CampaignError(file, f"cannot be read as CSV ({error})", row=before + 1) from error
    if not header:
        raise CampaignError(file, "is empty", expected=f"a header and {_ONE_ROW}")
    return header, cells, numbers


def _require_size(file: str, rows: int, columns: int) -> None:
    if rows * columns > MOST_CELLS:
        found = f"{columns} columns of {rows} rows and more"
        expected = f"at most {MOST_CELLS} cells: leave out rows or columns"
        raise CampaignError(file, "has more cells than can be read", found=found, expected=expected)


def _check_header(file: str, header: Sequence[str], number: int | None) -> None:
    if len(header) > MOST_COLUMNS:
        expected = f"at most {MOST_COLUMNS}, a row for each measurement: leave out others, or transpose the table"
        raise CampaignError(file, "too many columns", row=number, found=str(len(header)), expected=expected)
    if "" in header:
        found = f"column {header.index('') + 1} without one"
        raise CampaignError(file, "a column has no name", row=number, found=found)
    name, count = Counter(header).most_common(1)[0] if header else ("", 0)
    if count > 1:
        problem, found = f"duplicate column{without_names(header, file)}", f"it {count} times"
        raise CampaignError(file, problem, row=number, column=name, found=found, expected="every column once")
