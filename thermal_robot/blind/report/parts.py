"""The pieces of HTML that the trial's page is put together from."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape
from importlib.metadata import PackageNotFoundError, version
from importlib.resources import files
from typing import TYPE_CHECKING

from thermal_robot.report.inline import svg

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_STYLES = ("page.css", "page_whole.css")  # of the room report: the trial's page looks as that of a diagnosis


def document(title: str, body: str) -> str:
    """Return a complete page that needs nothing beside itself; ``body`` is HTML, ``title`` is text."""
    style = "".join(files("thermal_robot.report").joinpath(name).read_text(encoding="utf-8") for name in _STYLES)
    return (
        f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>\n{style}</style>\n</head>\n"
        f'<body>\n<main class="thermal-robot">\n{body}\n</main>\n</body>\n</html>\n'
    )


def section(heading: str, *content: str) -> str:
    """Return a section; its content is HTML."""
    return f"<section><h2>{escape(heading)}</h2>{''.join(content)}</section>"


def paragraph(sentence: str) -> str:
    """Return a paragraph of text."""
    return f"<p>{escape(sentence)}</p>"


def bullets(items: Iterable[str]) -> str:
    """Return a list of texts."""
    return f"<ul>{''.join(f'<li>{escape(item)}</li>' for item in items)}</ul>"


def drawn(figure: Figure, label: str) -> str:
    """Return a figure, drawn into the page; the label is read to whoever does not see it."""
    return f"<figure>{svg(figure, label)}</figure>"


def row(cells: Iterable[str]) -> str:
    """Return a row of a table: the first cell is HTML, the others are texts."""
    first, *rest = cells
    return f"<tr><td>{first}</td>{''.join(f'<td class=tr-n>{escape(cell)}</td>' for cell in rest)}</tr>"


def table(heads: Iterable[str], rows: Iterable[str], *, numbers: bool = True) -> str:
    """Return a table: its heads are texts, over numbers or words, its rows HTML."""
    first, *rest = heads
    shown = "".join(f"<th{' class=tr-n' if numbers else ''}>{escape(head)}</th>" for head in rest)
    return f"<table><thead><tr><th>{escape(first)}</th>{shown}</tr></thead><tbody>{''.join(rows)}</tbody></table>"


def signature(generated: str) -> str:
    """Return the footer's text: the program's version and, where it is told, when the page was made."""
    try:
        name = f"thermal-robot {version('thermal-robot')}"
    except PackageNotFoundError:  # run from a source tree that is not installed
        name = "thermal-robot"
    return f"{name}, {generated}" if generated else name
