"""ISO 9283 criteria of all repeated poses and paths, and their output as dict, data frame and text tables.

Tables are in mm and mrad, with one row for each pose or path; their cells are strings, for a terminal or a page.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from math import floor, isfinite, log10
from textwrap import fill
from typing import TYPE_CHECKING, Any

from thermal_robot.iso9283.criteria import PathCriteria, PoseCriteria
from thermal_robot.iso9283.groups import CYCLES, PATH_CYCLES
from thermal_robot.tables import aligned

if TYPE_CHECKING:
    import pandas as pd


SCHEMA = "thermal-robot/iso9283/1"
WIDTH = 96
MILLI = 1e3
MOST = 40
"""Rows of a table at most: a screen; data frame and JSON have all."""
LONGEST_NAME = 20
"""Characters of a label that a table shows, so that a line fits."""
NOTHING = 1e-6
"""mm and mrad: smaller values are rounding errors, and do not count for the number of decimals."""
_LEAST_DECIMALS, _MOST_DECIMALS = 3, 6
Criteria = PoseCriteria | PathCriteria

_FIGURES = {
    "AP_p": "accuracy.position",
    "AP_abc": "accuracy.angles",
    "AP_xyz": "accuracy.axes",
    "AP_p corrected": "corrected.position",
    "AP_abc corrected": "corrected.angles",
    "AP_xyz corrected": "corrected.axes",
    "RP_l": "repeatability.position",
    "RP_abc": "repeatability.angles",
    "vAP_p": "variation.position",
    "vAP_abc": "variation.angles",
    "dAP_p": "drift.accuracy",
    "dAP_abc": "drift.accuracy_angles",
    "dRP_l": "drift.repeatability",
    "dRP_abc": "drift.repeatability_angles",
    "shift": "drift.shift",
}
"""Attribute of ``PoseCriteria`` for each criterion; _abc and _xyz are three figures. For a path AT is AP, RT is RP."""
_OF_PATH = {"AP_p", "AP_abc", "AP_p corrected", "AP_abc corrected", "RP_l", "RP_abc"}
_COLUMNS = {
    "RP_l": "pose n dir AP_p corrected AP_x AP_y AP_z RP_l low high",
    "RP_a": "pose AP_a AP_b AP_c ±RP_a ±RP_b ±RP_c",
    "vAP_p": "pose dir n vAP_p vAP_a vAP_b vAP_c",
    "dRP_l": "pose times n dAP_p dRP_l shift",
    "RT_p": "path points n AT_p corrected RT_p",
    "RT_a": "path AT_a AT_b AT_c ±RT_a ±RT_b ±RT_c",
}
"""Columns of each table by the criterion without which a pose or path has no row in it."""
_HEADINGS = {
    "RP_l": "POSES: AP and RP in mm; n: cycles; dir: directions of approach; low, high: 95 % interval of RP_l",
    "RP_a": "POSES: angles about the axes of the base, in mrad",
    "vAP_p": "DIRECTIONS: vAP in mm; n: cycles from each, the least",
    "dRP_l": "DRIFT against the first time, in mm; n: cycles at each, the least; shift: of the barycentre",
    "RT_p": "PATHS: AT and RT in mm; n: cycles of each point, the least",
    "RT_a": "PATHS: angles about the axes of the base, in mrad",
}
_WHERE_KNOWN = ("corrected", "vAP_a", "vAP_b", "vAP_c")
"""Columns that are there only where some row has them."""


def _figures(one: Criteria) -> dict[str, float]:
    """Criteria of a pose or path as a flat dict by name (``AP_p``, ``AP_a`` …), m and rad, without unknown ones."""
    found: dict[str, float] = {}
    for name, place in _FIGURES.items():
        if isinstance(one, PathCriteria):
            if name not in _OF_PATH:
                continue
            name = name.replace("AP", "AT").replace("RP_l", "RT_p").replace("RP", "RT")
        part, _, attribute = place.partition(".")
        value = getattr(getattr(one, part), attribute, None)
        if isinstance(value, tuple):
            stem, _, letters = name.partition("_")
            found |= {f"{stem}_{letters[k]}{letters[3:]}": value[k] for k in range(3)}
        elif value is not None:
            found[name] = value
    return found


def _cycles(one: Criteria, name: str) -> int:
    """Return the number of cycles of the criterion ``name``: the smallest of its directions, times or path points."""
    if isinstance(one, PoseCriteria) and name[0] in "vds":
        return min(one.variation_cycles if name[0] == "v" else one.drift_cycles)
    return one.cycles


@dataclass(frozen=True)
class Table:
    """Text table of criteria, one row for each pose or path.

    ``head`` names the columns, the label's first; ``more`` is the number of poses or paths that are not shown.
    """

    heading: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    more: int = 0

    @property
    def rest(self) -> str:
        """Remark on what is not shown; empty where all is."""
        return f"and {self.more} more, in the JSON and the CSV" if self.more else ""

    @classmethod
    def of(cls, found: Sequence[Criteria], needs: str) -> Table | None:
        """Table of the poses or paths that have the criterion ``needs``, in mm and mrad; ``None`` where none has it."""
        cells = [_cells(one, figures, needs) for one in found if needs in (figures := _figures(one))]
        if not cells:
            return None
        head, heading = _COLUMNS[needs].split(), _HEADINGS[needs]
        shown = [name for name in head if name not in _WHERE_KNOWN or any(row.get(name) is not None for row in cells)]
        if "vAP_a" in shown:
            heading = heading.replace("in mm", "in mm and mrad")
        rows = [[row.get(name) for name in shown] for row in cells]
        decimals = _decimals([cell for row in rows for cell in row if isinstance(cell, float)])
        texts = tuple(tuple(_text(cell, decimals) for cell in row) for row in rows[:MOST])
        return cls(heading, tuple(shown), texts, len(rows) - len(texts))

    def __str__(self) -> str:
        lines = [f"  {line}" for line in aligned([self.head, *self.rows])]
        return "\n".join([self.heading, *lines, *([f"  {self.rest}"] if self.rest else [])])


def _cells(one: Criteria, figures: dict[str, float], needs: str) -> dict[str, str | int | float | None]:
    """Values of one pose or path by column name, in SI; ``needs`` is the criterion that names the table."""
    corrected = figures.get("AP_p corrected", figures.get("AT_p corrected"))
    angles = {f"±{name}": value for name, value in figures.items()}
    cells = {**figures, **angles, "corrected": corrected, "n": _cycles(one, needs)}
    if isinstance(one, PathCriteria):
        return {**cells, "path": one.path, "points": one.points}
    low, high = one.repeatability.ci95 or (None, None)
    directions = len(one.variation_cycles) if needs == "vAP_p" else one.directions
    times = len(one.drift_cycles)
    return {**cells, "pose": one.pose, "dir": directions, "times": times, "low": low, "high": high}


def _text(cell: str | int | float | None, decimals: int) -> str:
    if cell is None:
        return "–"
    if isinstance(cell, str):
        return cell if len(cell) <= LONGEST_NAME else f"{cell[: LONGEST_NAME - 1]}…"
    if isinstance(cell, int):
        return str(cell)
    shown = f"{MILLI * cell:.{decimals}f}"
    return (shown if float(shown) else f"{0.0:.{decimals}f}").replace("-", "−")


def _decimals(values: Sequence[float]) -> int:
    """Return how many decimals (3 to 6) give the median absolute value, in mm or mrad, two digits; values in SI."""
    sizes = sorted(MILLI * abs(value) for value in values if isfinite(value))
    sizes = [size for size in sizes if size > NOTHING]
    if not sizes:
        return _LEAST_DECIMALS
    return min(max(1 - floor(log10(sizes[len(sizes) // 2])), _LEAST_DECIMALS), _MOST_DECIMALS)


def _counted(name: str, counts: Sequence[int], standard: int) -> str:
    """Text with the number of poses or paths, their cycles, and the standard's number of cycles; empty without any."""
    if not counts:
        return ""
    often = f"{counts[0]}" if min(counts) == max(counts) else f"{min(counts)} to {max(counts)}"
    return f"{len(counts)} {name}{'s' if len(counts) > 1 else ''} of {often} cycles (the standard: {standard})"


def _wrapped(sentence: str, indent: str) -> str:
    """Wrap a sentence at 96 characters, with a hanging indent."""
    return fill(sentence, WIDTH, initial_indent=indent, subsequent_indent=" " * len(indent), break_on_hyphens=False)


def _worst(found: Sequence[Criteria], part: str) -> float | None:
    return max((value.position for one in found if (value := getattr(one, part))), default=None)


@dataclass(frozen=True)
class Performance:
    """ISO 9283:1998 criteria of a campaign with repeats; SI, in the axes of the robot's base.

    Attributes
    ----------
    campaign, robot, tool_frame
        Names of campaign, robot and tool frame.
    poses
        Poses at rest, in the sequence in which they were met.
    paths
        Paths, likewise.
    registered
        The frames that were fitted to the same measurements: ``base``, ``tool``. AP and AT are then after
        registration, and smaller than against frames that are measured separately. RP, vAP and RT do not depend on
        it.
    instrument
        RP_l that the noise of the instrument alone would show, m; ``None`` where that noise is not given.
    notes
        Remarks, a sentence each.

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
        return _worst(self.poses, "accuracy")

    @property
    def corrected(self) -> float | None:
        """AP_p of the worst pose against the corrected model, m."""
        return _worst(self.poses, "corrected")

    @property
    def repeatability(self) -> float | None:
        """RP_l of the worst pose, m."""
        return _worst(self.poses, "repeatability")

    @property
    def path_accuracy(self) -> float | None:
        """AT_p of the worst path, m."""
        return _worst(self.paths, "accuracy")

    @property
    def path_corrected(self) -> float | None:
        """AT_p of the worst path against the corrected model, m."""
        return _worst(self.paths, "corrected")

    @property
    def path_repeatability(self) -> float | None:
        """RT_p of the worst path, m."""
        return _worst(self.paths, "repeatability")

    @property
    def summary(self) -> str:
        """Text of one line with the worst AP_p, RP_l, AT_p and RT_p over all poses and paths, mm."""
        named = [("AP_p", self.accuracy), ("corrected", self.corrected), ("RP_l", self.repeatability)]
        named += [("AT_p", self.path_accuracy), ("corrected", self.path_corrected), ("RT_p", self.path_repeatability)]
        said = [f"{name} {_text(value, _decimals([value]))} mm" for name, value in named if value is not None]
        return f"ISO 9283, the worst of {self.extent}: {'; '.join(said)}"

    @property
    def extent(self) -> str:
        """Text with the numbers of poses and paths and of their cycles, and the standard's number of cycles."""
        at_rest = _counted("pose", [p.cycles for p in self.poses], CYCLES)
        along = _counted("path", [p.cycles for p in self.paths], PATH_CYCLES)
        return ", and ".join(part for part in (at_rest, along) if part)

    def to_dict(self) -> dict[str, Any]:
        """Return all criteria as plain values for JSON, SI.

        Examples
        --------
        >>> from thermal_robot.iso9283 import performance
        >>> tested = tr.simulate("builtin:rv_m2", tool_frame="tool0", rows=20, repeats=10, noise=2e-5)
        >>> list(performance(tested).to_dict())[:4]
        ['schema', 'campaign', 'robot', 'tool_frame']
        """
        return {"schema": SCHEMA, **asdict(self)}

    def to_frame(self) -> pd.DataFrame:
        """Return a long-format data frame with one row for each criterion of each pose or path, SI.

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
        return pd.DataFrame(self._rows(), columns=columns)

    @property
    def _all(self) -> tuple[Criteria, ...]:
        return (*self.poses, *self.paths)

    def _rows(self) -> Iterator[tuple[Any, ...]]:
        for one in self._all:
            label = one.pose if isinstance(one, PoseCriteria) else one.path
            for name, value in _figures(one).items():
                interval = one.repeatability.ci95 if isinstance(one, PoseCriteria) and name == "RP_l" else None
                low, high = interval or (float("nan"), float("nan"))
                unit = "rad" if name.partition("_")[2][:1] in {"a", "b", "c"} else "m"
                yield label, _cycles(one, name), name, value, low, high, unit

    @property
    def tables(self) -> tuple[Table, ...]:
        """Text tables of the criteria, in mm and mrad: those of poses, then those of paths; empty ones are left out."""
        made = (Table.of(self._all, needs) for needs in _COLUMNS)
        return tuple(table for table in made if table)

    def __str__(self) -> str:
        title = f"Performance criteria of ISO 9283:1998: {self.robot}, {self.tool_frame}; {self.extent}"
        notes = "\n".join(_wrapped(note, "  - ") for note in self.notes)
        return "\n\n".join(part for part in (_wrapped(title, ""), *map(str, self.tables), notes) if part)
