"""Tables of text: HTML for a notebook, aligned lines for a terminal."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from html import escape

_CELL = 'style="text-align: left; vertical-align: top"'


def html_table(rows: Iterable[Sequence[str]], *, head: Sequence[str] = (), heading: str = "") -> str:
    """HTML table of rows, styled by the surrounding notebook.

    Parameters
    ----------
    rows
        Cells as plain text; they are escaped. Shorter rows are filled up.
    head
        Names of the columns; none where it is empty.
    heading
        Stands above the table.
    """
    cells = [list(row) for row in rows]
    wide = max([len(row) for row in cells] + [len(head)], default=0)
    caption = f"<caption {_CELL}><b>{escape(heading)}</b></caption>" if heading else ""
    above = f"<thead>{_row(head, wide, 'th')}</thead>" if head else ""
    return f"<table>{caption}{above}<tbody>{''.join(_row(row, wide, 'td') for row in cells)}</tbody></table>"


def _row(cells: Sequence[str], wide: int, tag: str) -> str:
    filled = [*cells, *[""] * (wide - len(cells))]
    return f"<tr>{''.join(f'<{tag} {_CELL}>{escape(cell)}</{tag}>' for cell in filled)}</tr>"


def aligned(rows: Sequence[Sequence[str]], left: Collection[int] = (0,)) -> list[str]:
    """Lines of aligned columns, those numbered ``left`` flush left."""
    wide = [max(map(len, column)) for column in zip(*rows, strict=True)]
    padded = [
        [cell.ljust(w) if k in left else cell.rjust(w) for k, (cell, w) in enumerate(zip(row, wide, strict=True))]
        for row in rows
    ]
    return ["  ".join(cells).rstrip() for cells in padded]
