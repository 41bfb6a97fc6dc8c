"""Chunked storage of a workspace map in Zarr or Parquet; an interrupted run is resumed."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from importlib import import_module
from itertools import count, islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.errors import CampaignError, RobotError, require
from thermal_robot.maps.quantities import UNITS, Columns, columns
from thermal_robot.maps.question import Joints, Over, Positions, Question, Spec
from thermal_robot.robot import Robot

if TYPE_CHECKING:
    import pandas as pd


NOTES = "map.json"
"""File beside the parts of a Parquet folder that holds the specification of the map."""
LISTED = 10
"""Number of best places that are listed by default."""


class _Parquet:
    """Store of a map as a folder of Parquet files, one for each chunk, and a JSON file with its specification."""

    library, extra = "pyarrow", "parquet"

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        try:
            import_module(self.library)
        except ImportError as error:
            expected = f'pip install "thermal-robot[{self.extra}]"'
            raise CampaignError(str(folder), f"{self.library} is not installed", expected=expected) from error

    def _part(self, k: int) -> Path:
        return self.folder / f"part-{k:06d}.parquet"

    @property
    def notes(self) -> dict[str, Any]:
        """Specification of the map; empty where there is none yet."""
        file = self.folder / NOTES
        return dict(json.loads(file.read_text(encoding="utf-8"))) if file.is_file() else {}

    @property
    def done(self) -> int:
        """Number of finished chunks."""
        return next(k for k in count() if not self._part(k).is_file())

    def begin(self, notes: dict[str, Any]) -> None:
        """Create an empty map with this specification; parts of an earlier one are deleted."""
        self.folder.mkdir(parents=True, exist_ok=True)
        for part in self.folder.glob("part-*.parquet"):
            part.unlink()
        (self.folder / NOTES).write_text(json.dumps(notes, indent=2, ensure_ascii=False), encoding="utf-8")

    def add(self, columns: Columns) -> None:
        """Write the next chunk to its file; an atomic rename keeps an interrupted write from counting."""
        import pyarrow
        import pyarrow.parquet

        part = self._part(self.done)
        unfinished = part.with_suffix(".unfinished")
        pyarrow.parquet.write_table(pyarrow.table(columns), unfinished)
        os.replace(unfinished, part)

    def chunks(self, names: list[str] | None = None) -> Iterator[Columns]:
        """Yield a dict of the columns by name, all or those named, for each finished chunk."""
        import pyarrow.parquet

        for k in range(self.done):
            table = pyarrow.parquet.read_table(self._part(k), columns=names)
            yield {name: table[name].to_numpy() for name in table.column_names}


class _Zarr(_Parquet):
    """Store of a map as a Zarr group, one array for each column; rows beyond those counted are an unfinished chunk."""

    library, extra = "zarr", "maps"

    def _group(self, mode: Any = "r+") -> Any:
        import zarr

        return zarr.open_group(str(self.folder), mode=mode)

    @property
    def notes(self) -> dict[str, Any]:
        return dict(self._group("r").attrs["notes"]) if (self.folder / "zarr.json").is_file() else {}

    @property
    def done(self) -> int:
        return len(self._group("r").attrs["rows"]) if self.notes else 0

    def begin(self, notes: dict[str, Any]) -> None:
        self._group("w").attrs.update({"notes": notes, "rows": []})

    def add(self, columns: Columns) -> None:
        """Append the next chunk to the arrays; it counts as finished once its number of rows is written."""
        group = self._group()
        rows = [int(count) for count in group.attrs["rows"]]
        before, more = sum(rows), len(next(iter(columns.values())))
        for name, values in columns.items():
            if name not in group:
                group.create_array(name, shape=(0,), chunks=(1 << 16,), dtype=values.dtype)
            array = group[name]
            array.resize((before + more,))
            array[before:] = values
        group.attrs.update({"rows": [*rows, more]})

    def chunks(self, names: list[str] | None = None) -> Iterator[Columns]:
        group, start = self._group("r"), 0
        every = sorted(group.array_keys()) if names is None else names
        for more in group.attrs["rows"]:
            yield {name: np.asarray(group[name][start : start + more]) for name in every}
            start += more


def store(path: str | Path) -> _Parquet:
    """Store of a map, by its path's ending .zarr or .parquet; another, or a missing library, is a CampaignError."""
    folder = Path(path)
    kinds = {".zarr": _Zarr, ".parquet": _Parquet}
    if folder.suffix not in kinds:
        found = folder.suffix or "no ending"
        raise CampaignError(str(path), "no kind of map", found=found, expected=" or ".join(kinds))
    return kinds[folder.suffix](folder)


Limits = Mapping[str, tuple[float | None, float | None]]
"""Smallest and largest value that is accepted, by column; ``None`` for no limit."""


class Map:
    """Stored workspace map of a robot, with a row for each posture at each place, or for each configuration.

    Parameters
    ----------
    path
        Path of the map.

    Attributes
    ----------
    notes
        Specification: robot, grid, settings.

    Raises
    ------
    CampaignError
        There is no map at the path.
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
        """Whether all chunks are finished."""
        return bool(self._store.done == self.notes["parts"])

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns."""
        return ("place", "branch", *self.notes["joints"], *list(UNITS)[2:])

    def chunks(self, names: Sequence[str] | None = None) -> Iterator[Columns]:
        """Yield a dict of arrays by column, all or those named, for each finished chunk.

        Raises
        ------
        CampaignError
            A column that the map has not.
        """
        self._known(*(names or ()))
        return self._store.chunks(None if names is None else list(dict.fromkeys(names)))

    def frame(self, names: Sequence[str] | None = None) -> pd.DataFrame:
        """Read the columns, all or those named, of all finished chunks into one data frame, SI."""
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
        count: int = LISTED,
    ) -> pd.DataFrame:
        """Return the best places by one column, best first, each with its best posture; NaN rows are left out.

        Parameters
        ----------
        by
            Column by which rows are compared; the smallest value is best.
        largest
            Whether the largest value is best instead.
        within
            Accepted range by column, ``{"capability_warm": (1.33, None), "z": (None, 0.5)}``.
        count
            Number of places at most.

        Raises
        ------
        CampaignError
            A column that the map has not.
        """
        import pandas as pd

        limits = within or {}
        self._known(by, *limits)
        kept = []
        for chunk in self.chunks():
            part = pd.DataFrame({name: chunk[name] for name in self.columns})
            for name, (low, high) in limits.items():
                part = part[part[name].between(-np.inf if low is None else low, np.inf if high is None else high)]
            part = part[np.isfinite(part[by])].sort_values(by, ascending=not largest, kind="stable")
            kept.append(part.drop_duplicates("place")[:count])
        some = [part for part in kept if len(part)]
        if not some:
            return pd.DataFrame(columns=list(self.columns))
        best: pd.DataFrame = pd.concat(some).sort_values(by, ascending=not largest, kind="stable")
        return best[:count].reset_index(drop=True)

    def _known(self, *names: str) -> None:
        for name in names:
            if name not in self.columns:
                expected = f"one of {', '.join(self.columns)}"
                raise CampaignError(str(self.path), "the map has no such column", column=name, expected=expected)

    def values(self, by: str, *, largest: bool = False) -> tuple[NDArray[Any], NDArray[Any]]:
        """Positions (K, 3), m, of reached places, and the smallest (or largest) value (K,) of a column there."""
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
    """Compute the workspace map of a robot: scatter, thermal displacement, probability of joining, C_p, clearance.

    Results are written chunk by chunk. A run that is stopped leaves a map that can be read; the same call resumes it,
    and gives the same file.

    Parameters
    ----------
    robot
        The robot.
    over
        Places of the tip, at which all postures are found, or joint positions.
    path
        ``F.zarr`` (extra ``maps``), or ``F.parquet``, a folder of parts (extra ``parquet``).
    question
        Quantities to be computed at each configuration.
    replace
        Whether a map that is already at the path is overwritten.
    progress
        Called with a stage, how many chunks are done, and how many there are.

    Returns
    -------
    Map
        The map at the path.

    Raises
    ------
    RobotError
        Nothing to map, or a name that is not known.
    CampaignError
        A map with other settings is at that path, or the path has another ending.

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
        other = [key for key, own in spec.to_dict().items() if known.get(key) != own]
        found = "other " + ", ".join(other) if other else "settings of another version"
        raise CampaignError(
            str(path),
            "holds another map",
            found=found,
            expected="the same settings, another path, or --replace (replace=True)",
        )
    for k, rows in islice(enumerate(spec.chunks()), kept.done, None):
        progress("chunks", k, spec.parts)
        kept.add(columns(spec, rows))
    progress("chunks", spec.parts, spec.parts)
    return Map(path)
