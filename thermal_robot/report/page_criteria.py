"""The page's section on the performance criteria of ISO 9283, where poses or paths were repeated."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape
from typing import TYPE_CHECKING

from thermal_robot.report.html_parts import bullets, paragraph, row, table, wide

if TYPE_CHECKING:
    from thermal_robot.diagnosis.result import Diagnosis


def criteria_section(diagnosis: Diagnosis) -> Iterator[str]:
    """Yield a table for each kind of criterion, and what a reader must know of them; nothing without repeats."""
    found = diagnosis.performance
    if found is None:
        return
    yield f"<section><h2>ISO 9283</h2>{paragraph(f'{found.summary}.')}"
    for shown in found.tables:
        yield f'<p class="tr-caption">{escape(shown.heading)}</p>'
        yield wide(table(shown.head, (row((escape(label), *cells)) for label, *cells in shown.rows)), shown.heading)
        yield paragraph(f"{shown.rest}.") if shown.rest else ""
    yield f"{bullets(found.notes)}</section>"
