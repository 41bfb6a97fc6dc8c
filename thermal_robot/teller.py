"""The port through which results are put into words and drawn: who does so is registered here, and loaded late."""

from __future__ import annotations

from typing import Any, Protocol


class Teller(Protocol):
    """Who puts results into words and draws them: a module, or an object with these methods."""

    def headline(self, diagnosis: Any) -> str:
        """Return the verdict in one plain sentence."""

    def advice(self, diagnosis: Any) -> str:
        """Return what to measure next in one plain sentence."""

    def text(self, diagnosis: Any) -> str:
        """Return all of a diagnosis as plain text."""

    def fragment(self, diagnosis: Any) -> str:
        """Return all of a diagnosis as HTML without a page around it."""

    def explain_figure(self, explained: Any) -> Any:
        """Draw what one effect explains."""

    def calibration_text(self, calibration: Any) -> str:
        """Return all of a calibration as plain text."""

    def comparison_headline(self, comparison: Any) -> str:
        """Return what changed in one plain sentence."""

    def comparison_text(self, comparison: Any) -> str:
        """Return all of a comparison as plain text."""

    def comparison_fragment(self, comparison: Any) -> str:
        """Return all of a comparison as HTML without a page around it."""

    def fleet_text(self, summary: Any) -> str:
        """Return all of many diagnoses as plain text."""


_tellers: list[Teller] = []


def told_by(teller: Any) -> None:
    """Register who puts every result into words and figures from now on: see :class:`Teller`."""
    _tellers[:] = [teller]


def registered() -> Teller:
    """Return who was registered last; :class:`RuntimeError` if nobody was."""
    if not _tellers:
        raise RuntimeError("nobody can tell a diagnosis: import thermal_robot, or call told_by")
    return _tellers[0]
