"""A map of the workspace in chunks, Zarr or Parquet, each whole or not there: a stopped run is gone on with."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from thermal_robot.errors import CampaignError, RobotError, require
from thermal_robot.maps import settings
from thermal_robot.maps.quantities import UNITS, Columns, columns
from thermal_robot.maps.question import Joints, Over, Positions, Question, Spec
from thermal_robot.robot import Robot

if TYPE_CHECKING:
    import pandas as pd


ZARR, PARQUET = ".zarr", ".parquet"
NOTES = "map.json"
"""Beside the parts of a Parquet folder: what decides the map."""


class Store(Protocol):
    """Chunks of a map on disk."""

    @property
    def notes(self) -> dict[str, Any]:
        """What decides the map; empty where there is none yet."""
        ...

    @property
    def done(self) -> int:
        """How many chunks are there, from the first on."""
        ...

    def begin(self, notes: dict[str, Any]) -> None:
        """Make an empty map."""
        ...

    def add(self, columns: Columns) -> None:
        """Add the next chunk, whole."""
        ...

    def chunks(self, names: list[str] | None = None) -> Iterator[Columns]:
        """Yield the columns, some of them by name, chunk by chunk."""
        ...


def store(path: str | Path) -> Store:
    """Return the store of a path, by how its name ends; refused for another one, or a library not installed."""
    folder = Path(path)
    if folder.suffix == ZARR:
        return ZarrStore(folder)
    if folder.suffix == PARQUET:
        return ParquetStore(folder)
    raise CampaignError(
        str(path), "no kind of map", found=folder.suffix or "no ending", expected=f"{ZARR} or {PARQUET}"
    )


class ParquetStore:
    """A folder of parts, one a chunk, and its notes."""

    def __init__(self, folder: Path) -> None:
        try:
            import pyarrow  # noqa: F401
        except ImportError as error:
            raise CampaignError(
                str(folder), "pyarrow is not installed", expected='pip install "thermal-robot[parquet]"'
            ) from error
        self.folder = folder

    @property
    def notes(self) -> dict[str, Any]:
        """What decides the map; empty where there is none yet."""
        file = self.folder / NOTES
        return dict(json.loads(file.read_text(encoding="utf-8"))) if file.is_file() else {}

    def _part(self, k: int) -> Path:
        return self.folder / f"part-{k:06d}.parquet"

    @property
    def done(self) -> int:
        """How many chunks are there, from the first on."""
        k = 0
        while self._part(k).is_file():
            k += 1
        return k

    def begin(self, notes: dict[str, Any]) -> None:
        """Make an empty map."""
        self.folder.mkdir(parents=True, exist_ok=True)
        for part in self.folder.glob("part-*.parquet"):
            part.unlink()
        (self.folder / NOTES).write_text(json.dumps(notes, indent=2, ensure_ascii=False), encoding="utf-8")

    def add(self, columns: Columns) -> None:
        """Add the next chunk, whole: under another name until it is."""
        import pyarrow
        import pyarrow.parquet

        part = self._part(self.done)
        unfinished = part.with_suffix(".unfinished")
        pyarrow.parquet.write_table(pyarrow.table(columns), unfinished)
        os.replace(unfinished, part)

    def chunks(self, names: list[str] | None = None) -> Iterator[Columns]:
        """Yield the columns, some of them by name, chunk by chunk."""
        import pyarrow.parquet

        for k in range(self.done):
            table = pyarrow.parquet.read_table(self._part(k), columns=names)
            yield {name: table[name].to_numpy() for name in table.column_names}


class ZarrStore:
    """A group of one array a column; rows beyond those that are counted are an unfinished chunk."""

    def __init__(self, folder: Path) -> None:
        try:
            import zarr  # noqa: F401
        except ImportError as error:
            raise CampaignError(
                str(folder), "zarr is not installed", expected='pip install "thermal-robot[maps]"'
            ) from error
        self.folder = folder

    def _group(self, mode: Any = "r+") -> Any:
        import zarr

        return zarr.open_group(str(self.folder), mode=mode)

    @property
    def notes(self) -> dict[str, Any]:
        """What decides the map; empty where there is none yet."""
        return dict(self._group("r").attrs["notes"]) if (self.folder / "zarr.json").is_file() else {}

    @property
    def done(self) -> int:
        """How many chunks are there, from the first on."""
        return len(self._group("r").attrs["rows"]) if self.notes else 0

    def begin(self, notes: dict[str, Any]) -> None:
        """Make an empty map."""
        self._group("w").attrs.update({"notes": notes, "rows": []})

    def add(self, columns: Columns) -> None:
        """Add the next chunk; it counts once its number of rows is written."""
        group = self._group()
        rows = [int(count) for count in group.attrs["rows"]]
        before = sum(rows)
        count = len(next(iter(columns.values())))
        for name, values in columns.items():
            if name not in group:
                group.create_array(name, shape=(0,), chunks=(1 << 16,), dtype=values.dtype)
            array = group[name]
            array.resize((before + count,))
            array[before:] = values
        group.attrs.update({"rows": [*rows, count]})

    def chunks(self, names: list[str] | None = None) -> Iterator[Columns]:
        """Yield the columns, some of them by name, chunk by chunk."""
        group, start = self._group("r"), 0
        for count in group.attrs["rows"]:
            every = sorted(group.array_keys()) if names is None else names
            yield {name: np.asarray(group[name][start : start + count]) for name in every}
            start += count


Limits = Mapping[str, tuple[float | None, float | None]]
"""By column: the least and the largest value that will do; ``None`` for no limit."""


class Map:
    """What a robot is good for, place by place or configuration by configuration.

    Parameters
    ----------
    path
        Of the map.

    Attributes
    ----------
    notes
        What decided it: robot, grid, settings.

    Raises
    ------
    CampaignError
        No map there.
    """

    def __init__(self, path: str | Path) -> None:
        self._store = store(path)
        self.path, self.notes = Path(path), self._store.notes
        if not self.notes:
            raise CampaignError(str(path), "there is no map")

    def __repr__(self) -> str:
        done = "" if self.complete else f", {self._store.done} of {self.notes['parts']} chunks"
        return f"<Map of {self.notes['robot']!r} over {self.notes['over']}{done}>"

    @property
    def complete(self) -> bool:
        """Whether all chunks are there."""
        return bool(self._store.done == self.notes["parts"])

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns."""
        return ("place", "branch", *self.notes["joints"], *list(UNITS)[2:])

    def chunks(self, names: Sequence[str] | None = None) -> Iterator[Columns]:
        """Yield columns by name, all where left out, chunk by chunk.

        Raises
        ------
        CampaignError
            A column that the map has not.
        """
        for name in names or ():
            self._known(name)
        return self._store.chunks(None if names is None else list(dict.fromkeys(names)))

    def frame(self, names: Sequence[str] | None = None) -> pd.DataFrame:
        """Return columns as a data frame, SI; all of the map stands in memory then."""
        import pandas as pd

        wanted = list(names) if names is not None else list(self.columns)
        parts = [pd.DataFrame(chunk) for chunk in self.chunks(wanted)]
        return pd.concat(parts, ignore_index=True)[wanted] if parts else pd.DataFrame(columns=wanted)

    def best(
        self,
        by: str = "required_warm",
        *,
        largest: bool = False,
        within: Limits | None = None,
        count: int = settings.LISTED,
    ) -> pd.DataFrame:
        """Return the best rows, the best posture of each place, best first.

        Parameters
        ----------
        by
            Column by which rows are compared; the smallest is best.
        largest
            The largest is.
        within
            By column: what a row must have, ``{"capability_warm": (1.33, None), "z": (None, 0.5)}``.
        count
            How many places.

        Raises
        ------
        CampaignError
            A column that the map has not.
        """
        import pandas as pd

        for name in (by, *(within or {})):
            self._known(name)
        sign, kept = -1.0 if largest else 1.0, pd.DataFrame(columns=list(self.columns))
        for chunk in self.chunks():
            wanted = np.isfinite(chunk[by])
            for name, (low, high) in (within or {}).items():
                wanted &= (chunk[name] >= (-np.inf if low is None else low)) & (
                    chunk[name] <= (np.inf if high is None else high)
                )
            rows = np.flatnonzero(wanted)
            rows = rows[np.argsort(sign * chunk[by][rows], kind="stable")]
            rows = rows[np.sort(np.unique(chunk["place"][rows], return_index=True)[1])][:count]
            part = pd.DataFrame({name: chunk[name][rows] for name in self.columns})
            both = part if kept.empty else pd.concat([kept, part], ignore_index=True)
            kept = both.sort_values(by, ascending=not largest, kind="stable")[:count].reset_index(drop=True)
        return kept

    def _known(self, name: str) -> None:
        if name not in self.columns:
            raise CampaignError(
                str(self.path), "the map has no such column", column=name, expected=f"one of {', '.join(self.columns)}"
            )

    def values(self, by: str, *, largest: bool = False) -> tuple[NDArray[Any], NDArray[Any]]:
        """Return (K, 3) places, m, that are reached, and (K,) the best value of a column among their postures."""
        found = self.frame(["place", "x", "y", "z", by])
        best = found.sort_values(by, ascending=not largest, kind="stable").drop_duplicates("place").sort_values("place")
        return best[["x", "y", "z"]].to_numpy(dtype=float), best[by].to_numpy(dtype=float)


def workspace_map(
    robot: Robot,
    over: Over,
    path: str | Path,
    question: Question | None = None,
    *,
    replace: bool = False,
    progress: Callable[[str, int, int], None] = lambda _stage, _done, _all: None,
) -> Map:
    """Map what a robot is good for over its workspace: scatter, thermal displacement, probability, C_p, clearance.

    Results are written chunk by chunk. A run that is stopped leaves a map that can be read; the same call goes on with
    it, and gives the same file.

    Parameters
    ----------
    robot
        The robot.
    over
        Places of the tip, at which all postures are found, or joint positions.
    path
        ``F.zarr`` (extra ``maps``), or ``F.parquet``, a folder of parts (extra ``parquet``).
    question
        What is asked of each configuration.
    replace
        Begin anew where another map stands there.
    progress
        Called with a stage, how many chunks are done, and how many there are.

    Returns
    -------
    Map
        Read from there chunk by chunk.

    Raises
    ------
    RobotError
        Nothing to map, or a name that is not known.
    CampaignError
        Another map at that path, another ending.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> from thermal_robot.maps import Positions, Question, workspace_map
    >>> robot = tr.load_robot("builtin:rv_m2", "tool0")
    >>> line = Positions((0.0, 0.0, 1), (0.42, 0.48, 4), (0.2, 0.2, 1))
    >>> found = workspace_map(robot, line, "line.parquet", Question(axis=(0.0, 1.0, 0.0)))
    >>> found.frame(["place", "y", "required_warm"]).round(6).shape
    (4, 3)
    """
    require("workspace_map()", robot, (Robot,), "a robot, as load_robot returns it")
    require("workspace_map(), over", over, (Positions, Joints), "Positions or Joints")
    spec = Spec(robot, over, question or Question())
    if over.count < 1:
        raise RobotError("there is nothing to map: an axis has no values", name=robot.name)
    kept = store(path)
    known = kept.notes
    if not known or replace:
        kept.begin({**spec.to_dict(), "fingerprint": spec.fingerprint, "parts": spec.parts})
    elif known.get("fingerprint") != spec.fingerprint:
        raise CampaignError(
            str(path), "holds another map", found=_differs(known, spec), expected="the same settings, or replace"
        )
    done = kept.done
    for k, rows in enumerate(spec.chunks()):
        if k < done:
            continue
        progress("chunks", k, spec.parts)
        kept.add(columns(spec, rows))
    progress("chunks", spec.parts, spec.parts)
    return Map(path)


def _differs(known: dict[str, object], spec: Spec) -> str:
    """Say in which settings two maps differ."""
    own = spec.to_dict()
    other = [key for key in own if known.get(key) != own[key]]
    return "other " + ", ".join(other) if other else "settings of another version"
