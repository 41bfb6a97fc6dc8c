"""Registry of the renderer that puts results into words and figures, imported on first use."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol


class Teller(Protocol):
    """Renderer: a module, or an object, with these functions of one result.

    A headline and an advice are one plain sentence, a text is all of it, a fragment is HTML without a page around it.
    """

    headline: Callable[[Any], str]
    advice: Callable[[Any], str]
    text: Callable[[Any], str]
    fragment: Callable[[Any], str]
    explain_figure: Callable[[Any], Any]
    calibration_text: Callable[[Any], str]
    comparison_headline: Callable[[Any], str]
    comparison_text: Callable[[Any], str]
    comparison_fragment: Callable[[Any], str]
    fleet_text: Callable[[Any], str]
    wear_headline: Callable[[Any], str]
    wear_text: Callable[[Any], str]
    motion_headline: Callable[[Any], str]
    motion_advice: Callable[[Any], str]
    motion_text: Callable[[Any], str]
    motion_fragment: Callable[[Any], str]
    motion_comparison_headline: Callable[[Any], str]
    motion_comparison_text: Callable[[Any], str]


_tellers: list[Teller] = []


def told_by(teller: Any) -> None:
    """Register the renderer of all results: see :class:`Teller`."""
    _tellers[:] = [teller]


def registered() -> Teller:
    """Return the renderer that was registered last.

    Raises
    ------
    RuntimeError
        If nobody was.
    """
    if not _tellers:
        raise RuntimeError("nobody can tell a diagnosis: import thermal_robot, or call told_by")
    return _tellers[0]
