"""Tables of criteria: mm and mrad, the poses below each other; their cells are texts, for a terminal or a page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import floor, isfinite, log10
from textwrap import fill

from thermal_robot.iso9283.criteria import Three
from thermal_robot.iso9283.groups import CYCLES, PATH_CYCLES
from thermal_robot.iso9283.parts import PathCriteria, PoseCriteria

WIDTH = 96
MILLI = 1e3
MOST = 40
"""Rows of a table at most: a screen; data frame and JSON have all."""
LONGEST_NAME = 20
"""Letters of a label that a table shows, so that a line fits."""
NOTHING = 1e-6
"""mm and mrad: what is smaller is rounding, and asks for no decimals."""
_LEAST_DECIMALS, _MOST_DECIMALS = 3, 6
_MISSING = "–"
Cell = str | int | float | None


@dataclass(frozen=True)
class Table:
    """Criteria of poses or paths, one below the other; one without rows shows nothing.

    Attributes
    ----------
    heading
        What it shows, in which unit.
    head
        Names of the columns, the label's first.
    rows
        Their cells as texts.
    more
        How many poses or paths are not shown.
    """

    heading: str = ""
    head: tuple[str, ...] = ()
    rows: tuple[tuple[str, ...], ...] = ()
    more: int = 0

    @property
    def rest(self) -> str:
        """What is not shown, and where that is; empty where all is."""
        return f"and {self.more} more, in the JSON and the CSV" if self.more else ""


def millimetres(value: float) -> str:
    """Write a length with three digits, no fewer than a micrometre needs."""
    return f"{_cell(value, _decimals([value]))} mm"


def cycles_of(found: Sequence[PoseCriteria]) -> str:
    """Say how many poses there are, and how often they were repeated, beside what the standard asks for."""
    return _counted("pose", [p.cycles for p in found], CYCLES)


def paths_of(found: Sequence[PathCriteria]) -> str:
    """Say the same of paths."""
    return _counted("path", [p.cycles for p in found], PATH_CYCLES)


def _counted(name: str, counts: Sequence[int], standard: int) -> str:
    if not counts:
        return ""
    often = f"{counts[0]}" if min(counts) == max(counts) else f"{min(counts)} to {max(counts)}"
    return f"{len(counts)} {name}{'s' if len(counts) > 1 else ''} of {often} cycles (the standard: {standard})"


def poses(found: Sequence[PoseCriteria]) -> Table:
    """AP and RP of positions; nothing without poses."""
    corrected = any(p.corrected for p in found)
    head = [
        "pose",
        "n",
        "dir",
        "AP_p",
        *(["corrected"] if corrected else []),
        "AP_x",
        "AP_y",
        "AP_z",
        "RP_l",
        "low",
        "high",
    ]
    rows: list[list[Cell]] = []
    for p in found:
        a = p.accuracy
        away = a.position if a else None
        after = [p.corrected.position if p.corrected else None] if corrected else []
        low, high = p.repeatability.ci95 or (None, None)
        rows.append(
            [
                p.pose,
                p.cycles,
                p.directions,
                away,
                *after,
                *_of(a.axes if a else None),
                p.repeatability.position,
                low,
                high,
            ]
        )
    return _table(
        "POSES: AP and RP in mm; n: cycles; dir: directions of approach; low, high: 95 % interval of RP_l", head, rows
    )


def turns(found: Sequence[PoseCriteria]) -> Table:
    """AP and RP of orientations; nothing where only positions are known."""
    rows: list[list[Cell]] = [
        [p.pose, *_of(p.accuracy.angles if p.accuracy else None), *_of(p.repeatability.angles)]
        for p in found
        if p.repeatability.angles is not None
    ]
    head = ["pose", "AP_a", "AP_b", "AP_c", "±RP_a", "±RP_b", "±RP_c"]
    return _table("POSES: angles about the axes of the base, in mrad", head, rows)


def variations(found: Sequence[PoseCriteria]) -> Table:
    """VAP; nothing where no pose was reached from several directions."""
    shown = [(p, p.variation) for p in found if p.variation]
    turned = any(v.angles is not None for _, v in shown)
    rows: list[list[Cell]] = [
        [p.pose, len(p.variation_cycles), min(p.variation_cycles), v.position, *(_of(v.angles) if turned else [])]
        for p, v in shown
    ]
    head = ["pose", "dir", "n", "vAP_p", *(["vAP_a", "vAP_b", "vAP_c"] if turned else [])]
    return _table(f"DIRECTIONS: vAP in mm{' and mrad' if turned else ''}; n: cycles from each, the least", head, rows)


def drifts(found: Sequence[PoseCriteria]) -> Table:
    """Drift; nothing where no pose was measured at several times."""
    shown = [(p, p.drift) for p in found if p.drift]
    rows: list[list[Cell]] = [
        [p.pose, len(p.drift_cycles), min(p.drift_cycles), d.accuracy, d.repeatability, d.shift] for p, d in shown
    ]
    head = ["pose", "times", "n", "dAP_p", "dRP_l", "shift"]
    return _table(
        "DRIFT against the first time, in mm; n: cycles at each, the least; shift: of the barycentre", head, rows
    )


def paths(found: Sequence[PathCriteria]) -> Table:
    """AT and RT of positions; nothing without paths."""
    corrected = any(p.corrected for p in found)
    head = ["path", "points", "n", "AT_p", *(["corrected"] if corrected else []), "RT_p"]
    rows: list[list[Cell]] = []
    for p in found:
        after = [p.corrected.position if p.corrected else None] if corrected else []
        away = p.accuracy.position if p.accuracy else None
        rows.append([p.path, p.points, p.cycles, away, *after, p.repeatability.position])
    return _table("PATHS: AT and RT in mm; n: cycles of each point, the least", head, rows)


def path_turns(found: Sequence[PathCriteria]) -> Table:
    """AT and RT of orientations; nothing where only positions are known."""
    rows: list[list[Cell]] = [
        [p.path, *_of(p.accuracy.angles if p.accuracy else None), *_of(p.repeatability.angles)]
        for p in found
        if p.repeatability.angles is not None
    ]
    head = ["path", "AT_a", "AT_b", "AT_c", "±RT_a", "±RT_b", "±RT_c"]
    return _table("PATHS: angles about the axes of the base, in mrad", head, rows)


def wrapped(sentence: str, indent: str) -> str:
    """Break a sentence into lines."""
    return fill(sentence, WIDTH, initial_indent=indent, subsequent_indent=" " * len(indent), break_on_hyphens=False)


def _of(values: Three | None) -> list[Cell]:
    return [None] * 3 if values is None else [*values]


def _table(heading: str, head: Sequence[str], rows: Sequence[Sequence[Cell]]) -> Table:
    """Write SI figures in thousandths with as many decimals as the smallest needs."""
    if not rows:
        return Table()
    decimals = _decimals([cell for row in rows for cell in row if isinstance(cell, float)])
    shown = tuple(tuple(_cell(cell, decimals) for cell in row) for row in rows[:MOST])
    return Table(heading, tuple(head), shown, len(rows) - len(shown))


def lines(table: Table) -> list[str]:
    """Align the columns of a table as plain text, labels on the left, figures on the right; nothing without rows."""
    if not table.rows:
        return []
    cells = (table.head, *table.rows)
    wide = [max(len(row[k]) for row in cells) for k in range(len(table.head))]
    aligned = [
        "  " + "  ".join([row[0].ljust(wide[0]), *(c.rjust(w) for c, w in zip(row[1:], wide[1:], strict=True))])
        for row in cells
    ]
    return [table.heading, *aligned, *([f"  {table.rest}"] if table.rest else [])]


def _cell(cell: Cell, decimals: int) -> str:
    if cell is None:
        return _MISSING
    if isinstance(cell, str):
        return cell if len(cell) <= LONGEST_NAME else f"{cell[: LONGEST_NAME - 1]}…"
    if isinstance(cell, int):
        return str(cell)
    shown = f"{MILLI * cell:.{decimals}f}"
    return (shown if float(shown) else f"{0.0:.{decimals}f}").replace("-", "−")


def _decimals(values: Sequence[float]) -> int:
    """Decimals that leave two digits of the median, no fewer than a micrometre needs."""
    sizes = sorted(MILLI * abs(value) for value in values if isfinite(value))
    sizes = [size for size in sizes if size > NOTHING]
    if not sizes:
        return _LEAST_DECIMALS
    return min(max(1 - floor(log10(sizes[len(sizes) // 2])), _LEAST_DECIMALS), _MOST_DECIMALS)
