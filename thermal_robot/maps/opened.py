"""A map that was made: read chunk by chunk, its best places, its pictures."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.errors import CampaignError
from thermal_robot.maps import settings
from thermal_robot.maps.quantities import UNITS, Columns
from thermal_robot.maps.stores import store

if TYPE_CHECKING:
    import pandas as pd

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
