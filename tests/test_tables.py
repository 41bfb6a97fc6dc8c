"""How results are put into words: shares in per cent, tables, and who tells."""

import argparse
import io
import logging
import threading
import time
import warnings
from contextlib import redirect_stderr
from html.parser import HTMLParser

import pytest

from thermal_robot import console, renderer
from thermal_robot.console import NORMAL, QUIET, VERBOSE, add_loudness, counted, note, stages, warnings_as_notes
from thermal_robot.errors import Note
from thermal_robot.percents import percent
from thermal_robot.tables import aligned, html_table


@pytest.mark.parametrize(
    ("share", "decimals", "told"),
    [
        (0.5, 1, "50.0 %"),
        (0.126, 0, "13 %"),
        (-0.031, 1, "−3.1 %"),
        (-0.0003, 1, "0.0 %"),
        (-0.004, 0, "0 %"),
        (0.9996, 1, "99.96 %"),
        (0.996, 0, "99.6 %"),
        (0.99999999, 0, "> 99.9999 %"),
        (1.0 - 1e-14, 1, "100.0 %"),
        (1.0, 0, "100 %"),
        (float("nan"), 1, "–"),
        (None, 1, "–"),
    ],
)
def test_a_share_is_written(share, decimals, told):
    assert percent(share, decimals) == told


class Cells(HTMLParser):
    """Collects the text of every cell, row by row."""

    def __init__(self):
        super().__init__()
        self.rows, self.tags = [], []

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        if tag == "tr":
            self.rows.append([])
        elif tag in ("td", "th"):
            self.rows[-1].append("")

    def handle_data(self, data):
        if self.rows:
            self.rows[-1][-1] += data


def read(html):
    cells = Cells()
    cells.feed(html)
    return cells


def test_cells_are_read_back_as_they_were_and_shorter_rows_filled_up():
    rows = [("a", "1 < 2 & 3"), ("<script>alert(1)</script>", '"quoted"')]
    shown = read(html_table(rows, head=("name", "value")))
    assert shown.rows == [["name", "value"], *map(list, rows)]
    assert "script" not in shown.tags
    assert [len(row) for row in read(html_table([("a",), ("b", "c", "d")])).rows] == [3, 3]


def test_columns_of_plain_text_stand_below_each_other():
    rows = [("name", "mm", "why"), ("a", "0.1", ""), ("longer", "12.5", "x")]
    assert aligned(rows, left=(0, 2)) == ["name      mm  why", "a        0.1", "longer  12.5  x"]


def test_the_last_one_registered_counts(monkeypatch):
    monkeypatch.setattr(renderer, "_renderers", [])
    with pytest.raises(RuntimeError, match="import thermal_robot, or call register_renderer"):
        renderer.registered_renderer()
    first, last = object(), object()
    renderer.register_renderer(first)
    assert renderer.registered_renderer() is first
    renderer.register_renderer(last)
    assert renderer.registered_renderer() is last


# ---- what is told beside the result


SAID = ["unknown frames", "combinations of effects", "places"]


@pytest.fixture
def terminal(monkeypatch):
    """Give a screen that becomes stderr under ``redirect_stderr``; there it shows at once what takes long."""
    monkeypatch.setattr(console, "_PATIENCE", 0.0)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "80")
    screen = io.StringIO()
    screen.isatty = lambda: True
    return screen


def told_of_work(loudness, screen=None):
    screen = screen or io.StringIO()
    with redirect_stderr(screen), stages(loudness) as progress:
        for stage in SAID:
            progress(stage)
    return screen.getvalue()


def test_the_last_of_several_wishes_counts():
    parser = argparse.ArgumentParser()
    add_loudness(parser, NORMAL)
    for given, loudness in (
        ("", NORMAL),
        ("-q", QUIET),
        ("-v", VERBOSE),
        ("-qv", VERBOSE),
        ("--verbose --quiet", QUIET),
    ):
        assert parser.parse_args(given.split()).loudness == loudness


def test_stages_are_told_unasked_on_a_terminal_alone(terminal):
    assert told_of_work(QUIET) == told_of_work(NORMAL) == told_of_work(QUIET, terminal) == ""
    # where they are asked for, each is a line with the seconds, on a terminal too
    for told in (told_of_work(VERBOSE), told_of_work(VERBOSE, terminal)):
        lines = [line.split(" s  ") for line in told.splitlines()]
        assert [stage for _, stage in lines] == [*SAID, "done"]
        seconds = [float(number) for number, _ in lines]
        assert seconds == sorted(seconds)
        assert seconds[0] >= 0.0


def test_work_that_fails_is_not_called_done(capsys):
    def breaks():
        with stages(VERBOSE):
            raise ValueError("broken")

    with pytest.raises(ValueError, match="broken"):
        breaks()
    assert "done" not in capsys.readouterr().err


def test_a_terminal_shows_the_stage_as_it_is_called_and_nothing_stays_at_work(terminal):
    with redirect_stderr(terminal), stages(NORMAL) as progress:
        progress("a law of [bold]tilt[/x]")  # names are not markup
        until = time.monotonic() + 20.0
        while "tilt[/x]" not in terminal.getvalue() and time.monotonic() < until:
            time.sleep(0.05)
    assert "a law of [bold]tilt[/x]" in terminal.getvalue()
    assert [t for t in threading.enumerate() if isinstance(t, threading.Timer)] == []


def test_counted_work_has_bars_on_a_terminal_and_a_line_for_every_tenth_elsewhere(terminal, capsys):
    with redirect_stderr(terminal), counted(NORMAL) as progress:
        progress("diagnoses", 40, 40)
    assert "40/40" in terminal.getvalue()
    for loudness, lines in ((QUIET, 0), (NORMAL, 10), (VERBOSE, 10)):
        with counted(loudness) as progress:
            for done in range(41):
                progress("diagnoses", done, 40)
        err = capsys.readouterr().err
        assert err.count("\n") == lines
        assert lines == 0 or err.endswith("diagnoses: 40 of 40\n")


def test_counted_work_that_takes_long_says_what_time_is_left(capsys, monkeypatch):
    clock = [0.0]
    monkeypatch.setattr(console.time, "monotonic", lambda: clock[0])
    with counted(NORMAL) as progress:
        for done in range(1, 101):  # half was done before
            clock[0] += 60.0 if done > 50 else 0.0
            progress("campaigns", done, 100)
    lines = capsys.readouterr().err.splitlines()
    assert (lines[4], lines[-1]) == ("campaigns: 50 of 100", "campaigns: 100 of 100")
    told = dict(line.split(", about ") for line in lines[5:-1])
    assert told["campaigns: 60 of 100"] == "40 min left"
    assert told["campaigns: 90 of 100"] == "10 min left"
    assert told["campaigns: 56 of 100"] == "44 min left"  # after five minutes of silence
    assert [console._span(seconds) for seconds in (3.2, 720.0, 12600.0)] == ["3 s", "12 min", "3.5 h"]


def test_a_note_is_one_line_unless_none_is_wanted(capsys):
    note("two\nlines", NORMAL)
    note("nothing", QUIET)
    assert capsys.readouterr().err == "thermal-robot: note: two lines\n"


@pytest.mark.parametrize(
    ("loudness", "told"),
    [
        (QUIET, []),
        (NORMAL, ["an effect is left out"]),
        (VERBOSE, ["an effect is left out", "glyph missing", "font x not found"]),
    ],
)
def test_warnings_and_logs_become_notes_or_nothing(capsys, loudness, told):
    before = warnings.showwarning, list(logging.getLogger().handlers)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        warnings.simplefilter("always", UserWarning)
        shown = warnings.showwarning
        with warnings_as_notes(loudness):
            for _ in range(3):
                warnings.warn("an effect is left out", Note, stacklevel=1)
            warnings.warn("glyph missing", UserWarning, stacklevel=1)
            warnings.warn("will be removed", DeprecationWarning, stacklevel=1)
            logging.getLogger("their.library").warning("font %s not found", "x")
        assert warnings.showwarning is shown
    assert capsys.readouterr().err.splitlines() == [f"thermal-robot: note: {text}" for text in told]
    assert (warnings.showwarning, logging.getLogger().handlers) == before
