"""A comparison as plain text: what the command line prints."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from textwrap import fill
from typing import Any

from thermal_robot.report.comparison_words import (
    campaign_in_words,
    change_in_words,
    effects,
    headline,
    parameters,
    predictions,
)

_WIDTH = 96
_MOST = 40


def comparison_text(comparison: Mapping[str, Any]) -> str:
    """Write a comparison for the person who measured.

    Parameters
    ----------
    comparison
        Of the format ``thermal-robot/comparison/1``.

    Returns
    -------
    str
        Plain text without a newline at the end: what stayed and what changed, effect by effect, parameter by
        parameter, and whether predictions agree.
    """
    return "\n".join(_lines(comparison))


def comparison_headline(comparison: Mapping[str, Any]) -> str:
    """Return what stayed and what changed in one plain sentence or two."""
    return headline(comparison)


def _lines(comparison: Mapping[str, Any]) -> Iterator[str]:
    names = [c["name"] for c in comparison["campaigns"]]
    yield fill(headline(comparison), _WIDTH)
    yield ""
    for c in comparison["campaigns"]:
        yield fill(campaign_in_words(c), _WIDTH, subsequent_indent="  ")
    yield from ("", "CHANGED")
    told = [change_in_words(change, names) for change in comparison["changes"]]
    yield from (fill(line, _WIDTH, initial_indent="  ", subsequent_indent="    ") for line in told or ["nothing"])
    yield from ("", "EFFECTS")
    yield from _table([("effect", "in the joint fit", "χ²", "by chance"), *effects(comparison)])
    rows = list(parameters(comparison))
    if rows:
        yield from ("", "PARAMETERS, each by its own campaign, ± one standard deviation")
        yield from _table([("effect", "parameter", *names, "difference", "by chance"), *rows[:_MOST]])
        if len(rows) > _MOST:
            yield f"  … and {len(rows) - _MOST} more, in the JSON"
    yield from ("", "PREDICTIONS where both measured, frames aligned")
    yield from _table([("campaigns", "differ, rms", "stated", "beyond twice", ""), *predictions(comparison)])
    if comparison["not_told"]:
        yield from ("", "NOT COMPARED, as frames or other parameters take it up")
        yield fill(", ".join(comparison["not_told"]), _WIDTH, initial_indent="  ", subsequent_indent="  ")


def _table(rows: Sequence[Sequence[str]]) -> Iterator[str]:
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    for row in rows:
        yield "  " + "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
