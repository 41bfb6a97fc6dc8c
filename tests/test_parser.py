"""Complaints about a command line: one line, with what was probably meant; help that a newcomer can follow."""

import argparse
import re

import pytest

from thermal_robot import cli
from thermal_robot.cli import BAD_INPUT, DONE, FAILED, INTERRUPTED, STATUSES, Parser


def refused(capsys, *arguments):
    with pytest.raises(SystemExit) as stopped:
        cli.main(list(arguments))
    out, err = capsys.readouterr()
    assert (stopped.value.code, out) == (2, "")
    return err


@pytest.mark.parametrize(
    ("arguments", "meant"),
    [(["diagnos", "x"], "diagnose"), (["Predcit"], "predict"), (["blind", "--size", "shrt"], "short")],
)
def test_what_was_probably_meant_is_proposed(capsys, arguments, meant):
    err = refused(capsys, *arguments)
    assert f"did you mean {meant!r}?" in err
    assert err.count("\n") == 1


def test_nothing_is_proposed_for_what_is_like_nothing(capsys):
    err = refused(capsys, "xyzzy")
    assert "did you mean" not in err
    assert "diagnose" in err  # all of them are listed


@pytest.mark.parametrize("arguments", [[], ["-q"], ["-v"]])
def test_no_command_is_answered_by_a_short_usage(capsys, arguments):
    err = refused(capsys, *arguments)
    assert err.startswith("usage: thermal-robot COMMAND")
    assert err.count("\n") == 3
    assert "demo" in err
    assert "--help" in err


def commands():
    found = next(a for a in cli._parser()._actions if isinstance(a, argparse._SubParsersAction))
    return found.choices


def test_help_ends_with_every_exit_status():
    text = cli._parser().format_help()
    assert text.rstrip().endswith(STATUSES)
    told = {int(number) for number in re.findall(r"^  (\d+) ", STATUSES, flags=re.M)}
    assert told == {DONE, FAILED, BAD_INPUT, INTERRUPTED}


@pytest.mark.parametrize("name", sorted(commands()))
def test_help_of_a_command_says_what_it_does_and_gives_an_example_that_parses(name, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    text = commands()[name].format_help()
    example = re.search(r"example:\n  thermal-robot (.+)\n", text)
    assert cli._parser().parse_args(example[1].split()).loudness == "normal"
    arguments = [a for a in commands()[name]._actions if a.help is not argparse.SUPPRESS]
    assert all(a.help for a in arguments)


@pytest.mark.parametrize(
    ("given", "loudness"), [("-q check .", "quiet"), ("check . -v", "verbose"), ("check .", "normal")]
)
def test_loudness_is_taken_before_and_after_the_command(given, loudness):
    assert cli._parser().parse_args(given.split()).loudness == loudness


def test_an_error_names_the_command(capsys):
    with pytest.raises(SystemExit):
        Parser(prog="thermal-robot predict").error("the following arguments are required: samples")
    assert capsys.readouterr().err == (
        "thermal-robot predict: the following arguments are required: samples; see thermal-robot predict --help\n"
    )
