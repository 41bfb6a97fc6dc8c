"""Computation of the ledger, with the inputs that each row reads."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from textwrap import wrap
from typing import Any, cast

import numpy as np

from thermal_robot.paper import rows
from thermal_robot.paper.entry import VERDICTS, Entry, Words, judge
from thermal_robot.paper.inputs import PaperInputs

WIDTH = 120
_COLUMNS = (32, 22, 39, 21)
_HEADINGS = ("quantity", "printed", "computed", "verdict")
_INDENT = "    "


def text(entries: Sequence[Entry], counts: Mapping[str, int]) -> str:
    """Plain text of rows in aligned columns, with the reason indented below.

    Parameters
    ----------
    entries
        The rows.
    counts
        How many of them have each verdict.

    Returns
    -------
    str
        At most 120 columns wide, without a newline at the end.
    """
    lines = [*_cells(_HEADINGS), "─" * WIDTH]
    for entry in entries:
        lines += [*_cells((entry.quantity, entry.printed, entry.computed, entry.verdict))]
        # A unit stays with its number.
        said = wrap(_bound(f"{entry.where}. {entry.why}"), WIDTH - len(_INDENT), break_on_hyphens=False)
        lines += [_INDENT + line.replace("\u00a0", " ") for line in said]
        lines.append("")
    return "\n".join([*lines, *_legend(counts)])


def markdown(entries: Sequence[Entry], counts: Mapping[str, int]) -> str:
    """Markdown table of rows, with the meaning of the verdicts below; arguments as for :func:`text`."""
    lines = ["| quantity | printed | computed | verdict | why |", "|---|---|---|---|---|"]
    for entry in entries:
        cells = (f"{entry.quantity} ({entry.where})", entry.printed, entry.computed, f"**{entry.verdict}**", entry.why)
        lines.append("| " + " | ".join(_escaped(cell) for cell in cells) + " |")
    said = "; ".join(f"**{verdict}** ({counts[verdict]}): {VERDICTS[verdict]}" for verdict in counts)
    return "\n".join([*lines, "", f"{len(entries)} rows. {said}."])


def _cells(cells: Sequence[str]) -> Iterator[str]:
    columns = [
        wrap(_bound(cell), width, break_on_hyphens=False) or [""] for cell, width in zip(cells, _COLUMNS, strict=True)
    ]
    for row in range(max(len(column) for column in columns)):
        parts = [
            f"{column[row] if row < len(column) else '':<{width}}"
            for column, width in zip(columns, _COLUMNS, strict=True)
        ]
        yield "  ".join(parts).replace("\u00a0", " ").rstrip()


def _legend(counts: Mapping[str, int]) -> Iterator[str]:
    yield "─" * WIDTH
    for verdict, count in counts.items():
        first, *rest = wrap(VERDICTS[verdict], WIDTH - 27)
        yield f"{count:3} {verdict:<22} {first}"
        yield from (" " * 27 + line for line in rest)


def _bound(sentence: str) -> str:
    for unit in ("µm", "mm", "%", "µrad", "K", "°C"):
        sentence = sentence.replace(f" {unit}", f"\u00a0{unit}")
    return sentence


def _escaped(cell: str) -> str:
    return cell.replace("|", "\\|").replace("*", "\\*") if not cell.startswith("**") else cell


@dataclass(frozen=True)
class Ledger:
    """Table that compares each printed figure of the paper with the recomputed one.

    Parameters
    ----------
    inputs
        Inputs of the computed column.
    entries
        The rows, in the order of the paper; slips last.
    """

    inputs: PaperInputs
    entries: tuple[Entry, ...]

    def __iter__(self) -> Iterator[Entry]:
        return iter(self.entries)

    def __len__(self) -> int:
        return len(self.entries)

    def __getitem__(self, quantity: str) -> Entry:
        """Row of a quantity; ``KeyError`` if there is none."""
        for entry in self.entries:
            if entry.quantity == quantity:
                return entry
        raise KeyError(quantity)

    def __str__(self) -> str:
        return self.text()

    @property
    def counts(self) -> dict[str, int]:
        """Number of rows by verdict, in the order of :data:`VERDICTS`."""
        found = Counter(entry.verdict for entry in self.entries)
        return {verdict: found[verdict] for verdict in VERDICTS if found[verdict]}

    def text(self) -> str:
        """Plain text, at most 120 columns wide."""
        return text(self.entries, self.counts)

    def markdown(self) -> str:
        """Markdown table, for docs/paper.md."""
        return markdown(self.entries, self.counts)

    def to_dict(self) -> dict[str, Any]:
        """Return inputs, entries and counts as plain values for JSON; a number that is not finite is ``None``."""
        return {
            "inputs": {field.name: _plain(getattr(self.inputs, field.name)) for field in fields(self.inputs)},
            "entries": [{f.name: _plain(getattr(entry, f.name)) for f in fields(entry)} for entry in self.entries],
            "counts": self.counts,
        }


def ledger(inputs: PaperInputs | None = None) -> Ledger:
    """Compute the ledger: every printed number of the paper beside the recomputed one.

    Parameters
    ----------
    inputs
        By default the paper's own, with the assumed l5.

    Returns
    -------
    Ledger
        Each entry names the inputs that it read.

    Raises
    ------
    RobotError, EstimationError, ValueError
        If the inputs are not those of a robot and of samples.
    """
    given = PaperInputs() if inputs is None else inputs
    return Ledger(given, tuple(compute(row, given) for row in rows.table()))


class _Reading:
    """Proxy of the inputs that records the names of the fields that are read."""

    def __init__(self, inputs: PaperInputs) -> None:
        self._inputs, self._read = inputs, set[str]()

    def __getattr__(self, name: str) -> Any:
        value = getattr(self._inputs, name)
        self._read.add(name)
        return value


def compute(row: Mapping[str, Any], inputs: PaperInputs) -> Entry:
    """Compute one row of the ledger: run its equation, judge printed against computed numbers, fill in its texts."""
    reading, figures = _Reading(inputs), rows.printed(row["quantity"])
    equation = getattr(rows, row["equation"]) if "equation" in row else lambda *_: {"values": ()}
    # It has every field of the inputs, which is all that an equation may ask for.
    found = equation(cast("PaperInputs", reading), figures, row)
    values = _floats(found["values"])
    verdict = found.get("verdict") or row.get("verdict")
    if not verdict:
        bounds = {"low": found.get("low"), "high": found.get("high")}
        verdict = judge(figures, found.get("compared", values), otherwise=row["otherwise"], **bounds)
    words, given = Words(), {**row, **found, "i": reading}
    computed, why = (words.vformat(row[name], (), given) for name in ("computed", "why"))
    depends = tuple(f.name for f in fields(inputs) if f.name in reading._read)
    return Entry(row["quantity"], row["where"], row["printed"], computed, values, verdict, why, depends)


def _floats(values: Any) -> tuple[float, ...]:
    """Flatten nested numbers and arrays into one tuple."""
    if isinstance(values, tuple | list):
        return tuple(number for value in values for number in _floats(value))
    return tuple(float(number) for number in np.ravel(values))


def _plain(value: Any) -> Any:
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    if isinstance(value, float) and not abs(value) < float("inf"):
        return None
    return value
