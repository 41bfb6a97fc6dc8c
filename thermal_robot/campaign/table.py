"""A table as text or numbers, with its row numbers; knows nothing of robots or of what columns mean."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from thermal_robot.campaign.figures import first_beyond, settled
from thermal_robot.errors import CampaignError

if TYPE_CHECKING:
    import pandas as pd

Cells: TypeAlias = "Sequence[str] | NDArray[np.float64]"
"""A column: text as it stands in the file, or numbers where the source has a type of its own."""

_FEW = 5  # rows that a sentence names
_EMPTY = frozenset({"", "nan", "na", "n/a", "null", "none", "<na>"})


def without_names(header: Iterable[str], file: str) -> str:
    """Say that a header holds numbers alone, so that it was a row of the table; empty where it does not."""
    try:
        figures = [float(name.replace(",", ".").replace("−", "-")) for name in header]
    except ValueError:
        return ""
    remedy = "write names above it, or `header = false` under [table] of a mapping"
    told = f"; the first line of {file} is numbers alone and was taken for a header: {remedy}"
    return told if len(figures) > 1 else ""


@dataclass(frozen=True)
class Table:
    """Columns of equal length with the row number of each entry.

    Attributes
    ----------
    file
        Name of the file as the user gave it, for messages.
    columns
        Cells by name, names stripped of blanks.
    rows
        (N,) row numbers: as a text editor counts them, or the integer index of a data frame.
    header
        Row number of the header, ``None`` for a data frame.
    decimal_comma
        Numbers are written 1,5.
    warnings
        What was odd about the file.
    """

    file: str
    columns: Mapping[str, Cells]
    rows: NDArray[np.int64]
    header: int | None = None
    decimal_comma: bool = False
    warnings: tuple[str, ...] = ()

    @property
    def headless(self) -> str:
        """What :func:`without_names` says of its header."""
        return "" if self.header is None else without_names(self.columns, self.file)

    @property
    def unnamed(self) -> bool:
        """Whether the file has no header, so that its columns are called 1, 2, 3 …."""
        return self.header is None and all(name == str(k) for k, name in enumerate(self.columns, start=1))

    def told(self, chosen: NDArray[np.bool_]) -> str:
        """Say which rows were chosen (N,), a few of them by number: ``3 rows (4, 7, 9)``."""
        return told_rows(self.rows[chosen])

    def numbers(self, column: str, *, gaps: bool = False) -> NDArray[np.float64]:
        """Return a column as (N,) numbers in the file's unit.

        Parameters
        ----------
        column
            Its name.
        gaps
            Accept empty cells, as NaN.

        Raises
        ------
        CampaignError
            Text, a number that is infinite or larger than any, or an empty cell where none may be.
        """
        cells = self.columns[column]
        values = cells if isinstance(cells, np.ndarray) else self._parse(column, cells)
        index = first_beyond(np.nan_to_num(values, nan=0.0, posinf=np.inf, neginf=-np.inf) if gaps else values)
        if index is not None:
            value = values[index]
            unfilled = len(values) > 1 and bool(np.isnan(values).all())
            empty = "the column is still to be filled in" if unfilled else "a value is missing"
            finite = "not a finite number" if np.isinf(value) else "larger than anything that is measured"
            raise CampaignError(
                self.file,
                empty if np.isnan(value) else finite,
                row=int(self.rows[index]),
                column=column,
                found=self._as_found(cells[index]),
                expected="a number",
            )
        return settled(values)

    def text(self, column: str) -> list[str]:
        """Return a column as N strings; numbers as short as they can be, empty cells as ``""``."""
        cells = self.columns[column]
        if isinstance(cells, np.ndarray):
            return ["" if np.isnan(value) else f"{value:.15g}" for value in cells]
        return ["" if cell.lower() in _EMPTY else cell for cell in cells]

    def take(self, kept: NDArray[np.bool_]) -> Table:
        """Return the table of some of the rows, of (N,) booleans; they keep their numbers."""
        index = np.flatnonzero(kept)
        columns: dict[str, Cells] = {
            name: cells[index] if isinstance(cells, np.ndarray) else [cells[int(i)] for i in index]
            for name, cells in self.columns.items()
        }
        return replace(self, columns=columns, rows=self.rows[index])

    def frame(self, *, numbers: bool = False) -> pd.DataFrame:
        """Return the table as a data frame: cells as they stand, or ``numbers`` where a column has nothing else.

        Decimal commas become numbers in any case.
        """
        import pandas as pd

        if not (numbers or self.decimal_comma):
            return pd.DataFrame(dict(self.columns))
        plain = {name for name in self.columns if self.first_text(name) is None}
        return pd.DataFrame(
            {n: self.numbers(n, gaps=True) if n in plain else cells for n, cells in self.columns.items()}
        )

    def first_text(self, column: str) -> int | None:
        """Return the index of the first cell that is not a number, ``None`` for a numeric column."""
        cells = self.columns[column]
        if isinstance(cells, np.ndarray):
            return None
        values = self._numbers_or_none(cells)
        return values.index(None) if None in values else None

    def is_empty(self, column: str) -> bool:
        """Return whether no cell of the column holds anything."""
        cells = self.columns[column]
        if isinstance(cells, np.ndarray):
            return bool(np.isnan(cells).all())
        return all(cell.lower() in _EMPTY for cell in cells)

    def _parse(self, column: str, cells: Sequence[str]) -> NDArray[np.float64]:
        values = self._numbers_or_none(cells)
        if None in values:
            index = values.index(None)
            mixed = self.decimal_comma and "." in cells[index]
            raise CampaignError(
                self.file,
                "text where a number should be",
                row=int(self.rows[index]),
                column=column,
                found=repr(cells[index]),
                expected="a number" + (" with a decimal comma, as elsewhere in this file" if mixed else ""),
            )
        return np.array(values, dtype=np.float64)

    def _numbers_or_none(self, cells: Sequence[str]) -> list[float | None]:
        """Return the number in each cell, NaN for an empty one, ``None`` for text."""
        if not self.decimal_comma and "_" not in "".join(cells):
            try:
                return [float(cell) for cell in cells]  # nearly every column of nearly every file
            except ValueError:
                pass
        return [self._number(cell) for cell in cells]

    def _number(self, cell: str) -> float | None:
        """Return the number in a cell, NaN for an empty one, ``None`` for text."""
        if self.decimal_comma and "," in cell:
            if "." in cell:  # 1.234,5: a thousands separator, which cannot be told from a decimal point
                return None
            cell = cell.replace(",", ".")
        elif self.decimal_comma and "." in cell:
            return None
        try:
            value = float(cell)
        except ValueError:
            if cell.lower() in _EMPTY:
                return float("nan")
            # A spreadsheet's or a document's minus sign is still a minus sign.
            return self._number(cell.replace("−", "-")) if "−" in cell else None
        return None if "_" in cell else value  # Python reads 1_000 as a number; no instrument writes it

    @staticmethod
    def _as_found(cell: Any) -> str:
        if isinstance(cell, str):
            return repr(cell) if cell else "an empty cell"
        return "an empty cell" if np.isnan(cell) else repr(float(cell))


def told_rows(numbers: NDArray[np.int64]) -> str:
    """Say how many rows, and a few of them by number: ``3 rows (4, 7, 9)``."""
    more = "" if len(numbers) <= _FEW else " …"
    return f"{len(numbers)} row{'s' if len(numbers) > 1 else ''} ({', '.join(map(str, numbers[:_FEW]))}{more})"
