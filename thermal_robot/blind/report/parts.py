"""The pieces of HTML that only the trial's page has."""

from __future__ import annotations

from html import escape


def section(heading: str, *content: str) -> str:
    """Return a section; its content is HTML."""
    return f"<section><h2>{escape(heading)}</h2>{''.join(content)}</section>"
