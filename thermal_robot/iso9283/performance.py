"""The result: criteria of every pose and path that was repeated; a dict, a data frame, a table for the reader.

Tables are in mm and mrad, the poses below each other; their cells are texts, for a terminal or a page.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from math import floor, isfinite, log10
from textwrap import fill
from typing import TYPE_CHECKING, Any

from thermal_robot.iso9283.criteria import PathCriteria, PoseCriteria, Three
from thermal_robot.iso9283.groups import CYCLES, PATH_CYCLES

if TYPE_CHECKING:
    import pandas as pd


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

    ``head`` names the columns, the label's first; ``more`` poses or paths are not shown.
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


def _counted(name: str, counts: Sequence[int], standard: int) -> str:
    """Say how many there are, and how often they were repeated, beside what the standard asks for."""
    if not counts:
        return ""
    often = f"{counts[0]}" if min(counts) == max(counts) else f"{min(counts)} to {max(counts)}"
    return f"{len(counts)} {name}{'s' if len(counts) > 1 else ''} of {often} cycles (the standard: {standard})"


def poses(found: Sequence[PoseCriteria]) -> Table:
    """AP and RP of positions; nothing without poses."""
    corrected = any(p.corrected for p in found)
    after_name = ["corrected"] if corrected else []
    head = ["pose", "n", "dir", "AP_p", *after_name, "AP_x", "AP_y", "AP_z", "RP_l", "low", "high"]
    rows: list[list[Cell]] = []
    for p in found:
        a = p.accuracy
        away = a.position if a else None
        after = [p.corrected.position if p.corrected else None] if corrected else []
        low, high = p.repeatability.ci95 or (None, None)
        axes = _of(a.axes if a else None)
        rows.append([p.pose, p.cycles, p.directions, away, *after, *axes, p.repeatability.position, low, high])
    return _table(
        "POSES: AP and RP in mm; n: cycles; dir: directions of approach; low, high: 95 % interval of RP_l", head, rows
    )


def turns(found: Sequence[PoseCriteria]) -> Table:
    """AP and RP of orientations; nothing where only positions are known."""
    return _turns("pose", "AP", "RP", ((p.pose, p) for p in found))


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
    return _turns("path", "AT", "RT", ((p.path, p) for p in found))


def _turns(what: str, accuracy: str, again: str, found: Iterable[tuple[str, PoseCriteria | PathCriteria]]) -> Table:
    rows: list[list[Cell]] = [
        [name, *_of(p.accuracy.angles if p.accuracy else None), *_of(p.repeatability.angles)]
        for name, p in found
        if p.repeatability.angles is not None
    ]
    head = [what, *(f"{accuracy}_{axis}" for axis in "abc"), *(f"±{again}_{axis}" for axis in "abc")]
    return _table(f"{what.upper()}S: angles about the axes of the base, in mrad", head, rows)


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


SCHEMA = "thermal-robot/iso9283/1"


@dataclass(frozen=True)
class Performance:
    """Criteria of ISO 9283:1998 that a campaign with repeats tells; SI, in the axes of the robot's base.

    Attributes
    ----------
    campaign, robot, tool_frame
        What was measured.
    poses
        Poses at rest, in the sequence in which they were met.
    paths
        Paths, likewise.
    registered
        The frames that were fitted to the same measurements: ``base``, ``tool``. AP and AT are then after
        registration, and smaller than against frames that are measured by themselves. RP, vAP and RT do not depend on
        it.
    instrument
        RP_l that the instrument alone would show, m; ``None`` where its noise is not given.
    notes
        What a reader must know, a sentence each.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> from thermal_robot.iso9283 import performance
    >>> tested = tr.simulate("builtin:rv_m2", {"excess_repeatability": 1e-4}, tool_frame="tool0", rows=90, repeats=30)
    >>> found = performance(tested)
    >>> len(found.poses), found.extent, found.repeatability > found.accuracy
    (3, '3 poses of 30 cycles (the standard: 30)', True)
    >>> found.corrected, found.path_accuracy, found.path_corrected, found.path_repeatability
    (None, None, None, None)
    >>> found.tables[0].head[:4], len(found.tables[0].rows)
    (('pose', 'n', 'dir', 'AP_p'), 3)
    """

    campaign: str
    robot: str
    tool_frame: str
    poses: tuple[PoseCriteria, ...]
    paths: tuple[PathCriteria, ...] = ()
    registered: tuple[str, ...] = ()
    instrument: float | None = None
    notes: tuple[str, ...] = ()

    @property
    def accuracy(self) -> float | None:
        """AP_p of the worst pose, m."""
        return max((p.accuracy.position for p in self.poses if p.accuracy), default=None)

    @property
    def corrected(self) -> float | None:
        """AP_p of the worst pose against the corrected model, m."""
        return max((p.corrected.position for p in self.poses if p.corrected), default=None)

    @property
    def repeatability(self) -> float | None:
        """RP_l of the worst pose, m."""
        return max((p.repeatability.position for p in self.poses), default=None)

    @property
    def path_accuracy(self) -> float | None:
        """AT_p of the worst path, m."""
        return max((p.accuracy.position for p in self.paths if p.accuracy), default=None)

    @property
    def path_corrected(self) -> float | None:
        """AT_p of the worst path against the corrected model, m."""
        return max((p.corrected.position for p in self.paths if p.corrected), default=None)

    @property
    def path_repeatability(self) -> float | None:
        """RT_p of the worst path, m."""
        return max((p.repeatability.position for p in self.paths), default=None)

    @property
    def summary(self) -> str:
        """The worst figures in one line."""
        named = [("AP_p", self.accuracy), ("corrected", self.corrected), ("RP_l", self.repeatability)]
        named += [("AT_p", self.path_accuracy), ("corrected", self.path_corrected), ("RT_p", self.path_repeatability)]
        said = [f"{name} {millimetres(value)}" for name, value in named if value is not None]
        return f"ISO 9283, the worst of {self.extent}: {'; '.join(said)}"

    @property
    def extent(self) -> str:
        """How many poses and paths there are, and how often each was repeated."""
        at_rest = _counted("pose", [p.cycles for p in self.poses], CYCLES)
        along = _counted("path", [p.cycles for p in self.paths], PATH_CYCLES)
        return ", and ".join(part for part in (at_rest, along) if part)

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain values for JSON, SI.

        Examples
        --------
        >>> from thermal_robot.iso9283 import performance
        >>> tested = tr.simulate("builtin:rv_m2", tool_frame="tool0", rows=20, repeats=10, noise=2e-5)
        >>> list(performance(tested).to_dict())[:4]
        ['schema', 'campaign', 'robot', 'tool_frame']
        """
        return {"schema": SCHEMA, **asdict(self)}

    def to_frame(self) -> pd.DataFrame:
        """Return a data frame, one row a figure.

        Returns
        -------
        pandas.DataFrame
            ``label`` of the pose or path, ``cycles`` (of the direction, time or point with the fewest), ``criterion``
            (``AP_p``, ``RP_l``, ``vAP_a`` …), ``value``, ``ci95_low``, ``ci95_high`` (NaN where there is no interval),
            ``unit`` (m or rad). A criterion against the corrected model has ``corrected`` after its name.

        Examples
        --------
        >>> from thermal_robot.iso9283 import performance
        >>> tested = tr.simulate("builtin:rv_m2", tool_frame="tool0", rows=20, repeats=10, noise=2e-5)
        >>> sorted(set(performance(tested).to_frame()["criterion"]))
        ['AP_p', 'AP_x', 'AP_y', 'AP_z', 'RP_l']
        """
        import pandas as pd

        columns = ["label", "cycles", "criterion", "value", "ci95_low", "ci95_high", "unit"]
        return pd.DataFrame([*self._of_poses(), *self._of_paths()], columns=columns)

    def _of_poses(self) -> Iterator[tuple[Any, ...]]:
        for p in self.poses:
            for name, found in (("AP_{}", p.accuracy), ("AP_{} corrected", p.corrected)):
                if found:
                    yield from _figures(p.pose, p.cycles, name, "p", found.position, found.angles)
                    yield from _three(p.pose, p.cycles, name, "xyz", found.axes, "m")
            spread = p.repeatability
            yield from _figures(p.pose, p.cycles, "RP_{}", "l", spread.position, spread.angles, spread.ci95)
            if p.variation:
                fewest = min(p.variation_cycles)
                yield from _figures(p.pose, fewest, "vAP_{}", "p", p.variation.position, p.variation.angles)
            if p.drift:
                fewest, d = min(p.drift_cycles), p.drift
                if d.accuracy is not None:
                    yield from _figures(p.pose, fewest, "dAP_{}", "p", d.accuracy, d.accuracy_angles)
                yield from _figures(p.pose, fewest, "dRP_{}", "l", d.repeatability, d.repeatability_angles)
                yield from _figures(p.pose, fewest, "shift", "", d.shift, None)

    def _of_paths(self) -> Iterator[tuple[Any, ...]]:
        for p in self.paths:
            for name, found in (("AT_{}", p.accuracy), ("AT_{} corrected", p.corrected), ("RT_{}", p.repeatability)):
                if found:
                    yield from _figures(p.path, p.cycles, name, "p", found.position, found.angles)

    @property
    def tables(self) -> tuple[Table, ...]:
        """The criteria as tables of texts, in mm and mrad: those of poses, then those of paths, none that is empty."""
        at_rest = [table(self.poses) for table in (poses, turns, variations, drifts)]
        return tuple(t for t in (*at_rest, paths(self.paths), path_turns(self.paths)) if t.rows)

    def __str__(self) -> str:
        title = f"Performance criteria of ISO 9283:1998: {self.robot}, {self.tool_frame}; {self.extent}"
        blocks = [[wrapped(title, "")], *map(lines, self.tables), [wrapped(note, "  - ") for note in self.notes]]
        return "\n\n".join("\n".join(block) for block in blocks if block)


def _figures(
    label: str,
    cycles: int,
    name: str,
    letter: str,
    position: float,
    angles: Three | None,
    ci95: tuple[float, float] | None = None,
) -> Iterator[tuple[Any, ...]]:
    low, high = ci95 or (float("nan"), float("nan"))
    yield label, cycles, name.format(letter), position, low, high, "m"
    if angles is not None:
        yield from _three(label, cycles, name, "abc", angles, "rad")


def _three(label: str, cycles: int, name: str, letters: str, values: Three, unit: str) -> Iterator[tuple[Any, ...]]:
    for letter, value in zip(letters, values, strict=True):
        yield label, cycles, name.format(letter), value, float("nan"), float("nan"), unit
