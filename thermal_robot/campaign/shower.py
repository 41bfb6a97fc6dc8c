"""The port through which a campaign shows itself: who makes its table and its HTML is registered, not imported."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    import pandas as pd


class Shower(Protocol):
    """Who shows a campaign to pandas and to a notebook."""

    def frame(self, campaign: Any, /) -> pd.DataFrame:
        """Return its table, in the units of the file."""

    def html(self, campaign: Any, /) -> str:
        """Return what is said of it."""


_showers: list[Shower] = []


def shown_by(new: Shower) -> None:
    """Register who shows every campaign from now on."""
    _showers[:] = [new]


def shower() -> Shower:
    """Return who shows campaigns."""
    if not _showers:
        raise RuntimeError("nobody can show a campaign: import thermal_robot.campaign, or call shown_by")
    return _showers[0]
