"""Registry of the renderer that puts results into words and figures, and what every result can be shown as."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar, Protocol, overload

from thermal_robot.files import write_text


class Renderer(Protocol):
    """Renderer: a module, or an object, with these functions of one result.

    A headline and an advice are one plain sentence, a text is all of it, a fragment is HTML without a page around it,
    the others beside them are a page and a figure.
    """

    headline: Callable[[Any], str]
    advice: Callable[[Any], str]
    text: Callable[[Any], str]
    fragment: Callable[[Any], str]
    html: Callable[[Any], str]
    overview: Callable[[Any], Any]
    explain_figure: Callable[[Any], Any]
    calibration_text: Callable[[Any], str]
    crash_headline: Callable[[Any], str]
    crash_text: Callable[[Any], str]
    comparison_headline: Callable[[Any], str]
    comparison_text: Callable[[Any], str]
    comparison_fragment: Callable[[Any], str]
    comparison_html: Callable[[Any], str]
    plot_differences: Callable[[Any], Any]
    wear_fragment: Callable[[Any], str]
    wear_html: Callable[[Any], str]
    plot_wear: Callable[[Any], Any]
    fleet_text: Callable[[Any], str]
    wear_headline: Callable[[Any], str]
    wear_text: Callable[[Any], str]
    motion_headline: Callable[[Any], str]
    motion_advice: Callable[[Any], str]
    motion_text: Callable[[Any], str]
    motion_fragment: Callable[[Any], str]
    motion_html: Callable[[Any], str]
    plot_motions: Callable[[Any], Any]
    motion_comparison_headline: Callable[[Any], str]
    motion_comparison_text: Callable[[Any], str]


_renderers: list[Renderer] = []


def register_renderer(renderer: Any) -> None:
    """Register the renderer of all results: see :class:`Renderer`."""
    _renderers[:] = [renderer]


def registered_renderer() -> Renderer:
    """Return the renderer that was registered last.

    Raises
    ------
    RuntimeError
        If nobody was.
    """
    if not _renderers:
        raise RuntimeError("no renderer of results: import thermal_robot, or call register_renderer")
    return _renderers[0]


class Rendered:
    """Base class of results: text by the registered renderer, and JSON."""

    _kind: ClassVar[str] = ""
    """Prefix of the names of the renderer's functions for such a result."""

    def to_dict(self) -> dict[str, Any]:
        """Return the result as plain values, ready for JSON; each class of results defines it."""
        raise NotImplementedError

    def _given(self) -> Any:
        """Return the object that the renderer's functions take: the result itself, unless a class overrides it."""
        return self

    def _rendered(self, how: str) -> Any:
        return getattr(registered_renderer(), how)(self._given())

    @overload
    def to_json(self, path: None = None) -> str: ...
    @overload
    def to_json(self, path: str | Path) -> None: ...
    def to_json(self, path: str | Path | None = None) -> str | None:
        """JSON text of :meth:`to_dict`; with a path it is written there by an atomic replace.

        Examples
        --------
        >>> found = tr.diagnose(tr.demo_campaign())
        >>> found.to_json("diagnosis.json")
        >>> found.to_json().splitlines()[1]
        '  "schema": "thermal-robot/diagnosis/2",'
        """
        return _kept(json.dumps(self.to_dict(), indent=2, ensure_ascii=False, allow_nan=False) + "\n", path)

    def __str__(self) -> str:
        return str(self._rendered(f"{self._kind}text"))


class RenderedPage(Rendered):
    """Base class of results that have an HTML page and a figure, too, and show themselves in a notebook."""

    _figure: ClassVar[str] = "overview"
    """The renderer's function that draws it."""

    @overload
    def to_html(self, path: None = None) -> str: ...
    @overload
    def to_html(self, path: str | Path) -> None: ...
    def to_html(self, path: str | Path | None = None) -> str | None:
        """Self-contained HTML page, that of ``--report``; with a path it is written there by an atomic replace.

        Examples
        --------
        >>> found = tr.diagnose(tr.demo_campaign())
        >>> found.to_html("diagnosis.html")
        >>> found.to_html().startswith("<!DOCTYPE html>")
        True
        """
        return _kept(str(self._rendered(f"{self._kind}html")), path)

    def plot(self) -> Any:
        """Overview as a :class:`matplotlib.figure.Figure`, which shows itself in a notebook.

        Examples
        --------
        >>> tr.diagnose(tr.demo_campaign()).plot().savefig("diagnosis.png")
        """
        return self._rendered(self._figure)

    def _repr_html_(self) -> str:
        return str(self._rendered(f"{self._kind}fragment"))


def _kept(text: str, path: str | Path | None) -> str | None:
    """Return a text if there is no path; else write it to the path and return ``None``."""
    if path is None:
        return text
    write_text(path, text)
    return None
