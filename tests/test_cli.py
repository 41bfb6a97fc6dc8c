"""The program as a process, and its command line: one line for what cannot be, with what was probably meant; help."""

import argparse
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from thermal_robot import __version__, cli
from thermal_robot.cli import BAD_INPUT, DONE, FAILED, INTERRUPTED, STATUSES
from thermal_robot.datasets import demo_directory

FULL = pytest.mark.skipif(not Path("/dev/full").exists(), reason="has no full device")
POSIX = pytest.mark.skipif(sys.platform == "win32", reason="signals and pipes of POSIX")
PRINTING = pytest.mark.parametrize(
    "arguments",
    [
        pytest.param(("effects",), marks=pytest.mark.slow),
        ("plan", "builtin:rv_m2", "--tool", "tool0", "--rows", "6", "--effects", "backlash", "--json", "-"),
    ],
    ids=["text", "a file that is printed"],
)


def started(*arguments, **streams):
    return subprocess.Popen([sys.executable, "-m", "thermal_robot", *map(str, arguments)], text=True, **streams)


@POSIX
def test_an_interrupt_is_one_line_and_leaves_no_file(tmp_path):
    os.mkfifo(tmp_path / "nobody-reads")  # who writes to it waits, if the interrupt comes late
    asked = ("diagnose", demo_directory(), "-v", "--json", tmp_path / "nobody-reads", "--model", tmp_path / "m.json")
    # who is started in the background ignores interrupts, and so would all that it starts
    heeds = {"preexec_fn": lambda: signal.signal(signal.SIGINT, signal.SIG_DFL)}
    with started(*asked, stdout=subprocess.PIPE, stderr=subprocess.PIPE, **heeds) as process:
        assert process.stderr.readline().endswith("reading the campaign\n")
        process.send_signal(signal.SIGINT)
        try:
            out, err = process.communicate(timeout=60)
        finally:
            process.kill()
    assert process.returncode == 130
    assert err.splitlines()[-1] == "thermal-robot: interrupted; nothing was left half written"
    assert "Traceback" not in err
    assert out == ""
    assert [file.name for file in tmp_path.iterdir()] == ["nobody-reads"]


@FULL
@PRINTING
def test_a_full_disk_behind_what_is_printed_is_one_line(arguments):
    with open("/dev/full", "w") as full, started(*arguments, stdout=full, stderr=subprocess.PIPE) as process:
        err = process.communicate(timeout=60)[1]
    assert (process.returncode, err) == (1, "thermal-robot: cannot print: No space left on device\n")


@POSIX
@PRINTING
def test_a_reader_that_leaves_is_no_error(arguments):
    with started(*arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        process.stdout.close()
        assert process.stderr.read() == ""
    assert process.returncode == 0


def refused(capsys, *arguments):
    """Complaint about a command line that is none."""
    with pytest.raises(SystemExit) as stopped:
        cli.main(list(arguments))
    out, err = capsys.readouterr()
    assert (stopped.value.code, out) == (BAD_INPUT, "")
    return err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["diagnos", "x"], "did you mean 'diagnose'?"),
        (["Predcit"], "did you mean 'predict'?"),
        (["blind", "--size", "shrt"], "did you mean 'short'?"),
        (["xyzzy"], "diagnose"),  # all of them are listed
        (
            ["predict", "m", "s"],
            "the following arguments are required: -o/--output; see thermal-robot predict --help\n",
        ),
        (["check", "a", "b"], "unrecognized arguments: b"),
        (["check", "campaign.toml", "a\nb"], "unrecognized arguments: a b"),
    ],
)
def test_what_is_wrong_is_said_in_one_line_with_what_was_probably_meant(capsys, arguments, said):
    err = refused(capsys, *arguments)
    assert said in err
    assert err.startswith("thermal-robot")
    assert err.count("\n") == 1
    assert ("did you mean" in err) == ("did you mean" in said)


def test_a_diagnosis_of_nothing_is_bad_input(capsys):
    assert cli.main(["diagnose"]) == BAD_INPUT
    assert capsys.readouterr().err.startswith("thermal-robot: diagnose: no campaign was named")


@pytest.mark.parametrize("arguments", [[], ["-q"], ["-v"]])
def test_no_command_is_answered_by_a_short_usage(capsys, arguments):
    err = refused(capsys, *arguments)
    assert err.startswith("usage: thermal-robot COMMAND")
    assert err.count("\n") == 3
    assert "demo" in err
    assert "--help" in err


def test_the_version_is_told(capsys):
    with pytest.raises(SystemExit) as stopped:
        cli.main(["--version"])
    assert stopped.value.code == 0
    assert capsys.readouterr().out == f"thermal-robot {__version__}\n"


def test_help_says_what_each_command_does_with_an_example_that_parses(monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    parser = cli._parser()
    text = parser.format_help()
    assert text.rstrip().endswith(STATUSES)
    told = {int(number) for number in re.findall(r"^  (\d+) ", STATUSES, flags=re.M)}
    assert told == {DONE, FAILED, BAD_INPUT, INTERRUPTED}
    commands = next(a for a in parser._actions if isinstance(a, argparse._SubParsersAction)).choices
    assert len(commands) >= 16
    for name, command in commands.items():
        example = re.search(r"example:\n  thermal-robot (.+)\n", command.format_help())
        assert example[1].split()[0] == name
        assert parser.parse_args(example[1].split()).loudness == "normal"
        assert all(a.help for a in command._actions if a.help is not argparse.SUPPRESS)
    for given, loudness in (("-q check .", "quiet"), ("check . -v", "verbose"), ("check .", "normal")):
        assert parser.parse_args(given.split()).loudness == loudness
