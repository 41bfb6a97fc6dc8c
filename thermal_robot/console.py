"""Messages on stderr beside the result: progress and notes, as many as were asked for."""

from __future__ import annotations

import argparse
import logging
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from thermal_robot.errors import Note

QUIET, NORMAL, VERBOSE = "quiet", "normal", "verbose"
_PATIENCE = 2.0
"""s after which a terminal shows the stages: a shorter task needs no progress display."""

_SILENCE = 300.0
"""s after which a line tells the progress of counted work although no tenth is full: a fleet may take days."""

Counted = Callable[[str, int, int], None]
"""Callback of a progress display: name of a stage, number of parts done, and number of all parts."""


def add_loudness(parser: argparse.ArgumentParser, default: str) -> None:
    """Define the options ``-q`` and ``-v``; the last one given counts."""
    told = {QUIET: "print the result alone: no progress, no notes; of a diagnosis its one sentence"}
    told[VERBOSE] = "print each stage with the seconds that have passed, and what libraries warn of, on stderr"
    for loudness, text in told.items():
        names = (f"-{loudness[0]}", f"--{loudness}")
        parser.add_argument(*names, dest="loudness", action="store_const", const=loudness, default=default, help=text)


def note(text: str, loudness: str) -> None:
    """Print a note in one line on stderr, unless ``loudness`` is quiet."""
    if loudness != QUIET:
        print(f"thermal-robot: note: {' '.join(text.split())}", file=sys.stderr, flush=True)


@contextmanager
def warnings_as_notes(loudness: str) -> Iterator[None]:
    """Print warnings as notes on stderr, each text once: the program's own, and those of libraries only if verbose."""
    told = set()

    def show(message: Warning | str, category: type[Warning], *_: Any, **__: Any) -> None:
        text = str(message)
        if text not in told and (loudness == VERBOSE or issubclass(category, Note)):
            told.add(text)
            note(text, loudness)

    logs = logging.Handler(logging.WARNING)
    logs.emit = lambda record: show(record.getMessage(), Warning)  # type: ignore[method-assign]
    with warnings.catch_warnings():
        warnings.simplefilter("always", Note)
        warnings.showwarning = show
        logging.getLogger().addHandler(logs)
        try:
            yield
        finally:
            logging.getLogger().removeHandler(logs)


@contextmanager
def stages(loudness: str) -> Iterator[Callable[[str], None]]:
    """Progress display of stages of unknown length.

    A terminal shows stage and elapsed time after two seconds; if verbose, each stage is a line of its own instead.

    Yields
    ------
    Callable
        Takes a few words at the beginning of each stage.
    """
    if loudness == VERBOSE:
        begin = time.monotonic()

        def line(stage: str) -> None:
            print(f"{time.monotonic() - begin:6.1f} s  {stage}", file=sys.stderr, flush=True)

        yield line
        line("done")
        return
    if loudness == QUIET or not sys.stderr.isatty():
        yield lambda _: None
        return
    shown = _progress("Spinner", "TimeElapsed", "Text")
    task = shown.add_task("", total=None)
    patience = threading.Timer(_PATIENCE, shown.start)
    patience.daemon = True
    patience.start()
    try:
        yield lambda stage: shown.update(task, description=stage)
    finally:
        patience.cancel()
        patience.join()  # it may be about to start what is stopped here
        shown.stop()


@contextmanager
def counted(loudness: str) -> Iterator[Counted]:
    """Progress display of counted parts, with the remaining time.

    Bars on a terminal; elsewhere, or if verbose, a line for every tenth, or after five minutes. Nothing if quiet.

    Yields
    ------
    Callable
        A :data:`Counted`.
    """
    if loudness == QUIET:
        yield lambda *_: None
    elif loudness == VERBOSE or not sys.stderr.isatty():
        yield _tenths()
    else:
        tasks: dict[str, Any] = {}
        with _progress("Text", "Bar", "MofNComplete", "TimeRemaining") as bars:

            def show(stage: str, done: int, total: int) -> None:
                if stage not in tasks:
                    tasks[stage] = bars.add_task(stage, total=total)
                bars.update(tasks[stage], completed=done)

            yield show


def _progress(*kinds: str) -> Any:
    """Transient progress display on stderr with the given columns."""
    from rich import progress
    from rich.console import Console

    plain = {"Text": {"text_format": "{task.description}", "markup": False}}
    columns = (getattr(progress, f"{kind}Column")(**plain.get(kind, {})) for kind in kinds)
    return progress.Progress(*columns, console=Console(stderr=True), transient=True)


def _tenths() -> Counted:
    told: dict[str, tuple[float, int]] = {}

    def show(stage: str, done: int, total: int) -> None:
        now = time.monotonic()
        since, before = told.setdefault(stage, (now, 0))
        if 10 * done // total > 10 * before // total or (done > before and now - since > _SILENCE):
            # by the parts since the last line: those that were done before the work began took no time
            left = (now - since) * (total - done) / (done - before)
            ahead = f", about {_span(left)} left" if done < total and left > _PATIENCE else ""
            told[stage] = now, done
            print(f"{stage}: {done} of {total}{ahead}", file=sys.stderr, flush=True)

    return show


def _span(seconds: float) -> str:
    """Format a duration: ``40 s``, ``12 min``, ``3.5 h``."""
    if seconds < 100.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 6000.0 else f"{seconds / 3600.0:.1f} h"
