"""Reading CSV, Parquet and pandas data frames into a :class:`~thermal_robot.campaign.table.Table`."""

from __future__ import annotations

import csv
import io
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from thermal_robot.campaign.names import LABELS
from thermal_robot.campaign.table import Cells, Table
from thermal_robot.errors import CampaignError

if TYPE_CHECKING:
    import pandas as pd

_DECIMAL_COMMA = re.compile(r"[+\-−]?\d*,\d+([eE][+-]?\d+)?")
PARQUET = (".parquet", ".pq")
"""Endings of the names of Parquet files."""
NO_PARQUET = "Parquet files need pyarrow, which is not installed"
WITH_PARQUET = 'pip install "thermal-robot[parquet]", or the table as CSV'


def read_table(path: Path) -> Table:
    """Read a CSV or, by its ending, a Parquet file.

    Columns of a CSV file may be separated by commas, semicolons or tabs, with decimal commas where the
    separator is not a comma; a byte-order mark, Windows line ends and blank lines do no harm.

    Raises
    ------
    CampaignError
        No such file, an empty one, a header without rows, a row with too few or too many fields, a duplicate
        column.
    """
    file = str(path)
    if not path.is_file():
        problem = "is a directory" if path.is_dir() else "there is no such file"
        raise CampaignError(file, problem, expected="the table of measurements")
    if path.suffix.lower() in PARQUET:
        return _read_parquet(path)
    text, warnings = _decode(path)
    lines, numbers = _records(file, text)
    header = [name.strip() for name in lines[0]]
    body, rows = lines[1:], np.array(numbers[1:], dtype=np.int64)
    if not body:
        raise CampaignError(file, "has a header but no rows", expected="one row per measurement")
    cells: dict[int, list[str]] = {i: [row[i].strip() for row in body] for i in range(len(header))}
    # A separator at the end of every line makes a column of nothing.
    kept = [i for i, name in enumerate(header) if name or any(cells[i])]
    _check_header(file, [header[i] for i in kept], number=numbers[0])
    columns = {header[i]: cells[i] for i in kept}
    comma = _separator(text) != "," and _has_decimal_comma(columns)
    return Table(file, columns, rows, numbers[0], comma, warnings)


def table_from_frame(frame: pd.DataFrame, file: str = "<table>", *, first_row: int | None = None) -> Table:
    """Return a pandas data frame as a table.

    Parameters
    ----------
    frame
        The data.
    file
        What to call it in messages.
    first_row
        Number of the first row; without it rows are known by an integer index of the frame, so that
        ``frame.loc[row]`` finds the one a message speaks of, or by position from 0.

    Raises
    ------
    CampaignError
        No rows, a duplicate column.
    """
    import pandas as pd

    header = [_as_text(name) for name in frame.columns]
    _check_header(file, header, number=None if first_row is None else 1)
    if len(frame) == 0:
        raise CampaignError(file, "has a header but no rows", expected="one row per measurement")
    if first_row is not None:
        rows = np.arange(first_row, first_row + len(frame))
    elif pd.api.types.is_signed_integer_dtype(frame.index.dtype) and frame.index.is_unique and not frame.index.hasnans:
        rows = frame.index.to_numpy(dtype=np.int64)
    else:
        rows = np.arange(len(frame))
    columns: dict[str, Cells] = {}
    for i, name in enumerate(header):
        series = frame.iloc[:, i]
        if pd.api.types.is_numeric_dtype(series.dtype) and not pd.api.types.is_complex_dtype(series.dtype):
            columns[name] = series.to_numpy(dtype=np.float64, na_value=np.nan)
        else:
            columns[name] = ["" if gap else _as_text(cell) for cell, gap in zip(series, series.isna(), strict=True)]
    return Table(file, columns, rows.astype(np.int64), None if first_row is None else 1)


def _as_text(cell: object) -> str:
    """Return any value as one line of text; what cannot say itself by its type."""
    try:
        return str(cell).strip()
    except Exception:  # a cell may hold anybody's object, and Python writes no whole number of 5000 digits
        return f"<{type(cell).__name__}>"


def _read_parquet(path: Path) -> Table:
    import pandas as pd

    try:
        frame = pd.read_parquet(path)
    except ImportError as error:
        raise CampaignError(str(path), NO_PARQUET, expected=WITH_PARQUET) from error
    except Exception as error:  # pyarrow raises its own, which cannot be named without importing it
        reason = " ".join(str(error).split())
        raise CampaignError(str(path), f"cannot be read as a Parquet file ({reason})") from error
    # An index with a name is a column that pandas set aside.
    frame = frame.reset_index(drop=frame.index.names == [None])
    return table_from_frame(frame, str(path), first_row=2)


def _decode(path: Path) -> tuple[str, tuple[str, ...]]:
    """Return the text of a file and what was odd about it."""
    file = str(path)
    try:
        data = path.read_bytes()
    except OSError as error:
        raise CampaignError(file, f"cannot be read: {error.strerror}") from error
    if data.startswith(b"PK\x03\x04"):
        raise CampaignError(file, "is a workbook or an archive", expected="a table saved as CSV or Parquet")
    if data.startswith(b"PAR1"):
        raise CampaignError(file, "is a Parquet file by its contents", expected="a name that ends in .parquet")
    utf16 = data.startswith((b"\xff\xfe", b"\xfe\xff"))
    try:
        text = data.decode("utf-16" if utf16 else "utf-8-sig")
        warnings: tuple[str, ...] = ()
    except UnicodeDecodeError:
        # Spreadsheets still write the Windows code page; only letters outside ASCII differ.
        text = data.decode("cp1252", errors="replace")
        warnings = (f"{file} is not UTF-8 and was read as Windows-1252: check names and labels with accents",)
    if not text.strip():
        raise CampaignError(file, "is empty", expected="a header and one row per measurement")
    return text, warnings


def _separator(text: str) -> str:
    """Return the separator of the header."""
    header = re.split(r"[\r\n]", text.lstrip("\r\n "), maxsplit=1)[0]
    return ";" if ";" in header else "\t" if "\t" in header else ","


def _records(file: str, text: str) -> tuple[list[list[str]], list[int]]:
    """Return the lines that hold anything, split into fields, with the line numbers where they start."""
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=_separator(text))
    lines: list[list[str]] = []
    numbers: list[int] = []
    before = 0
    try:
        for fields in reader:
            start, before = before + 1, reader.line_num
            if not any(field.strip() for field in fields):
                continue
            if lines and len(fields) != len(lines[0]):
                raise CampaignError(
                    file,
                    "wrong number of fields",
                    row=start,
                    found=str(len(fields)),
                    expected=f"{len(lines[0])} as in the header",
                )
            lines.append(fields)
            numbers.append(start)
    except csv.Error as error:
        raise CampaignError(file, f"cannot be read as CSV ({error})", row=before + 1) from error
    return lines, numbers


def _check_header(file: str, header: Sequence[str], number: int | None) -> None:
    for name, count in Counter(header).items():
        if not name:
            raise CampaignError(
                file, "a column has no name", row=number, found=f"column {header.index('') + 1} without one"
            )
        if count > 1:
            raise CampaignError(
                file,
                "duplicate column",
                row=number,
                column=name,
                found=f"it {count} times",
                expected="every column once",
            )


def _has_decimal_comma(columns: Mapping[str, Sequence[str]]) -> bool:
    return any(
        "," in cell and _DECIMAL_COMMA.fullmatch(cell)
        for name, cells in columns.items()
        if name not in LABELS
        for cell in cells
    )
