"""A fleet's summary as plain text."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from thermal_robot.report.fleet_words import SECTIONS, failures, headline

_MOST_LINES = 12
_REST = "the page and the table have all"


def fleet_text(summary: Mapping[str, Any]) -> str:
    """Return a summary in words: a headline, and tables of a few lines each.

    Parameters
    ----------
    summary
        Of the format ``thermal-robot/fleet/1``.
    """
    return "\n".join(_lines(summary))


def _lines(summary: Mapping[str, Any]) -> Iterator[str]:
    yield headline(summary)
    for heading, heads, told in SECTIONS:
        if rows := list(told(summary)):
            yield from ("", heading)
            yield from _table([heads, *rows[:_MOST_LINES]])
            yield from _more(len(rows))
    if reasons := list(failures(summary)):
        yield from ("", "Without a diagnosis")
        yield from (f"  {line}" for line in reasons[:_MOST_LINES])
        yield from _more(len(reasons))


def _table(rows: Sequence[Sequence[str]]) -> Iterator[str]:
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    for row in rows:
        yield "  " + "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()


def _more(count: int) -> Iterator[str]:
    if count > _MOST_LINES:
        yield f"  … and {count - _MOST_LINES} more; {_REST}"
