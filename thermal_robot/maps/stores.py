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
"""Beside the parts of a Parquet folder: what decides the map."""
LISTED = 10
"""Best places that are told."""


class _Parquet:
    """Folder of Parquet files, one for each chunk, with notes."""

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
        """Create an empty map."""
        self.folder.mkdir(parents=True, exist_ok=True)
        for part in self.folder.glob("part-*.parquet"):
            part.unlink()
        (self.folder / NOTES).write_text(json.dumps(notes, indent=2, ensure_ascii=False), encoding="utf-8")

    def add(self, columns: Columns) -> None:
        """Add the next chunk by an atomic rename."""
        import pyarrow
        import pyarrow.parquet

        part = self._part(self.done)
        unfinished = part.with_suffix(".unfinished")
        pyarrow.parquet.write_table(pyarrow.table(columns), unfinished)
        os.replace(unfinished, part)

    def chunks(self, names: list[str] | None = None) -> Iterator[Columns]:
        """Yield the columns, or some of them, chunk by chunk."""
        import pyarrow.parquet

        for k in range(self.done):
            table = pyarrow.parquet.read_table(self._part(k), columns=names)
            yield {name: table[name].to_numpy() for name in table.column_names}


class _Zarr(_Parquet):
    """Zarr group with one array for each column; rows beyond the counted ones are unfinished."""

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
        """Add the next chunk; it counts once its number of rows is written."""
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
    """Store of a path by its ending; an unknown ending or a missing library is an error."""
    folder = Path(path)
    kinds = {".zarr": _Zarr, ".parquet": _Parquet}
    if folder.suffix not in kinds:
        found = folder.suffix or "no ending"
        raise CampaignError(str(path), "no kind of map", found=found, expected=" or ".join(kinds))
    return kinds[folder.suffix](folder)


Limits = Mapping[str, tuple[float | None, float | None]]
"""By column: the least and the largest value that will do; ``None`` for no limit."""


class Map:
    """Stored workspace map of a robot, by place and posture or by configuration.

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
        """Whether all chunks are finished."""
        return bool(self._store.done == self.notes["parts"])

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns."""
        return ("place", "branch", *self.notes["joints"], *list(UNITS)[2:])

    def chunks(self, names: Sequence[str] | None = None) -> Iterator[Columns]:
        """Yield the columns by name, by default all, chunk by chunk.

        Raises
        ------
        CampaignError
            A column that the map has not.
        """
        self._known(*(names or ()))
        return self._store.chunks(None if names is None else list(dict.fromkeys(names)))

    def frame(self, names: Sequence[str] | None = None) -> pd.DataFrame:
        """Return the data frame of the columns, SI, in memory."""
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
        """Best rows, with the best posture of each place, best first.

        Parameters
        ----------
        by
            Column by which rows are compared; the smallest is best.
        largest
            The largest is.
        within
            Required range by column, ``{"capability_warm": (1.33, None), "z": (None, 0.5)}``.
        count
            Number of places.

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
        """Reached places (K, 3), m, and the best value (K,) of a column among their postures."""
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
    """Workspace map of a robot: scatter, thermal displacement, probability, C_p, clearance.

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
        Quantities to be computed at each configuration.
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
