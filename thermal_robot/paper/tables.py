"""The ledger as plain text and as Markdown."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from textwrap import wrap

from thermal_robot.paper.entry import VERDICTS, Entry

WIDTH = 120
_COLUMNS = (32, 22, 39, 21)
_HEADINGS = ("quantity", "printed", "computed", "verdict")
_INDENT = "    "


def text(entries: Sequence[Entry], counts: Mapping[str, int]) -> str:
    """Write a row in aligned columns, and below it, indented, why.

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
    """Write one table with a row for each entry, and below it what the verdicts mean; arguments as for :func:`text`."""
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
