"""The ledger: every row computed when it is asked for, with the inputs that it read."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, replace
from typing import Any, TypeAlias, cast

from thermal_robot.paper import joining, randomised, scatter, slips, tables, warming
from thermal_robot.paper.entry import VERDICTS, Entry
from thermal_robot.paper.inputs import PaperInputs

Row: TypeAlias = Callable[[PaperInputs], Entry]

ROWS: tuple[Row, ...] = (*scatter.ROWS, *warming.ROWS, *randomised.ROWS, *joining.ROWS, *slips.ROWS)
"""Every row of the ledger as a function of the inputs."""


@dataclass(frozen=True)
class Ledger:
    """The paper's figures beside the computed ones.

    Parameters
    ----------
    inputs
        What it was computed from.
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
        """Return the row of a quantity; ``KeyError`` if there is none."""
        for entry in self.entries:
            if entry.quantity == quantity:
                return entry
        raise KeyError(quantity)

    def __str__(self) -> str:
        return self.text()

    @property
    def counts(self) -> dict[str, int]:
        """How many rows have each verdict; those that occur, in the order of :data:`VERDICTS`."""
        found = Counter(entry.verdict for entry in self.entries)
        return {verdict: found[verdict] for verdict in VERDICTS if found[verdict]}

    def text(self) -> str:
        """Write the ledger as plain text, at most 120 columns wide."""
        return tables.text(self.entries, self.counts)

    def markdown(self) -> str:
        """Write the ledger as a table in Markdown, for docs/paper.md."""
        return tables.markdown(self.entries, self.counts)

    def to_dict(self) -> dict[str, Any]:
        """Return inputs, entries and counts as plain data, for JSON; a number that is not finite is ``None``."""
        return {
            "inputs": {field.name: _plain(getattr(self.inputs, field.name)) for field in fields(self.inputs)},
            "entries": [{f.name: _plain(getattr(entry, f.name)) for f in fields(entry)} for entry in self.entries],
            "counts": self.counts,
        }


def ledger(inputs: PaperInputs | None = None) -> Ledger:
    """Compute every row.

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
    return Ledger(given, tuple(_compute(row, given) for row in ROWS))


class _Reading:
    """Inputs that note which of their fields are read."""

    def __init__(self, inputs: PaperInputs) -> None:
        self._inputs, self._read = inputs, set[str]()

    def __getattr__(self, name: str) -> Any:
        value = getattr(self._inputs, name)
        self._read.add(name)
        return value


def _compute(row: Row, inputs: PaperInputs) -> Entry:
    reading = _Reading(inputs)
    # It has every field of the inputs, which is all that a row may ask for.
    entry = row(cast("PaperInputs", reading))
    return replace(entry, depends=tuple(f.name for f in fields(inputs) if f.name in reading._read))


def _plain(value: Any) -> Any:
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    if isinstance(value, float) and not abs(value) < float("inf"):
        return None
    return value
