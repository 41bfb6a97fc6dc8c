"""``-`` for standard input and output: a file at the edge, one clear sentence for what cannot be read."""

import argparse
import io
import sys
from pathlib import Path

import pytest

from thermal_robot import streams
from thermal_robot.errors import CampaignError
from thermal_robot.streams import piped


def options(**given):
    return argparse.Namespace(reads=("model", "samples"), writes=("json", "output"), **{**NONE, **given})


NONE = {"model": "m.json", "samples": None, "json": None, "output": None}


@pytest.fixture
def stdin(monkeypatch):
    monkeypatch.setattr(streams, "MOST_PIPED", 100)

    def stdin(content):
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(content)))

    return stdin


@pytest.fixture(autouse=True)
def folders(tmp_path, monkeypatch):
    """Where temporary folders are made; empty once all is over."""
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    yield tmp_path
    assert list(tmp_path.iterdir()) == []


def test_files_are_left_alone(folders):
    given = options(json="./-", output="o.csv")
    with piped(given):
        assert (given.model, given.json, given.output) == ("m.json", "./-", "o.csv")
        assert (given.piped, given.printed) == (False, False)
        assert list(folders.iterdir()) == []


@pytest.mark.parametrize("content", ["a;b\r\n1,5;µ\r\n".encode(), b"x" * 100, "x;y\n1;2".encode("utf-16")])
def test_standard_input_is_a_file_with_just_these_bytes(stdin, content):
    stdin(content)
    given = options(samples="-")
    with piped(given):
        assert Path(given.samples).read_bytes() == content
        assert (given.piped, given.printed) == (True, False)


def test_what_is_written_for_standard_output_is_printed_byte_by_byte(capfdbinary):
    given = options(output="-")
    with piped(given):
        assert (given.piped, given.printed) == (False, True)
        Path(given.output).write_bytes(b"x\xc2\xb5\r\n\n")
    assert capfdbinary.readouterr().out == b"x\xc2\xb5\r\n\n"


def test_a_stream_of_text_alone_gets_text(monkeypatch):
    monkeypatch.setattr(sys, "stdout", io.StringIO())
    given = options(json="-")
    with piped(given):
        Path(given.json).write_text("µ", encoding="utf-8")
    assert sys.stdout.getvalue() == "µ"


def test_errors_speak_of_the_streams_and_what_was_written_is_printed_all_the_same(stdin, capsys):
    stdin(b"x\n1\n")
    given = options(samples="-", json="-")

    def fails():
        with piped(given):
            Path(given.json).write_text("{}")
            raise CampaignError(given.samples, "a value is missing", row=2, expected=f"not {given.json}")

    with pytest.raises(CampaignError) as caught:
        fails()
    assert str(caught.value) == "standard input, row 2: a value is missing, expected not standard output"
    assert capsys.readouterr().out == "{}"


@pytest.mark.parametrize("given", [{"model": "-", "samples": "-"}, {"json": "-", "output": "-"}])
def test_a_stream_serves_once(given):
    with pytest.raises(CampaignError, match="there is one standard") as caught, piped(options(**given)):
        pass
    assert all(name in str(caught.value) for name in given)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "is empty"),
        (b" \n\n", "is empty"),
        (b"\x89PNG\r\n\x1a\n\0\0\0", "is not text"),
        (b"x" * 101, "is too long"),
        (None, "is closed"),
        ("a terminal", "is a terminal"),
    ],
)
def test_what_cannot_be_read_is_one_clear_sentence(stdin, monkeypatch, content, said):
    stdin(content if isinstance(content, bytes) else b"typed")
    monkeypatch.setattr(sys.stdin, "isatty", lambda: content == "a terminal", raising=False)
    if content is None:
        monkeypatch.setattr(sys, "stdin", None)
    with pytest.raises(CampaignError, match=f"^standard input: {said}"), piped(options(samples="-")):
        pass
