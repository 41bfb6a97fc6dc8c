"""What is measured: a file each, with ``TITLE`` and ``measured(effort, peers)``, which returns a :class:`Part`."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Curve:
    """Seconds over a size, for a plot and its exponent."""

    name: str
    sizes: tuple[float, ...]
    seconds: tuple[float, ...]


@dataclass(frozen=True)
class Plot:
    """Curves over the same size."""

    name: str
    title: str
    size: str
    curves: tuple[Curve, ...]


@dataclass(frozen=True)
class Part:
    """One part of the page: heading, what was done, tables of text with their heading first, plots below."""

    title: str
    text: str
    tables: tuple[tuple[tuple[str, ...], ...], ...] = ()
    plots: tuple[Plot, ...] = ()
