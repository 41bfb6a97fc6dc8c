"""The result: criteria of every pose and path that was repeated; a dict, a data frame, a table for the reader."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from thermal_robot.iso9283.criteria import Three
from thermal_robot.iso9283.parts import PathCriteria, PoseCriteria
from thermal_robot.iso9283.table import (
    Table,
    cycles_of,
    drifts,
    lines,
    millimetres,
    path_turns,
    paths,
    paths_of,
    poses,
    turns,
    variations,
    wrapped,
)

if TYPE_CHECKING:
    import pandas as pd

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
        return ", and ".join(part for part in (cycles_of(self.poses), paths_of(self.paths)) if part)

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
