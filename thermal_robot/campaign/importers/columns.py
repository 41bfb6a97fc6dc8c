"""From the columns of another program's table to those of a campaign: names, sums, scales, signs, instants."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime, timezone
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.campaign.headings import bare
from thermal_robot.campaign.names import did_you_mean, listed
from thermal_robot.campaign.table import Table
from thermal_robot.errors import CampaignError
from thermal_robot.schema import Kind, MisfitError, below, boolean, number, record, text, whole
from thermal_robot.schema import listed as list_of

JOINTS = "joints"
"""Key of the list that names the columns of all joints, in the order of the chain."""
_NUMBER = number()


@dataclass(frozen=True)
class Column:
    """Where the values of one column come from: the sum of some columns, times ``scale``, plus ``offset``.

    Attributes
    ----------
    sources
        Names of columns, or numbers from 1; several are added.
    scale, offset
        In the unit that the campaign's column has.
    time
        Pattern of an instant, as of :meth:`datetime.datetime.strptime`; empty for numbers.
    since_first
        Whether the smallest value is taken off, as of a clock that began elsewhere.
    value
        The same number or text in every row, instead of a source.
    counted
        0, 1, 2 … in the order of the rows, instead of a source.
    """

    sources: tuple[str | int, ...] = ()
    scale: float = 1.0
    offset: float = 0.0
    time: str = ""
    since_first: bool = False
    value: float | str | None = None
    counted: bool = False

    def numbers(self, table: Table) -> NDArray[np.float64]:
        """Return (N,) numbers, NaN where a cell is empty.

        Raises
        ------
        CampaignError
            No such column, text where a number should be, an instant of another pattern.
        """
        if self.counted:
            return np.arange(float(len(table.rows)))
        if self.value is not None:
            return np.full(len(table.rows), float(self.value))
        values = np.zeros(len(table.rows))
        for source in self.sources:
            name = found(table, source)
            values += self._instants(table, name) if self.time else table.numbers(name, gaps=True)
        values = values * self.scale + self.offset
        if self.since_first or self.time:
            values = values - np.nanmin(values)
        return values

    def header_unit(self, table: Table) -> str | None:
        """Return the unit that its header names; none of a sum, or where another scale than a sign is stated."""
        plain = len(self.sources) == 1 and abs(self.scale) == 1.0 and not (self.offset or self.time)
        return bare(found(table, self.sources[0])).unit if plain else None

    def complete(self, table: Table, name: str = "") -> NDArray[np.float64]:
        """Return (N,) numbers of which none may be missing; ``name`` is the campaign's column.

        Raises
        ------
        CampaignError
            An empty cell, or what :meth:`numbers` raises.
        """
        values = self.numbers(table)
        if np.isnan(values).any():
            problem = "a value is missing" + (f", for the column {name!r} of the campaign" if name else "")
            row, column = int(table.rows[int(np.argmax(np.isnan(values)))]), " + ".join(map(str, self.sources))
            expected = "a number"
            raise CampaignError(table.file, problem, row=row, column=column, found="an empty cell", expected=expected)
        return values

    def text(self, table: Table) -> list[str]:
        """Return N texts; those of several columns with a blank between.

        Raises
        ------
        CampaignError
            No such column.
        """
        if self.value is not None:
            return [str(self.value)] * len(table.rows)
        parts = [table.text(found(table, source)) for source in self.sources]
        return [" ".join(row) for row in zip(*parts, strict=True)]

    def _instants(self, table: Table, name: str) -> NDArray[np.float64]:
        """(N,) s since some instant."""
        seconds = np.full(len(table.rows), np.nan)
        for k, cell in enumerate(table.text(name)):
            if not cell:
                continue
            try:
                instant = datetime.strptime(cell, self.time)
            except ValueError:
                raise CampaignError(
                    table.file,
                    "no instant of this pattern",
                    row=int(table.rows[k]),
                    column=name,
                    found=repr(cell),
                    expected=repr(self.time),
                ) from None
            seconds[k] = (instant if instant.tzinfo else instant.replace(tzinfo=timezone.utc)).timestamp()
        return seconds


def found(table: Table, source: str | int) -> str:
    """Return the name of a column of the table, by its name or its number.

    Raises
    ------
    CampaignError
        There is none.
    """
    names = list(table.columns)
    if source in names or (table.header is None and str(source) in names):  # without a header numbers are names
        return str(source)
    if isinstance(source, int) and source <= len(names):
        return names[source - 1]
    known = [name for name in names if bare(name).column == source]
    if len(known) == 1:
        return known[0]
    meant = did_you_mean(str(source), names) if isinstance(source, str) else ""
    raise CampaignError(
        table.file,
        f"there is no such column{meant}{table.headless}",
        row=table.header,
        column=str(source),
        found=f"the columns {listed(names)}" if table.header else f"{len(names)} columns without names",
        expected="a name or a number of one of them",
    )


def _source(value: Any, path: str) -> str | int:
    """Take the name of a column, or its number."""
    kind: Kind = whole(1) if isinstance(value, int) else text("the name of a column, or its number from 1")
    taken: str | int = kind(value, path)
    return taken


def _figure_or_text(value: Any, path: str) -> float | str:
    taken: float | str = text("a number or text")(value, path) if isinstance(value, str) else _NUMBER(value, path)
    return taken


_FIELDS: dict[str, Kind] = {
    "column": _source,
    "sum": list_of(_source),
    "value": _figure_or_text,
    "count": boolean,
    "scale": _NUMBER,
    "offset": _NUMBER,
    "time": text("a pattern such as %Y%m%d%H%M%S"),
    "since_first": boolean,
}
_ORIGINS = ("column", "sum", "value", "count")


def column_kind(value: Any, path: str) -> Column:
    """Take where a column comes from: a name, a number, or an inline table."""
    if not isinstance(value, Mapping):
        return Column((_source(value, path),))
    given = record(_FIELDS, may_lack=_FIELDS)(value, path)
    if len([key for key in _ORIGINS if key in given]) != 1:
        raise MisfitError(path, value, f"one of the keys {', '.join(_ORIGINS)}")
    sources = (given["column"],) if "column" in given else given.get("sum", ())
    rest = {key: given[key] for key in ("scale", "offset", "time", "since_first", "value") if key in given}
    return Column(sources, counted=given.get("count", False), **rest)


def columns_kind(value: Any, path: str) -> dict[str, Any]:
    """Take where the columns come from: by their name in a campaign, and ``joints`` as a list of sources."""
    if not isinstance(value, Mapping):
        raise MisfitError(path, value, "columns by name")
    kinds: dict[str, Kind] = dict.fromkeys(value, column_kind) | {JOINTS: list_of(column_kind)}
    return {name: kinds[name](given, below(path, name)) for name, given in value.items()}
