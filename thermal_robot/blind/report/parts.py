"""The pieces of HTML that only the trial's page has: sections of figures, tables of rates."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape


def section(heading: str, *content: str) -> str:
    """Return a section; its content is HTML."""
    return f"<section><h2>{escape(heading)}</h2>{''.join(content)}</section>"


def row(cells: Iterable[str]) -> str:
    """Return a row of a table: the first cell is HTML, the others are texts."""
    first, *rest = cells
    return f"<tr><td>{first}</td>{''.join(f'<td class=tr-n>{escape(cell)}</td>' for cell in rest)}</tr>"


def table(heads: Iterable[str], rows: Iterable[str], *, numbers: bool = True) -> str:
    """Return a table: its heads are texts, over numbers or words, its rows HTML."""
    first, *rest = heads
    shown = "".join(f"<th{' class=tr-n' if numbers else ''}>{escape(head)}</th>" for head in rest)
    return f"<table><thead><tr><th>{escape(first)}</th>{shown}</tr></thead><tbody>{''.join(rows)}</tbody></table>"
