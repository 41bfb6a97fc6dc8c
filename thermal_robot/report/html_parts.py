"""The pieces that every HTML page is made of: document, style, figure, paragraph, list, signature."""

from __future__ import annotations

import re
from base64 import b64encode
from collections.abc import Iterable, Mapping
from hashlib import sha256
from html import escape
from importlib.metadata import PackageNotFoundError, version
from importlib.resources import files
from io import StringIO
from typing import TYPE_CHECKING

from thermal_robot.report.drawing import AFTER, BEFORE, FAINT, INK, MUTED, PAPER, THIRD

if TYPE_CHECKING:
    from matplotlib.figure import Figure


_MADE_BY = ("thermal-robot", "pin", "numpy", "scipy")
"""Packages on which the figures of a page depend."""


def document(title: str, body: str, script: str = "") -> str:
    """Return a complete page that needs nothing beside itself, prints on A4, and runs no script but its own.

    Its content security policy says so to the browser: nothing is fetched, whatever a name within the page holds.

    Parameters
    ----------
    title
        Plain text for the browser's bar.
    body
        HTML.
    script
        JavaScript that ships with this room; none where empty.
    """
    runs = f"'sha256-{b64encode(sha256(script.encode()).digest()).decode()}'" if script else "'none'"
    policy = f"default-src 'none'; style-src 'unsafe-inline'; img-src data:; script-src {runs}"
    code = f"<script>{script}</script>\n" if script else ""
    return (
        f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n'
        f'<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>\n{css('page.css')}{css('page_whole.css')}</style>\n</head>\n"
        f'<body>\n<main class="thermal-robot">\n{body}\n</main>\n{code}</body>\n</html>\n'
    )


def css(name: str) -> str:
    """Return a style sheet that ships with this room: ``page.css``, or ``page_whole.css`` for whole pages."""
    return files(__package__).joinpath(name).read_text(encoding="utf-8")


def figure(drawn: Figure, label: str) -> str:
    """Return a figure as HTML; ``label`` says what it shows, for those who cannot see it."""
    return f"<figure>{wide(_svg(drawn, label), label)}</figure>"


def wide(content: str, label: str) -> str:
    """Return a table or figure in a box of its own, which scrolls where the screen is narrower than what it holds.

    Parameters
    ----------
    content
        HTML.
    label
        What it is, as plain text: the box can be reached by keyboard, and says so.
    """
    return f'<div class="tr-wide" role="region" tabindex="0" aria-label="{escape(label)}">{content}</div>'


def row(cells: Iterable[str], words: int = 1) -> str:
    """Return a row of a table: the first cells are words, as HTML, the others numbers, as plain text."""
    shown = list(cells)
    told = "".join(f"<td>{cell}</td>" for cell in shown[:words])
    return f"<tr>{told}{''.join(f'<td class=tr-n>{escape(cell)}</td>' for cell in shown[words:])}</tr>"


def table(heads: Iterable[str], rows: Iterable[str], words: int = 1) -> str:
    """Return a table.

    Parameters
    ----------
    heads
        Names of the columns, plain text.
    rows
        As :func:`row` makes them.
    words
        How many of the columns hold words; the others hold numbers, which end where their heads do.
    """
    shown = "".join(f"<th{'' if k < words else ' class=tr-n'}>{escape(head)}</th>" for k, head in enumerate(heads))
    return f"<table><thead><tr>{shown}</tr></thead><tbody>{''.join(rows)}</tbody></table>"


def paragraph(sentence: str, strong: bool = False) -> str:
    """Return a sentence of plain text as a paragraph."""
    return f"<p><strong>{escape(sentence)}</strong></p>" if strong else f"<p>{escape(sentence)}</p>"


def bullets(items: Iterable[str]) -> str:
    """Return lines of plain text as a list; empty where there is none."""
    lines = "".join(f"<li>{escape(item)}</li>" for item in items)
    return f"<ul>{lines}</ul>" if lines else ""


def checksums(files: Mapping[str, str]) -> str:
    """List the files that a page was made from, each with the SHA-256 of its content; empty without any."""
    lines = "".join(f"<li>{escape(name)} <code>{escape(told)}</code></li>" for name, told in files.items())
    return f'<p>Made from these files (SHA-256):</p><ul class="tr-files">{lines}</ul>' if lines else ""


def signature(generated: str | None) -> str:
    """Say, as plain text, which program made a page, on which libraries, and when if that is to be told."""
    told = ", ".join(filter(None, (_version(_MADE_BY[0]) or _MADE_BY[0], *map(_version, _MADE_BY[1:]))))
    return f"{told}, {generated}" if generated else told


def _version(package: str) -> str:
    try:
        return f"{package} {version(package)}"
    except PackageNotFoundError:  # run from a source tree that is not installed
        return ""


_PIXELS = 106.0  # per inch at most, so that letters are equally large in all figures of a page
_NAMES = {
    INK: "ink",
    MUTED: "muted",
    FAINT: "faint",
    PAPER: "paper",
    BEFORE: "before",
    AFTER: "after",
    THIRD: "third",
}


def _svg(figure: Figure, label: str) -> str:
    """Return a figure as an ``<svg>``, the same for equal figures; no identifier clashes with another figure's."""
    stream = StringIO()
    figure.savefig(stream, format="svg", transparent=True, dpi=200, metadata={"Date": None})
    text = stream.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    # HTML knows these two namespaces by itself; without their addresses the page holds no address at all
    text = re.sub(r'\sxmlns(:xlink)?="[^"]*"', "", text)
    text = re.sub(r"\s*\n\s*", "\n", text)
    for colour, name in _NAMES.items():
        text = text.replace(colour, f"var(--tr-{name},{colour})")
    width = f"max-width:{figure.get_figwidth() * _PIXELS:.0f}px"
    shown = f'<svg role="img" aria-label="{escape(label)}" class="tr-figure" style="{width}"'
    return _own_names(text).replace("<svg", shown, 1).strip()


def _own_names(text: str) -> str:
    """Replace identifiers, which Matplotlib draws at random, by the content's hash and a number."""
    found = list(dict.fromkeys(re.findall(r'\bid="([^"]+)"', text)))
    numbers = {name: str(k) for k, name in enumerate(found)}
    pattern = re.compile(r'(\bid="|href="#|url\(#)([^")]+)')
    text = pattern.sub(lambda m: m[1] + "@" + numbers.get(m[2], m[2]), text)
    return text.replace("@", f"f{sha256(text.encode()).hexdigest()[:8]}-")
