"""What is measured: a file each, with ``TITLE`` and ``measured(effort, peers)``, which returns a :class:`Part`."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Curve:
    """Seconds over a size, for a plot and its exponent.

    Attributes
    ----------
    name
        What was timed.
    sizes, seconds
        Of each call.
    """

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
    """One part of the page.

    Attributes
    ----------
    title, text
        Heading, and what was done, in whole sentences.
    tables
        Each with its heading first, cells as text.
    plots
        Drawn below.
    """

    title: str
    text: str
    tables: tuple[tuple[tuple[str, ...], ...], ...] = ()
    plots: tuple[Plot, ...] = field(default=())
